//! Repairs a data sheet: applies the [`fix`](field@crate::Diagnostic::fix) of every finding that has one.
//!
//! Everything else stays byte for byte. Findings with several possible remedies are left to people, and so are those
//! whose fix would cause another finding.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::model::Device;
use crate::patch::Patch;
use crate::{Diagnostics, Input, MAX_PER_CODE, load};

/// A fix can reveal further findings: once the lines of a list have different numbers, they can be counted. Real files
/// need three rounds.
const MAX_ROUNDS: usize = 100;

/// A repaired data sheet.
#[derive(Clone, Debug)]
pub struct Fixed {
    /// The repaired data sheet, with the overlays as they were.
    pub input: Input,
    /// The device that the repaired data sheet describes.
    pub device: Device,
    /// The findings that remain.
    pub left: Diagnostics,
    /// The number of fixed findings, by code.
    pub fixed: BTreeMap<&'static str, usize>,
}

/// Applies the fixes of all findings until none is left. Fixing the result again changes nothing.
#[must_use]
pub fn fix(input: &Input) -> Fixed {
    let mut state = State::new(input.clone());
    let mut fixed = BTreeMap::new();
    for _ in 0..MAX_ROUNDS {
        let patches = patches(&state.left);
        let Some((next, applied)) = state.after(&patches).or_else(|| state.after_some(&patches)) else { break };
        for finding in state.left.iter().filter(|it| {
            it.fix
                .as_ref()
                .is_some_and(|fix| applied.iter().any(|patch| std::ptr::eq(*patch, &**fix) || **patch == **fix))
        }) {
            *fixed.entry(finding.code).or_default() += 1;
        }
        state = next;
    }
    Fixed { input: state.input, device: state.device, left: state.left, fixed }
}

/// The fixes without duplicates: findings may share one.
fn patches(findings: &Diagnostics) -> Vec<&Patch> {
    let mut patches: Vec<&Arc<Patch>> = findings.iter().filter_map(|finding| finding.fix.as_ref()).collect();
    patches.dedup();
    patches.into_iter().map(|patch| &**patch).collect()
}

struct State {
    input: Input,
    device: Device,
    left: Diagnostics,
}

impl State {
    fn new(input: Input) -> Self {
        let (device, left) = load(&input);
        Self { input, device, left }
    }

    /// Applies the patches, except those that touch a line of an earlier one, and returns the new state and the patches
    /// applied. `None` if nothing changes, or if a code then has more findings than before.
    fn after<'p>(&self, patches: &[&'p Patch]) -> Option<(Self, Vec<&'p Patch>)> {
        let mut lines = BTreeSet::new();
        let mut all = Patch::default();
        let mut applied = Vec::new();
        for &patch in patches {
            let of_patch = patch.lines();
            if of_patch.is_disjoint(&lines) {
                lines.extend(of_patch);
                all.extend(patch.clone());
                applied.push(patch);
            }
        }
        let eds = self.input.eds.with_text(all.apply(&self.input.eds));
        if eds.text() == self.input.eds.text() {
            return None;
        }
        let next = Self::new(Input { eds, overlays: self.input.overlays.clone() });
        let (before, after) = (self.counts(), next.counts());
        let is_worse = after.iter().any(|(code, count)| before.get(code).is_none_or(|before| count > before));
        // At the bound, findings that were only counted take the place of those that are gone, so the counts may stay
        // the same.
        let is_better = after != before || before.values().any(|&count| count >= MAX_PER_CODE);
        (is_better && !is_worse).then_some((next, applied))
    }

    /// The same without the patches that make matters worse even when applied alone.
    fn after_some<'p>(&self, patches: &[&'p Patch]) -> Option<(Self, Vec<&'p Patch>)> {
        let good: Vec<&Patch> = patches.iter().copied().filter(|&patch| self.after(&[patch]).is_some()).collect();
        self.after(&good).or_else(|| self.after(good.get(..1)?))
    }

    /// The number of findings, by code.
    fn counts(&self) -> BTreeMap<&'static str, usize> {
        let mut counts = BTreeMap::new();
        self.left.iter().for_each(|finding| *counts.entry(finding.code).or_default() += 1);
        counts
    }
}
