//! What the manuals say in running text, clause by clause.

mod network;
mod travelling;
mod trouble;

use super::bench::Siko;
use crate::checker::Checker;
use crate::drive::Case;
use crate::kinds::prose;

/// Compares `statements.csv`.
pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let all = [travelling::statements::<D>(), trouble::statements::<D>(), network::statements::<D>()].concat();
    prose::statements::<D>(checker, case, &all, super::known::<D>);
}
