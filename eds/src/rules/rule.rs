//! What a rule is, and what it reports with.

use super::context::Context;
use crate::diagnostic::{Diagnostic, Diagnostics, Severity};
use crate::finding::Finding;
use crate::text::Span;

/// The most places that are shown of one finding.
const MAX_PLACES: usize = 4;

/// A rule.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// The code of its findings.
    pub code: &'static str,
    /// How bad its findings are.
    pub severity: Severity,
    /// What holds where it finds nothing: one sentence.
    pub holds: &'static str,
    /// Why that matters, and what is done about it: one paragraph.
    pub why: &'static str,
    /// What [`fix`](mod@crate::fix) does about its findings, if there is one right answer: one sentence.
    pub fixes: Option<&'static str>,
    pub(super) find: Find,
}

/// How a rule comes to its findings.
#[derive(Clone, Copy, Debug)]
pub(super) enum Find {
    /// It puts into words what parsing or an overlay has found.
    Read(fn(&Context<'_>, &Finding) -> Option<Diagnostic>),
    /// It looks at the finished model.
    Check(fn(&Context<'_>, &mut Out<'_>)),
    /// It is about the findings themselves.
    Last,
}

/// Where a rule puts its findings.
pub(super) struct Out<'o> {
    pub(super) rule: &'static Rule,
    pub(super) diagnostics: &'o mut Diagnostics,
}

/// A finding in the words of a rule, whose code and severity it gets from the table.
pub(super) fn note(message: impl Into<String>) -> Diagnostic {
    Diagnostic::new("", Severity::Note, message)
}

impl Diagnostic {
    /// At several places, of which the first few are shown: the remark at the first one, and at each of the others.
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
