//! The simulated drive.

pub mod controller;
pub mod inputs;
pub mod motion;
pub mod parameters;
mod status;
pub mod trajectory;
