//! What the simulated drives do in cases that no manual speaks of.

use std::sync::LazyLock;

use super::rig::Siko;
use crate::checker::Checker;
use crate::rig::once;
use crate::script::Script;

static SCRIPT: LazyLock<Script> = LazyLock::new(|| Script::parse(include_str!("../../scripts/siko_beyond.txt")));

/// Each of [`failures`] is a finding.
pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>) {
    for failure in once::<D, _>("beyond", failures::<D>) {
        checker.require(false, || failure);
    }
}

/// What a drive does otherwise than the script says.
pub(crate) fn failures<D: Siko>() -> Vec<String> {
    SCRIPT.failures::<D>()
}
