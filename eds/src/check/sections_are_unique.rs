//! No two sections have the same name.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::syntax::{Section, Syntax};

pub(crate) const RULE: Rule = Rule {
    code: "eds::duplicate-section",
    severity: Severity::Warning,
    holds: "No two sections have the same name.",
    explain: "Readers differ in which one they take. The first one counts here, as with the functions of Windows that \
              data sheets were made for.",
    help: "",
    check: None,
};

pub(crate) fn found(syntax: &Syntax<'_>, first: &Section<'_>, second: &Section<'_>) -> Diagnostic {
    let equal = first.pairs.len() == second.pairs.len()
        && first.pairs.iter().zip(&second.pairs).all(|(a, b)| a.key.eq_ignore_ascii_case(b.key) && a.value == b.value);
    let same = if equal { "with the same content" } else { "with other content" };
    RULE.finding(format!("the section `{}` comes again {same}", second.name))
        .at(syntax.name_span(second), "ignored")
        .and(syntax.name_span(first), "this one counts")
}
