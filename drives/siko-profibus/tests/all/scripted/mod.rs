//! Without a bus: the master's side and the gateway's door against a drive that does what the test says.

mod bench;
mod gateway;
mod master;
