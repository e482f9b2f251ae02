//! `cargo xtask interop`: lexican against python-canopen, both ways, over slcan and over vcan.
//!
//! slcan goes over a pair of pseudo-terminals and needs nothing of the kernel; vcan goes through
//! `cargo xtask vcan`. The runs themselves are `tests/interop/run.py` and `tests/interop/peer/`.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::vcan;

/// What the environment of python-canopen consists of.
const PACKAGES: [&str; 3] = ["canopen==2.4.1", "python-can==4.6.1", "pyserial==3.5"];

/// Who plays what: the name of the direction in `run.py`, and the head of its columns.
const DIRECTIONS: [(&str, &str); 3] = [
    ("device", "our device, python-canopen's manager"),
    ("manager", "our manager, python-canopen's device"),
    ("both", "our manager, our device"),
];

const LINKS: [&str; 2] = ["slcan", "vcan"];

/// Where the table is written.
const TABLE: &str = "tests/interop/README.md";

pub(crate) fn run(root: &Path) -> Result<(), String> {
    let folder = vcan::target_folder(root).join("interop");
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let python = environment(&folder)?;
    for (program, package) in [("candump", "can-utils"), ("tshark", "tshark")] {
        if Command::new(program).arg("-h").output().is_err() {
            return Err(format!("there is no {program}\ninstall it: apt-get install {package}"));
        }
    }
    crate::ci::cargo(root, &["build", "--release", "-p", "lexican", "-p", "lexican-tests", "--bins"], &[])?;
    let peer = vcan::target_folder(root).join("release/interop-peer");
    let mut columns = Vec::new();
    for (direction, _) in DIRECTIONS {
        for link in LINKS {
            let results = folder.join(format!("{direction}-{link}.txt"));
            let script = root.join("tests/interop/run.py");
            let words = [&python, &script, &peer].map(|path| path.to_string_lossy().into_owned());
            let results_word = results.to_string_lossy().into_owned();
            let line: Vec<&str> = words.iter().map(String::as_str).chain([direction, link, &results_word]).collect();
            // A service that failed is in the results, too: the table tells it.
            let outcome = if link == "vcan" { vcan::run_command(root, &line, &[&folder]) } else { directly(&line) };
            let mut column = Column::read(&results).map_err(|error| match outcome {
                Err(reason) => reason,
                Ok(()) => error,
            })?;
            if link == "vcan" {
                column.add(&compare(root, &results.with_extension("log"))?);
            }
            columns.push(column);
        }
    }
    let table = table(&columns);
    fs::write(root.join(TABLE), &table).map_err(|error| format!("{TABLE}: {error}"))?;
    println!("{table}");
    let failed: usize = columns.iter().map(|column| column.count("failed")).sum();
    if failed == 0 { Ok(()) } else { Err(format!("{failed} services failed: see {}", folder.display())) }
}

/// What tshark and lexican make of a recorded bus: a line of results.
fn compare(root: &Path, log: &Path) -> Result<String, String> {
    let lexican = vcan::target_folder(root).join("release/lexican");
    let output = Command::new("python3").arg(root.join("tests/interop/compare.py")).arg(lexican).arg(log).output();
    let output = output.map_err(|error| format!("python3: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{}", text.trim_end());
    match text.lines().last() {
        Some(line) if line.contains('\t') => Ok(line.to_owned()),
        _ => Err(format!("compare.py: {}", String::from_utf8_lossy(&output.stderr))),
    }
}

/// A virtual environment with python-canopen, made when it is not there yet.
fn environment(folder: &Path) -> Result<PathBuf, String> {
    let venv = folder.join("venv");
    let python = venv.join("bin/python");
    let complete = venv.join("complete");
    if fs::read_to_string(&complete).is_ok_and(|packages| packages == PACKAGES.join("\n")) {
        return Ok(python);
    }
    let venv_word = venv.to_string_lossy().into_owned();
    let python_word = python.to_string_lossy().into_owned();
    directly(&["python3", "-m", "venv", "--clear", &venv_word])
        .map_err(|error| format!("{error}\ninstall it: apt-get install python3-venv"))?;
    directly(&[&[&*python_word, "-m", "pip", "install", "--quiet"], &PACKAGES[..]].concat())?;
    fs::write(complete, PACKAGES.join("\n")).map_err(|error| error.to_string())?;
    Ok(python)
}

fn directly(words: &[&str]) -> Result<(), String> {
    let line = words.join(" ");
    println!("$ {line}");
    let (program, arguments) = words.split_first().ok_or("no command")?;
    let status = Command::new(program).args(arguments).status().map_err(|error| format!("{line}: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("{line}: {status}")) }
}

/// The results of one run: verdict and remark by service.
struct Column {
    services: Vec<String>,
    results: BTreeMap<String, (String, String)>,
}

impl Column {
    fn read(path: &Path) -> Result<Self, String> {
        let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let mut column = Column { services: Vec::new(), results: BTreeMap::new() };
        text.lines().for_each(|line| column.add(line));
        if column.services.is_empty() { Err(format!("{}: no results", path.display())) } else { Ok(column) }
    }

    /// Service, verdict and remark, between tabs.
    fn add(&mut self, line: &str) {
        let mut parts = line.split('\t').map(str::to_owned);
        let (Some(service), Some(verdict)) = (parts.next(), parts.next()) else { return };
        self.services.push(service.clone());
        self.results.insert(service, (verdict, parts.next().unwrap_or_default()));
    }

    fn count(&self, verdict: &str) -> usize {
        self.results.values().filter(|(found, _)| found == verdict).count()
    }
}

fn table(columns: &[Column]) -> String {
    let mut services: Vec<&str> = Vec::new();
    for service in columns.iter().flat_map(|column| &column.services) {
        if !services.contains(&service.as_str()) {
            services.push(service);
        }
    }
    let mut text = format!(
        "# Interoperability\n\nMade by `cargo xtask interop`; python-canopen is {}. A fault is one of python-canopen: the \
         note says which.\n\n| service |",
        PACKAGES.join(", ")
    );
    for (_, head) in DIRECTIONS {
        for link in LINKS {
            let _ = write!(text, " {head}: {link} |");
        }
    }
    let _ = writeln!(text, "\n| --- |{}", " --- |".repeat(columns.len()));
    let mut notes: Vec<&str> = Vec::new();
    for service in services {
        let _ = write!(text, "| {service} |");
        for column in columns {
            let _ = write!(text, " {} |", cell(column.results.get(service), &mut notes));
        }
        text.push('\n');
    }
    text.push('\n');
    for (number, note) in notes.iter().enumerate() {
        let _ = writeln!(text, "{}. {note}", number + 1);
    }
    text
}

/// Verdict or figures; a remark on what is not well becomes a note.
fn cell<'a>(result: Option<&'a (String, String)>, notes: &mut Vec<&'a str>) -> String {
    match result.map(|(verdict, remark)| (verdict.as_str(), remark.as_str())) {
        None => "-".to_owned(),
        // Figures are the result.
        Some(("ok", remark)) if remark.contains("/s, ") || remark.contains(" agree") => remark.to_owned(),
        Some(("ok", _)) => "ok".to_owned(),
        Some((verdict, remark)) => {
            let known = notes.iter().position(|note| *note == remark);
            let number = known.unwrap_or_else(|| {
                notes.push(remark);
                notes.len() - 1
            });
            format!("{verdict} ({})", number + 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_well_becomes_a_note_once() {
        let mut notes = Vec::new();
        let result = |verdict: &str, remark: &str| (verdict.to_owned(), remark.to_owned());
        let (fault, failed) = (result("fault", "no blocks"), result("failed", "no answer"));
        assert_eq!(cell(Some(&fault), &mut notes), "fault (1)");
        assert_eq!(cell(Some(&failed), &mut notes), "failed (2)");
        assert_eq!(cell(Some(&fault), &mut notes), "fault (1)");
        let (well, rate) = (result("ok", "500 bytes"), result("ok", "700/s, 5 us"));
        assert_eq!(cell(Some(&well), &mut notes), "ok");
        assert_eq!(cell(Some(&rate), &mut notes), "700/s, 5 us");
        assert_eq!(cell(None, &mut notes), "-");
        assert_eq!(notes, ["no blocks", "no answer"]);
    }
}
