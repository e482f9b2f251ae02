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
//! [`compile`] turns a model into text; the same input gives the same bytes. [`Config`] is for build scripts, and the
//! only part that does I/O.
//!
//! Generated code consists of rows of names, types, numbers and documentation, from which macros and types of
//! `lexican-runtime` make the code. Codes and bits are in hexadecimal, quantities in decimal. There are no inner
//! attributes and no `unsafe`. It imports the runtime by a glob, over which other names take precedence: types of the
//! data sheet may have the names of runtime types, and the including module may import the same types itself.
//!
//! For a CiA 402 drive, [`Config::driver`] adds the description for its driver. A drive that follows the profile needs
//! no handwritten line.
//!
//! # Findings
//!
//! Generating has findings of its own besides those of `lexican-eds`; see [`FINDINGS`].

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
