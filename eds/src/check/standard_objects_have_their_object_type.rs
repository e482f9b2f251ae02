//! Objects of CiA 301 and of the profile have the object type of the standard.

use super::standard;
use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::object::Key;

pub(crate) const RULE: Rule = Rule {
    code: "cia301::object-type",
    severity: Severity::Warning,
    holds: "Objects of CiA 301 and of the profile have the object type of the standard.",
    explain: "A tool that knows the standard reads 1018h as a RECORD, and 1003h as an ARRAY. Where the device really \
              differs nothing can be done; where only the data sheet does, an overlay cannot change it, but nothing is \
              lost.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, facts) in context.objects() {
        let Some(standard) = standard::object(object.index, context.device.profile) else { continue };
        let same = object.kind == standard.kind || facts.declared.is_none();
        // What is a list of equal values may be either.
        let alike = object.kind.has_subs() && standard.kind.has_subs() && standard.loose;
        if !same && !alike {
            let found = object.kind.name();
            let finding = RULE.finding(format!(
                "{:04X} is a {found}, in {} a {}",
                object.index,
                standard.source,
                standard.kind.name()
            ));
            out.push(finding.at(context.value_span(object.span, Key::ObjectType), ""));
        }
    }
}
