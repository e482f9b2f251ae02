//! Without a bus: the master's side and the gateway's door with a scripted drive.

mod gateway;
mod master;
mod rig;
