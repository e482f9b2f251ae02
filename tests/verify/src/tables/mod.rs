//! The comparisons, one file per group of tables.

mod claims;
mod examples;
mod facts;
mod faults;
mod leds;
mod meanings;
mod network;
mod objects;
mod observed;
mod overview;
mod parameters;
mod pdo;
mod sheet;
mod statements;
mod states;
mod words;

pub(crate) use sheet::Sheet;

use crate::checker::Checker;
use crate::manual::Manual;

/// All of them, the quick ones first: a mutant is found sooner.
pub(crate) const ALL: &[fn(&mut Checker<'_>, &Manual, &Sheet)] = &[
    sheet::check,
    meanings::check,
    objects::check,
    network::check,
    examples::check,
    states::check,
    faults::check,
    facts::check,
    statements::check,
    pdo::check,
    words::check,
];
