//! Names that stand side by side: who collides is renamed, on all sides.

use std::collections::BTreeMap;

use lexican_eds::{Diagnostic, Diagnostics, Severity, Span};

use crate::name::{self, Case};

/// So many places of a collision are shown.
const MAX_PLACES: usize = 4;

/// One name that an item would like to have.
#[derive(Clone, Debug)]
pub(crate) struct Claim {
    /// The identifier.
    pub(crate) wanted: String,
    /// How it is written.
    pub(crate) case: Case,
    /// What is appended when others want it too: lower-case words, mostly an address.
    pub(crate) suffix: String,
    /// Where the data sheet names it.
    pub(crate) span: Span,
}

impl Claim {
    /// The identifier of `name`; `empty` when that has no letter.
    pub(crate) fn new(name: &str, case: Case, suffix: String, span: Span) -> Self {
        let mut wanted = name::identifier(name, case);
        if wanted.is_empty() {
            wanted = name::identifier(&format!("object {suffix}"), case);
        }
        Claim { wanted, case, suffix, span }
    }
}

/// The identifiers of all claims, in their order; no two are equal and none is in `reserved`.
///
/// Adding an item never renames another in silence: when two want one name, neither gets it.
pub(crate) fn resolve(scope: &str, reserved: &[&str], claims: &[Claim], findings: &mut Diagnostics) -> Vec<String> {
    let mut groups: BTreeMap<&str, Vec<&Claim>> = BTreeMap::new();
    for claim in claims {
        groups.entry(&claim.wanted).or_default().push(claim);
    }
    let is_free = |name: &str| groups.get(name).is_none_or(|group| group.len() == 1) && !reserved.contains(&name);
    let mut taken: BTreeMap<String, ()> = claims
        .iter()
        .map(|claim| claim.wanted.clone())
        .filter(|wanted| is_free(wanted))
        .map(|wanted| (wanted, ()))
        .collect();
    let mut resolved = Vec::with_capacity(claims.len());
    for claim in claims {
        if is_free(&claim.wanted) {
            resolved.push(claim.wanted.clone());
            continue;
        }
        let mut name = name::with_suffix(&claim.wanted, &claim.suffix, claim.case);
        while taken.contains_key(&name) || reserved.contains(&name.as_str()) {
            name = name::with_suffix(&name, "x", claim.case);
        }
        taken.insert(name.clone(), ());
        resolved.push(name);
    }
    for (wanted, group) in &groups {
        if !is_free(wanted) {
            findings.push(collision(scope, wanted, group));
        }
    }
    resolved
}

fn collision(scope: &str, wanted: &str, group: &[&Claim]) -> Diagnostic {
    let message = match group.len() {
        1 => format!("{scope} `{wanted}` is a name that lexican uses itself"),
        n => format!("{n} {scope}s would be called `{wanted}`"),
    };
    let first = group.first().expect("a group has members");
    let example = name::with_suffix(wanted, &first.suffix, first.case);
    let start = Diagnostic::new("od::name-collision", Severity::Warning, message);
    let mut shown = group.iter().take(MAX_PLACES);
    let mut diagnostic = shown.next().map(|claim| start.clone().at(claim.span, "")).unwrap_or(start);
    for claim in shown {
        diagnostic = diagnostic.and(claim.span, "");
    }
    diagnostic.help(format!("to tell them apart each is called as `{example}`; an overlay can rename them"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(names: &[(&str, &str)], reserved: &[&str], expected: &[&str]) {
        let claim = |&(name, suffix): &(&str, &str)| Claim::new(name, Case::Snake, suffix.into(), Span::default());
        let mut findings = Diagnostics::default();
        let claims: Vec<_> = names.iter().map(claim).collect();
        assert_eq!(resolve("object", reserved, &claims, &mut findings), expected);
        assert_eq!(findings.is_empty(), claims.iter().map(|claim| &claim.wanted).eq(expected));
    }

    #[test]
    fn whoever_collides_is_renamed_on_all_sides() {
        check(&[("a", "2000"), ("b", "2001"), ("A", "2002")], &[], &["a_2000", "b", "a_2002"]);
        check(&[("at", "2000"), ("b", "2001")], &["at"], &["at_2000", "b"]);
    }

    #[test]
    fn a_suffix_does_not_take_the_name_of_another() {
        check(&[("a", "2000"), ("a", "2001"), ("a 2000", "3000")], &[], &["a_2000_x", "a_2001", "a_2000"]);
        check(&[("a", "2000"), ("a", "2000")], &[], &["a_2000", "a_2000_x"]);
    }

    #[test]
    fn a_name_without_letters_is_the_address() {
        check(&[("?", "2000_01")], &[], &["object_2000_01"]);
    }
}
