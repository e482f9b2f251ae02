//! `lexican machine`: a machine in one file. Every other command finds it as well, and takes the names of its nodes.

mod check;
mod export;
mod fmt;
pub(crate) mod names;
mod plan;

use std::path::{Path, PathBuf};

use lexican_eds::Severity;
use lexican_machine::Machine;

use crate::output::{Failure, Outcome, print_result};

/// The environment variable that names the file of the machine.
const MACHINE: &str = "LEXICAN_MACHINE";
/// The name of the file that is looked for.
const FILE: &str = "machine.toml";

/// The commands for a machine in one file.
#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    Check(check::Args),
    Plan(plan::Args),
    Export(export::Args),
    Fmt(fmt::Args),
    /// Print the JSON Schema of the file, by which editors complete and explain its keys
    Schema,
}

impl Command {
    pub(crate) fn run(self) -> Result<Outcome, Failure> {
        match self {
            Command::Check(args) => check::run(&args),
            Command::Plan(args) => plan::run(&args),
            Command::Export(args) => export::run(&args),
            Command::Fmt(args) => fmt::run(&args),
            Command::Schema => {
                print_result(false, serde_json::Value::Null, format_args!("{:#}", lexican_machine::schema()))?;
                Ok(Outcome::Clean)
            }
        }
    }
}

/// The long help of the command.
pub(crate) const ABOUT: &str = "\
Check, plan and format a machine in one file

The file is machine.toml, in this folder or one above it, or what LEXICAN_MACHINE names. All other commands find it as well: \
they take the names of its nodes for their node-IDs, and its bus and data sheets where none are given; --bus sim is its \
simulation.

    [bus]
    url = \"can0\"
    bit-rate = \"500 kbit/s\"
    manager = 127
    heartbeat = \"200 ms\"             # the nodes watch it

    [node.feeder]
    id = 5
    sheet = \"siko/ag03-1\"            # a file, or a device that lexican knows
    overlay = [\"axis.toml\"]          # corrections and meanings in addition to it
    guarding = \"100 ms\"              # or heartbeat
    settings = { 6060 = \"profile velocity\", 2412 = \"2.5 mm\" }

    [node.io]
    id = 7
    sheet = \"io.eds\"
    heartbeat = \"100 ms\"
    optional = true
    tpdo.1 = [\"6000:01\"]

    [wire]                           # PDOs are made for it
    \"feeder.statusword\" = \"manager\"
    \"io.6000:01\" = { to = [\"manager\"], every = \"20 ms\" }

    [simulate.feeder]                # what a real machine does not need
    inputs = [\"blocked = true\"]

`lexican machine schema` has all keys, with their explanations.";

/// Which machine.
#[derive(clap::Args, Debug)]
pub(crate) struct MachineArgs {
    /// The machine; by default machine.toml in this folder or one above it
    #[arg(value_name = "MACHINE")]
    machine: Option<PathBuf>,
}

impl MachineArgs {
    fn path(&self) -> Result<PathBuf, Failure> {
        found(self.machine.clone())
    }

    /// The machine, with what is wrong with its file.
    fn read(&self) -> Result<Machine, Failure> {
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
fn of_here() -> Option<PathBuf> {
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
