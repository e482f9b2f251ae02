//! python-canopen, which lexican is tried and measured against, in an environment of its own.

use std::fs;
use std::path::{Path, PathBuf};

use crate::{command, workspace};

/// What the environment consists of.
pub(crate) const PACKAGES: [&str; 3] = ["canopen==2.4.1", "python-can==4.6.1", "pyserial==3.5"];

/// What reads CAN databases, beside [`PACKAGES`].
const CANTOOLS: &str = "cantools==45.1.0";

/// Whether python's cantools reads what `lexican eds to-dbc` and `machine export` write: tests that are skipped without it.
pub(crate) fn read_databases(root: &Path) -> Result<(), String> {
    let python = environment(root)?.to_string_lossy().into_owned();
    command::run(&[&python, "-m", "pip", "install", "--quiet", CANTOOLS])?;
    command::run_cargo(
        root,
        &["test", "-p", "lexican-toolbox", "-p", "lexican-machine", "--test", "all", "--", "dbc::", "cantools_reads"],
        &[("LEXICAN_PYTHON", &python)],
    )
}

/// The python of the environment, which is made when it is not there yet.
pub(crate) fn environment(root: &Path) -> Result<PathBuf, String> {
    let venv = workspace::target_folder(root).join("python-canopen");
    let python = venv.join("bin/python");
    let complete = venv.join("complete");
    if fs::read_to_string(&complete).is_ok_and(|packages| packages == PACKAGES.join("\n")) {
        return Ok(python);
    }
    let venv_word = venv.to_string_lossy().into_owned();
    let python_word = python.to_string_lossy().into_owned();
    command::run(&["python3", "-m", "venv", "--clear", &venv_word])
        .map_err(|error| format!("{error}\ninstall it: apt-get install python3-venv"))?;
    command::run(&[&[&*python_word, "-m", "pip", "install", "--quiet"], &PACKAGES[..]].concat())?;
    fs::write(complete, PACKAGES.join("\n")).map_err(|error| error.to_string())?;
    Ok(python)
}
