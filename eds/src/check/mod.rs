//! The rules: one per file, named after what holds where it finds nothing.

use crate::diagnostics::Severity;

/// A rule.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// The code of its findings.
    pub code: &'static str,
    /// How bad its findings are.
    pub severity: Severity,
    /// What holds where it finds nothing: one sentence.
    pub holds: &'static str,
    /// Why that matters, and how to mend it: one paragraph.
    pub explain: &'static str,
}

/// All rules, by code.
#[must_use]
pub fn rules() -> &'static [&'static Rule] {
    &[]
}

/// The rule with this code.
#[must_use]
pub fn rule(code: &str) -> Option<&'static Rule> {
    rules().iter().copied().find(|rule| rule.code == code)
}
