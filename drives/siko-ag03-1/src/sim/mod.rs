//! The simulated drive.

pub mod motion;
pub mod trajectory;
