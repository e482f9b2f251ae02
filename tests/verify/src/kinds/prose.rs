//! Prose, clause by clause: the text for a cell contains a clause only if the drive does what the clause says. So words
//! in tables are compared like numbers.

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::rig::once;
use crate::script::{Clauses, Script, Scripted};

/// The clauses joined. One that does not hold is marked, so that it matches no table.
pub(crate) fn said(clauses: &Clauses) -> String {
    let clause = |(text, holds): &(&str, bool)| if *holds { (*text).to_owned() } else { format!("not so: {text}") };
    clauses.iter().map(clause).collect::<Vec<_>>().join("; ")
}

/// Adds a finding for each run of a script that does not hold. The script is about what a drive does where its manual
/// says nothing.
pub(crate) fn left_open<S: Scripted>(checker: &mut Checker<'_>, script: &Script) {
    for failure in once::<S, _>("left open", || script.failures::<S>()) {
        checker.require(false, || failure);
    }
}

/// A statement: its key, and its clauses.
pub(crate) type Statement = (&'static str, fn() -> Clauses);

/// Compares `statements.csv` with a script. `known` converts the key of a row to that of its paragraph.
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
