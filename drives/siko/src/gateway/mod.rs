//! A drive behind another interface than CAN, presented as a CANopen node.
//!
//! A [`Gateway`] takes the frames for its node-ID, and carries out by telegrams of the other interface, through its
//! [`Door`], what the drive would do on CAN. So drivers, networks and tools work unchanged: only the line by which a
//! program opens the link differs. [`GatewayLink`] is that link; [`GatewayNode`] is the same as a node of a simulated
//! bus.
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
//! - An object that the interface does not have is aborted by 0602 0000h before anything is sent. So are guard time
//!   (100Ch, 100Dh) and 1016h: the node ends with the program that drops its link, and cannot notice that its manager
//!   is gone.
//! - If the drive does not answer, the node is silent. So it is if its facts are older than [`Door::worst_cycle`],
//!   whatever the reason. When the drive answers again, the node goes on, or boots if its motor has been released
//!   meanwhile.
//! - The communication objects (1014h, 1017h, 1400h..) are the gateway's: they have their defaults whenever it starts.
//! - Frames are answered once the line has answered: see [`Job`] for what is read anew, and what comes from the last
//!   facts.
//! - NMT resets release the motor and reset the gateway, but not the drive.

mod face;
mod link;
mod node;
mod objects;

use lexican_runtime::object::Address;
use lexican_runtime::{AbortCode, Duration, Instant, Measured};

pub use link::{Carrier, GatewayLink, GatewayNode};
pub use node::Gateway;

use crate::order::Order;

/// What an interface does for the gateway, without I/O: its telegrams are exchanged through its [`Carrier`].
pub trait Door {
    /// Whether the interface has the object. Not called for the gateway's own objects: 6040h, 6041h, and most of the
    /// communication profile area.
    fn has(&self, address: Address) -> bool;

    /// Takes a job. The next one follows once `poll` has returned the end of this one, or [`Report::Lost`].
    fn begin(&mut self, now: Instant, job: Job);

    /// The longest time between two measurements of the facts while drive and line work, including lost telegrams. When
    /// facts are older, the drive counts as lost.
    fn worst_cycle(&self) -> Duration;

    /// The longest time from the beginning of a job to its end while drive and line work.
    fn worst_job(&self) -> Duration;

    /// The drive counts as lost, because its facts are too old. A job under way is over, and its remaining telegrams
    /// are not sent; [`Report::Lost`] need not follow. Facts follow when the drive is back.
    fn lose(&mut self, now: Instant);

    /// The next report, until there is none. Called after each event of the line and after each deadline.
    fn poll(&mut self, now: Instant) -> Option<Report>;

    /// When to call [`Door::handle_timeout`] if nothing comes before.
    fn poll_timeout(&self) -> Option<Instant>;

    /// Handles the deadline of [`Door::poll_timeout`], which has come.
    fn handle_timeout(&mut self, now: Instant);
}

/// A job for a door. Each one ends with one [`Report::Done`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Job {
    /// Reads an object; the job ends with its value.
    Read(Address),
    /// Writes an object.
    Write(Address, i64),
    /// Gives an order. Facts from after the order are reported before the end of the job.
    Order {
        /// The order.
        order: Order,
        /// For [`Order::Start`]: 607Ah in positioning mode, 60FFh in velocity mode.
        target: i32,
    },
    /// Measures the facts: before an SDO client reads the status, and before an edge of the control word is judged.
    Look,
}

/// What a door reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// The facts and when they were measured: at least once in each [`Door::worst_cycle`], and before the end of some
    /// jobs.
    Facts(Measured<Facts>),
    /// The end of a job, with the value that was read. A refusal is the abort code for the SDO client:
    /// [`AbortCode::LOCAL_CONTROL`] if another interface has command, [`AbortCode::HARDWARE_ERROR`] if it is not known
    /// whether the drive has carried it out.
    Done(Result<i64, AbortCode>),
    /// The drive does not answer any more. A job under way is over. Facts follow when the drive is back.
    Lost,
}

/// What a drive reports cyclically.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// The bits of 1002h: [`words::system`](crate::words::system).
    pub system: u16,
    /// The latest known position, in units of 6064h.
    pub position: i32,
    /// The latest known velocity, in units of 606Ch.
    pub velocity: i32,
}

impl Facts {
    /// Whether any of these bits of 1002h is set.
    #[must_use]
    pub const fn has(&self, bits: u16) -> bool {
        self.system & bits != 0
    }
}
