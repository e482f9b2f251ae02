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
//! [`compile`] does the work and touches nothing: model in, text out, byte-identical for identical input.
//! [`Config`] is the way there from a build script, and the only part with I/O.
//!
//! Generated code is data (names, types, numbers, documentation); what it does is generic code in
//! `lexican-runtime`. It has no inner attributes, no `use`, no `unsafe`, and names only paths of the runtime
//! and of `core`, so that it can be included anywhere.
//!
//! # Findings
//!
//! Beside those of the data sheet (`lexican-eds`), generating has findings of its own; see [`FINDINGS`].

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
mod standard;
mod start;

pub use compile::{Output, compile};
pub use config::Config;
pub use error::Error;
pub use findings::{FINDINGS, Finding};
pub use options::Options;
pub use start::{Initial, initial};

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
