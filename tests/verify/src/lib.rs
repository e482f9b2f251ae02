//! Compares drives with every table of their manuals.
//!
//! [`verify`] takes the texts of a drive's data sheet, of its overlay and of its manual's tables (`tests/manual/`), and
//! compares each cell with its subject: the model that data sheet and overlay make, the generated code that is compiled
//! in, and the simulated drive, which is asked over a virtual bus. Where the manual contradicts itself or CiA,
//! `errata.csv` names the cells that cannot agree; a cell that disagrees without being named there is a finding, and so
//! is a named one that agrees.
//!
//! - `drive`, `manual`, `checker`, `report`: what a drive brings, its tables, which cell was compared with what, the report;
//! - `rig`, `code`: the simulated drive on a bus, the generated code as data;
//! - `kinds`: comparisons of tables that any manual has: objects, terms, PDOs, frames, NMT, SDO, the states of CiA 402,
//!   statements of prose checked by behaviour;
//! - `script`: statements of prose as scripts (`scripts/`), which a drive is asked by;
//! - `servo`: drives whose simulator is the servo of CiA 402;
//! - `siko`: what the manuals of SIKO's drives share beyond that, and their other interfaces;
//! - `drives`: one file per drive: its paths, its simulator, its list of comparisons.

mod checker;
mod code;
mod drive;
mod drives;
mod exempt;
mod kinds;
mod manual;
mod notation;
mod report;
mod rig;
mod script;
mod servo;
mod sheet;
mod siko;
mod states;

pub use checker::Against;
pub use drive::{Drive, Inputs, Interface};
pub use drives::{ALL as DRIVES, left_open};
pub use exempt::Exempt;
pub use report::{Erratum, Report, TableReport};
pub use sheet::PROSE;

use lexican_eds::Source;

use checker::Checker;
use drive::Case;
use manual::Manual;
use sheet::Sheet;

/// Compares everything; see the documentation of the crate.
#[must_use]
pub fn verify(drive: &Drive, inputs: &Inputs) -> Report {
    compared(drive, inputs, false).unwrap_or_default()
}

/// Whether [`verify`] has findings. Stops at the first one.
#[must_use]
pub fn finds(drive: &Drive, inputs: &Inputs) -> bool {
    compared(drive, inputs, true).is_none_or(|report| !report.findings.is_empty())
}

/// The report; `None` at the first finding if `one_is_enough`.
fn compared(drive: &Drive, inputs: &Inputs, one_is_enough: bool) -> Option<Report> {
    let manual = Manual::parse(drive.tables, &inputs.tables);
    let sources = [(drive.data_sheet, &inputs.eds), (drive.overlay, &inputs.overlay)];
    let sources = sources.map(|(path, text)| Source::new(path, text.as_str()));
    let sheet = Sheet::new(sources, (drive.code)(drive.node), drive.node, inputs.code_is_stale);
    let case = Case { drive, manual: &manual, sheet: &sheet };
    let mut checker = Checker::new(&drive.exempt, &manual);
    for check in drive.checks {
        check(&mut checker, &case);
        if one_is_enough && checker.has_finding() {
            return None;
        }
    }
    checker.finish();
    Some(report::report(&manual, checker))
}
