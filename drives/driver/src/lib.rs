//! A driver for drives of the CiA 402 kind. What a drive does differently is data: its [`Description`].
//!
//! ```text
//! Drive            a thin blocking shell over a link; so is tokio::Drive
//!   Session        the four verbs: frames and deadlines in and out
//!     sequence     what to do, step by step, written once
//!       Desk       where sequences and session meet
//!   Description    what is particular to a kind of drive
//! ```
//!
//! A crate of a drive describes it, and names its kind; the driver is there:
//!
//! ```
//! use lexican_driver::{Description, Kind};
//!
//! /// As its manual has it.
//! static SPINDLE: Description = Description {
//!     name: "spindle",
//!     // All that it does otherwise than CiA 402 has it.
//!     ..Description::CIA_402
//! };
//!
//! enum Spindle {}
//!
//! impl Kind for Spindle {
//!     const DESCRIPTION: &'static Description = &SPINDLE;
//! }
//!
//! type Drive<L> = lexican_driver::Drive<L, Spindle>;
//!
//! // For the tests of that crate: what cannot be right in the description.
//! assert!(SPINDLE.findings().is_empty());
//! ```
//!
//! # Describing a drive
//!
//! Begin with [`Description::CIA_402`], and go through the fields with the drive's manual:
//!
//! 1. which 1000h, 1018h and 1008h tell it from its relatives (`identity`);
//! 2. where its objects are, and how wide (`objects`): from the generated dictionary, by
//!    [`Number::of`](description::Number::of);
//! 3. whether it takes orders by PDO or by SDO, and which PDOs carry what (`outputs`, `inputs`);
//! 4. its state machine and its bits (`transitions`, `control`, `status`), when the bit of a new setpoint falls
//!    again (`release`), and its mode numbers (`modes`);
//! 5. what makes it refuse which order (`conditions`), and what its emergency codes mean (`codes`);
//! 6. how long things take (`times`), most of all for how long it tells of what was before an order;
//! 7. what it can do beyond that: each capability is an `Option`.
//!
//! What no field can say is a reason for another field, not for an `if` in a sequence.
//!
//! # What never happens
//!
//! - No sequence asks which drive it is talking to, and this crate names none (`cargo xtask tidy`).
//! - Nothing moves before every condition for it has been looked at: what is missing is told as
//!   [`Error::Refused`], and what the drive does not have as [`Error::Unsupported`], before anything is sent.
//! - No sequence does I/O or reads a clock.
//!
//! # What stops the drive when the application does not
//!
//! An operation that ends in an error after its order was sent, that is not over in time, or whose call is dropped,
//! leaves the drive doing what it was told last; [`Error::Refused`] and [`Error::Unsupported`] come before anything
//! moves. Then `stop`, `quick_stop` and `disable` stop whatever moves, and so does dropping the `Drive`.
//!
//! A `Drive` that is dropped, also by a panic that unwinds, sends a stop if the drive may be moving: a quick stop in
//! the middle of a step, which nothing else ends. That is all that the driver can do: **nothing here supervises the
//! process that it runs in.** After SIGKILL, `abort`, a crash of the machine or a cable that breaks, nobody sends that
//! stop: a travel goes on to its target, and inching and velocity mode go on until something else ends them. What a
//! drive can do about that, by life guarding, say, its own crate tells.

mod blocking;
pub mod description;
mod desk;
mod direction;
mod error;
mod fault;
mod kind;
mod mode;
mod operations;
mod parameter;
pub mod sequence;
mod session;
#[cfg(feature = "tokio")]
pub mod tokio;
mod units;

pub use blocking::Drive;
pub use description::Description;
pub use desk::Desk;
pub use direction::Direction;
pub use error::{Capability, Error, Missing, Outcome, Refusal, VelocityOutcome};
pub use fault::{ByteOrder, Cause, Code, Codes};
pub use kind::Kind;
pub use mode::Mode;
pub use parameter::{Parameter, ParameterSet};
pub use session::Session;
pub use units::Units;
