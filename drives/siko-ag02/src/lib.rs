//! The SIKO AG02 positioning drive: a typed driver, and its dictionary.
//!
//! - [`od`]: the dictionary, generated from the data sheet;
//! - [`driver`]: what the drive can do, in its own words;
//! - [`fault`]: its faults and emergency codes;
//! - [`state`], [`words`], [`worked_examples`]: the tables that it shares with SIKO's other drives.
//!
//! Chapters and tables are those of the German manual of 02/2018, firmware 2.00 or higher. Where it contradicts itself
//! or is silent, the choice is said where it is made.

pub mod driver;
pub mod fault;

pub use lexican_driver::Direction;
pub use siko::{state, words, worked_examples};

/// The dictionary, generated from the data sheet `siko/ag02` and its overlay.
pub mod od {
    lexican_runtime::include_od!("siko_ag02");
}

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
