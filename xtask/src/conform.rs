//! `cargo xtask conform`: `lexican conform` against devices of many kinds, and the page with what it says of them.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::report::{Case, Report};
use crate::{firmware, outside, python};

/// Where the results are written.
const PAGE: &str = "conform/REPORTS.md";

/// From here on, the page has what is not simulated: it is measured in real time, and not checked.
const MEASURED: &str = "## Not simulated\n";

/// From here on, the page is written by people: what was seen of devices that are not part of the project.
const BY_HAND: &str = "\n### Foreign stacks\n";

/// A device that is tested.
struct Subject {
    name: &'static str,
    /// What kind of device it is, and where it comes from.
    kind: &'static str,
    /// Its data sheet: a file, or the name of a drive in the library.
    sheet: &'static str,
    /// In what it is known to deviate from the standard: a file.
    known: Option<&'static str>,
    /// What the test may do.
    allow: &'static str,
}

const fn simulated(name: &'static str, kind: &'static str, sheet: &'static str) -> Subject {
    Subject { name, kind, sheet, known: None, allow: "all" }
}

const fn drive(name: &'static str, kind: &'static str, sheet: &'static str, known: &'static str) -> Subject {
    Subject { known: Some(known), ..simulated(name, kind, sheet) }
}

/// In virtual time: their results are the same on every machine.
const SIMULATED: &[Subject] = &[
    simulated("minimal", "what CiA 301 requires of every device, and LSS", "tests/conformance/minimal.eds"),
    Subject {
        // It has objects of CiA 402, but no drive behind them.
        allow: "manufacturer,outputs,store,restore,node-id",
        ..simulated("conformance", "nearly all that CiA 301 knows; nothing moves", "tests/conformance/device.eds")
    },
    simulated("encoder", "CiA 406, LSS", "tests/conformance/encoder.eds"),
    simulated("inclinometer", "CiA 410, guarding, fixed mapping", "tests/conformance/inclinometer.eds"),
    simulated("recorder", "all data types, 200 samples, no PDO", "tests/conformance/recorder.eds"),
    simulated("sensor", "a TPDO of its own kind, LSS", "cli/tests/sensor.eds"),
    simulated("valve", "CiA 408", "tests/downstream/no_std/eds/valve.eds"),
    simulated("servo", "CiA 402, as a simulated servo", "tests/downstream/servo/eds/servo.eds"),
    simulated("peer", "what python-canopen is tried with", "tests/interop/peer.eds"),
    simulated("golden", "the data sheet of the lints' tests", "eds/tests/golden/base.eds"),
    drive("AG03/1", "SIKO's positioning drive", "siko/ag03-1", "drives/siko-ag03-1/conform.toml"),
    drive("AG02", "SIKO's positioning drive", "siko/ag02", "drives/siko-ag02/conform.toml"),
    drive("AKD", "Kollmorgen's servo drive", "kollmorgen/akd", "drives/kollmorgen-akd/conform.toml"),
];

/// Tests every device and writes the page; with `check` only tests those that are simulated, and compares.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    let folder = outside::empty_folder(root, "conform")?;
    let lexican = outside::lexican(root)?;
    let bench = Bench { root, folder, lexican };
    let mut page = String::from(HEAD);
    let reports = SIMULATED.iter().map(|subject| bench.simulated(subject)).collect::<Result<Vec<_>, _>>()?;
    write_table(&mut page, SIMULATED.iter().zip(&reports));
    let failed: usize = reports.iter().map(|report| report.failed).sum();
    let text = fs::read_to_string(root.join(PAGE)).map_err(|error| format!("{PAGE}: {error}"))?;
    if check {
        if text.split(MEASURED).next() != Some(&page) {
            return Err(format!("{PAGE} is stale\nmend it: cargo xtask conform"));
        }
    } else {
        let reports = [bench.python_canopen()?, bench.firmware()?];
        let _ = write!(page, "{MEASURED}{INTRODUCTION}");
        write_table(&mut page, [&PYTHON_CANOPEN, &FIRMWARE].into_iter().zip(&reports));
        let by_hand = text.find(BY_HAND).map_or("", |at| &text[at..]);
        page.push_str(by_hand);
        fs::write(root.join(PAGE), &page).map_err(|error| format!("{PAGE}: {error}"))?;
    }
    println!("{page}");
    if failed > 0 { Err(format!("{failed} cases failed on simulated devices: see {PAGE}")) } else { Ok(()) }
}

const HEAD: &str = "# What `lexican conform` says of devices\n\nMade by `cargo xtask conform`; CI tests what is simulated again. \
                    Everything is allowed, motion included (`--allow all`).\nA case does not apply to a device whose data sheet lacks what it \
                    is about. What a drive is known to deviate in is\nwhat its manual says (`--known`), with the place \
                    there.\n\n## Simulated\n\n";

const INTRODUCTION: &str = "\nOver a serial line (slcan) between two pseudo-terminals, in real time.\n\n";

const PYTHON_CANOPEN: Subject =
    simulated("LocalNode", "python-canopen's device, with the PDOs that its users write", "tests/interop/peer.eds");

const FIRMWARE: Subject = simulated("I/O device", "firmware on a Cortex-M4, in QEMU", firmware::EDS);

struct Bench<'a> {
    root: &'a Path,
    /// Where the reports go.
    folder: PathBuf,
    lexican: PathBuf,
}

impl Bench<'_> {
    fn simulated(&self, subject: &Subject) -> Result<Report, String> {
        let bus = format!("sim:{}?node=5", subject.sheet);
        let mut command = Command::new(&self.lexican);
        command.current_dir(self.root).args(["conform", "--allow", subject.allow, "--bus", &bus]);
        command.args(subject.known.into_iter().flat_map(|file| ["--known", file]));
        self.report(subject, command.args(["--force", "--report"]))
    }

    /// `tests/interop/conform.py` has a node of python-canopen tested.
    fn python_canopen(&self) -> Result<Report, String> {
        let python = python::environment(self.root)?;
        let mut command = Command::new(python);
        command.arg("-B").arg(self.root.join("tests/interop/conform.py")).arg(&self.lexican);
        self.report(&PYTHON_CANOPEN, &mut command)
    }

    fn firmware(&self) -> Result<Report, String> {
        let path = self.path(&FIRMWARE)?;
        firmware::report(self.root, self.lexican.clone(), &path)?;
        read(&FIRMWARE, &path)
    }

    /// Runs a command that takes the report's name as its last argument. Cases may fail, which the exit code 1 says.
    fn report(&self, subject: &Subject, command: &mut Command) -> Result<Report, String> {
        let path = self.path(subject)?;
        let output = command.arg(&path).output().map_err(|error| format!("{command:?}: {error}"))?;
        if !matches!(output.status.code(), Some(0 | 1)) {
            return Err(format!("{}: {}\n{}", subject.name, output.status, String::from_utf8_lossy(&output.stderr)));
        }
        read(subject, &path)
    }

    /// Where the report on a device is written.
    fn path(&self, subject: &Subject) -> Result<PathBuf, String> {
        println!("conform: {}", subject.name);
        let path = self.folder.join(subject.name.replace('/', "-")).with_extension("json");
        outside::write(&path, "").map(|()| path)
    }
}

fn read(subject: &Subject, path: &Path) -> Result<Report, String> {
    Report::read(path).map_err(|error| format!("{}: {error}", subject.name))
}

/// A row for each device, and below it the cases that failed with the reasons.
fn write_table<'a>(page: &mut String, devices: impl Iterator<Item = (&'a Subject, &'a Report)> + Clone) {
    page.push_str(
        "| device | what it is | passed | failed | as known | only recommended, failed | does not apply |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for (subject, report) in devices.clone() {
        let sheet = match subject.sheet {
            file if file.ends_with(".eds") => format!(": [data sheet](../{file})"),
            _ => String::new(),
        };
        let _ = writeln!(
            page,
            "| {} | {}{sheet} | {} | {} | {} | {} | {} |",
            subject.name,
            subject.kind,
            report.passed,
            report.failed,
            report.known,
            report.advised,
            report.not_applicable
        );
    }
    for (subject, report) in devices {
        let noticed: Vec<&Case> = report
            .cases
            .iter()
            .filter(|case| matches!(&*case.verdict, "failed" | "known" | "advised" | "blocked" | "not decidable"))
            .collect();
        if noticed.is_empty() {
            continue;
        }
        let _ = writeln!(
            page,
            "\n### {}\n\n| case | what has to hold | what was seen |\n| --- | --- | --- |",
            subject.name
        );
        for Case { id, title, reason, known, verdict, .. } in noticed {
            let only = match verdict.as_str() {
                "advised" => " (recommended)",
                "blocked" => " (blocked)",
                "not decidable" => " (not decidable)",
                _ => "",
            };
            let why = known.as_ref().map_or_else(String::new, |why| format!(" (known: {why})"));
            let _ = writeln!(page, "| {id}{only} | {} | {} |", in_a_cell(title), in_a_cell(&format!("{reason}{why}")));
        }
    }
    page.push('\n');
}

/// One line, without what ends a cell.
fn in_a_cell(text: &str) -> String {
    text.lines().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}
