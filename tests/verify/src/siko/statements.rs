//! What the manuals say in running text, clause by clause.

use std::sync::LazyLock;

use super::rig::Siko;
use crate::checker::Checker;
use crate::drive::Case;
use crate::kinds::prose;
use crate::script::Script;

/// What the manuals say in words.
pub(super) static SCRIPT: LazyLock<Script> = LazyLock::new(|| Script::parse(include_str!("../../scripts/siko.txt")));

/// What the simulated drives do where the manuals leave it open.
pub(crate) static LEFT_OPEN: LazyLock<Script> =
    LazyLock::new(|| Script::parse(include_str!("../../scripts/siko_beyond.txt")));

/// Compares `statements.csv`.
pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    prose::statements::<D>(checker, case, &SCRIPT, super::known::<D>);
}
