//! An open conformance test for any CANopen device, by frames alone: the cases of CiA's test plan (CCT 3.0.3.10) and
//! more.
//!
//! A [`Case`] judges frames: it reaches the device through a [`Tester`], which sends, receives and waits, and knows the
//! data [`Sheet`]. A case about something that the data sheet lacks does not apply. Anything that may move a machine or
//! outlast the test is a [`Hazard`], and is done only if it is [allowed](Settings::allow).

mod answers;
mod axis;
mod background;
mod case;
mod cases;
mod hazard;
mod host;
mod known;
mod lss;
mod report;
mod sdo;
mod sheet;
mod suite;
mod tester;
mod trace;
mod value;
mod verdict;

pub use background::{End, Running};
pub use case::Case;
pub use cases::{cases, profile_cases};
pub use hazard::Hazard;
pub use host::HostLateness;
pub use known::Known;
pub use report::{About, Differences, Document, Earlier, Tally};
pub use sheet::{Findings, Sheet};
pub use suite::{CaseReport, Observer, Report, run};
pub use tester::{Heard, InputStimulus, Motion, Record, Settings, Stimuli, Tester, Write};
pub use trace::{Asked, ChapterReport, Row, Step, StepReport, Trace, TraceReport, ask, run_trace};
pub use verdict::{Ended, Level, Outcome, Verdict};

/// The README, so that its examples are compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
