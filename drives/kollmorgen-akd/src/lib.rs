//! The Kollmorgen AKD servo drive over CANopen: a typed driver, and a drive that exists only in software.
//!
//! - [`od`]: the dictionary, generated from the data sheet;
//! - [`driver`]: what the drive can do, in its own words;
//! - [`ascii`]: its own commands, through objects 2026h;
//! - [`fault`]: its faults and warnings, by number;
//! - [`sim`]: the simulated drive, in virtual time.
//!
//! Chapters are those of the manual "AKD CANopen Communication", edition E of October 2011. Where it contradicts itself or
//! is silent, the choice is said where it is made.

pub mod ascii;
pub mod driver;
pub mod fault;
pub mod sim;

/// The dictionary, generated from the data sheet `kollmorgen/akd` and its overlay.
pub mod od {
    lexican_runtime::include_od!("kollmorgen_akd");
}

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
