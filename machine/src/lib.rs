//! A CANopen machine in one file, `machine.toml`: its bus, its nodes by name, the values that go between them, how it boots
//! and how it is simulated.
//!
//! [`Machine::open`] reads it, with a finding for each mistake; [`Machine::writes`] is what is written into each node,
//! [`Machine::boot_plan`] what a manager does with it, [`Machine::load`] how busy the bus is; [`schema`] is for editors. With the feature `codegen`,
//! `generate` makes a typed machine of it in a build script.

mod at;
mod check;
mod faults;
mod file;
mod files;
mod format;
#[cfg(feature = "codegen")]
mod generate;
mod model;
mod nodes;
mod plan;
mod read;
mod wire;

pub use at::At;
pub use check::Load;
pub use files::Files;
pub use format::format;
#[cfg(feature = "codegen")]
pub use generate::generate;
#[cfg(feature = "codegen")]
pub use lexican_codegen::{Config, Error as BuildError};
pub use model::{Bus, Fault, Machine, Node, PlannedPdo, Setting, Simulated};
pub use plan::{Why, Write};

/// The JSON Schema of the file, for editors.
#[must_use]
pub fn schema() -> serde_json::Value {
    let mut schema = schemars::schema_for!(file::File);
    schema.insert("title".to_owned(), "machine.toml of lexican".into());
    schema.to_value()
}

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
