//! The description of a drive that is compared with its manual.

use std::collections::BTreeMap;
use std::path::Path;

use lexican_runtime::NodeId;

use crate::checker::Checker;
use crate::code::Code;
use crate::exempt::Exempt;
use crate::manual::{Keys, Manual};
use crate::sheet::Sheet;

/// A drive that is compared with its manual.
pub struct Drive {
    /// Its name in the command.
    pub name: &'static str,
    /// Maker and drive, as the manual names them.
    pub(crate) vendor: &'static str,
    pub(crate) title: &'static str,
    /// Data sheet and overlay, below the workspace's root.
    pub(crate) data_sheet: &'static str,
    pub(crate) overlay: &'static str,
    /// The folder of the manual's tables.
    pub(crate) folder: &'static str,
    /// The file of the report.
    pub report: &'static str,
    /// The tables. A row's key consists of the cells of the given columns, joined with `:`; empty cells are left out.
    pub(crate) tables: Keys,
    /// What is not compared.
    pub exempt: Exempt,
    /// The generated code.
    pub(crate) code: fn(NodeId) -> Code,
    /// The node of the manual's examples.
    pub(crate) node: NodeId,
    /// The objects whose entries are all alike. Others with several entries are records.
    pub(crate) arrays: &'static [u16],
    /// All comparisons, the quick ones first, so that a mutant is found sooner.
    pub(crate) checks: &'static [Check],
    /// The interface through which it is compared.
    pub interface: Interface,
}

/// An interface of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interface {
    /// CANopen. The whole data sheet, the overlay and the generated code are compared, too.
    CanOpen,
    /// Another one, whose parameters are compared with the data sheet.
    Other {
        /// The name of its section in the overlay: `serial`.
        section: &'static str,
        /// What is compared in place of the generated code.
        code: &'static str,
        /// What the simulated drive is asked over.
        over: &'static str,
    },
}

/// A comparison of some tables.
pub(crate) type Check = fn(&mut Checker<'_>, &Case<'_>);

/// A drive, and the texts that are compared at present.
pub(crate) struct Case<'a> {
    pub(crate) drive: &'a Drive,
    pub(crate) manual: &'a Manual,
    pub(crate) sheet: &'a Sheet,
}

/// The texts that are compared.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    /// The data sheet.
    pub eds: String,
    /// Its overlay.
    pub overlay: String,
    /// The manual's tables: file name and text.
    pub tables: BTreeMap<String, String>,
    /// Whether the code was generated from another data sheet or overlay. These are then not compared with the code,
    /// because code generated anew would agree with them: a mistake in them has to show against the manual.
    pub code_is_stale: bool,
}

impl Inputs {
    /// Reads the texts of a drive below the workspace's root.
    ///
    /// # Errors
    ///
    /// The file that cannot be read, and why.
    pub fn read(drive: &Drive, root: &Path) -> Result<Self, String> {
        let text = |path: &Path| std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()));
        let folder = root.join(drive.folder);
        let mut tables = BTreeMap::new();
        let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        for entry in entries.filter_map(Result::ok) {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.ends_with(".csv") {
                tables.insert(name, text(&entry.path())?);
            }
        }
        let (eds, overlay) = (text(&root.join(drive.data_sheet))?, text(&root.join(drive.overlay))?);
        Ok(Inputs { eds, overlay, tables, code_is_stale: false })
    }
}
