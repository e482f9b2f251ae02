//! The firmware of `examples/firmware` on a microcontroller that QEMU plays, and the command's tools against it.
//!
//! The board's UART is a serial CAN adapter to the command, so that all of it is what a user runs, but for the CAN
//! controller. QEMU takes its time from this machine: both run before other processes, and a case of the conformance test
//! that has failed by a time that was measured is tried again. Every other failure counts at once.

mod sizes;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::qemu::{self, Board, Running};
use crate::report::Report;
use crate::{command, outside, workspace};

/// What the firmware is compiled for.
const TARGET: &str = "thumbv7em-none-eabihf";
pub(crate) const EDS: &str = "examples/firmware/device/eds/io.eds";

/// How many bytes the block transfers have.
const BLOCK: usize = 10_240;

/// How many requests one call of the command makes.
const REQUESTS: usize = 5_000;

/// How often a case of the conformance test is tried that fails by milliseconds.
const ATTEMPTS: usize = 4;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Only compare the sizes with those in examples/firmware/README.md, which are written otherwise
    #[arg(long)]
    pub check: bool,
    /// How many SDO requests are made one after the other
    #[arg(long, value_name = "NUMBER", default_value_t = 100_000)]
    pub round_trips: usize,
}

/// What runs in QEMU.
const PROGRAM: &str = "firmware-mps2";

/// A manager that runs there, too, and what it boots.
const MASTER: &str = "master-mps2";
const MACHINE: &str = "examples/firmware/mps2/machine.toml";

/// A test, and what it shows.
type Test = (&'static str, fn(&mut Bench<'_>) -> Result<(), String>);

const TESTS: [Test; 8] = [
    ("LSS gives it node-ID 5, and it stores it", get_a_node_id),
    ("scan finds it", be_scanned),
    ("check finds all entries as the data sheet has them", be_checked),
    ("10 kB go there and back in blocks", transfer_blocks),
    ("a lost heartbeat sets the outputs to their error values, and is over when it is back", lose_a_heartbeat),
    ("stored parameters outlast a restart, and defaults are restored", store_parameters),
    ("SDO requests are answered, one after the other", answer_requests),
    ("it passes the conformance test", conform),
];

/// Whether it can be run here; where not, the reason.
pub(crate) fn is_possible() -> Result<(), String> {
    qemu::is_installed().and_then(|()| target_is_installed())
}

pub(crate) fn run(root: &Path, arguments: &Arguments) -> Result<(), String> {
    if let Err(reason) = is_possible() {
        println!("skipped: firmware on a microcontroller: {reason}");
        return Ok(());
    }
    let lexican = outside::lexican(root)?;
    // The firmware of the other board is only linked, and not run.
    build(root, "firmware-stm32")?;
    let master = build(root, PROGRAM)?.with_file_name(MASTER);
    println!("test a master boots the machine that the command simulates, and enables its drive");
    let unused_by_master = boot_a_machine(root, &lexican, &master)?;
    on_bench(root, lexican, |bench| {
        bench.round_trips = arguments.round_trips;
        bench.run(&["eds", "lint", "--strict", EDS])?;
        for (name, test) in TESTS {
            println!("test {name}");
            let failed = |error| format!("the firmware: {name}: failed: {error}{}", bench.board.complaints());
            test(bench).map_err(failed)?;
        }
        let unused_stack = bench.number("2001")?;
        let programs = [("device", bench.board.elf, unused_stack), ("master", &master, unused_by_master)];
        sizes::run(root, &programs, arguments.check)
    })
}

/// Has the master boot the machine that the command simulates at its UART, until its drive is enabled; how much of its stack
/// is unused then.
fn boot_a_machine(root: &Path, lexican: &Path, elf: &Path) -> Result<u64, String> {
    let folder = outside::empty_folder(root, "firmware-master")?;
    let board = Board { elf, folder: &folder, icount: None, seconds: 60 };
    let mut running = board.start()?;
    let bus = format!("slcan:{}?bitrate=500000", running.terminal().display());
    let mut simulation = qemu::in_time(lexican);
    simulation
        .args(["simulate", "--json", MACHINE, "--bus", &bus])
        .current_dir(root)
        .stdin(Stdio::null())
        .stdout(Stdio::null());
    let mut simulation = simulation.spawn().map_err(|error| format!("lexican simulate: {error}"))?;
    let ended = running.wait();
    // It has ended already if it has noticed that the board is gone.
    let _ = simulation.kill().and_then(|()| simulation.wait());
    let failed = |what: &str| format!("the master: {what}{}", board.complaints());
    ended.map_err(|error| failed(&error))?;
    let printed = board.printed()?;
    for node in [5, 7] {
        if !printed.contains(&format!("node {node} has booted")) {
            return Err(failed(&format!("node {node} has not booted")));
        }
    }
    let unused = printed.split("feeder is enabled, ").nth(1).and_then(|rest| rest.split(' ').next()?.parse().ok());
    unused.ok_or_else(|| failed("the drive is not enabled"))
}

/// Has the conformance test write what it says of the firmware, as JSON. Cases may fail.
pub(crate) fn report(root: &Path, lexican: PathBuf, path: &Path) -> Result<(), String> {
    is_possible()?;
    on_bench(root, lexican, |bench| {
        get_a_node_id(bench)?;
        bench.test_conformance(&["--force", "--report", &path.to_string_lossy()]).map(drop)
    })
}

/// Builds the firmware, and starts it on a board without the flash of another run.
fn on_bench(
    root: &Path,
    lexican: PathBuf,
    work: impl FnOnce(&mut Bench<'_>) -> Result<(), String>,
) -> Result<(), String> {
    let elf = build(root, PROGRAM)?;
    let folder = outside::empty_folder(root, "firmware")?;
    let board = Board { elf: &elf, folder: &folder, icount: None, seconds: 1200 };
    work(&mut Bench { root, lexican, board: &board, running: board.start()?, round_trips: 0 })
}

/// Builds a program of `examples/firmware` for QEMU's board.
pub(crate) fn build(root: &Path, program: &str) -> Result<PathBuf, String> {
    // In the workspace's folder: what both depend on is compiled once.
    let folder = workspace::target_folder(root);
    let target = folder.to_string_lossy();
    let manifest = ["--manifest-path", "examples/firmware/Cargo.toml", "--target-dir", &target];
    let build = ["build", "--locked", "--release", "--target", TARGET, "-p", program];
    command::run_cargo(root, &[&build[..], &manifest].concat(), &[])?;
    Ok(folder.join(TARGET).join("release").join(program))
}

fn target_is_installed() -> Result<(), String> {
    workspace::has_target(TARGET)
        .then_some(())
        .ok_or_else(|| format!("{TARGET} is not installed: rustup target add {TARGET}"))
}

/// The board and the command at its UART.
struct Bench<'a> {
    root: &'a Path,
    lexican: PathBuf,
    board: &'a Board<'a>,
    running: Running,
    round_trips: usize,
}

impl Bench<'_> {
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = qemu::in_time(&self.lexican);
        command.args(arguments).current_dir(self.root);
        command
    }

    /// Runs the command; what it prints.
    fn run(&self, arguments: &[&str]) -> Result<String, String> {
        let output = command::output(&mut self.command(arguments))?;
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }

    fn bus(&self) -> String {
        format!("slcan:{}?bitrate=500000", self.running.terminal().display())
    }

    /// Runs the command on the board's bus.
    fn on_bus(&self, arguments: &[&str]) -> Result<String, String> {
        self.run(&[arguments, &["--bus", &self.bus()]].concat())
    }

    /// Runs the command with node 5, of this data sheet.
    fn on_node(&self, arguments: &[&str]) -> Result<String, String> {
        self.on_bus(&[arguments, &["--node", "5", "--device", EDS]].concat())
    }

    fn write(&self, object: &str, value: &str) -> Result<(), String> {
        self.on_node(&["write", object, value]).map(|_| ())
    }

    fn number(&self, object: &str) -> Result<u64, String> {
        let json = self.on_node(&["read", "--json", object])?;
        let value = json.split("\"value\":").nth(1).and_then(|rest| rest.split([',', '}']).next()?.parse().ok());
        value.ok_or_else(|| format!("{object} is no number: {json}"))
    }

    fn expect(&self, object: &str, expected: u64) -> Result<(), String> {
        let value = self.number(object)?;
        if value == expected { Ok(()) } else { Err(format!("{object} is {value}, not {expected}")) }
    }
}

fn get_a_node_id(bench: &mut Bench<'_>) -> Result<(), String> {
    bench.on_bus(&["lss", "node-id", "--unconfigured", "5", "--store"]).map(|_| ())
}

fn be_scanned(bench: &mut Bench<'_>) -> Result<(), String> {
    let nodes = bench.on_bus(&["scan"])?;
    if nodes.contains("node   5  CiA 401") { Ok(()) } else { Err(format!("it finds {nodes}")) }
}

fn be_checked(bench: &mut Bench<'_>) -> Result<(), String> {
    bench.on_bus(&["check", "5", "--device", EDS, "--write", "--domains"]).map(|_| ())
}

fn transfer_blocks(bench: &mut Bench<'_>) -> Result<(), String> {
    // 251 is prime: no two segments are the same.
    let bytes: Vec<String> = (0..BLOCK).map(|at| format!("{:02X}", at % 251)).collect();
    bench.write("2000", &bytes.concat())?;
    let read = bench.on_node(&["read", "--json", "2000"])?;
    if read.contains(&bytes.join(" ")) { Ok(()) } else { Err(format!("other bytes came back: {read}")) }
}

/// Node 1 is the manager, whose heartbeats this test sends itself: one, and after a while all the time.
fn lose_a_heartbeat(bench: &mut Bench<'_>) -> Result<(), String> {
    const HEARTBEAT: &str = "t701105\r";
    // In naps. The command is listening at the first of them, also on a busy machine; the heartbeat is lost between them.
    const FIRST: u32 = 100;
    const BACK: u32 = 300;
    bench.write("6200:01", "15")?;
    bench.write("1016:01", &(0x0001_0000 | 500).to_string())?;
    let mut monitor = bench.command(&["monitor", "--json", "--bus", &bench.bus(), "--for", "5s"]);
    let mut monitor = monitor.stdout(Stdio::piped()).spawn().map_err(|error| format!("monitor: {error}"))?;
    let mut naps = 0;
    while let Ok(None) = monitor.try_wait() {
        if naps == FIRST || naps >= BACK {
            bench.running.send(HEARTBEAT)?;
        }
        qemu::nap();
        naps += 1;
    }
    let output = monitor.wait_with_output().map_err(|error| format!("monitor: {error}"))?;
    let frames = String::from_utf8_lossy(&output.stdout).into_owned();
    let codes: Vec<&str> = frames.lines().filter_map(|line| line.split("\"code\":\"").nth(1)?.get(..4)).collect();
    if codes != ["8130", "0000"] {
        return Err(format!("the emergencies are not 8130 and 0000: {frames}"));
    }
    bench.expect("6200:01", 0)?;
    bench.write("1016:01", "0")
}

fn store_parameters(bench: &mut Bench<'_>) -> Result<(), String> {
    const SAVE: u32 = u32::from_le_bytes(*b"save");
    const LOAD: u32 = u32::from_le_bytes(*b"load");
    bench.write("1017", "500")?;
    bench.write("6207:02", "170")?;
    bench.write("1010:01", &SAVE.to_string())?;
    bench.write("1017", "700")?;
    bench.restart()?;
    bench.expect("1017", 500)?;
    bench.expect("6207:02", 170)?;
    bench.write("1011:01", &LOAD.to_string())?;
    bench.restart()?;
    bench.expect("1017", 0)?;
    bench.expect("6207:02", 0)
}

fn answer_requests(bench: &mut Bench<'_>) -> Result<(), String> {
    let mut left = bench.round_trips;
    while left > 0 {
        let now = left.min(REQUESTS);
        let answers = bench.on_node(&[&["read"][..], &vec!["1018:01"; now]].concat())?;
        let right = answers.lines().filter(|line| line.contains("= 19544")).count();
        if right != now {
            return Err(format!("{right} of {now} answers are right"));
        }
        left -= now;
    }
    println!("     {} requests", bench.round_trips);
    Ok(())
}

fn conform(bench: &mut Bench<'_>) -> Result<(), String> {
    let path = bench.board.folder.join("conform.json");
    let mut only = String::new();
    for attempt in 1..=ATTEMPTS {
        let json = path.to_string_lossy();
        let arguments = ["--force", "--report", &json, "--only", &only];
        let output = bench.test_conformance(&arguments[..if only.is_empty() { 3 } else { 5 }])?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        if let Some(sum) = text.lines().last() {
            println!("     {sum}");
        }
        if output.status.success() {
            return Ok(());
        }
        let seen = || format!("{text}{}", String::from_utf8_lossy(&output.stderr));
        let report = Report::read(&path).map_err(|error| format!("{error}\n{}", seen()))?;
        let failed: Vec<_> = report.cases.iter().filter(|case| case.verdict == "failed").collect();
        let may_be_late = !failed.is_empty() && failed.iter().all(|case| case.is_out_of_time());
        if attempt == ATTEMPTS || !may_be_late {
            return Err(seen());
        }
        failed.iter().for_each(|case| println!("     again: {}: {}", case.id, case.reason));
        only = failed.iter().map(|case| &*case.id).collect::<Vec<_>>().join(",");
    }
    Ok(())
}

impl Bench<'_> {
    /// Cuts the power, and gives it back.
    fn restart(&mut self) -> Result<(), String> {
        self.running.stop();
        self.running = self.board.start()?;
        Ok(())
    }

    /// Runs the conformance test, with further arguments.
    fn test_conformance(&self, further: &[&str]) -> Result<Output, String> {
        let bus = self.bus();
        let mut arguments = vec!["conform", "--bus", &bus, "5", "--device", EDS, "--allow", "all"];
        arguments.extend(["--emergency", "2002=0xCDAB3120", "--input", "2003=10", "2003=0", "6000:02"]);
        arguments.extend(further);
        self.command(&arguments).output().map_err(|error| format!("lexican conform: {error}"))
    }
}
