//! A drive that exists only in software: it serves the dictionary generated from the data sheet, moves as
//! chapter 2 of the manual says, and fails on demand as chapter 5 says.
//!
//! From the bottom up: [`trajectory`] solves ways in closed form, [`motion`] makes travel jobs of them,
//! [`controller`] adds state machine, status and faults; [`SimulatedDrive`] puts all of it on a bus. What
//! the manual leaves open is decided where it matters, and said there: look for "assumption".

pub mod controller;
mod drive;
pub mod inputs;
pub mod motion;
mod objects;
pub mod parameters;
mod status;
pub mod trajectory;

pub use drive::{BEHAVIOUR, Gear, NonVolatile, Setup, SimulatedDrive, StatusLed};
