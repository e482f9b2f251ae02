//! SIKO's drives on PROFIBUS, in virtual time.

mod any_bytes;
mod carrier;
mod drive;
mod flow;
mod gsd;
mod parameters;
#[path = "../../../../profibus/tests/all/random.rs"]
mod random;
mod rig;
mod scripted;
mod tokio;
