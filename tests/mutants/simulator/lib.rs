//! What SIKO's drives share, with all mutants of the simulated drive and the gateway in it: `build.rs` makes it of the sources of
//! `lexican-siko`.
//!
//! Every place that can be wrong asks [`mutant::is`] whether it is to be, so that one build has all mutants and a
//! process chooses one by its environment.

pub use shared::{assert_describes, description, fault, faults, order, words, worked_examples};

#[allow(warnings, clippy::all, reason = "mutants are not written, but made")]
mod mutated {
    include!(concat!(env!("OUT_DIR"), "/mutated.rs"));
}

pub use mutated::{gateway, model, sim, state};

#[path = "../mutant.rs"]
pub mod mutant;
