//! SIKO's drives on PROFIBUS-DP with all mutants of master, gateway and simulated slave in it: `build.rs` makes it of the
//! sources of `lexican-siko-profibus`.
//!
//! Every place that can be wrong asks [`mutant::is`] whether it is to be, so that one build has all mutants and a
//! process chooses one by its environment.

#[allow(warnings, clippy::all, reason = "mutants are not written, but made")]
mod mutated {
    include!(concat!(env!("OUT_DIR"), "/mutated.rs"));
}

pub use mutated::drive::ProfibusDrive;
pub use mutated::model::{AG02, AG03_1, Model, PPO};
pub use mutated::{bus, gateway, line, master, table, words};

#[path = "../mutant.rs"]
pub mod mutant;
