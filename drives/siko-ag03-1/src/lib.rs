//! The SIKO AG03/1 positioning drive: a typed driver, and a simulated drive.
//!
//! ```
//! use lexican_runtime::NodeId;
//! use lexican_runtime::host::VirtualBus;
//! use siko_ag03_1::driver::{Drive, Outcome};
//! use siko_ag03_1::od;
//! use siko_ag03_1::sim::{MODEL, SimulatedDrive};
//!
//! let node = NodeId::literal(5);
//! let bus = VirtualBus::with_bit_rate(500);
//! bus.attach(SimulatedDrive::new(&MODEL, node));
//!
//! // On a machine it is the link of an interface; everything else is the same.
//! let mut drive = Drive::connect(bus.link(), node)?;
//! drive.write(od::MOTOR_PARAMETER_SET.v_pos(), od::Speed(60))?;
//! drive.enable()?;
//! assert_eq!(drive.move_to(5000)?, Outcome::Reached { position: 5000 });
//! drive.disable()?;
//! # Ok::<(), siko_ag03_1::driver::Error>(())
//! ```
//!
//! - [`od`]: the dictionary, generated from the data sheet;
//! - [`driver`]: the typed driver;
//! - [`sim`]: the simulated drive, with faults on demand, in virtual time;
//! - [`state`], [`words`], [`fault`], [`parameter`], [`worked_examples`]: tables of the manual as data, for driver and
//!   simulator.
//!
//! Chapters, tables and figures are those of the English CANopen manual, firmware 4.01 or higher. Where it contradicts
//! itself or is silent, a comment states the choice.

pub mod driver;
pub mod fault;
pub mod model;
pub mod parameter;
pub mod sim;

pub use lexican_driver::Direction;
pub use siko::{state, words, worked_examples};

/// The dictionary, generated from the data sheet `siko/ag03-1` and its overlay.
pub mod od {
    lexican_runtime::include_od!("siko_ag03_1");
}

/// The README, so that its examples are compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
