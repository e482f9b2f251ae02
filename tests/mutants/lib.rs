//! A crate of the drives with all its mutants. `build.rs` makes it of the sources of the original, and it has the same
//! name.
//!
//! Every place with a mutant asks [`mutant::is`] whether to use it. So one build has all mutants, and a process chooses
//! one by its environment.

#[allow(warnings, clippy::all, reason = "mutants are not written, but made")]
mod mutated {
    include!(concat!(env!("OUT_DIR"), "/mutated.rs"));
}

pub use mutated::*;

pub mod mutant;
