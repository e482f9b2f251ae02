//! What simulated drives share.
//!
//! [`trajectory`] solves motion in closed form; [`servo`] is a CiA 402 servo made of a dictionary, and
//! [`SimulatedServo`] puts it on a bus. A [`script`] says what happens to a drive, and when; a [`Memory`] holds what it
//! keeps without power.

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
