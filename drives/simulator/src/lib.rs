//! Drives that exist only in software: what they share.
//!
//! [`trajectory`] solves ways in closed form; [`servo`] is a CiA 402 servo made of a dictionary, and [`SimulatedServo`]
//! puts it on a bus. A [`script`] is what happens to a drive, and
//! when; a [`Memory`] is what it keeps without power.

pub mod eeprom;
pub mod script;
pub mod servo;
pub mod trajectory;

mod memory;
mod node;
mod storage;

pub use memory::{Memory, read};
pub use node::SimulatedServo;
pub use storage::{Storage, raw_of, signed};
