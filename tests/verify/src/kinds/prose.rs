//! Prose, clause by clause: a clause stands in the place of a cell only if the drive, asked for it, does what it says.
//! So words in tables are compared like numbers.

use crate::bench::{Simulator, once};
use crate::checker::{Against, Checker};
use crate::drive::Case;

/// Clauses, and whether the drive is so.
pub(crate) type Clauses = Vec<(&'static str, bool)>;

/// The clauses that hold, one after another; each of the others as one that does not, which no table has.
pub(crate) fn said(clauses: &Clauses) -> String {
    let clause = |(text, holds): &(&str, bool)| if *holds { (*text).to_owned() } else { format!("not so: {text}") };
    clauses.iter().map(clause).collect::<Vec<_>>().join("; ")
}

/// A statement: its key, and the clauses that it has.
pub(crate) type Statement = (&'static str, fn() -> Clauses);

/// Compares `statements.csv`. `known` makes of a row's key the one that its statement has here.
pub(crate) fn statements<S: Simulator>(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    all: &[Statement],
    known: fn(&str) -> String,
) {
    for row in case.manual.rows("statements.csv") {
        let key = known(&row.key);
        let Some((key, clauses)) = all.iter().find(|(of, _)| *of == key) else { continue };
        checker.key(row);
        checker.cell(row, "statement", Against::Drive, once::<S, _>(key, || said(&clauses())));
    }
}
