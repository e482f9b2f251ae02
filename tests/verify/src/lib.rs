//! The AG03/1 against every table of its manual.
//!
//! [`verify`] takes the texts of the data sheet, of its overlay and of the manual's tables
//! (`tests/manual/ag03-1`), and compares each cell with what it speaks of: the model that the data sheet and the
//! overlay make, the generated code that is compiled in, and the simulated drive, which is asked over a virtual
//! bus. Where the manual contradicts itself or CiA, `errata.csv` names the cells that cannot agree; a
//! cell that disagrees without being named there is a finding, and so is a named one that agrees.

mod bench;
mod checker;
mod code;
mod exempt;
mod inputs;
mod manual;
mod notation;
mod report;
mod tables;

pub use checker::Against;
pub use exempt::{KEYS, ROWS, is_prose};
pub use inputs::Inputs;
pub use report::{Erratum, Report, TableReport};

use checker::Checker;
use manual::Manual;

/// Compares everything with everything; see the crate's documentation.
#[must_use]
pub fn verify(inputs: &Inputs) -> Report {
    let manual = Manual::parse(&inputs.tables);
    let mut checker = Checker::new(&manual);
    let sheet = tables::Sheet::new(inputs);
    tables::ALL.iter().for_each(|check| check(&mut checker, &manual, &sheet));
    checker.finish();
    report::report(&manual, checker)
}

/// Whether [`verify`] has findings, without looking for more than one.
#[must_use]
pub fn finds(inputs: &Inputs) -> bool {
    let manual = Manual::parse(&inputs.tables);
    let mut checker = Checker::new(&manual);
    let sheet = tables::Sheet::new(inputs);
    for check in tables::ALL {
        check(&mut checker, &manual, &sheet);
        if !checker.findings.is_empty() || checker.disagreements.keys().any(|cell| !report::is_erratum(&manual, cell)) {
            return true;
        }
    }
    checker.finish();
    !report::report(&manual, checker).findings.is_empty()
}
