//! A data sheet is an EDS or DCF, not XML.

use super::Rule;
use crate::diagnostics::{Diagnostic, Severity};
use crate::source::Span;

pub(crate) const RULE: Rule = Rule {
    code: "eds::xml",
    severity: Severity::Error,
    holds: "A data sheet is an EDS or DCF, not XML.",
    explain: "Files of CiA 311 (XDD, XDC, XPD) describe the same devices in XML. They are recognised, but only EDS and \
              DCF are read; most vendors offer both, and editors convert one into the other.",
    help: "",
    check: None,
};

pub(crate) fn found(span: Span) -> Diagnostic {
    RULE.finding("this is an XML file, not an EDS or DCF")
        .at(span, "")
        .help("ask the vendor for the EDS, or convert the XDD with an editor")
}
