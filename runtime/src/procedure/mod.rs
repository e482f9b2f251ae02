//! Sequences of steps as data, and one runner for all of them.
//!
//! A procedure is an iterator of [`Step`]s: an array, or something that computes them one after another. The [`Runner`]
//! carries out one step at a time, and stops at the first failure. It has its own
//! [`SdoClient`](crate::service::sdo_client::SdoClient): no other client may use the same channel meanwhile.

mod boot;
mod concise;
mod pdo;
mod runner;
mod step;

pub use boot::{BootError, BootEvent, BootNode, BootPlan};
pub use concise::{ConciseDcf, ConciseDcfError, EncodeError};
pub use pdo::{PdoSettings, configure_pdo};
pub use runner::{Event, Failure, Runner, StepError};
pub use step::{Data, Decision, Steer, Step};
