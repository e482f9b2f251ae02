//! Runs Python's cantools, which reads CAN databases.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// Runs a script with the path of a database as its argument, and returns the output. `None` if cantools is not
/// installed.
pub(crate) fn run(script: &str, database: &[u8]) -> Option<String> {
    // The environment of `cargo xtask interop`, or any python with cantools.
    let own = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../python-canopen/bin/python");
    let has_cantools = |python: &PathBuf| {
        Command::new(python).args(["-c", "import cantools"]).output().is_ok_and(|run| run.status.success())
    };
    let named = env::var_os("LEXICAN_PYTHON").map(PathBuf::from);
    let Some(python) = named.or_else(|| [own, "python3".into()].into_iter().find(has_cantools)) else {
        eprintln!("SKIPPED: no python with cantools; LEXICAN_PYTHON can name one (pip install cantools)");
        return None;
    };
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(concat!(env!("CARGO_PKG_NAME"), ".dbc"));
    fs::write(&path, database).unwrap();
    let run = Command::new(python).args(["-c", script]).arg(&path).output().unwrap();
    let [stdout, stderr] = [run.stdout, run.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(run.status.success(), "{stderr}");
    Some(stdout)
}
