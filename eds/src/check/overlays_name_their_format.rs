//! An overlay names a format that is known.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::format",
    severity: Severity::Error,
    holds: "An overlay names a format that is known.",
    explain: "`format = 1` in `[overlay]` says how the overlay is meant, so that a later format cannot be taken for \
              this one.",
    help: "",
    check: None,
};

pub(crate) fn missing(span: Span) -> Diagnostic {
    RULE.finding("the overlay does not name its format").at(span, "").help("begin with `[overlay]` and `format = 1`")
}

pub(crate) fn unknown(format: i128, span: Span) -> Diagnostic {
    RULE.finding(format!("the overlay has format {format}; this version knows format 1")).at(span, "")
}
