//! SIKO's positioning drives on PROFIBUS-DP.
//!
//! - [`table`]: the parameters of the AG03/1 (41) and the AG02 (27), each with its CANopen object;
//! - [`words`]: the bits of control and status word in each operating mode;
//! - [`ProfibusDrive`]: a simulated drive behind a simulated slave, with the same motion as on CANopen;
//! - [`master::DriveMaster`]: the master's side of one drive, which makes control words of orders, and facts of status
//!   words;
//! - [`gateway::ProfibusDoor`]: the same as the door of a gateway, by which the drives' drivers work over PROFIBUS;
//!   with the feature `master`, `line::link` is a link for them;
//! - [`Model`]: the differences between the drives, as data.
//!
//! ```
//! use lexican_profibus::pkw::{Reply, Task, Value};
//! use siko_profibus::{AG03_1, bus};
//!
//! let (mut bus, drive) = bus::with(&AG03_1, 7);
//! assert_eq!(bus.ask(drive, Task::Read { number: 1004 }), Some(Reply::Value(Value::Word(30))));
//! ```
//!
//! Chapters and tables are those of the manual *AG03/1 PROFIBUS-DP* unless the AG02 is named.

#[cfg(feature = "master")]
pub mod bus;
mod drive;
pub mod gateway;
#[cfg(feature = "master")]
pub mod line;
pub mod master;
mod model;
pub mod table;
pub mod words;

pub use drive::ProfibusDrive;
pub use model::{AG02, AG03_1, Model, PPO};

/// The README, so that its examples are compiled.
#[cfg(all(doctest, feature = "master"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
