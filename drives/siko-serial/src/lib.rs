//! The serial port of the SIKO AG02: RS-232 or RS-485 with the "Standardprotokoll" (chapter 6 of its manual).
//!
//! ```
//! use siko_ag02::driver::{Drive, Outcome};
//! use siko_serial::Settings;
//! use siko_serial::gateway::{self, NODE};
//! use siko_serial::sim::{SerialDrive, VirtualLine};
//!
//! // On a machine it is `gateway::open("/dev/ttyUSB0", Settings::default(), NODE)`; everything else is the same, and as on CAN.
//! let link = gateway::link(VirtualLine::new(SerialDrive::default()), Settings::default(), NODE);
//! let mut drive = Drive::connect(link, NODE)?;
//! drive.enable()?;
//! assert_eq!(drive.move_to(5000)?, Outcome::Reached { position: 5000 });
//! # Ok::<(), siko_ag02::driver::Error>(())
//! ```
//!
//! - [`command`], [`answer`], [`error`], [`telegram`]: tables 3 and 4 as total functions, without allocation;
//! - [`client`]: one command at a time, without I/O, with recovery after noise and a broken line;
//! - [`parameter`]: the object of the CANopen dictionary for each parameter, and how their numbers differ;
//! - [`gateway`]: the drive as a CANopen node on a [`Line`], such as a [`Port`], for all drivers and tools of CANopen;
//! - [`sim`]: the simulated AG02 of [`siko_ag02::sim`] behind a line.
//!
//! The protocol connects one drive to one computer, also over RS-485 ("nicht busfähig"): there are no addresses.
//! Chapters, tables and figures are those of the German manual of 02/2018, firmware 2.00 or higher.

pub mod answer;
pub mod client;
pub mod command;
pub mod error;
pub mod gateway;
mod line;
pub mod parameter;
pub mod sim;
pub mod telegram;

pub use client::{Client, Settings};
pub use line::{Line, Port};

/// The README, so that its examples are compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
