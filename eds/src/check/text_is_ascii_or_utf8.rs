//! Text outside ASCII is UTF-8 without byte order mark.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::{Encoding, Source, Span};

pub(crate) const RULE: Rule = Rule {
    code: "eds::encoding",
    severity: Severity::Note,
    holds: "Text outside ASCII is UTF-8 without byte order mark.",
    explain: "CiA 306-1 knows ASCII only. Names with umlauts or degree signs come in code page 1252 or in UTF-8; bytes \
              that are not UTF-8 are read as code page 1252, and a byte order mark is dropped.",
    help: "",
    check: None,
};

pub(crate) fn found(source: &Source) -> Option<Diagnostic> {
    let message = match source.encoding() {
        Encoding::Utf8 => return None,
        Encoding::Utf8WithMark => "the file begins with a byte order mark",
        Encoding::Utf16 => "the file is in UTF-16",
        Encoding::Windows1252 => "the file is not UTF-8; it is read as code page 1252",
    };
    let first = source.text().char_indices().find(|(_, c)| !c.is_ascii());
    let (start, end) = first.map_or((0, 0), |(at, c)| (at, at + c.len_utf8()));
    Some(RULE.finding(message).at(Span::eds(start as u32, end as u32), if end > 0 { "first here" } else { "" }))
}
