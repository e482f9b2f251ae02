//! A machine at work: what both shells share.

pub mod blocking;
mod error;
mod event;
mod heard;
#[cfg(feature = "archive")]
pub mod parameters;
pub mod tokio;

use lexican_runtime::host::Link;

pub use error::MachineError;
pub use event::{Event, What};
pub use heard::Heard;

/// The link to one bus of a machine.
pub type BoxedLink = Box<dyn Link + Send>;
