//! Figures, ours and our peers' in one run. A crate of its own does it, `tests/bench`: what the peers depend on
//! stays out of the workspace.

use std::path::Path;
use std::process::Command;

use clap::{Args, ValueEnum};

#[derive(Args)]
pub(crate) struct Bench {
    /// What to compare; all, one after the other, when none is named
    what: Option<What>,
    /// The data sheet to read; else the one of LEXICAN_CORPUS, a folder, that is nearest to 131 kB
    file: Option<String>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum What {
    /// SDO transfers, and frames of other nodes
    Sdo,
    /// Reading a data sheet, in time and memory
    Eds,
}

pub(crate) fn run(root: &Path, bench: &Bench) -> Result<(), String> {
    match bench.what {
        None => run_one(root, &["sdo"]).and_then(|()| run_one(root, &["eds"])),
        Some(What::Sdo) => run_one(root, &["sdo"]),
        Some(What::Eds) => {
            let file = bench.file.as_deref();
            run_one(root, &["eds"].into_iter().chain(file).collect::<Vec<_>>())
        }
    }
}

fn run_one(root: &Path, arguments: &[&str]) -> Result<(), String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(["run", "--quiet", "--release", "--manifest-path"]).arg(root.join("tests/bench/Cargo.toml"));
    // Beside the workspace's own, and so ignored by git and removed with it.
    if std::env::var_os("CARGO_TARGET_DIR").is_none() {
        command.arg("--target-dir").arg(root.join("target/bench"));
    }
    let status = command.arg("--").args(arguments).status().map_err(|error| format!("cargo run: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("the benchmark failed: {status}")) }
}
