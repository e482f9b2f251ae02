//! Mends what has one right answer in a data sheet: the [`fix`](field@crate::Diagnostic::fix) of each finding that has one.
//!
//! All else stays byte for byte. A finding that several things could mend is left to people; so is one whose fix would
//! bring up another.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::model::Device;
use crate::patch::Patch;
use crate::{Diagnostics, Input, MAX_PER_CODE, load};

/// Fixes can uncover others: a list can be counted when its numbers differ. Real files need three rounds.
const MAX_ROUNDS: usize = 100;

/// A data sheet after its fixes.
#[derive(Clone, Debug)]
pub struct Fixed {
    /// The data sheet, with the overlays as they were.
    pub input: Input,
    /// The device that it describes.
    pub device: Device,
    /// What is still found.
    pub left: Diagnostics,
    /// How many findings were fixed, by their code.
    pub fixed: BTreeMap<&'static str, usize>,
}

/// Applies the fixes of all findings, until none is left. A data sheet without such a finding stays as it is, so a second
/// time changes nothing.
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

/// The fixes, each once: findings may have one in common.
fn patches(findings: &Diagnostics) -> Vec<&Patch> {
    let mut patches: Vec<&Arc<Patch>> = findings.iter().filter_map(|finding| finding.fix.as_ref()).collect();
    patches.dedup();
    patches.into_iter().map(|patch| &**patch).collect()
}

/// A data sheet and what is found in it.
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

    /// After all patches that change different lines, with these; `None` if there is none, or if something else is found
    /// then.
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
        // Beyond the bound findings are not kept, and others come in the place of those that are gone.
        let is_better = after != before || before.values().any(|&count| count >= MAX_PER_CODE);
        (is_better && !is_worse).then_some((next, applied))
    }

    /// The same without the patches that bring up something else by themselves.
    fn after_some<'p>(&self, patches: &[&'p Patch]) -> Option<(Self, Vec<&'p Patch>)> {
        let good: Vec<&Patch> = patches.iter().copied().filter(|&patch| self.after(&[patch]).is_some()).collect();
        self.after(&good).or_else(|| self.after(good.get(..1)?))
    }

    /// How many findings there are, by code.
    fn counts(&self) -> BTreeMap<&'static str, usize> {
        let mut counts = BTreeMap::new();
        self.left.iter().for_each(|finding| *counts.entry(finding.code).or_default() += 1);
        counts
    }
}
