//! What is wrong where, and how to mend it.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::Arc;

use crate::patch::Patch;
use crate::text::Span;

/// The most findings of one code that are kept; those beyond are only counted.
pub const MAX_PER_CODE: usize = 1000;

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable words: `eds::missing-key`.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// One line, lower case, without full stop.
    pub message: String,
    /// Where: the primary place first, then those that disagree with it.
    pub labels: Vec<Label>,
    /// How to mend it.
    pub help: Option<String>,
    /// What mends it in the data sheet, if there is one right answer: what [`fix`](mod@crate::fix) applies.
    /// Findings may have one in common.
    pub fix: Option<Arc<Patch>>,
}

/// A place with a remark.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// The remark; may be empty.
    pub text: String,
    /// Whether this is the place of the finding; else it is a place that disagrees with it.
    pub primary: bool,
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// The data sheet contradicts itself or the standard; what was read is a guess that is usually right.
    Warning,
    /// Nothing correct can be made of it.
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

    /// With its place, and a remark there.
    #[must_use]
    pub fn at(self, span: Span, text: impl Into<String>) -> Self {
        self.label(span, text.into(), true)
    }

    /// With a place that disagrees with it.
    #[must_use]
    pub fn and(self, span: Span, text: impl Into<String>) -> Self {
        self.label(span, text.into(), false)
    }

    /// How to mend it.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// The place of the finding, when it has one.
    #[must_use]
    pub fn span(&self) -> Option<Span> {
        self.labels.first().map(|label| label.span)
    }

    fn label(mut self, span: Span, text: String, primary: bool) -> Self {
        // Most findings have one place, and there may be thousands of findings.
        self.labels.reserve_exact(1);
        self.labels.push(Label { span, text, primary });
        self
    }
}

/// All findings, in the order of their places once [`load`](crate::load) has returned them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    kept: BTreeMap<&'static str, usize>,
}

impl Diagnostics {
    /// Adds a finding; beyond [`MAX_PER_CODE`] of its code it is only counted.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        let seen = self.kept.entry(diagnostic.code).or_default();
        *seen += 1;
        if *seen <= MAX_PER_CODE {
            self.list.push(diagnostic);
        }
    }

    /// Counts findings that are not kept, because there were enough of their code.
    pub(crate) fn count_only(&mut self, code: &'static str, more: usize) {
        *self.kept.entry(code).or_default() += more;
    }

    /// Whether anything is an error.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.count(Severity::Error) > 0
    }

    /// How many findings have this severity.
    #[must_use]
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|diagnostic| diagnostic.severity == severity).count()
    }

    /// How bad the worst finding is.
    #[must_use]
    pub fn worst(&self) -> Option<Severity> {
        self.list.iter().map(|diagnostic| diagnostic.severity).max()
    }

    /// Gives all findings of a code this severity; `None` removes them.
    pub fn set_severity(&mut self, code: &str, severity: Option<Severity>) {
        match severity {
            None => self.list.retain(|diagnostic| diagnostic.code != code),
            Some(severity) => {
                let of_code = self.list.iter_mut().filter(|diagnostic| diagnostic.code == code);
                of_code.for_each(|diagnostic| diagnostic.severity = severity);
            }
        }
    }

    /// Makes all findings of a code errors.
    pub fn deny(&mut self, code: &str) {
        self.set_severity(code, Some(Severity::Error));
    }

    /// Removes all findings of a code.
    pub fn allow(&mut self, code: &str) {
        self.set_severity(code, None);
    }

    /// All findings, to add to them.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Diagnostic> {
        self.list.iter_mut()
    }

    /// Takes back some findings.
    pub(crate) fn retract(&mut self, mut some: impl FnMut(&Diagnostic) -> bool) {
        self.list.retain(|diagnostic| !some(diagnostic));
    }

    /// Puts the findings in the order of their places, and says how many were only counted.
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
