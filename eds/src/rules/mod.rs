//! The rules: a table with one row each, and their functions in files by subject.
//!
//! A new rule is a row in `table.rs`, a function, and a golden case under `tests/golden/`.

mod cia301;
mod context;
mod info;
mod limits;
mod lines;
mod lists;
mod numbers;
mod objects;
mod overlays;
mod pdo;
mod remedy;
mod rule;
mod table;
mod xdd;

use std::collections::BTreeSet;

use context::Context;
pub use rule::Rule;
use rule::{Find, Out};

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::finding::{Finding, Findings, Kind};
use crate::model::Device;
use crate::model::keys::Key;
use crate::overlay::{Accepted, Changes};
use crate::parse::facts::Facts;
use crate::text::Span;

/// All rules, in the order in which they are applied.
#[must_use]
pub fn rules() -> &'static [Rule] {
    table::RULES
}

/// The rule with this code.
#[must_use]
pub fn rule(code: &str) -> Option<&'static Rule> {
    rules().iter().find(|rule| rule.code == code)
}

/// Applies all rules to the finished model and to what parsing and overlays have found.
pub(crate) fn apply(device: &Device, facts: &Facts<'_>, changes: &Changes, found: &Findings) -> Diagnostics {
    let context = Context { device, facts, changes };
    let mut diagnostics = Diagnostics::default();
    let corrected = Corrected::new(device, facts, changes);
    let open: Vec<&Finding> = found.iter().filter(|finding| !corrected.covers(finding)).collect();
    for rule in rules() {
        let mut out = Out { rule, diagnostics: &mut diagnostics };
        match rule.find {
            Find::Read(words) => read(&context, words, &open, &mut out),
            Find::Check(check) => check(&context, &mut out),
            Find::Last => {}
        }
    }
    accept(&context, &mut diagnostics);
    for finding in diagnostics.iter_mut().filter(|finding| finding.help.is_none()) {
        finding.help = remedy::rest(&context, finding);
    }
    diagnostics.finish();
    diagnostics
}

/// Reports what was found in a text that is no data sheet.
pub(crate) fn of_text(facts: &Facts<'_>, found: &Findings) -> Diagnostics {
    let context = Context { device: &Device::default(), facts, changes: &Changes::default() };
    let mut diagnostics = Diagnostics::default();
    let open: Vec<&Finding> = found.iter().collect();
    for rule in rules() {
        if let Find::Read(words) = rule.find {
            read(&context, words, &open, &mut Out { rule, diagnostics: &mut diagnostics });
        }
    }
    diagnostics.finish();
    diagnostics
}

fn read(
    context: &Context<'_>,
    words: fn(&Context<'_>, &Finding) -> Option<Diagnostic>,
    found: &[&Finding],
    out: &mut Out<'_>,
) {
    for finding in found {
        if let Some(note) = words(context, finding) {
            out.push(note);
            out.diagnostics.count_only(out.rule.code, finding.more);
        }
    }
}

/// Places in the data sheet that an overlay corrects: findings there are void.
struct Corrected {
    values: BTreeSet<Span>,
    /// Entries whose missing data type (true) or access type (false) an overlay supplies.
    missing: BTreeSet<(bool, Span)>,
}

impl Corrected {
    fn new(device: &Device, facts: &Facts<'_>, changes: &Changes) -> Self {
        let mut corrected = Self { values: BTreeSet::new(), missing: BTreeSet::new() };
        for correction in &changes.corrections {
            let Some(entry) = device.entry(correction.index, correction.sub) else { continue };
            let section = facts.syntax.section_at(entry.span);
            let pair = section.and_then(|section| section.get(correction.key.name()));
            match (pair.filter(|pair| !pair.value.is_empty()), correction.key) {
                (Some(pair), _) => corrected.values.insert(facts.syntax.value_span(pair)),
                (None, Key::DataType | Key::AccessType) => {
                    corrected.missing.insert((correction.key == Key::DataType, entry.span))
                }
                _ => continue,
            };
        }
        corrected
    }

    fn covers(&self, finding: &Finding) -> bool {
        let missing = |data_type: bool| self.missing.contains(&(data_type, finding.span));
        match finding.kind {
            Kind::MissingDataType => missing(true),
            Kind::MissingAccessType => missing(false),
            _ => self.values.contains(&finding.span),
        }
    }
}

/// Removes the findings that overlays accept, and reports acceptances without a finding.
fn accept(context: &Context<'_>, diagnostics: &mut Diagnostics) {
    let accepted = &context.changes.accepted;
    let mut used = vec![false; accepted.len()];
    diagnostics.retract(|finding| {
        let Some((index, sub)) = finding.span().and_then(|span| context.address_of(span)) else { return false };
        let accepts = |accepted: &Accepted| {
            let here = accepted.index == index && accepted.sub.is_none_or(|accepted| accepted == sub.unwrap_or(0));
            here && accepted.code == finding.code
        };
        let at = accepted.iter().position(accepts);
        at.inspect(|&at| used[at] = true).is_some()
    });
    for (accepted, _) in accepted.iter().zip(used).filter(|(_, used)| !used) {
        let (code, note) = overlays::accepted_in_vain(accepted, rule(&accepted.code).is_some());
        if let Some(rule) = rule(code) {
            Out { rule, diagnostics: &mut *diagnostics }.push(note);
        }
    }
}
