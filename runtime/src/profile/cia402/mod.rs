//! CiA 402, drives and motion control: states, commands and modes as pure functions.
//!
//! What differs between drives is data: the table of [`Transitions`], and the numbers of [`Modes`]. Who
//! moves a drive asks [`Transitions::next`] which command leads on; who simulates one asks
//! [`Transitions::follow`] where a command leads.

mod state;
mod transition;
mod word;

pub use lexican_cia::cia402::{Mode, Modes, Signal};

pub use state::State;
pub use transition::{Cause, Command, Steering, Transition, Transitions};
pub use word::{control, status};
