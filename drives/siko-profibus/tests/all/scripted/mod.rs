//! Without a bus: the master's side and the gateway's door against a scripted drive.

mod gateway;
mod master;
mod rig;
