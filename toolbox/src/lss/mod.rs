//! Node-IDs and bit rates for devices that are selected by their identity (CiA 305).
//!
//! A [`Session`] begins and ends with all devices in the state WAITING.

mod search;
mod session;
mod trouble;

pub use search::SCAN_STEPS;
pub use session::{Done, Selected, Session, Target};
pub use trouble::{Times, Trouble};
