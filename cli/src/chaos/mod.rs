//! `lexican chaos`: judges what a program leaves behind that ends at a random moment.

mod program;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use lexican_conform::{About, Case, CaseReport, Ended, Level, Record, Report, Verdict};
use lexican_runtime::host::{BusUrl, Link, Pace, Participant};
use lexican_runtime::{Duration, Instant};
use lexican_simulation::Plant;
use lexican_simulation::chaos::{self, Act, Finding, Plan, Reference, Running, Settings, Trial, judge_file};
use lexican_toolbox::decode::Decoder;

use crate::bus::kind::{Kind, Simulated};
use crate::bus::pty::Ptys;
use crate::bus::{BusArgs, url};
use crate::conform::print;
use crate::conform::reports::{ReportArgs, about};
use crate::output::{Failure, Outcome, ctrl_c, note, stdout, styled};
use crate::simulate::PlantArgs;
use lexican_toolbox::text::duration::time;
use program::Program;

/// Disturb a program at random moments, and judge what it leaves behind
///
/// Runs any program against simulated devices: once undisturbed, then once for each seed. A seed decides what is done and at which
/// event of the bus: the program gets SIGTERM, SIGINT or SIGKILL, it is stopped for a while (SIGSTOP), its bus is cut, or
/// the devices lose their supply. Then each axis has to stand within its dead-man time and may not move again, and no axis may leave
/// its limits (607Dh). The program may not report success after a failure, or leave PDOs off, transfers open or files
/// half written.
///
/// The program gets the bus as LEXICAN_BUS, and in place of {bus}. It runs in real time, in a process group of its own, which
/// is ended with it. What the devices store is forgotten after each run.
///
/// Exit code 1 if something is found that must not be, 2 if the program fails undisturbed.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    plant: PlantArgs,

    /// The bus instead of a pseudo-terminal: a CAN interface such as vcan0, for programs that know no serial adapter (slcan)
    #[arg(long, value_name = "URL", value_parser = url)]
    bus: Option<BusUrl>,

    /// The first seed; without it, a new one, which is printed
    #[arg(long, value_name = "NUMBER")]
    seed: Option<u64>,

    /// How many seeds, one after the other
    #[arg(long, value_name = "TIMES", default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    runs: u64,

    /// How long the program may run before it is told to end, by SIGTERM
    #[arg(long = "for", value_name = "TIME", value_parser = time, default_value = "60s")]
    span: Duration,

    /// Within which time each drive has to stand when nothing commands it [default: that of the drive, else 2s]
    #[arg(long, value_name = "TIME", value_parser = time)]
    dead_man: Option<Duration>,

    /// A file that the program writes: it is to be as before or whole; may be given several times
    #[arg(long, value_name = "FILE")]
    writes: Vec<PathBuf>,

    /// Count what is only recommended as well
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    reports: ReportArgs,

    /// Print one JSON object per line: each run when it has ended, and the sum
    #[arg(long)]
    json: bool,

    /// The program and its arguments
    #[arg(last = true, required = true, value_name = "COMMAND")]
    command: Vec<String>,
}

const EXAMPLES: &str = "\
Examples:
    lexican chaos siko/ag03-1 --node 5 -- ./machine --bus {bus}
    lexican chaos machine.toml --runs 50 --report chaos.html -- ./machine --bus {bus}
    lexican chaos machine.toml --seed 17 --runs 1 -- ./machine --bus {bus}     (the same again)
    lexican chaos siko/ag03-1 --writes kept.txt -- lexican backup --bus {bus} 1 -o kept.txt --force
    lexican chaos FILE.eds --node 7 --bus vcan0 --for 20s -- python3 machine.py";

/// The interval of checking program and axes.
const LOOK: Duration = Duration::from_millis(2);
/// The requirement for all programs.
const REQUIREMENT: &str = "Each axis stands within its dead-man time and does not move again, nothing is left half done, and no \
    success is claimed that is none.";
/// If the computer is later than this, a run says nothing about times.
const TOO_LATE: Duration = Duration::from_millis(500);

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.reports.guard(|_| Ok(()))?;
    let files = args.writes.iter().map(|path| Written::of(path)).collect::<Result<Vec<_>, _>>()?;
    let stopped = ctrl_c()?;
    let first = args.seed.unwrap_or_else(fresh_seed);
    let end = first.checked_add(args.runs).ok_or_else(|| Failure::new("the seeds end at 18446744073709551615"))?;
    let mut lab = Lab { args, stopped: &stopped, files };
    let (reference, undisturbed) = lab.undisturbed()?;
    let mut report = Report::default();
    lab.show(&mut report, "chaos/undisturbed", "undisturbed".to_owned(), undisturbed)?;
    for seed in first..end {
        let plan = Plan::draw(seed, reference.moves);
        let Some(trial) = lab.disturbed(plan, &reference)? else {
            report.ended_early = Some(Ended::Cancelled);
            break;
        };
        lab.show(&mut report, &format!("chaos/{seed}"), plan.to_string(), trial)?;
    }
    lab.files.iter().try_for_each(Written::put_back)?;
    lab.write(&report)?;
    print::sum(&report, args.json)?;
    let tally = report.tally();
    let counted = tally.failed + if args.strict { tally.advised } else { 0 };
    if counted > 0 && !args.json {
        note("--seed NUMBER --runs 1 does the same again: the number is that of chaos/NUMBER");
    }
    Ok(if counted == 0 && report.ended_early.is_none() { Outcome::Clean } else { Outcome::Found })
}

fn fresh_seed() -> u64 {
    let elapsed = std::time::UNIX_EPOCH.elapsed().unwrap_or_default();
    // Few enough digits to type them again.
    (elapsed.as_millis() % 1_000_000) as u64
}

/// What all trials share.
struct Lab<'a> {
    args: &'a Args,
    stopped: &'a AtomicBool,
    files: Vec<Written>,
}

/// A trial that has run to its end.
struct Ran<'a> {
    running: Running<'a>,
    now: Instant,
    end: chaos::End,
    stderr: String,
}

impl Lab<'_> {
    /// New devices, without anything stored in the previous run.
    fn plant(&self) -> Result<(Plant, tempfile::TempDir), Failure> {
        let mut plant = self.args.plant.plant()?;
        let failed = |error| Failure::new(format_args!("cannot copy what a device stores: {error}"));
        let folder = tempfile::tempdir().map_err(failed)?;
        for (at, device) in plant.devices.iter_mut().enumerate() {
            let Some(file) = &mut device.eeprom else { continue };
            let copy = folder.path().join(at.to_string());
            if file.exists() {
                fs::copy(&*file, &copy).map_err(failed)?;
            }
            *file = copy;
        }
        Ok((plant, folder))
    }

    /// Runs the program; `None` after Ctrl-C.
    fn run<'p>(&self, plant: &'p Plant, planned: Option<(Plan, &'p Reference)>) -> Result<Option<Ran<'p>>, Failure> {
        self.files.iter().try_for_each(Written::put_back)?;
        let (link, url): (Box<dyn Link + Send>, String) = match &self.args.bus {
            None => {
                let ptys = Ptys::open(1)?;
                let url = ptys.urls().concat();
                (Box::new(ptys), url)
            }
            Some(url) if matches!(Kind::of(url).simulated, Simulated::Shared) => {
                (BusArgs::named(url.clone()).open(Pace::RealTime)?.link, url.to_string())
            }
            Some(url) => {
                return Err(Failure::new(format_args!("{url} is no bus that two programs share"))
                    .help("leave --bus out for a pseudo-terminal, or name a CAN interface such as vcan0"));
            }
        };
        let settings = Settings { span: self.args.span, dead_man: self.args.dead_man };
        let running = Running::new(link.now(), plant, settings, planned)?;
        let mut bus = Participant::new(link, running);
        let mut program = Program::start(&self.args.command, &url)?;
        loop {
            let until = bus.now() + LOOK;
            while bus.run(until)?.is_some() {}
            let now = bus.now();
            if self.stopped.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let has_ended = program.has_ended()?;
            match bus.node().poll(now, has_ended, now.since(until)) {
                Some(Act::Signal(signal)) => program.signal(signal),
                Some(Act::Over) => break,
                None => {}
            }
        }
        let (now, (end, stderr)) = (bus.now(), program.finish());
        Ok(Some(Ran { running: bus.into_parts().1, now, end, stderr }))
    }

    fn undisturbed(&mut self) -> Result<(Reference, Trial), Failure> {
        let (plant, _folder) = self.plant()?;
        let Some(ran) = self.run(&plant, None)? else { return Err(Failure::new("it was cancelled")) };
        for file in &mut self.files {
            file.whole = read(&file.path)?;
        }
        if let Some(code @ 1..) = ran.end.code {
            let last: Vec<&str> = ran.stderr.trim_end().lines().rev().take(5).collect();
            let last: String = last.iter().rev().map(|line| format!("    {line}\n")).collect();
            return Err(Failure::new(format_args!("undisturbed, the program ends with exit code {code}"))
                .help("it has to succeed on this plant before it can be disturbed; {bus} or LEXICAN_BUS is its bus")
                .after(last));
        }
        Ok(ran.running.into_reference(ran.now, ran.end))
    }

    fn disturbed(&self, plan: Plan, reference: &Reference) -> Result<Option<Trial>, Failure> {
        let (plant, _folder) = self.plant()?;
        let Some(Ran { running, now, end, .. }) = self.run(&plant, Some((plan, reference)))? else { return Ok(None) };
        let present = self.files.iter().map(|file| read(&file.path)).collect::<Result<Vec<_>, _>>()?;
        let judge_files = |claims_success| -> Vec<Finding> {
            let files = self.files.iter().zip(&present);
            files.filter_map(|(file, now)| file.judge(now.as_deref(), claims_success)).collect()
        };
        Ok(Some(running.conclude(now, &end, judge_files)))
    }

    /// Prints a trial, and adds it to the report.
    fn show(&self, report: &mut Report, id: &str, title: String, trial: Trial) -> Result<(), Failure> {
        let level = trial.findings.iter().map(|finding| finding.level).min();
        let level = if level == Some(chaos::Level::Should) { Level::Should } else { Level::Must };
        let reason = trial.findings.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
        let outcome = match (&*reason, trial.plan) {
            ("", Some(_)) if !trial.was_disturbed => {
                Err(Verdict::NotApplicable("the program had ended before".to_owned()))
            }
            ("", _) => Ok(()),
            _ if trial.late > TOO_LATE => {
                Err(Verdict::NotDecidable(format!("this computer was {} late: {reason}", trial.late)))
            }
            _ => Err(Verdict::Failed(reason)),
        };
        let frames = trial.frames.iter();
        let case = CaseReport {
            case: Case::judged_elsewhere(id.to_owned(), title, REQUIREMENT, level),
            outcome,
            took: trial.took,
            frames: frames.map(|it| Record { at: it.at, frame: it.frame, sent: it.sent }).collect(),
            known: None,
            expected: Vec::new(),
            measured: Vec::new(),
            notes: trial.notes,
        };
        let mut stdout = stdout();
        if self.args.json {
            writeln!(stdout, "{}", case.json())?;
        } else {
            let (verdict, reason) = (styled(print::style(&case), case.verdict()), case.outcome.as_ref().err());
            let reason = reason.map(|why| format!(": {}", why.reason())).unwrap_or_default();
            writeln!(stdout, "{verdict} {id} {}{reason}", case.case.title)?;
        }
        stdout.flush()?;
        report.cases.push(case);
        Ok(())
    }

    fn write(&self, report: &Report) -> Result<(), Failure> {
        if self.args.reports.is_empty() {
            return Ok(());
        }
        let plant = self.args.plant.plant()?;
        let mut decoder = Decoder::new();
        let nodes = plant.devices.iter().filter_map(|device| Some((device.node?, &device.sheet.device)));
        nodes.clone().for_each(|(node, device)| decoder.introduce(node, device));
        let about = About {
            device: format!("{} against {}", self.args.command.join(" "), self.args.plant.name()),
            node: nodes.map(|(node, _)| node.get()).next().unwrap_or_default(),
            data_sheet: self.args.plant.name().to_owned(),
            ..about([("plant", self.args.plant.name().to_owned())])
        };
        let document = report.document(about, |frame| decoder.decode(frame).words());
        self.args.reports.write(&document)
    }
}

/// A file that the program writes.
struct Written {
    path: PathBuf,
    before: Option<Vec<u8>>,
    /// The content after the undisturbed run.
    whole: Option<Vec<u8>>,
}

impl Written {
    fn of(path: &Path) -> Result<Self, Failure> {
        Ok(Written { path: path.to_owned(), before: read(path)?, whole: None })
    }

    /// Restores the content from before.
    fn put_back(&self) -> Result<(), Failure> {
        let put_back = match &self.before {
            Some(content) => fs::write(&self.path, content),
            None if self.path.exists() => fs::remove_file(&self.path),
            None => Ok(()),
        };
        put_back.map_err(|error| Failure::file("put back", &self.path, &error))
    }

    fn judge(&self, now: Option<&[u8]>, claims_success: bool) -> Option<Finding> {
        let name = self.path.display().to_string();
        judge_file(&name, self.before.as_deref(), self.whole.as_deref(), now, claims_success)
    }
}

/// The content of a file; `None` if it does not exist.
fn read(path: &Path) -> Result<Option<Vec<u8>>, Failure> {
    match fs::read(path) {
        Ok(content) => Ok(Some(content)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Failure::file("read", path, &error)),
    }
}
