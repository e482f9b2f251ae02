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
mod manual;
mod notation;
mod report;
mod tables;

use std::collections::BTreeMap;
use std::path::Path;

pub use checker::Against;
pub use exempt::{KEYS, ROWS, is_prose};
pub use report::{Erratum, Report, TableReport};

use checker::Checker;
use manual::Manual;

/// The texts that are compared.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    /// The data sheet.
    pub eds: String,
    /// Its overlay.
    pub overlay: String,
    /// The manual's tables: file name and text.
    pub tables: BTreeMap<String, String>,
    /// The code was not generated from this data sheet and overlay. Generated anew, it would agree with them, so the
    /// two are not compared: what is wrong in them has to show against the manual.
    pub code_is_stale: bool,
}

impl Inputs {
    /// Reads them where they lie below the workspace's root.
    ///
    /// # Errors
    ///
    /// The file that cannot be read, and why.
    pub fn read(root: &Path) -> Result<Self, String> {
        let text = |path: &Path| {
            std::fs::read_to_string(root.join(path)).map_err(|error| format!("{}: {error}", path.display()))
        };
        let device = Path::new("eds/devices/siko/ag03-1");
        let folder = Path::new("tests/manual/ag03-1");
        let mut tables = BTreeMap::new();
        let entries = std::fs::read_dir(root.join(folder)).map_err(|error| format!("{}: {error}", folder.display()))?;
        for entry in entries.filter_map(Result::ok) {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.ends_with(".csv") {
                tables.insert(name.clone(), text(&folder.join(name))?);
            }
        }
        let (eds, overlay) = (text(&device.join("SIKOAG03.EDS"))?, text(&device.join("SIKOAG03.toml"))?);
        Ok(Inputs { eds, overlay, tables, code_is_stale: false })
    }
}

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
