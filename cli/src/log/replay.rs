//! `lexican replay`: sends the frames of a log to a bus.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;
use lexican_runtime::host::{Incoming, Link, Pace};
use lexican_runtime::{Duration, Instant};
use lexican_toolbox::log::{Format, Skipped};
use serde_json::json;

use super::{SelectionArgs, factor, frames, is_pipe, open, remark_on};
use crate::bus::{Bus, BusArgs, let_leave};
use crate::output::{Failure, Outcome, ctrl_c, print_result, warn};

/// Send the frames of a log to a bus, in the time of the log
///
/// A log contains the commands of its machine, and they command again: NMT commands, SDO writes, RPDOs and SYNC MOVE DRIVES that are on
/// the bus, and the boot-up messages and heartbeats of nodes that are there appear twice. On a bus with machines, leave them out,
/// or replay at another bus. A program that only listens needs no bus: `--bus log:FILE`, with any command, receives
/// the frames of a log of every format.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The log, of any format; - for stdin
    #[arg(value_name = "FILE")]
    file: PathBuf,

    #[command(flatten)]
    bus: BusArgs,

    #[arg(long, value_name = "FORMAT", help = format!("The format of the log: {}", Format::kinds()))]
    from: Option<Format>,

    #[command(flatten)]
    selection: SelectionArgs,

    /// The speed, as a multiple of that of the recording
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = factor)]
    speed: f64,

    /// As fast as the bus takes the frames
    #[arg(long, conflicts_with = "speed")]
    fast: bool,

    /// Repeat the log this many times; without a number until the command is interrupted
    #[arg(long = "loop", value_name = "N", num_args = 0..=1, default_missing_value = "18446744073709551615")]
    passes: Option<u64>,

    /// Print the result as one JSON object
    ///
    /// It has frames, passes, seconds, and late_ms: by how much a frame was sent too late at most.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican replay bus.log --bus vcan0
    lexican replay bus.blf --bus vcan0 --speed 10 --loop
    lexican replay bus.asc --bus can0 --cob-id 181-1FF,281-2FF           (TPDOs alone)
    lexican replay bus.asc --bus can0 --except 000,080,200-27F,300-37F,400-47F,500-57F,600-67F
    lexican monitor --bus log:bus.blf?pace=real";

/// How soon the command reacts to an interruption.
const LOOK: Duration = Duration::from_millis(100);

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if is_pipe(&args.file) && args.passes.is_some() {
        return Err(Failure::new("stdin can be read once only: --loop needs a file"));
    }
    if !is_pipe(&args.file) {
        // Report a missing log before touching the bus.
        open(&args.file, args.from)?;
    }
    let stop = ctrl_c()?;
    let Bus { link, .. } = args.bus.open(Pace::RealTime)?;
    let begin = link.now();
    let mut replay = Replay { args, link, sent: 0, late: Duration::ZERO, skipped: Skipped::default() };
    let (mut passes, progress) = (0, ProgressBar::new_spinner());
    while passes < args.passes.unwrap_or(1).max(1) && !stop.load(Ordering::Relaxed) {
        let before = replay.sent;
        replay.pass(&stop, &progress)?;
        passes += 1;
        if replay.sent == before {
            break;
        }
    }
    progress.finish_and_clear();
    let_leave(&mut replay.link)?;
    let span = replay.link.now() - begin;
    remark_on(replay.skipped);
    let (sent, late) = (replay.sent, replay.late.as_secs_f64() * 1e3);
    let seconds = span.as_secs_f64();
    let fields = json!({ "frames": sent, "passes": passes, "seconds": seconds, "late_ms": late });
    let text = format!("{} in {seconds:.1} s, at most {late:.1} ms late", frames(sent));
    print_result(args.json, fields, text)?;
    Ok(Outcome::Clean)
}

struct Replay<'a> {
    args: &'a Args,
    link: Box<dyn Link + Send>,
    sent: u64,
    /// The greatest delay of a frame.
    late: Duration,
    /// What each pass leaves out.
    skipped: Skipped,
}

impl Replay<'_> {
    /// Sends the log once.
    fn pass(&mut self, stop: &AtomicBool, progress: &ProgressBar) -> Result<(), Failure> {
        let (mut reader, _) = open(&self.args.file, self.args.from)?;
        let (selection, mut start, mut first) = (self.args.selection.selection(), None, None);
        for record in reader.by_ref() {
            let record = record?;
            if stop.load(Ordering::Relaxed) {
                break;
            }
            if !selection.contains(&record, *start.get_or_insert(record.at)) {
                continue;
            }
            let (begin, origin) = *first.get_or_insert((self.link.now(), record.at));
            if !self.args.fast {
                let passed = (record.at - origin).as_micros() as f64 / self.args.speed;
                let due = begin + Duration::from_micros(passed as u64);
                self.wait(due, stop)?;
                self.late = self.late.max(self.link.now() - due);
            } else if self.sent.is_multiple_of(64) {
                // Drain received frames. On a virtual bus, time passes while listening.
                let now = self.link.now();
                self.receive(now)?;
            }
            if stop.load(Ordering::Relaxed) {
                break;
            }
            self.link.send(&record.frame)?;
            self.sent += 1;
            progress.set_message(frames(self.sent));
        }
        self.skipped = reader.skipped();
        Ok(())
    }

    fn wait(&mut self, due: Instant, stop: &AtomicBool) -> Result<(), Failure> {
        while self.link.now() < due && !stop.load(Ordering::Relaxed) {
            let until = due.min(self.link.now() + LOOK);
            self.receive(until)?;
        }
        Ok(())
    }

    /// Waits for one frame until `until`, and drops it.
    fn receive(&mut self, until: Instant) -> Result<(), Failure> {
        if let Some(Incoming::State(state)) = self.link.receive(until)? {
            warn(format_args!("the bus is {state}"));
        }
        Ok(())
    }
}
