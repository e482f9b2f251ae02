//! A key stands where it means something.

use super::Rule;
use crate::diagnostics::Severity;

pub(crate) const RULE: Rule = Rule {
    code: "eds::key-without-effect",
    severity: Severity::Note,
    holds: "A key stands where it means something.",
    explain: "The data type, access type or value of an ARRAY or RECORD is that of its sub-indices; the same keys in \
              the section of the object mean nothing unless `CompactSubObj` is used, nor does `SubNumber` in the \
              section of a sub-index.",
    help: "",
    check: None,
};
