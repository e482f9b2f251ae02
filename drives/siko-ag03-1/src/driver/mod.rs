//! The typed driver of the AG03/1.
//!
//! Sequences and shells are those of [`lexican_driver`]; this module has the drive's particulars as data ([`AG03_1`]),
//! and its names.
//!
//! # How a program ends, and what the drive does then
//!
//! The table of [`lexican_driver`](lexican_driver#how-a-program-ends-and-what-the-drive-does-then) applies: a program
//! that returns, fails, panics or cancels stops the drive. During inching operation 1 it sends a quick stop, since Stop
//! only interrupts a positioning (table 23). A program that is killed, exits or aborts sends nothing: **then this drive
//! goes on**, a travel to its target, inching and velocity mode without end.
//!
//! So [`Drive::connect`](lexican_driver::Drive::connect) arms life guarding (7.2.11; 100Ch, 100Dh), which is off
//! otherwise, and sends the requests; the drive consumes no heartbeats (7.2.10). Without requests for guard time times
//! factor, it goes to SWITCH ON DISABLED, where its motor has no torque. Life guarding and heartbeats exclude each
//! other (1017h must be 0). None of this replaces an emergency stop.

mod description;

pub use description::AG03_1;
pub use lexican_driver::description::{Approach, Description};
pub use lexican_driver::sequence;
pub use lexican_driver::{
    CancelHandle, Capability, DriveContext, Error, Kind, Missing, Mode, Outcome, Protection, Refusal, Session,
    Supervision, Units, VelocityOutcome,
};

/// The AG03/1, as a kind of drive.
#[derive(Clone, Copy, Debug)]
pub enum Ag03_1 {}

impl Kind for Ag03_1 {
    const DESCRIPTION: &'static Description = &AG03_1;
}

/// An AG03/1 over a link. Every method blocks until its operation is over.
pub type Drive<L> = lexican_driver::Drive<L, Ag03_1>;

/// The driver over the runtime's tokio shell: the same operations, many drives at once on one network.
#[cfg(feature = "tokio")]
pub mod tokio {
    /// An AG03/1 on a network.
    pub type Drive = lexican_driver::tokio::Drive<super::Ag03_1>;
}
