//! SIKO's drives on PROFIBUS, in virtual time.

mod ag02_driver;
mod any_bytes;
mod carrier;
mod drive;
mod flow;
mod gsd;
mod master;
mod parameters;
#[path = "../../../../profibus/tests/all/random.rs"]
mod random;
mod rig;
mod scripted;
mod tokio;
