//! CiA 402, drives and motion control: states, commands and modes as pure functions.
//!
//! The differences between drives are data: the table of [`Transitions`], and the numbers of [`Modes`]. To move a
//! drive, [`Transitions::next`] tells which command leads on; to simulate one, [`Transitions::follow`] tells where a
//! command leads.

mod state;
mod transition;
mod word;

pub use lexican_cia::cia402::{Mode, Modes, Signal};

pub use state::State;
pub use transition::{Cause, Command, Steering, Transition, Transitions};
pub use word::{control, status};
