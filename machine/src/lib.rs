//! A CANopen machine in one file, `machine.toml`: its bus, its nodes by name, the values that they exchange, how it
//! boots, and how it is simulated.
//!
//! [`Machine::open`] reads the file and reports each mistake as a finding; [`Machine::writes`] lists the values to
//! write into a node, [`Machine::boot_plan`] is the manager's plan, [`Machine::load`] the bus load; [`schema`] is for
//! editors. [`Machine::dcf`], [`Machine::database`], [`Machine::page`] and others export to tools and people. A
//! [`Draft`] makes the file of an existing machine, from nodes [`Found`] on its bus, a [`BusYml`] or a [`Cpj`]. With
//! the feature `codegen`, `generate` makes a typed machine in a build script.

mod at;
mod bench;
mod bus_yml;
mod check;
mod cpj;
mod draft;
mod export;
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
#[cfg(feature = "shells")]
mod shell;
mod wire;

pub use at::{At, Revision};
pub use bus_yml::BusYml;
pub use check::Load;
pub use cpj::Cpj;
pub use draft::{Draft, Found};
pub use files::Files;
pub use format::format;
#[cfg(feature = "codegen")]
pub use generate::generate;
#[cfg(feature = "codegen")]
pub use lexican_codegen::{Config, Error as BuildError};
pub use model::{Bus, Fault, Filter, Identity, Machine, Node, PlannedPdo, Setting, Shown, Simulated, WhichBus};
pub use plan::{Why, Write};
#[cfg(feature = "archive")]
pub use shell::parameters;
#[cfg(feature = "shells")]
pub use shell::{BoxedLink, Event, Heard, MachineError, What, blocking, tokio};

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
