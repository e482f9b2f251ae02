//! Drives that exist only in software: what they share.
//!
//! [`trajectory`] solves ways in closed form; [`servo`] is a CiA 402 servo made of a dictionary, and [`SimulatedServo`]
//! puts it on a bus.

pub mod servo;
pub mod trajectory;

mod node;
mod storage;

pub use node::SimulatedServo;
pub use storage::{Storage, signed};
