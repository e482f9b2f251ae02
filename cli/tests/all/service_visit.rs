//! The page "A service visit", followed to the letter with simulated devices; `LEXICAN_BLESS=1` writes the output of
//! the commands, and the picture.
#![cfg(unix)]

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use crate::common::{files, folder};
use crate::page::follow;
use crate::simulation::Simulation;

/// The terminals of the bus, as named in the page.
const TERMINALS: [&str; 4] = ["slcan:/dev/pts/3", "slcan:/dev/pts/4", "slcan:/dev/pts/5", "slcan:/dev/pts/6"];

/// The engineer's desk: a folder, the simulations, and the processes in a second terminal.
struct Desk {
    folder: PathBuf,
    /// The simulation of the machine, which provides the bus.
    machine: Option<Simulation>,
    /// The new drive, at the last terminal of the bus.
    drive: Option<Simulation>,
    /// Lines that set variables for all later lines.
    exported: String,
    /// The file that the present block writes.
    file: PathBuf,
    second: Vec<(String, Child)>,
}

impl Desk {
    /// Carries out a line of the page, and returns its output.
    fn act(&mut self, language: &str, line: &str) -> String {
        match (language, line.split_once(' ')) {
            ("toml" | "seq", _) => self.write_file(line),
            ("simulation", _) => self.handle(line),
            ("sh", Some(("export", _))) => self.exported += &(self.here(line) + "\n"),
            ("sh", Some(("lexican", simulation))) if simulation.starts_with("simulate ") => self.simulate(line),
            ("sh", _) => return self.run(line),
            _ => panic!("a block that the test does not follow: {language}"),
        }
        String::new()
    }

    /// Appends a line to the file that the first line of the block names.
    fn write_file(&mut self, line: &str) {
        if let Some(name) = line.strip_prefix("# ").filter(|name| name.ends_with(".toml") || name.ends_with(".seq")) {
            self.file = self.folder.join(name);
        }
        let file = OpenOptions::new().create(true).append(true).open(&self.file);
        writeln!(file.expect("a block of a file begins with the name of its file"), "{line}").unwrap();
    }

    /// Types a line into the terminal of the machine.
    fn handle(&mut self, line: &str) {
        let event = if line.contains("fault") { "emcy" } else { "state" };
        self.machine.as_mut().expect("the machine is simulated").asks(line, event);
    }

    /// Begins a simulation: at first of the machine, then of the new drive.
    fn simulate(&mut self, line: &str) {
        let line = self.here(line);
        let words: Vec<_> = line.split_whitespace().skip(2).collect();
        if self.machine.is_none() {
            self.machine = Some(Simulation::begin(&self.folder, &words));
        } else {
            self.drive = Some(Simulation::begin(&self.folder, &words));
        }
    }

    /// Runs a line in a shell. A line with `&` runs in a second terminal, until `wait`.
    fn run(&mut self, line: &str) -> String {
        if line == "wait" {
            let ended = self.second.drain(..).map(|(line, child)| (line, child.wait_with_output().unwrap()));
            return ended.map(|(line, output)| printed(&line, &output)).collect();
        }
        let (line, is_second) = line.strip_suffix(" &").map_or((line, false), |line| (line, true));
        let bin = Path::new(env!("CARGO_BIN_EXE_lexican")).parent().unwrap();
        let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap());
        let child = Command::new("sh")
            .args(["-c", &format!("{}exec 2>&1\n{}", self.exported, self.here(line))])
            .current_dir(&self.folder)
            .env("PATH", path)
            .env_remove("LEXICAN_BUS")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("there is a shell");
        if is_second {
            self.second.push((line.to_owned(), child));
            return String::new();
        }
        printed(line, &child.wait_with_output().unwrap())
    }

    /// A line of the page, with the terminals of this run.
    fn here(&self, line: &str) -> String {
        let buses = self.machine.iter().flat_map(|machine| &machine.buses);
        let words = line.split_inclusive([' ', '=']);
        let renamed = |word: &str| {
            let at = TERMINALS.iter().position(|name| *name == word.trim_end());
            let bus = at.and_then(|at| buses.clone().nth(at));
            bus.map_or_else(|| word.to_owned(), |bus| word.replace(word.trim_end(), bus))
        };
        words.map(renamed).collect()
    }
}

/// The output of a line. Its exit code must be the one named in the line, or 0.
#[track_caller]
fn printed(line: &str, output: &Output) -> String {
    let text = String::from_utf8(output.stdout.clone()).expect("the command prints UTF-8");
    let code = line.split_once("# exit code ").map_or(0, |(_, code)| code.parse().unwrap());
    assert_eq!(output.status.code(), Some(code), "{line}\n{text}");
    text
}

/// The text without measured numbers. Lines that are then equal appear only once, because their number depends on the
/// machine.
fn without_measurements(text: &str) -> String {
    let mut lines: Vec<String> = text.lines().map(without_measurement).collect();
    lines.dedup();
    lines.join("\n")
}

fn without_measurement(line: &str) -> String {
    let is_measured = line.starts_with(' ') && line.trim_start().starts_with(|first: char| first.is_ascii_digit())
        || [" per second, ", " noticed after ", " UTC", " lines in "].iter().any(|words| line.contains(words));
    if !is_measured {
        return line.to_owned();
    }
    let is_number = |c: char| c.is_ascii_digit() || "+-.".contains(c);
    let words = line.split_whitespace().map(|word| if word.contains(is_number) { "#" } else { word });
    words.collect::<Vec<_>>().join(" ")
}

/// The drive of the page: the servo of the conformance test, with LSS and parameters that it can store.
fn axis(root: &Path) -> String {
    let sheet = |name| fs::read_to_string(root.join("tests/conformance").join(name)).expect("there is its data sheet");
    let (servo, encoder) = (sheet("servo.eds"), sheet("encoder.eds"));
    let store = encoder.split("\n\n").filter(|section| section.starts_with("[1010"));
    let servo = servo
        .replace("LSS_Supported=0", "LSS_Supported=1")
        .replace("SupportedObjects=56\n", "SupportedObjects=57\n57=0x1010\n");
    [servo].into_iter().chain(store.map(|section| format!("\n{section}\n"))).collect()
}

#[test]
fn the_page_exchanges_a_drive() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = folder("service-visit");
    fs::write(folder.join("axis.eds"), axis(&root)).unwrap();
    fs::copy(root.join("tests/conformance/encoder.eds"), folder.join("encoder.eds")).unwrap();
    let mut desk = Desk {
        folder: folder.clone(),
        machine: None,
        drive: None,
        exported: String::new(),
        file: PathBuf::new(),
        second: Vec::new(),
    };
    let page = root.join("cli/service-visit.md");
    follow(&page, "service_visit", without_measurements, |language, line| desk.act(language, line));
    let made = ["axis.eds", "axis.toml", "encoder.eds", "labeller.tar", "machine.toml", "new.txt", "report.txt"];
    assert_eq!(files(&folder), [&made[..], &["travel.csv", "travel.seq", "travel.svg"]].concat());
    // The picture shows that the drive went to 50 mm and back.
    let table = fs::read_to_string(folder.join("travel.csv")).unwrap();
    let positions: Vec<_> = table.lines().filter(|line| line.contains("6064:00")).collect();
    assert!(positions.iter().any(|line| line.ends_with("+50.00 mm")), "{table}");
    assert!(positions.last().is_some_and(|line| line.ends_with(" 0.00 mm") || line.ends_with(",0.00 mm")), "{table}");
    let picture = fs::read_to_string(folder.join("travel.svg")).unwrap();
    assert!(picture.contains("Position actual value") && picture.contains("[mm]"), "{picture}");
    if std::env::var_os("LEXICAN_BLESS").is_some() {
        fs::write(root.join("cli/docs/travel.svg"), picture).unwrap();
    }
}
