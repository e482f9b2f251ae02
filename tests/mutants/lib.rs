//! A crate of the drives with all its mutants: `build.rs` makes it of the sources of that crate, under whose name it stands in
//! for it.
//!
//! Every place that can be wrong asks [`mutant::is`] whether it is to be, so that one build has all mutants and a
//! process chooses one by its environment.

#[allow(warnings, clippy::all, reason = "mutants are not written, but made")]
mod mutated {
    include!(concat!(env!("OUT_DIR"), "/mutated.rs"));
}

pub use mutated::*;

pub mod mutant;
