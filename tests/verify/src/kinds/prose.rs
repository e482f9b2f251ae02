//! Prose, clause by clause: a clause stands in the place of a cell only if the drive, asked for it, does what it says.
//! So words in tables are compared like numbers.

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::rig::once;
use crate::script::{Clauses, Script, Scripted};

/// The clauses that hold, one after another; each of the others as one that does not, which no table has.
pub(crate) fn said(clauses: &Clauses) -> String {
    let clause = |(text, holds): &(&str, bool)| if *holds { (*text).to_owned() } else { format!("not so: {text}") };
    clauses.iter().map(clause).collect::<Vec<_>>().join("; ")
}

/// Finds each run of a script that does not hold: what a drive does where its manual says nothing.
pub(crate) fn left_open<S: Scripted>(checker: &mut Checker<'_>, script: &Script) {
    for failure in once::<S, _>("left open", || script.failures::<S>()) {
        checker.require(false, || failure);
    }
}

/// A statement: its key, and the clauses that it has.
pub(crate) type Statement = (&'static str, fn() -> Clauses);

/// Compares `statements.csv` with a script. `known` makes of a row's key the one of its paragraph.
pub(crate) fn statements<S: Scripted>(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    script: &Script,
    known: fn(&str) -> String,
) {
    for row in case.manual.rows("statements.csv") {
        let key = known(&row.key);
        let Some(found) = once::<S, _>(&key, || script.clauses::<S>(&key).map(|clauses| said(&clauses))) else {
            continue;
        };
        checker.key(row);
        checker.cell(row, "statement", Against::Drive, found);
    }
}
