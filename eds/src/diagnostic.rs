//! Findings: what is wrong, where, and how to mend it.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::Arc;

use crate::patch::Patch;
use crate::text::Span;

/// At most this many findings of one code are kept; the others are only counted.
pub const MAX_PER_CODE: usize = 1000;

/// A finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// A stable code: `eds::missing-key`.
    pub code: &'static str,
    /// That of its rule, unless a configuration sets another one.
    pub severity: Severity,
    /// One line, lower case, without full stop.
    pub message: String,
    /// The primary place first, then the places that disagree with it.
    pub labels: Vec<Label>,
    /// How to mend it.
    pub help: Option<String>,
    /// The patch of the data sheet, if there is one right answer; [`fix`](mod@crate::fix) applies it. Several findings
    /// may share one.
    pub fix: Option<Arc<Patch>>,
}

/// A place with a remark.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The bytes that it marks.
    pub span: Span,
    /// The remark; may be empty.
    pub text: String,
    /// Whether the finding is about this place; otherwise it is a place that disagrees with it.
    pub primary: bool,
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// The data sheet contradicts itself or the standard; it is read by a guess that is usually right.
    Warning,
    /// The value cannot be interpreted.
    Error,
}

impl Severity {
    /// `error`, `warning`, `note`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

impl Diagnostic {
    /// A finding without place.
    pub fn new(code: &'static str, severity: Severity, message: impl Into<String>) -> Self {
        Self { code, severity, message: message.into(), labels: Vec::new(), help: None, fix: None }
    }

    /// Adds the primary place, with a remark.
    #[must_use]
    pub fn at(self, span: Span, text: impl Into<String>) -> Self {
        self.label(span, text.into(), true)
    }

    /// Adds a place that disagrees with the primary one.
    #[must_use]
    pub fn and(self, span: Span, text: impl Into<String>) -> Self {
        self.label(span, text.into(), false)
    }

    /// Sets how to mend it.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// The primary place.
    #[must_use]
    pub fn span(&self) -> Option<Span> {
        self.labels.first().map(|label| label.span)
    }

    fn label(mut self, span: Span, text: String, primary: bool) -> Self {
        // Most findings have one place, and there may be thousands of findings: allocate no spare room.
        self.labels.reserve_exact(1);
        self.labels.push(Label { span, text, primary });
        self
    }
}

/// All findings. [`load`](crate::load) returns them in the order of their places.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    kept: BTreeMap<&'static str, usize>,
}

impl Diagnostics {
    /// Adds a finding, or only counts it if [`MAX_PER_CODE`] of its code are kept already.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        let seen = self.kept.entry(diagnostic.code).or_default();
        *seen += 1;
        if *seen <= MAX_PER_CODE {
            self.list.push(diagnostic);
        }
    }

    /// Counts findings that are not kept because there are enough of their code.
    pub(crate) fn count_only(&mut self, code: &'static str, more: usize) {
        *self.kept.entry(code).or_default() += more;
    }

    /// Whether any finding is an error.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.count(Severity::Error) > 0
    }

    /// The number of findings with this severity.
    #[must_use]
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|diagnostic| diagnostic.severity == severity).count()
    }

    /// The severity of the worst finding; `None` without findings.
    #[must_use]
    pub fn worst(&self) -> Option<Severity> {
        self.list.iter().map(|diagnostic| diagnostic.severity).max()
    }

    /// Sets the severity of all findings with this code; `None` removes them.
    pub fn set_severity(&mut self, code: &str, severity: Option<Severity>) {
        match severity {
            None => self.list.retain(|diagnostic| diagnostic.code != code),
            Some(severity) => {
                let of_code = self.list.iter_mut().filter(|diagnostic| diagnostic.code == code);
                of_code.for_each(|diagnostic| diagnostic.severity = severity);
            }
        }
    }

    /// Makes all findings with this code errors.
    pub fn deny(&mut self, code: &str) {
        self.set_severity(code, Some(Severity::Error));
    }

    /// Removes all findings with this code.
    pub fn allow(&mut self, code: &str) {
        self.set_severity(code, None);
    }

    /// The findings, to add labels and help to them.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Diagnostic> {
        self.list.iter_mut()
    }

    /// Removes the findings for which `some` holds.
    pub(crate) fn retract(&mut self, mut some: impl FnMut(&Diagnostic) -> bool) {
        self.list.retain(|diagnostic| !some(diagnostic));
    }

    /// Sorts the findings by place, and notes how many were only counted.
    pub fn finish(&mut self) {
        for (code, seen) in std::mem::take(&mut self.kept) {
            if seen > MAX_PER_CODE {
                let more = seen - MAX_PER_CODE;
                let message = format!("{more} more findings of {code} are not shown");
                self.list.push(Diagnostic::new("eds::more-findings", Severity::Note, message));
            }
        }
        self.list.sort_by_key(|diagnostic| diagnostic.span().unwrap_or(Span { source: u16::MAX, start: 0, end: 0 }));
    }
}

impl Deref for Diagnostics {
    type Target = [Diagnostic];

    fn deref(&self) -> &[Diagnostic] {
        &self.list
    }
}

impl IntoIterator for Diagnostics {
    type Item = Diagnostic;
    type IntoIter = std::vec::IntoIter<Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.list.into_iter()
    }
}

impl Extend<Diagnostic> for Diagnostics {
    fn extend<T: IntoIterator<Item = Diagnostic>>(&mut self, diagnostics: T) {
        diagnostics.into_iter().for_each(|diagnostic| self.push(diagnostic));
    }
}
