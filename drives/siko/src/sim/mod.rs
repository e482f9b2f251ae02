//! The simulated drive: it serves the dictionary generated from the data sheet, moves as in chapter 2 of the manual,
//! and fails on demand as in chapter 5. A [`Model`] says which drive it is.
//!
//! From the bottom up: [`trajectory`] solves motion in closed form, [`motion`] makes travel jobs of it, [`controller`]
//! adds state machine, status and faults, and [`SimulatedDrive`] puts all of it on a bus.

mod address;
pub mod controller;
mod doors;
mod drive;
mod eeprom;
mod follow;
pub mod inputs;
mod leds;
pub mod motion;
mod node;
mod objects;
pub mod parameters;
mod power;
mod require;
pub mod script;
mod setup;
mod status;
mod switches;
mod watch;

pub use crate::model::{Addressing, BEHAVIOUR, Model};
pub use crate::order::{Braking, Order, Refused};
pub use drive::SimulatedDrive;
pub use eeprom::{EepromError, NonVolatile};
pub use leds::{BusLed, FLASH, Lights, PAUSE, StatusLed};
pub use script::Script;
pub use setup::{BIT_RATES, Setup};
pub use simulator::{Storage, trajectory};
pub use switches::{DipSwitches, NotSwitches, Restore, Termination};
