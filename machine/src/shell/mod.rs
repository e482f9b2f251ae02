//! A machine at work: what both shells share.

pub mod blocking;
mod error;
mod event;
pub mod tokio;

pub use error::MachineError;
pub use event::{Event, What};
