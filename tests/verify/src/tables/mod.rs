//! The comparisons, one file per group of tables.

mod claims;
mod examples;
mod facts;
mod faults;
mod leds;
mod meanings;
mod network;
mod objects;
mod overview;
mod parameters;
mod pdo;
mod sheet;
mod states;
mod words;

pub(crate) use sheet::Sheet;

use crate::checker::Checker;
use crate::manual::Manual;

/// All of them.
pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, sheet: &Sheet) {
    sheet::check(checker, manual, sheet);
    objects::check(checker, manual, sheet);
    meanings::check(checker, manual, sheet);
    pdo::check(checker, manual, sheet);
    states::check(checker, manual);
    words::check(checker, manual, sheet);
    network::check(checker, manual, sheet);
    examples::check(checker, manual);
    facts::check(checker, manual, sheet);
    faults::check(checker, manual);
}
