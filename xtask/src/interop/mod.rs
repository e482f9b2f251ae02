//! `cargo xtask interop`: lexican against python-canopen, both ways, over slcan and over vcan; and the simulated AG02
//! behind its serial port, driven by pyserial alone; and logs of all formats that lexican and others exchange.
//!
//! slcan goes over a pair of pseudo-terminals and needs nothing of the kernel; vcan goes through
//! `cargo xtask vcan`. The runs themselves are `tests/interop/run.py` and `tests/interop/peer/`.

mod table;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{command, python, vcan, workspace};
use table::{Column, Direction, Table};

/// Every service of CANopen: the columns of the first table.
const SERVICES: [Direction; 3] = [
    Direction {
        name: "device",
        peer: "python-canopen",
        program: "interop-peer",
        head: "our device, python-canopen's manager",
    },
    Direction {
        name: "manager",
        peer: "python-canopen",
        program: "interop-peer",
        head: "our manager, python-canopen's device",
    },
    Direction { name: "both", peer: "lexican", program: "interop-peer", head: "our manager, our device" },
];

/// Drives that move: the columns of the second table.
const DRIVES: [Direction; 3] = [
    drive("ag03-1", "our simulated AG03/1, python-canopen's manager"),
    drive("ag02", "our simulated AG02, python-canopen's manager"),
    drive("akd", "our simulated AKD, python-canopen's manager"),
];

const fn drive(name: &'static str, head: &'static str) -> Direction {
    Direction { name, peer: "python-canopen", program: "lexican", head }
}

/// Logs: the columns of the third table, with where each of them is exchanged.
const LOGS: [(Direction, &str); 3] = [
    (logs("written", "others read what lexican writes"), "file"),
    (logs("read", "lexican reads what others write"), "file"),
    (logs("bus", "lexican and can-utils on one bus"), "vcan"),
];

const fn logs(name: &'static str, head: &'static str) -> Direction {
    Direction { name, peer: "python-can, can-utils, tshark", program: "lexican", head }
}

const LINKS: [&str; 2] = ["slcan", "vcan"];

/// Where the tables are written.
const PAGE: &str = "tests/interop/README.md";

/// Runs everything and writes the tables; with `check` only looks whether the written ones are right.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    let folder = workspace::target_folder(root).join("interop");
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let python = python::environment(root)?;
    for (program, package) in [("candump", "can-utils"), ("tshark", "tshark"), ("editcap", "wireshark-common")] {
        if Command::new(program).arg("-h").output().is_err() {
            return Err(format!("there is no {program}\ninstall it: apt-get install {package}"));
        }
    }
    command::run_cargo(root, &["build", "--workspace", "--bins"], &[])?;
    serial_port(root, &python)?;
    python::read_databases(root)?;
    let run = Run { root, folder, python };
    let tables = [run.table(&SERVICES)?, run.table(&DRIVES)?, run.logs()?];
    let page = table::page(&tables);
    println!("{page}");
    let failed: usize = tables.iter().map(|table| table.count("failed")).sum();
    if failed > 0 {
        return Err(format!("{failed} services failed: see {}", run.folder.display()));
    }
    let path = root.join(PAGE);
    if !check {
        return fs::write(path, page).map_err(|error| format!("{PAGE}: {error}"));
    }
    let written = fs::read_to_string(path).map_err(|error| format!("{PAGE}: {error}"))?;
    match table::difference(&written, &page) {
        None => Ok(()),
        Some(difference) => Err(format!("{PAGE} is stale: {difference}\nmend it: cargo xtask interop")),
    }
}

/// Drives a simulated serial port: an error when a step of the manual's flow charts fails.
fn serial_port(root: &Path, python: &Path) -> Result<(), String> {
    let build = ["build", "-p", "lexican-siko-serial", "--features", "serialport", "--example", "simulate"];
    command::run_cargo(root, &build, &[])?;
    let script = root.join("tests/interop/serial_port.py");
    let program = workspace::program(root, "examples/simulate");
    let [python, script, program] = [python, &script, &program].map(|path| path.to_string_lossy().into_owned());
    command::run(&[&*python, "-B", &script, &program])
}

/// What all runs need.
struct Run<'a> {
    root: &'a Path,
    /// Where results and recordings go.
    folder: PathBuf,
    python: PathBuf,
}

impl Run<'_> {
    fn table(&self, directions: &'static [Direction]) -> Result<Table, String> {
        let mut table = Table::default();
        for direction in directions {
            for link in LINKS {
                table.columns.push(self.column(direction, link)?);
            }
        }
        Ok(table)
    }

    fn column(&self, direction: &'static Direction, link: &'static str) -> Result<Column, String> {
        let results = self.folder.join(format!("{}-{link}.txt", direction.name));
        let script = self.root.join("tests/interop/run.py");
        let program = workspace::program(self.root, direction.program);
        let [python, script, program, results_word] =
            [&self.python, &script, &program, &results].map(|path| path.to_string_lossy().into_owned());
        // -B: no byte code beside the scripts.
        let line = [&*python, "-B", &script, &program, direction.name, link, &results_word];
        let mut column = self.results(direction, link, &line, &results)?;
        if link == "vcan" {
            column.add(&self.compare(&results.with_extension("log"))?);
        }
        Ok(column)
    }

    fn logs(&self) -> Result<Table, String> {
        let mut table = Table::default();
        for (direction, link) in &LOGS {
            let folder = self.folder.join("logs");
            let results = self.folder.join(format!("logs-{}.txt", direction.name));
            let script = self.root.join("tests/interop/logs.py");
            let program = workspace::program(self.root, direction.program);
            let words = [&self.python, &script, &program, &folder, &results];
            let [python, script, program, folder, out] = words.map(|path| path.to_string_lossy().into_owned());
            let line = [&*python, "-B", &script, &program, direction.name, &folder, &out];
            table.columns.push(self.results(direction, link, &line, &results)?);
        }
        Ok(table)
    }

    /// Runs a script that writes results; where one has failed, it is in the results, and so in the table.
    fn results(
        &self,
        direction: &'static Direction,
        link: &'static str,
        line: &[&str],
        results: &Path,
    ) -> Result<Column, String> {
        let outcome = match link {
            "vcan" => vcan::run_command(self.root, line, &[&self.folder]),
            _ => command::run(line),
        };
        Column::read(direction, link, results).map_err(|error| match outcome {
            Err(reason) => reason,
            Ok(()) => error,
        })
    }

    /// What tshark and lexican make of a recorded bus: a line of results.
    fn compare(&self, log: &Path) -> Result<String, String> {
        let lexican = workspace::program(self.root, "lexican");
        let script = self.root.join("tests/interop/compare.py");
        let output = Command::new("python3").arg(script).arg(lexican).arg(log).output();
        let output = output.map_err(|error| format!("python3: {error}"))?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        println!("{}", text.trim_end());
        match text.lines().last() {
            Some(line) if line.contains('\t') => Ok(line.to_owned()),
            _ => Err(format!("compare.py: {}", String::from_utf8_lossy(&output.stderr))),
        }
    }
}
