//! Resolves names in one scope: if several items want the same name, the first one gets it.

use std::collections::{BTreeMap, BTreeSet};

use lexican_eds::{Diagnostic, Diagnostics, Severity, Span};

use crate::name::{self, Case};

/// The most places of a collision that are shown.
const MAX_PLACES: usize = 4;

/// The most names that are listed.
const MAX_NAMES: usize = 8;

/// The name that an item wants.
#[derive(Clone, Debug)]
pub(crate) struct Claim {
    /// The identifier.
    pub(crate) wanted: String,
    pub(crate) case: Case,
    /// Appended if the name is taken already: lower-case words, mostly the address.
    pub(crate) suffix: String,
    /// The place in the data sheet.
    pub(crate) span: Span,
}

impl Claim {
    /// Claims the identifier of `name`, or `empty` if that has no letter.
    pub(crate) fn new(name: &str, case: Case, suffix: String, span: Span) -> Self {
        let mut wanted = name::identifier(name, case);
        if wanted.is_empty() {
            wanted = name::identifier(&format!("object {suffix}"), case);
        }
        Claim { wanted, case, suffix, span }
    }
}

/// The identifiers for all claims, in order: all different, and none of them in `reserved`.
///
/// The first claim of a name gets it, so that an item appended later renames none of the others.
pub(crate) fn resolve(scope: &str, reserved: &[&str], claims: &[Claim], findings: &mut Diagnostics) -> Vec<String> {
    let mut taken: BTreeSet<String> = reserved.iter().map(|&name| name.to_owned()).collect();
    let mut groups: BTreeMap<&str, Vec<&Claim>> = BTreeMap::new();
    let mut resolved = Vec::with_capacity(claims.len());
    for claim in claims {
        let mut name = claim.wanted.clone();
        if taken.contains(&name) {
            name = name::with_suffix(&name, &claim.suffix, claim.case);
        }
        while taken.contains(&name) {
            name = name::with_suffix(&name, "x", claim.case);
        }
        groups.entry(&claim.wanted).or_default().push(claim);
        taken.insert(name.clone());
        resolved.push(name);
    }
    for (wanted, group) in &groups {
        let chosen = claims.iter().zip(&resolved).filter(|(claim, _)| claim.wanted == *wanted).map(|(_, name)| name);
        findings.extend(collision(scope, wanted, reserved.contains(wanted), group, chosen));
    }
    resolved
}

/// The finding that several items want one name; `chosen` are the names that they get, in order.
fn collision<'a>(
    scope: &str,
    wanted: &str,
    is_reserved: bool,
    group: &[&Claim],
    chosen: impl Iterator<Item = &'a String>,
) -> Option<Diagnostic> {
    let renamed: Vec<String> = chosen.filter(|name| *name != wanted).map(|name| format!("`{name}`")).collect();
    let shown = renamed[..renamed.len().min(MAX_NAMES)].join(", ");
    let more = match renamed.len().saturating_sub(MAX_NAMES) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let message = match (is_reserved, group) {
        (false, [_]) => return None,
        (true, _) => format!("{scope} `{wanted}` is a name that lexican uses itself; it becomes {shown}{more}"),
        (false, _) => {
            format!("{} {scope}s would be called `{wanted}`; all but the first become {shown}{more}", group.len())
        }
    };
    let mut places = group.iter().take(MAX_PLACES);
    let start = Diagnostic::new("od::name-collision", Severity::Warning, message).at(places.next()?.span, "");
    let diagnostic = places.fold(start, |diagnostic, claim| diagnostic.and(claim.span, ""));
    Some(diagnostic.help(if group.len() > 1 { "an overlay can rename them" } else { "an overlay can rename it" }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(names: &[(&str, &str)], reserved: &[&str], expected: &[&str]) {
        let claim = |&(name, suffix): &(&str, &str)| Claim::new(name, Case::Snake, suffix.into(), Span::default());
        let mut findings = Diagnostics::default();
        let claims: Vec<_> = names.iter().map(claim).collect();
        assert_eq!(resolve("object", reserved, &claims, &mut findings), expected);
        assert_eq!(findings.is_empty(), claims.iter().map(|claim| &claim.wanted).eq(expected));
    }

    #[test]
    fn the_first_keeps_the_name() {
        check(&[("a", "2000"), ("b", "2001"), ("A", "2002")], &[], &["a", "b", "a_2002"]);
        check(&[("at", "2000"), ("b", "2001")], &["at"], &["at_2000", "b"]);
        check(&[("at", "2000"), ("at", "2001")], &["at"], &["at_2000", "at_2001"]);
    }

    #[test]
    fn a_collision_says_the_names_that_are_chosen() {
        let claim = |address: u16| Claim::new("a", Case::Snake, format!("{address:04x}"), Span::default());
        let mut findings = Diagnostics::default();
        let claims: Vec<Claim> = (0x2000..0x200B).map(claim).collect();
        resolve("object", &[], &claims, &mut findings);
        let message = &findings.iter().next().unwrap().message;
        let start = "11 objects would be called `a`; all but the first become `a_2001`, `a_2002`, ";
        assert!(message.starts_with(start) && message.ends_with("`a_2008` and 2 more"), "{message}");
    }

    #[test]
    fn a_suffix_does_not_take_the_name_of_another() {
        check(&[("a", "2000"), ("a", "2001"), ("a 2001", "3000")], &[], &["a", "a_2001", "a_2001_3000"]);
        check(&[("a 2001", "2000"), ("a", "2000"), ("a", "2001")], &[], &["a_2001", "a", "a_2001_x"]);
        check(&[("a", "2000"), ("a", "2000"), ("a", "2000")], &[], &["a", "a_2000", "a_2000_x"]);
    }

    proptest! {
        #[test]
        fn what_is_added_later_renames_nothing(names in prop::collection::vec("[ab]( 200[01])?", 1..12)) {
            let claims: Vec<Claim> = names.iter().zip(0x2000..).map(|(name, index)| {
                Claim::new(name, Case::Snake, format!("{index:04x}"), Span::default())
            }).collect();
            let resolve = |claims: &[Claim]| resolve("object", &["b"], claims, &mut Diagnostics::default());
            let all = resolve(&claims);
            for count in 0..claims.len() {
                prop_assert_eq!(&resolve(&claims[..count]), &all[..count]);
            }
        }
    }

    #[test]
    fn a_name_without_letters_is_the_address() {
        check(&[("?", "2000_01")], &[], &["object_2000_01"]);
    }
}
