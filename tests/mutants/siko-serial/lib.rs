//! The AG02's serial port with all mutants of its codec, client, gateway and simulation in it: `build.rs` makes it of the
//! sources of `lexican-siko-serial`.
//!
//! Every place that can be wrong asks [`mutant::is`] whether it is to be, so that one build has all mutants and a
//! process chooses one by its environment.

#[allow(warnings, clippy::all, reason = "mutants are not written, but made")]
mod mutated {
    include!(concat!(env!("OUT_DIR"), "/mutated.rs"));
}

pub use mutated::client::{Client, Settings};
pub use mutated::line::{Line, Port};
pub use mutated::{answer, client, command, error, gateway, parameter, sim, telegram};

#[path = "../mutant.rs"]
pub mod mutant;
