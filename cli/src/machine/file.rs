//! The file of a machine: which one it is, and what is wrong with it.

use std::path::{Path, PathBuf};

use lexican_eds::Severity;
use lexican_machine::Machine;

use crate::output::Failure;

/// The environment variable that names the file of the machine.
const MACHINE: &str = "LEXICAN_MACHINE";
/// The name of the file that is looked for.
const FILE: &str = "machine.toml";

/// Which machine.
#[derive(clap::Args, Debug)]
pub(crate) struct MachineArgs {
    /// The machine; by default machine.toml in this folder or one above it
    #[arg(value_name = "MACHINE")]
    machine: Option<PathBuf>,
}

impl MachineArgs {
    pub(super) fn path(&self) -> Result<PathBuf, Failure> {
        found(self.machine.clone())
    }

    /// The machine, with what is wrong with its file.
    pub(super) fn read(&self) -> Result<Machine, Failure> {
        Ok(Machine::open(&self.path()?)?)
    }
}

/// The file of a machine: the one that is named, or that of this folder.
pub(crate) fn found(named: Option<PathBuf>) -> Result<PathBuf, Failure> {
    named.or_else(of_here).ok_or_else(|| {
        Failure::new(format_args!("there is no {FILE} in this folder or above it"))
            .help("name the file of the machine; `lexican machine --help` shows one")
    })
}

/// The file of the machine of this folder, or of the environment.
pub(super) fn of_here() -> Option<PathBuf> {
    std::env::var_os(MACHINE).map(PathBuf::from).or_else(above)
}

/// The file of the machine that this folder belongs to.
fn above() -> Option<PathBuf> {
    let folder = std::env::current_dir().ok()?;
    let found = folder.ancestors().map(|folder| folder.join(FILE)).find(|path| path.is_file())?;
    // As people would name it.
    Some(found.strip_prefix(&folder).map_or_else(|_| found.clone(), Path::to_owned))
}

/// A machine in whose file nothing is wrong; findings that are no errors are left to `machine check`.
pub(crate) fn sound(path: &Path) -> Result<Machine, Failure> {
    without_errors(Machine::open(path)?, &path.display().to_string())
}

/// The same of one that has been read.
pub(crate) fn without_errors(machine: Machine, name: &str) -> Result<Machine, Failure> {
    if !machine.findings.has_errors() {
        return Ok(machine);
    }
    let errors = machine.findings.iter().filter(|finding| finding.severity == Severity::Error);
    let errors: String = errors.map(|finding| finding.render(&machine.input) + "\n\n").collect();
    Err(Failure::new(format_args!("{name} cannot be used: see above")).after(errors))
}
