//! Every key of an overlay is one that is known.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "overlay::unknown-key",
    severity: Severity::Error,
    holds: "Every key of an overlay is one that is known.",
    explain: "An overlay is written for this reader, so an unknown key is a slip that would otherwise lose what was \
              meant.",
    help: "",
    check: None,
};

pub(crate) fn found(key: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("the key `{key}` is unknown here")).at(span, "")
}

pub(crate) fn of_record(key: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("`{key}` belongs to an entry of the record"))
        .at(span, "")
        .help("name the entry: `[object.\"2410:05\"]`")
}
