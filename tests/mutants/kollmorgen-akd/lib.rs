//! The AKD with all mutants of its driver and simulator in it: `build.rs` makes it of the sources of
//! `lexican-kollmorgen-akd`.
//!
//! Every place that can be wrong asks [`mutant::is`] whether it is to be, so that one build has all mutants and a
//! process chooses one by its environment.

pub use shared::od;

#[allow(warnings, clippy::all, reason = "mutants are not written, but made")]
mod mutated {
    include!(concat!(env!("OUT_DIR"), "/mutated.rs"));
}

pub use mutated::{ascii, driver, fault, sim};

#[path = "../mutant.rs"]
pub mod mutant;
