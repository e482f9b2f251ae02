//! The only variable in a value is $NODEID.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::unknown-variable",
    severity: Severity::Warning,
    holds: "The only variable in a value is $NODEID.",
    explain: "CiA 306-1 knows `$NODEID` and no other variable. Another name is read as if it were `$NODEID`, which it \
              usually means.",
    help: "an overlay can correct it: `default = \"$NODEID+0x180\"` with a reason",
    check: None,
};

pub(crate) fn found(key: &str, span: Span) -> Diagnostic {
    RULE.finding(format!("`{key}` uses a variable other than $NODEID")).at(span, "read as $NODEID")
}
