//! The serial port, in virtual time.

mod authority;
mod codec;
mod door;
mod flow_charts;
mod gateway;
#[path = "../../../../profibus/tests/all/random.rs"]
#[allow(dead_code, reason = "not every test needs all of it")]
mod random;
mod serial_rig;
mod slow;
mod tokio;
mod trouble;
