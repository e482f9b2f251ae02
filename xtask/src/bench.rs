//! Figures of this project and its peers, measured in one run, printed, and written to `tests/bench/*.md`. The crate
//! `tests/bench` measures them; it is no member of the workspace, to keep the peers' dependencies out.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

use clap::{Args, ValueEnum};

use crate::{command, python, vcan, workspace};

#[derive(Args)]
pub(crate) struct Bench {
    /// What to compare; all, one after the other, when none is named
    what: Option<What>,
    /// For eds, the data sheet to read; else the one of LEXICAN_CORPUS, a folder, that is nearest to 131 kB. For files,
    /// the folder
    file: Option<String>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum What {
    /// SDO transfers, and frames of other nodes
    Sdo,
    /// Reading a data sheet, in time and memory
    Eds,
    /// How many data sheets of a folder each reader takes, and how much it keeps of them
    Files,
    /// Instructions that a frame costs the manager and the device, counted by valgrind
    Instructions,
    /// SDO over pseudo-terminals and vcan, beside python-canopen. Not among "all"
    Bus,
}

/// The file with the figures of [`What::Bus`].
const TABLE: &str = "tests/bench/bus.md";

pub(crate) fn run(root: &Path, bench: &Bench) -> Result<(), String> {
    let file = bench.file.as_deref();
    match (bench.what, file) {
        (None, _) => ["sdo", "eds", "instructions"].into_iter().try_for_each(|what| print(root, &[what])),
        (Some(What::Sdo), _) => print(root, &["sdo"]),
        (Some(What::Eds), _) => print(root, &["eds"].into_iter().chain(file).collect::<Vec<_>>()),
        (Some(What::Files), Some(folder)) => print(root, &["files", folder]),
        (Some(What::Files), None) => Err("which folder? cargo xtask bench files FOLDER".to_owned()),
        (Some(What::Instructions), _) => print(root, &["instructions"]),
        (Some(What::Bus), _) => bus(root),
    }
}

/// Runs the program over pseudo-terminals here, and over vcan in [`vcan`].
fn bus(root: &Path) -> Result<(), String> {
    let results = workspace::target_folder(root).join("interop");
    fs::create_dir_all(&results).map_err(|error| format!("{}: {error}", results.display()))?;
    let python = python::environment(root)?;
    succeeded(cargo(root, "build").status().map_err(failed)?)?;
    let program = folder(root).join("release/lexican-bench");
    let mut text = format!(
        "# Figures: bus\n\nSDO over a bus, beside python-canopen ({}), made by `cargo xtask bench bus`. Each side \
         is a process of its own; a client reads 1000h, one read after the other, and a round trip is two frames. \
         Contenders take turns of a second: the rate is that of the middle turn, processor time that of all turns. \
         Ratios of rates: above 1 is faster; of processor time: below 1 is cheaper. Under user-mode Linux every \
         system call takes ten times as long, and reading the clock is one. When one of eight nodes is silent, the \
         others share what it leaves them: expected is 1.00 or more.\n",
        python::PACKAGES.join(", ")
    );
    for link in ["slcan", "vcan"] {
        let table = results.join(format!("bench-{link}.md"));
        let [program, python, table_word] = [&program, &python, &table].map(|path| path.to_string_lossy().into_owned());
        let line = [&*program, "bus", link, &python, &table_word];
        if link == "vcan" {
            vcan::run_command(root, &line, &[&results])?;
        } else {
            command::run(&line)?;
        }
        let figures = fs::read_to_string(&table).map_err(|error| format!("{}: {error}", table.display()))?;
        text = format!("{text}\n{figures}");
    }
    text = format!("{text}\n{}\n", load());
    fs::write(root.join(TABLE), text).map_err(|error| format!("{TABLE}: {error}"))
}

/// The note for instruction counts, which do not depend on how busy the machine is.
const COUNTED: &str = "Instructions on x86-64, counted by valgrind, of all that a shell calls for a frame or deadline: \
                       `handle_frame` or `handle_timeout`, `poll_transmit` until there is nothing more to send, and \
                       `poll_timeout`. The frames are of all nodes in turn.";

/// Runs the program, prints its output, and writes it to a file.
fn print(root: &Path, arguments: &[&str]) -> Result<(), String> {
    let what = arguments.first().copied().unwrap_or_default();
    let mut command = cargo(root, "run");
    // Without this environment, the program says that python-canopen does not take part.
    if matches!(what, "eds" | "files")
        && let Ok(python) = python::environment(root)
    {
        command.env("LEXICAN_PYTHON", python);
    }
    let mut child = command.arg("--").args(arguments).stdout(Stdio::piped()).spawn().map_err(failed)?;
    let mut figures = String::new();
    for line in BufReader::new(child.stdout.take().ok_or("its output is piped")?).lines() {
        let line = line.map_err(failed)?;
        println!("{line}");
        figures += &(line + "\n");
    }
    succeeded(child.wait().map_err(failed)?)?;
    // Output that is no table is lined up by spaces.
    let figures = if figures.starts_with('|') { figures } else { format!("```text\n{}\n```\n", figures.trim()) };
    let note = if what == "instructions" { COUNTED.to_owned() } else { load() };
    let text = format!("# Figures: {what}\n\nMade by `cargo xtask bench {what}`. {note}\n\n{figures}");
    let path = format!("tests/bench/{what}.md");
    fs::write(root.join(&path), text).map_err(|error| format!("{path}: {error}"))
}

/// How busy the machine is, which tells how far to trust times.
fn load() -> String {
    let average = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let average = average.split(' ').next().unwrap_or_default();
    format!("Load average of the machine at the end: {average}. Above 1.5, measure again.")
}

/// Cargo with the arguments that build or run the program.
fn cargo(root: &Path, verb: &str) -> Command {
    let mut command = command::cargo();
    command.args([verb, "--quiet", "--release", "--manifest-path"]).arg(root.join("tests/bench/Cargo.toml"));
    command.arg("--target-dir").arg(folder(root));
    command
}

fn succeeded(status: ExitStatus) -> Result<(), String> {
    if status.success() { Ok(()) } else { Err(format!("the benchmark failed: {status}")) }
}

fn failed(error: std::io::Error) -> String {
    format!("the benchmark failed: {error}")
}

/// The program's target folder: inside the workspace's own, so that git ignores it and `cargo clean` removes it.
fn folder(root: &Path) -> PathBuf {
    workspace::target_folder(root).join("bench")
}
