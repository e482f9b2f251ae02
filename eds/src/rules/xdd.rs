//! Rules about what only an XDD, XDC or XPD (CiA 311) can contain.

use super::context::Context;
use super::rule::note;
use crate::diagnostic::Diagnostic;
use crate::finding::{Finding, Kind};

pub(super) fn dangling_reference(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::DanglingReference(id) = &finding.kind else { return None };
    let note = note(format!("there is no parameter `{id}`")).at(finding.span, "the object's own attributes count");
    Some(note.help(
        "add the parameter to `parameterList`, or give the object its `dataType` and `accessType` and no reference",
    ))
}

pub(super) fn duplicate_id(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::DuplicateId { id, first } = &finding.kind else { return None };
    let note = note(format!("the identifier `{id}` comes again")).at(finding.span, "ignored");
    Some(
        note.and(*first, "this one counts")
            .help("give one of them another identifier, and its objects a reference to it"),
    )
}

pub(super) fn not_read(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::Unread(elements) = &finding.kind else { return None };
    let elements: Vec<String> = elements.iter().map(|(name, count)| format!("{name} ({count})")).collect();
    let note = note(format!("not read: {}", elements.join(", "))).at(finding.span, "the first of them");
    Some(note.help("they do no harm, but an EDS or XDD that is written has none of them"))
}
