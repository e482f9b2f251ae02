//! A file has at most 64 MiB and a million lines.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::file-size",
    severity: Severity::Error,
    holds: "A file has at most 64 MiB and a million lines.",
    explain: "Data sheets of the largest devices known have some 2 MB. A file beyond the bounds is something else, or \
              an attempt to exhaust memory; it is not read at all.",
    help: "",
    check: None,
};

pub(crate) fn found(refusal: crate::source::Refusal) -> Diagnostic {
    use crate::source::{MAX_BYTES, MAX_LINES, Refusal};
    let message = match refusal {
        // Who reads no further than that does not know how many there are.
        Refusal::TooLong { .. } => format!("the file has more than {MAX_BYTES} bytes, which is as many as are read"),
        Refusal::TooManyLines { lines } => format!("the file has {lines} lines; at most {MAX_LINES} are read"),
    };
    RULE.finding(message)
}
