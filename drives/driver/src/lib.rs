//! A driver for drives of the CiA 402 kind. What is particular to one kind of drive is data: its [`Description`].
//!
//! ```text
//! Drive            a thin blocking shell over a link; so is tokio::Drive
//!   Session        the four verbs: frames and deadlines in and out
//!     sequence     what to do, step by step, written once
//!       DriveContext       where sequences and session meet
//!   Description    what is particular to a kind of drive
//! ```
//!
//! A drive's crate describes the drive and names its kind; the driver itself is here:
//!
//! ```
//! use lexican_driver::{Description, Kind};
//!
//! /// By its manual.
//! static SPINDLE: Description = Description {
//!     name: "spindle",
//!     // Here follow the differences from CiA 402.
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
//! Start from what its data sheet says, which `lexican_codegen::Config::driver` generates, or else from
//! [`Description::CIA_402`], and go through the fields with the drive's manual:
//!
//! 1. which 1000h, 1018h and 1008h distinguish it from its relatives (`identity`);
//! 2. where its objects are, and how wide (`objects`): from the generated dictionary, by
//!    [`Number::of`](description::Number::of);
//! 3. whether it takes orders by PDO or by SDO, and which PDOs carry what (`outputs`, `inputs`);
//! 4. its state machine and its bits (`transitions`, `control`, `status`), when the bit New set-point is cleared
//!    (`release`), and its mode numbers (`modes`);
//! 5. what makes it refuse which order (`conditions`), and what its emergency codes mean (`codes`);
//! 6. how long things take (`times`), above all how long it still reports its old state after an order;
//! 7. what else it can do: each capability is an `Option`.
//!
//! A peculiarity that no field can express asks for a new field, not for an `if` in a sequence.
//!
//! # What never happens
//!
//! - No sequence asks which drive it is talking to, and this crate names none (`cargo xtask tidy`).
//! - Nothing moves before every condition for it has been checked: an unmet condition is reported as
//!   [`Error::Refused`], and a missing capability as [`Error::Unsupported`], before anything is sent.
//!
//! # A bus that its drives fill
//! # A bus that its drives fill up
//! Many drives send a PDO whenever a position or velocity in it changes, and come from the factory without an inhibit time.
//! While two of them move, a bus at 500 kbit/s may be full: SDOs give way to PDOs, and operations of any drive on it time out
//! ([`Error::Sdo`]). [`Drive::unpaced_pdos`] finds such PDOs when a machine is commissioned, and [`Drive::configure_pdos`] gives
//! them an inhibit time or a synchronous transmission type. Connecting looks for what makes a drive unsafe to move, and not
//! them an inhibit time or a synchronous transmission type. Connecting checks for what makes a drive unsafe to move,
//! and does not check for such PDOs.
//! # Many axes, and drives that come back
//!
//! [`cyclic`] leads several drives along a path by SYNC, in every cycle of 1 to 10 ms. [`Drive::recover`] brings a drive back
//! that has lost its power, its bus or its state, and moves nothing that is not ordered again.
//!
//! # How a program ends, and what the drive does then
//!
//! An operation that fails after its order was sent, that times out, or whose call is dropped, leaves the drive doing
//! what it was last ordered to do; such an error is [`Error::MayBeMoving`]. [`Error::Refused`] and
//! [`Error::Unsupported`] come before anything moves. `stop`, `quick_stop` and `disable` stop all movement, and so does
//! dropping the `Drive`: in the middle of a step by a quick stop, since nothing else ends a step.
//!
//! | The program | sends | so the drive | and one that is protected |
//! | --- | --- | --- | --- |
//! | returns, or ends in an error | a stop, as the `Drive` is dropped | stands | also notices later |
//! | panics, and unwinds | the same | stands | also notices later |
//! | gets SIGINT or SIGTERM, and handles it by a [`CancelHandle`] | a stop | stands | |
//! | gets SIGINT or SIGTERM, and does not handle it | nothing | goes on | notices |
//! | calls `exit` or `abort`, or panics with `panic = "abort"` | nothing | goes on | notices |
//! | gets SIGKILL, or loses its power | nothing | goes on | notices |
//! | loses its cable | a stop that does not arrive, and says so | goes on | notices |
//!
//! With the driver of tokio, a task that handles a signal drops the call that is under way, and then stops the drive.
//!
//! A drive that goes on finishes a travel at its target; inching and velocity mode do not end. A protected drive
//! notices by life guarding or a missing heartbeat that its manager is gone, and reacts as its manual says.
//! [`Drive::connect`] protects each drive that can notice, within a second ([`Supervision::default`]), and
//! [`Drive::protection`] says how. [`Drive::connect_unprotected`] does not: it is for a program that only looks at a
//! drive, or whose drive is protected by something else. While the program does something else, a thread of the
//! blocking driver, or the task of a network, sends four signs of life in that time. A program that ends in order, with
//! the drive at rest, disarms the protection: by dropping or releasing the blocking `Drive`, or by `unprotect` of the
//! tokio one.
//! The test `endings` of the crate of a drive ends a real process in each of these ways, `killed` of `examples/changeover` by
//! SIGKILL. None of this replaces an emergency stop.

mod blocking;
mod cancel;
mod context;
pub mod cyclic;
#[cfg(feature = "eds")]
mod data_sheet;
pub mod description;
mod direction;
mod error;
mod fault;
mod kind;
mod mode;
mod operations;
mod outcome;
mod parameter;
mod protection;
mod remedy;
pub mod sequence;
mod session;
mod set_point;
#[cfg(feature = "tokio")]
pub mod shared;
#[cfg(feature = "tokio")]
pub mod tokio;
mod units;

pub use blocking::Drive;
pub use cancel::CancelHandle;
pub use context::{Awaited, DriveContext, Seen};
#[cfg(feature = "eds")]
pub use data_sheet::NotADrive;
pub use description::Description;
pub use direction::Direction;
pub use error::{Capability, Error, Missing, Refusal};
pub use fault::{ByteOrder, Cause, Code, Codes};
pub use kind::{Any, Kind};
pub use mode::Mode;
pub use outcome::{HomingOutcome, Outcome, VelocityOutcome};
pub use parameter::{Parameter, ParameterSet};
pub use protection::{Protection, Supervision};
pub use remedy::{Remedy, Step};
pub use session::Session;
pub use set_point::{SetPoint, Succession};
pub use units::Units;
