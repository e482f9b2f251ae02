//! The Kollmorgen AKD servo drive on CANopen: a typed driver, and a simulated drive.
//!
//! - [`od`]: the dictionary, generated from the data sheet;
//! - [`driver`]: the typed driver;
//! - [`ascii`]: its ASCII commands, through object 2026h;
//! - [`fault`]: its faults and warnings, by number;
//! - [`sim`]: the simulated drive, in virtual time.
//!
//! Chapters are those of the manual "AKD CANopen Communication", edition E of October 2011. Where it contradicts itself
//! or is silent, a comment states the choice.

pub mod ascii;
pub mod driver;
pub mod fault;
pub mod sim;

/// The dictionary, generated from the data sheet `kollmorgen/akd` and its overlay.
pub mod od {
    lexican_runtime::include_od!("kollmorgen_akd");
}

/// The README, so that its examples are compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
