//! A drive behind another interface than CAN, presented as a CANopen node.
//!
//! A [`Gateway`] takes the frames that are meant for its node-ID, and has done by its [`Door`], in telegrams of the
//! interface, what the drive would do for them over CAN. So drivers, networks and tools work unchanged: what differs is the
//! line of a program that opens the link. [`GatewayLink`] is that link; [`GatewayNode`] is the same as a node of a simulated bus.
//!
//! ```text
//! SDO, PDO, NMT, EMCY    Device of the runtime, over the drive's generated dictionary
//! 6040h, 6041h           state machine of CiA 402, here: edges become orders, facts become bits
//! 2000h.. and 1002h      Door: one job at a time, answered later; an SDO request is held until then
//! bytes or process data  Carrier: the only I/O
//! ```
//!
//! # What differs from the drive on CAN
//!
//! - An object that the interface does not have is aborted by 0602 0000h before anything is sent, and so are guard time (100Ch,
//!   100Dh) and 1016h: who drops the link drops the node with it, so it cannot notice that its manager is gone.
//! - A drive that does not answer is a node that is silent, and so is one whose facts are older than
//!   [`Door::worst_cycle`], whatever the reason. One that answers again is as it was, or boots if its motor has been
//!   released meanwhile.
//! - The communication objects (1014h, 1017h, 1400h..) are the gateway's: they have their defaults whenever it begins.
//! - Frames are answered when the line has: see [`Job`] for what is read anew, and what comes from the last look.
//! - NMT resets release the motor and reset the gateway, and not the drive.

mod face;
mod link;
mod node;
mod objects;

use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, Duration, Instant, Measured};

pub use link::{Carrier, GatewayLink, GatewayNode};
pub use node::Gateway;

use crate::order::Order;

/// What an interface does for the gateway. Without I/O: what it sends and receives is between it and its [`Carrier`].
pub trait Door {
    /// Whether the interface has the object. Not asked for the objects of the gateway itself: 6040h, 6041h, and most of the
    /// communication profile area.
    fn has(&self, address: Address) -> bool;

    /// Takes a job. The next one follows when the end of this one has been polled, or [`Report::Lost`].
    fn begin(&mut self, now: Instant, job: Job);

    /// The longest time between two measurements of the facts while drive and line work, lost telegrams included. Facts
    /// that are older are worth nothing: the drive counts as lost then.
    fn worst_cycle(&self) -> Duration;

    /// The longest time from the beginning of a job to its end while drive and line work.
    fn worst_job(&self) -> Duration;

    /// The drive counts as lost, because its facts are too old. A job that is under way is over, and nothing of it is sent
    /// any more; [`Report::Lost`] need not follow. Facts follow when it is back.
    fn lose(&mut self, now: Instant);

    /// What is new. Called after each event of the line, and each deadline, until it returns nothing.
    fn poll(&mut self, now: Instant) -> Option<Report>;

    /// When to call [`Door::handle_timeout`] though the line is silent.
    fn poll_timeout(&self) -> Option<Instant>;

    /// Handles the deadline of [`Door::poll_timeout`], which has come.
    fn handle_timeout(&mut self, now: Instant);
}

/// What a door is to do. Each job ends with one [`Report::Done`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Job {
    /// Reads an object: its value, as the object has it, is the end of the job.
    Read(Address),
    /// Writes an object.
    Write(Address, i64),
    /// Gives an order. Facts as of after the order are reported before the end of the job.
    Order {
        /// The order.
        order: Order,
        /// For [`Order::Start`]: 607Ah in positioning mode, 60FFh in velocity mode.
        target: i32,
    },
    /// Reports the facts anew: before the status is read by SDO, and before an edge of the control word is judged.
    Look,
}

/// What a door reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// What the drive shows, and when that was measured: at least once in each [`Door::worst_cycle`], and before the end of
    /// some jobs.
    Facts(Measured<Facts>),
    /// The end of a job, with the value that was read. A refusal is the abort code that an SDO client gets:
    /// [`AbortCode::LOCAL_CONTROL`] if something else has command, [`AbortCode::HARDWARE_ERROR`] if it is not known whether
    /// the drive has done it.
    Done(Result<i64, AbortCode>),
    /// The drive does not answer any more. A job that was under way is over. Facts follow when it is back.
    Lost,
}

/// What a drive shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// As 1002h: the bits of [`words::system`](crate::words::system).
    pub system: u16,
    /// The latest known position, as 6064h.
    pub position: i32,
    /// The latest known velocity, as 606Ch.
    pub velocity: i32,
}

impl Facts {
    /// Whether any of these bits of 1002h is set.
    #[must_use]
    pub const fn has(&self, bits: u16) -> bool {
        self.system & bits != 0
    }
}
