//! The errors of a plant.

use std::ops::Range;

use lexican_eds::text::Span;
use lexican_eds::{Diagnostic, Input, Severity};

use crate::device::SimulationError;

/// Why devices cannot be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlantError {
    /// A machine or a script has mistakes.
    #[error("{file} cannot be simulated\n\n{findings}")]
    Wrong {
        /// The file.
        file: String,
        /// What is wrong, with the lines in question; each finding ends with an empty line.
        findings: String,
    },
    /// A device that belongs to no machine cannot be simulated.
    #[error(transparent)]
    Device(#[from] SimulationError),
}

impl PlantError {
    /// A mistake that shows only in the simulation.
    pub(super) fn at(input: &Input, span: &Range<usize>, what: impl ToString, help: Option<String>) -> Self {
        let place = Span { source: 0, start: span.start as u32, end: span.end as u32 };
        let finding = Diagnostic::new("machine::simulate", Severity::Error, what.to_string()).at(place, "");
        PlantError::of([&Diagnostic { help, ..finding }], input)
    }

    /// The errors among findings.
    pub(super) fn of<'a>(findings: impl IntoIterator<Item = &'a Diagnostic>, input: &Input) -> Self {
        let errors = findings.into_iter().filter(|finding| finding.severity == Severity::Error);
        let findings = errors.map(|finding| finding.render(input) + "\n\n").collect();
        PlantError::Wrong { file: input.eds.name().to_owned(), findings }
    }
}
