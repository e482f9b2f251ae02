//! Reads CANopen electronic data sheets (EDS and DCF, CiA 306-1) as a compiler reads programs: reading never
//! fails, nothing is dropped in silence, and every finding names its place.
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
//! What comes of it: [`dump`] shows a device as a table, [`diff`] compares two, [`write`](mod@write) makes EDS and
//! DCF of one; [`fmt`] brings a file into the form of the standard. [`library`] holds the data sheets that are shipped.
//!
//! From text to device: [`source`] (bytes, encodings, lines, places) → `syntax` (sections and keys) → `object`
//! and `info` (what CiA 306 says) → [`overlay`] (corrections and meanings beside the data sheet) → [`model`] →
//! [`check`] (the rules) → [`diagnostics`].

pub mod check;
mod compact;
mod compact_pdo;
pub mod diagnostics;
pub mod diff;
pub mod dump;
mod eds;
pub mod fmt;
mod info;
pub mod library;
mod lists;
pub mod model;
mod modules;
mod number;
mod object;
pub mod overlay;
mod pdo;
mod read;
mod section;
pub mod source;
mod syntax;
pub mod types;
pub mod write;

pub use diagnostics::{Diagnostic, Diagnostics, Severity};
pub use source::{Source, Span};

/// A data sheet with its overlays; also what findings need to show the lines they are about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// The data sheet.
    pub eds: Source,
    /// The overlays, applied in order.
    pub overlays: Vec<Source>,
}

impl Input {
    /// A data sheet without overlay.
    #[must_use]
    pub fn new(eds: Source) -> Self {
        Self { eds, overlays: Vec::new() }
    }

    /// The same with one overlay more.
    #[must_use]
    pub fn overlay(mut self, overlay: Source) -> Self {
        self.overlays.push(overlay);
        self
    }

    /// The text that spans with this number are in.
    #[must_use]
    pub fn source(&self, number: u16) -> Option<&Source> {
        match number {
            0 => Some(&self.eds),
            n => self.overlays.get(usize::from(n) - 1),
        }
    }
}

/// Reads a data sheet and its overlays, builds the model and applies all rules.
///
/// Never fails and never panics: whatever is wrong is in the findings, and the model holds what could be read.
#[must_use]
pub fn load(input: &Input) -> (model::Device, Diagnostics) {
    let mut out = Diagnostics::default();
    let mut device = model::Device::default();
    if readable(&input.eds, &mut out) {
        let syntax::Tokens { text, lengths } = syntax::tokenize(&input.eds, &mut out);
        let syntax = syntax::Syntax::new(&input.eds, &text, lengths);
        let (read, facts) = eds::read(syntax, &mut out);
        device = read;
        let mut changes = overlay::Changes::default();
        for (overlay, number) in input.overlays.iter().zip(1..) {
            overlay::apply(overlay, number, &mut device, &mut changes, &mut out);
        }
        overlay::forget_what_was_corrected(&device, &facts, &changes, &mut out);
        device.profile = overlay::profile(&device, &changes);
        device.pdos = pdo::pdos(&device);
        overlay::merge_pdos(&mut device, &changes);
        check::all(&check::Context { device: &device, facts: &facts, changes: &changes }, &mut out);
        overlay::forget_what_is_accepted(&facts, &changes, &mut out);
        overlay::help(&facts, &mut out);
    }
    out.finish();
    (device, out)
}

/// Whether a text is one that can be a data sheet.
fn readable(eds: &Source, out: &mut Diagnostics) -> bool {
    if let Some(refusal) = eds.refusal() {
        out.push(check::file_is_within_bounds::found(refusal));
        return false;
    }
    out.extend(check::text_is_ascii_or_utf8::found(eds));
    let start = eds.text().len() - eds.text().trim_start().len();
    let xml = eds.text()[start..].starts_with('<');
    if xml {
        out.push(check::file_is_not_xml::found(Span::eds(start as u32, start as u32 + 1)));
    }
    !xml
}

/// The README, so that what it shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
