//! Figures of this project and its peers, measured in one run, printed, and written to `tests/bench/*.md`, and from there to the
//! comparison. The crate `tests/bench` measures them; it is no member of the workspace, to keep the peers' dependencies out. What
//! has no peer is an example of its crate.

mod compared;

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
    /// Plants of 127 simulated devices, side by side on one core and on two. Without peers, and not among "all"
    Scale,
    /// What a busy bus costs the bench's model and a page. Without peers, and not among "all"
    Flood,
    /// Nothing: writes the comparison anew by the figures of all pages
    Compared,
}

/// The file with the figures of [`What::Bus`].
const TABLE: &str = "tests/bench/bus.md";

pub(crate) fn run(root: &Path, bench: &Bench) -> Result<(), String> {
    let file = bench.file.as_deref();
    let peers = |arguments: &[&str]| print(root, arguments[0], peers(root, arguments));
    match (bench.what, file) {
        (None, _) => ["sdo", "eds", "instructions"].into_iter().try_for_each(|what| peers(&[what])),
        (Some(What::Sdo), _) => peers(&["sdo"]),
        (Some(What::Eds), _) => peers(&["eds"].into_iter().chain(file).collect::<Vec<_>>()),
        (Some(What::Files), Some(folder)) => peers(&["files", folder]),
        (Some(What::Files), None) => Err("which folder? cargo xtask bench files FOLDER".to_owned()),
        (Some(What::Instructions), _) => peers(&["instructions"]),
        (Some(What::Bus), _) => bus(root),
        (Some(What::Scale), _) => print(root, "scale", example(root, "lexican-simulation", "scale")),
        (Some(What::Flood), _) => print(root, "flood", example(root, "lexican-bench", "flood")),
        (Some(What::Compared), _) => Ok(()),
    }?;
    compared::write(root)
}

/// Runs the program over pseudo-terminals here, and over vcan in [`vcan`].
fn bus(root: &Path) -> Result<(), String> {
    let results = workspace::target_folder(root).join("interop");
    fs::create_dir_all(&results).map_err(|error| format!("{}: {error}", results.display()))?;
    let python = python::environment(root)?;
    succeeded(cargo(root, "build").status().map_err(failed)?)?;
    let program = folder(root).join("release/lexican-bench");
    let mut text = format!(
        "# Figures: bus\n\n{} SDO over a bus, beside python-canopen ({}). Each side \
         is a process of its own; a client reads 1000h, one read after the other, and a round trip is two frames. \
         Contenders take turns of a second: the rate is that of the middle turn, processor time that of all turns. \
         Ratios of rates: above 1 is faster; of processor time: below 1 is cheaper. Under user-mode Linux every \
         system call takes ten times as long, and reading the clock is one. When one of eight nodes is silent, the \
         others share what it leaves them: expected is 1.00 or more.\n",
        made_by("bus")?,
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

/// What figures of the example with this name say besides.
const SCALE: &str = "Each plant has 127 devices on a bus of its own at 1 Mbit/s, and a SYNC every millisecond of virtual time for 10 s. \
                     Times real time are those of all plants together; the best of three runs in turn, all with the same frames. \
                     Processor time does not depend on what else the machine does, as far as caches are not shared.";

/// The same of the example `flood`.
const FLOOD: &str = "Frames of twelve drives, heard by the bench's model: of ten, seven are process data, two an SDO transfer, one a \
                     heartbeat. All in processor time: the rate is that of one core, which in a second makes ten views for a page, too.";

/// Runs a program, shows what it prints, and writes that down.
fn print(root: &Path, what: &str, mut program: Command) -> Result<(), String> {
    let mut child = program.stdout(Stdio::piped()).spawn().map_err(failed)?;
    let mut figures = String::new();
    for line in BufReader::new(child.stdout.take().ok_or("its output is piped")?).lines() {
        let line = line.map_err(failed)?;
        println!("{line}");
        figures += &(line + "\n");
    }
    succeeded(child.wait().map_err(failed)?)?;
    // Output that is no table is lined up by spaces.
    let figures = if figures.starts_with('|') { figures } else { format!("```text\n{}\n```\n", figures.trim()) };
    let note = match what {
        "instructions" => COUNTED.to_owned(),
        "scale" => format!("{SCALE} {}", load()),
        "flood" => format!("{FLOOD} {}", load()),
        _ => load(),
    };
    let text = format!("# Figures: {what}\n\n{} {note}\n\n{figures}", made_by(what)?);
    let path = format!("tests/bench/{what}.md");
    fs::write(root.join(&path), text).map_err(|error| format!("{path}: {error}"))
}

/// Which task has made figures, when and with what. A peer's version stands beside its name.
fn made_by(what: &str) -> Result<String, String> {
    let says = |program: &str, arguments: &[&str]| {
        let output = command::output(Command::new(program).args(arguments))?;
        Ok::<_, String>(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let [date, rustc] = [says("date", &["-u", "+%F"])?, says("rustc", &["--version"])?];
    let counter =
        if what == "instructions" { format!(" and {}", says("valgrind", &["--version"])?) } else { String::new() };
    Ok(format!("Made by `cargo xtask bench {what}` on {date}, with {rustc}{counter}."))
}

/// How busy the machine is, which tells how far to trust times.
fn load() -> String {
    let average = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let average = average.split(' ').next().unwrap_or_default();
    format!("Load average of the machine at the end: {average}. Above 1.5, measure again.")
}

/// The program that measures us and our peers.
fn peers(root: &Path, arguments: &[&str]) -> Command {
    let mut command = cargo(root, "run");
    // Without this environment, the program says that python-canopen does not take part.
    if matches!(arguments[0], "eds" | "files")
        && let Ok(python) = python::environment(root)
    {
        command.env("LEXICAN_PYTHON", python);
    }
    command.arg("--").args(arguments);
    command
}

/// Cargo with the arguments that build or run that program.
fn cargo(root: &Path, verb: &str) -> Command {
    let mut command = command::cargo();
    command.args([verb, "--quiet", "--release", "--manifest-path"]).arg(root.join("tests/bench/Cargo.toml"));
    command.arg("--target-dir").arg(folder(root));
    command
}

/// A program of a package that measures it alone.
fn example(root: &Path, package: &str, name: &str) -> Command {
    let mut command = command::cargo();
    command.args(["run", "--quiet", "--release", "--package", package, "--example", name]).current_dir(root);
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
