//! The definition of a rule, and how it reports.

use super::context::Context;
use crate::diagnostic::{Diagnostic, Diagnostics, Severity};
use crate::finding::Finding;
use crate::text::Span;

/// The most places that one finding shows.
const MAX_PLACES: usize = 4;

/// A rule: one row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// `eds::missing-key`.
    pub code: &'static str,
    /// How bad its findings are.
    pub severity: Severity,
    /// The requirement, in one sentence.
    pub holds: &'static str,
    /// Why it matters, and what is done about it, in one paragraph.
    pub why: &'static str,
    /// What [`fix`](mod@crate::fix) changes, in one sentence; `None` without a fix.
    pub fixes: Option<&'static str>,
    pub(super) find: Find,
}

/// Where the findings of a rule come from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Find {
    /// Puts into words what parsing or an overlay has found.
    Read(fn(&Context<'_>, &Finding) -> Option<Diagnostic>),
    /// Checks the finished model.
    Check(fn(&Context<'_>, &mut Out<'_>)),
    /// Is about the other findings, and so comes last.
    Last,
}

/// Collects the findings of a rule.
pub(super) struct Out<'o> {
    pub(super) rule: &'static Rule,
    pub(super) diagnostics: &'o mut Diagnostics,
}

/// A finding with this message; the table supplies code and severity.
pub(super) fn note(message: impl Into<String>) -> Diagnostic {
    Diagnostic::new("", Severity::Note, message)
}

impl Diagnostic {
    /// Adds places, of which the first few are shown: with the remark `first` at the first one and `other` at each
    /// other.
    pub(super) fn at_each(self, places: impl IntoIterator<Item = Span>, first: &str, other: &str) -> Self {
        let places = places.into_iter().take(MAX_PLACES).enumerate();
        places.fold(self, |note, (at, span)| if at == 0 { note.at(span, first) } else { note.and(span, other) })
    }
}

impl Out<'_> {
    pub(super) fn push(&mut self, note: Diagnostic) {
        self.diagnostics.push(Diagnostic { code: self.rule.code, severity: self.rule.severity, ..note });
    }
}
