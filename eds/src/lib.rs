//! Reads CANopen electronic data sheets (EDS and DCF, CiA 306-1; XDD, XDC and XPD, CiA 311) as a compiler reads
//! programs: reading never fails, nothing is dropped silently, and every finding names its place.
//!
//! ```
//! use lexican_eds::{Input, Source, load};
//!
//! let input = Input::new(Source::new("drive.eds", "[1000]\nParameterName Device type\nDataType=7\n"));
//! let (device, diagnostics) = load(&input);
//! assert_eq!(device.objects[0].name, "Device type");
//! assert!(diagnostics.render(&input).contains("drive.eds:2:1"));
//! ```
//!
//! [`dump`] shows a device as a table, [`diff`] compares two, [`write`](mod@write) makes EDS and DCF, [`mod@xdd`] XDD
//! and XDC, and [`convert`] lists what a format loses; [`template`] makes a new device to begin with. [`fmt`] formats a
//! file, [`edit`] changes keys and objects in it, [`fix`](mod@fix) repairs what has one right answer, and [`outline`]
//! says what each place of a file is about. [`library`] holds the data sheets that are shipped.
//!
//! [`cia301`], [`cia402`] and [`standard`] describe the objects of CiA 301 and CiA 402, for rules and for generated
//! code, and [`meanings`] adds the meanings of their numbers to a device. [`drive`] extracts what drivers need of a CiA
//! 402 drive; [`start`] says which values a device starts with.
//!
//! Data flow in one direction: [`text`] (bytes, encodings, lines, places) → `parse` (sections, keys, CiA 306) →
//! [`model`] → [`overlay`] (corrections and meanings beside the data sheet) → [`rules`] → [`report`]. Parsing and
//! overlays return findings as data; the rules, one table row each, put them into words.

pub mod convert;
mod diagnostic;
pub mod diff;
pub mod drive;
pub mod dump;
pub mod edit;
mod finding;
pub mod fix;
pub mod fmt;
pub mod library;
pub mod meanings;
pub mod model;
pub mod outline;
pub mod overlay;
mod parse;
pub mod patch;
pub mod report;
pub mod rules;
pub mod standard;
pub mod start;
pub mod template;
pub mod text;
pub mod write;
pub mod xdd;

pub use lexican_cia::{cia301, cia402};

pub use diagnostic::{Diagnostic, Diagnostics, Label, MAX_PER_CODE, Severity};
pub use model::types;
pub use parse::syntax::Memory;
pub use text::{Input, Source, Span};

use finding::Findings;

/// Reads a data sheet and its overlays, builds the model and applies all rules.
///
/// Never fails and never panics: everything wrong becomes a finding, and the model holds what could be read.
#[must_use]
pub fn load(input: &Input) -> (model::Device, Diagnostics) {
    read_all(input, rules::apply, None)
}

/// The same as [`load`], but faster if most of the data sheet is unchanged since the last reading.
#[must_use]
pub fn load_again(input: &Input, memory: &mut Memory) -> (model::Device, Diagnostics) {
    read_all(input, rules::apply, Some(memory))
}

/// The model alone, without applying any rule: for programs that do not report what is wrong with the data sheet.
#[must_use]
pub fn device(input: &Input) -> model::Device {
    read_all(input, |_, _, _, _| Diagnostics::default(), None).0
}

/// Makes the findings about a device.
type Judge = fn(&model::Device, &parse::facts::Facts<'_>, &overlay::Changes, &Findings) -> Diagnostics;

fn read_all(input: &Input, judge: Judge, memory: Option<&mut Memory>) -> (model::Device, Diagnostics) {
    let mut found = Findings::default();
    let device = model::Device::default();
    if !parse::is_readable(&input.eds, &mut found) {
        return (device, rules::of_text(&parse::facts::Facts::none(&input.eds), &found));
    }
    if !xdd::is_xml(&input.eds) {
        return read(&input.eds, &input.overlays, &mut found, None, judge, memory);
    }
    let Some(mut sheet) = xdd::translate(&input.eds, &mut found) else {
        return (device, rules::of_text(&parse::facts::Facts::none(&input.eds), &found));
    };
    let eds = sheet.eds.clone();
    let (mut device, mut diagnostics) = read(&eds, &input.overlays, &mut found, Some(&mut sheet), judge, memory);
    sheet.take_back(&mut device, &mut diagnostics);
    (device, diagnostics)
}

/// Reads a text in the form of CiA 306, which may have been translated from XML.
fn read(
    eds: &Source,
    overlays: &[Source],
    found: &mut Findings,
    sheet: Option<&mut xdd::Sheet>,
    judge: Judge,
    memory: Option<&mut Memory>,
) -> (model::Device, Diagnostics) {
    let tokens = parse::syntax::tokenize(eds, found, memory);
    let syntax = parse::syntax::Syntax::new(eds, &tokens.text, tokens.lengths);
    if parse::is_project(&syntax, found) {
        return (model::Device::default(), rules::of_text(&parse::facts::Facts::none(eds), found));
    }
    let (mut device, facts) = parse::read(syntax, found);
    let mut changes = overlay::Changes::default();
    if let Some(sheet) = sheet {
        sheet.annotate(&mut device, &mut changes, found);
    }
    for (overlay, number) in overlays.iter().zip(1..) {
        overlay::apply(overlay, number, &mut device, &mut changes, found);
    }
    device.profile = overlay::profile(&device, &changes);
    device.pdos = model::pdo::pdos(&device);
    overlay::pdo::merge(&mut device, &changes);
    let diagnostics = judge(&device, &facts, &changes, found);
    (device, diagnostics)
}

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
