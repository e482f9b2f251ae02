//! ObjectLinks name objects that are there.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};

pub(crate) const RULE: Rule = Rule {
    code: "eds::broken-link",
    severity: Severity::Warning,
    holds: "ObjectLinks name objects that are there.",
    explain: "`[xxxxObjectLinks]` (CiA 306-1) lists objects that belong together.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    for (object, _) in context.objects() {
        for &link in object.links.iter().filter(|&&link| context.device.object(link).is_none()) {
            let message = format!("the object {:04X} links to {link:04X}, which is not there", object.index);
            out.push(RULE.finding(message).at(object.span, ""));
        }
    }
}
