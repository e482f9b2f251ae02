//! The typed driver: what the drive can do, in its own words.
//!
//! Its sequences and shells are those of all drives of its kind, [`lexican_driver`]; here stands what is particular
//! to this one, as data ([`AG03_1`]), and its names.
//!
//! # What stops the drive when the application does not
//!
//! A `Drive` that is dropped, also by a panic that unwinds, sends a stop if the drive may be moving: a quick stop in
//! the middle of inching operation 1, which Stop does not end (table 23 has Stop interrupt a positioning). That is all
//! that the driver can do: **nothing here supervises the process that it runs in.** After SIGKILL, `abort`, a crash of the
//! machine or a cable that breaks, nobody sends that stop: a travel goes on to its target, and inching and velocity
//! mode go on until something else ends them.
//!
//! The drive itself can watch over its manager, by life guarding (7.2.11), which is off unless it is armed:
//! write [`GUARD_TIME`](crate::od::GUARD_TIME) (100Ch, ms) and [`LIFE_TIME_FACTOR`](crate::od::LIFE_TIME_FACTOR)
//! (100Dh), and request the node's state (a remote frame on 700h + node-ID) at least once per guard time. Once the
//! first request has come, and then none for guard time times factor, the drive goes to SWITCH ON DISABLED, where
//! its motor has no torque. Life guarding and heartbeats exclude each other (1017h must be 0). The driver sends no such
//! requests: they must come from the process that is to be watched over. None of this replaces an emergency stop.

mod description;

pub use description::AG03_1;
pub use lexican_driver::description::{Approach, Description};
pub use lexican_driver::sequence;
pub use lexican_driver::{
    Capability, Desk, Error, Kind, Missing, Mode, Outcome, Refusal, Session, Units, VelocityOutcome,
};

/// The AG03/1, as a kind of drive.
#[derive(Clone, Copy, Debug)]
pub enum Ag03_1 {}

impl Kind for Ag03_1 {
    const DESCRIPTION: &'static Description = &AG03_1;
}

/// An AG03/1 at the other end of a link. Every method blocks until its operation is over.
pub type Drive<L> = lexican_driver::Drive<L, Ag03_1>;

/// The driver over the runtime's tokio shell: the same operations, many drives at once on one network.
#[cfg(feature = "tokio")]
pub mod tokio {
    /// An AG03/1 on a network.
    pub type Drive = lexican_driver::tokio::Drive<super::Ag03_1>;
}
