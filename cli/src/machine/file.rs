//! Finds and reads the file of a machine, and reports what is wrong with it.

use std::ffi::OsString;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use lexican_machine::Machine;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::text::files::ReadError;

use crate::output::Failure;

/// The environment variable that names the file of the machine.
const MACHINE: &str = "LEXICAN_MACHINE";
/// The file name that is searched for.
const FILE: &str = "machine.toml";

/// Selects the machine.
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

    /// Reads the machine, including findings about its file.
    pub(super) fn read(&self) -> Result<Arc<Machine>, Failure> {
        Ok(read(&self.path()?)?)
    }
}

/// The selected bus of a machine with several.
static BUS: OnceLock<String> = OnceLock::new();

/// Selects a bus, unless one is selected already.
pub(super) fn choose_bus(name: &str) -> &'static str {
    BUS.get_or_init(|| name.to_owned())
}

/// The file of the machine: the named one, or that of this folder; with the selected bus as in machine.toml#left.
pub(crate) fn found(named: Option<PathBuf>) -> Result<PathBuf, Failure> {
    let found = named.or_else(of_here).map(|path| match (BUS.get(), Machine::file_and_bus(&path)) {
        (Some(bus), (file, None)) => format!("{}#{bus}", file.display()).into(),
        _ => path,
    });
    found.ok_or_else(|| {
        Failure::new(format_args!("there is no {FILE} in this folder or above it"))
            .help("name the file of the machine with --machine; `lexican machine --help` shows one")
    })
}

/// The position of an option's value, and the length of what precedes it in the same word.
pub(super) fn valued(args: &[OsString], long: &str) -> Option<(usize, usize)> {
    args.iter().enumerate().find_map(|(at, word)| match word.to_str()?.strip_prefix(long)? {
        "" => Some((at + 1, 0)).filter(|(value, _)| *value < args.len()),
        rest => rest.starts_with('=').then_some((at, long.len() + 1)),
    })
}

/// The file in `--machine`.
static NAMED: OnceLock<PathBuf> = OnceLock::new();

/// Takes `--machine FILE` out of the arguments, wherever it is.
pub(super) fn take_named(args: &mut Vec<OsString>) {
    let end = args.iter().position(|word| word == "--").unwrap_or(args.len());
    // If the file is missing, clap reports it.
    let Some((at, prefix)) = valued(&args[..end], "--machine") else { return };
    let mut word = args.remove(at);
    if prefix == 0 {
        args.remove(at - 1);
    } else {
        word = word.to_string_lossy()[prefix..].into();
    }
    NAMED.get_or_init(|| word.into());
}

/// The file of the machine that is named for all commands, or else of this folder.
pub(super) fn of_here() -> Option<PathBuf> {
    NAMED.get().cloned().or_else(|| std::env::var_os(MACHINE).map(PathBuf::from)).or_else(above)
}

/// The file in this folder, or in the next one above that has it.
fn above() -> Option<PathBuf> {
    let folder = std::env::current_dir().ok()?;
    let found = folder.ancestors().map(|folder| folder.join(FILE)).find(|path| path.is_file())?;
    // Relative, as users would write it.
    Some(found.strip_prefix(&folder).map_or_else(|_| found.clone(), Path::to_owned))
}

/// Reads a machine once per process, so that names, data sheets and commands see the same text.
pub(super) fn read(name: &Path) -> Result<Arc<Machine>, ReadError> {
    let (path, _) = Machine::file_and_bus(name);
    static READ: Mutex<Vec<(PathBuf, Arc<Machine>)>> = Mutex::new(Vec::new());
    let mut all = READ.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, machine)) = all.iter().find(|(known, _)| known == path) {
        return Ok(Arc::clone(machine));
    }
    let machine = Arc::new(Machine::open(path)?);
    all.push((path.to_owned(), Arc::clone(&machine)));
    Ok(machine)
}

/// The data sheet of a node in a machine, with a name such as `machine.toml#feeder`.
pub(crate) fn sheet_of_node(name: &str) -> Option<DataSheet> {
    let (machine, node) = machine_of_sheet(name)?;
    machine.node(&node)?.sheet.as_deref().cloned()
}

/// The machine, on its bus, and the node that such a data sheet belongs to.
pub(crate) fn machine_of_sheet(name: &str) -> Option<(OnBus, String)> {
    let (path, node) = name.rsplit_once('#')?;
    let all = read(path.as_ref()).ok()?;
    let at = all.buses().position(|machine| machine.node(node).is_some())?;
    Some((OnBus { all, at }, node.to_owned()))
}

/// The name for the data sheet of a node in a machine.
pub(super) fn name_of_sheet(path: &Path, node: &str) -> String {
    format!("{}#{node}", path.display())
}

/// A machine, reduced to one of its buses.
pub(crate) struct OnBus {
    all: Arc<Machine>,
    at: usize,
}

impl Deref for OnBus {
    type Target = Machine;

    fn deref(&self) -> &Machine {
        self.all.buses().nth(self.at).expect("it is one of its buses")
    }
}

/// Reads a machine without errors in its file. Warnings are left to `machine check`.
pub(crate) fn sound(path: &Path) -> Result<Arc<Machine>, Failure> {
    without_errors(read(path)?, &path.display().to_string())
}

/// The same on its only bus, or on the one named as in `machine.toml#left`.
pub(crate) fn sound_on_bus(name: &Path) -> Result<OnBus, Failure> {
    on_bus(sound(name)?, Machine::file_and_bus(name).1)
}

/// A machine on its only bus, or on the bus with this name.
pub(crate) fn on_bus(all: Arc<Machine>, bus: Option<&str>) -> Result<OnBus, Failure> {
    let at = all.place_of_bus(bus).map_err(|which| {
        Failure::new(which).help("--bus takes the name of one; so does the file, as machine.toml#NAME")
    })?;
    Ok(OnBus { all, at })
}

/// The same for a machine that has been read.
pub(crate) fn without_errors(machine: Arc<Machine>, name: &str) -> Result<Arc<Machine>, Failure> {
    let errors = machine.errors();
    if errors.is_empty() {
        return Ok(machine);
    }
    Err(Failure::new(format_args!("{name} cannot be used: see above")).after(errors))
}
