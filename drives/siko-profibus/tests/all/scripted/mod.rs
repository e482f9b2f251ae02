//! Without a bus: the master's side and the gateway's door against a drive that does what the test says.

mod gateway;
mod master;
mod rig;
