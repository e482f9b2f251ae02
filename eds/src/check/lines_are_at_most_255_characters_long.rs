//! A line has at most 255 characters.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::long-line",
    severity: Severity::Note,
    holds: "A line has at most 255 characters.",
    explain: "CiA 306-1 limits lines to 255 characters, and readers with a fixed buffer cut them there. Longer lines \
              are read whole here.",
    help: "",
    check: None,
};

pub(crate) fn found(text: &str, start: u32) -> Diagnostic {
    let cut = text.char_indices().nth(crate::syntax::MAX_LINE_LENGTH).map_or(text.len(), |(at, _)| at);
    let span = Span::eds(start + cut as u32, start + text.len() as u32);
    RULE.finding(format!("the line has {} characters", text.chars().count())).at(span, "other readers may cut this off")
}
