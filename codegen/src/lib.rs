//! Turns a CANopen data sheet into a typed object dictionary, from a `build.rs`:
//!
//! ```no_run
//! fn main() -> Result<(), lexican_codegen::Error> {
//!     lexican_codegen::Config::new().eds("eds/drive.eds").generate()
//! }
//! ```
//!
//! and in the crate, `mod od { lexican_runtime::include_od!("drive"); }`.
//!
//! [`compile`] turns a model into text, the same bytes for the same input. [`Config`] is for build scripts, and the only
//! part with I/O.
//!
//! Generated code is the data sheet in rows: names, types, numbers, documentation. Codes and bits are in hexadecimal,
//! quantities in decimal. Macros and types of `lexican-runtime` make code of the rows. It has no inner attributes and no
//! `unsafe`. What it imports is a glob of the runtime, which gives way to other names: types of the data sheet may be
//! called like types of the runtime, and the code may be included into a module that imports the same types itself.
//!
//! For a drive of CiA 402, [`Config::driver`] adds what its driver has to know, so that a drive that does what the profile
//! says needs no line of its own.
//!
//! # Findings
//!
//! Besides those of the data sheet (`lexican-eds`), generating has findings of its own; see [`FINDINGS`].

mod compile;
mod config;
mod defined;
mod emit;
mod error;
mod findings;
mod name;
mod options;
mod plan;
mod scope;

pub use compile::{Output, compile, compile_pdos, module_names};
pub use config::Config;
pub use error::Error;
pub use findings::FINDINGS;
pub use lexican_eds::drive::Finding;
pub use options::Options;

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
