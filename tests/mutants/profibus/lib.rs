//! PROFIBUS-DP with all mutants of its codecs, its slave and its bus in it: `build.rs` makes it of the sources of
//! `lexican-profibus`.
//!
//! Every place that can be wrong asks [`mutant::is`] whether it is to be, so that one build has all mutants and a
//! process chooses one by its environment.

#[allow(warnings, clippy::all, reason = "mutants are not written, but made")]
mod mutated {
    include!(concat!(env!("OUT_DIR"), "/mutated.rs"));
}

pub use mutated::slave::{Application, BitRate, Identity, Slave, State};
pub use mutated::trouble::Trouble;
pub use mutated::{bus, dp, fdl, master, pkw, profidrive, virtual_bus, virtual_line};

#[path = "../mutant.rs"]
pub mod mutant;
