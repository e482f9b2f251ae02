//! The serial port, in virtual time.

mod authority;
mod bench;
mod codec;
mod door;
mod flow_charts;
mod gateway;
mod slow;
mod tokio;
mod trouble;
