//! The serial port of the SIKO AG02: RS-232 or RS-485 with the "Standardprotokoll" (chapter 6 of its manual).
//!
//! ```
//! use siko_serial::command::{Command, Long};
//! use siko_serial::sim::{SerialDrive, VirtualLine};
//! use siko_serial::{Connection, Settings};
//! use lexican_runtime::Duration;
//!
//! // On a machine it is `Port::open("/dev/ttyUSB0", 9600)`; everything else is the same.
//! let mut drive = Connection::new(VirtualLine::new(SerialDrive::default()), Settings::default());
//! drive.request(Command::WriteLong(Long::Setpoint, 5000))?;
//! drive.request(Command::Start)?;
//! // Figure 4: bit 14 is clear and bit 3 is set when the target is reached.
//! drive.await_status(Duration::from_secs(30), |word| word & 0x4008 == 0x0008)?;
//! assert_eq!(drive.number(Command::Position)?, 5000);
//! # Ok::<(), siko_serial::Error>(())
//! ```
//!
//! - [`command`], [`answer`], [`error`], [`telegram`]: tables 3 and 4 as total functions, without allocation;
//! - [`client`]: one command at a time, without I/O; how it finds its way back after noise and a cut line;
//! - [`Connection`] on a [`Line`], such as a [`Port`]: the blocking shell; with the feature `tokio` also one for tokio;
//! - [`parameter`]: which parameter is which object of the CANopen dictionary, and how their numbers differ;
//! - [`gateway`]: the drive as a CANopen node, for all drivers and tools of CANopen;
//! - [`sim`]: the simulated AG02 of [`siko_ag02::sim`] behind a line.
//!
//! The protocol connects one drive to one computer, also over RS-485 ("nicht busfähig"): there are no addresses.
//! Chapters, tables and figures are those of the German manual of 02/2018, firmware 2.00 or higher.

pub mod answer;
pub mod client;
pub mod command;
mod connection;
pub mod error;
pub mod gateway;
mod line;
pub mod parameter;
pub mod sim;
pub mod telegram;
#[cfg(feature = "tokio")]
pub mod tokio;

pub use client::{Client, Settings};
pub use connection::{Connection, Error};
pub use line::{Line, Port};

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
