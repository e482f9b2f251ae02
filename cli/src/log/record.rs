//! `lexican record`: the frames of a bus in a file.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::UNIX_EPOCH;

use indicatif::{DecimalBytes, ProgressBar};
use lexican_runtime::host::{Link, LinkError, Listener, Pace, Pump, Turn};
use lexican_runtime::{Duration, Frame, Instant};
use lexican_toolbox::bus::cob_ids::CobIds;
use lexican_toolbox::log::{Direction, Files, Format, Limits, Record, Writer};
use lexican_toolbox::text::files::Existing;
use serde_json::json;

use super::{format_of, frames, is_pipe, size, write_failure};
use crate::bus::{Bus, BusArgs};
use crate::output::{Failure, ForceArgs, Outcome, ctrl_c, missing_frames, note, print_result, warn};
use lexican_toolbox::text::duration::time;

/// Record the frames of a bus in a file
///
/// Runs until it is interrupted (Ctrl-C or SIGTERM), or until a log ends. Nothing is sent. The format follows from the
/// file's extension, unless it is named. If the command is killed, the frames of the last fifth
/// of a second are lost at most. Exit code 1 if frames are missing, because they came faster than they could be written.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// The file to be written; - for stdout
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    #[command(flatten)]
    force: ForceArgs,

    #[arg(long, value_name = "FORMAT", help = format!("The format: {}", Format::names()))]
    to: Option<Format>,

    /// Only these COB-IDs, in hexadecimal: 185,280-28F; with eight digits for extended ones
    #[arg(long, value_name = "COB-IDS")]
    cob_id: Option<CobIds>,

    /// None of these COB-IDs
    #[arg(long, value_name = "COB-IDS")]
    except: Option<CobIds>,

    /// Stop after this time
    #[arg(long = "for", value_name = "TIME", value_parser = time)]
    span: Option<Duration>,

    /// Stop after so many frames
    #[arg(long, value_name = "N")]
    count: Option<u64>,

    /// Begin another file whenever one has this size: 10M makes FILE-0001.log, FILE-0002.log and so on
    #[arg(long, value_name = "SIZE", value_parser = size)]
    split_size: Option<u64>,

    /// Delete the oldest of these files while all of them are larger than this
    #[arg(long, value_name = "SIZE", value_parser = size, requires = "split_size")]
    max_size: Option<u64>,

    /// Print the result as one JSON object, if FILE is not stdout
    ///
    /// It has frames, seconds, bytes, missing and file, the last one that was written.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican record --bus can0 -o bus.log
    lexican record --bus can0 -o bus.blf --for 1min
    lexican record --bus can0 -o bus.pcapng --split-size 100M --max-size 1G
    lexican record --bus can0 -o - --to pcap | wireshark -k -i -";

/// How long frames may wait to be written; also the interval of showing the progress.
const FLUSH: Duration = Duration::from_millis(200);
/// How soon the command reacts to an interruption.
const LOOK: Duration = Duration::from_millis(100);

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let format = format_of(&args.output, args.to, "--to")?;
    // Refuse to replace the log that is being read.
    let is_read = Existing::Replace.guard(&args.output, args.bus.log_file());
    is_read.map_err(|error| Failure::file("write", &args.output, &error))?;
    let stop = ctrl_c()?;
    let pace = if args.span.is_some() { Pace::Virtual } else { Pace::RealTime };
    let Bus { mut link, .. } = args.bus.open(pace)?;
    let limits = Limits { file: args.split_size, all: args.max_size };
    let files = if is_pipe(&args.output) {
        Files::stream(Writer::new(io::stdout(), format), format)
    } else {
        Files::create(&args.output, format, limits, args.force.existing())
            .map_err(|error| Failure::file("write", &args.output, &error))?
    };
    let recorder = Recorder {
        args,
        files,
        interface: args.bus.interface().into(),
        // A log has its own times.
        origin: if args.bus.is_log() { Duration::ZERO } else { since_1970() - (link.now() - Instant::ZERO) },
        begin: link.now(),
        flushed: link.now(),
        frames: 0,
        shown: 0,
        missing: 0,
        progress: ProgressBar::new_spinner(),
    };
    recorder.record(&mut *link, &stop)
}

#[expect(clippy::disallowed_methods, reason = "a recording has the time of day")]
fn since_1970() -> Duration {
    std::time::SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().into()
}

struct Recorder<'a> {
    args: &'a Args,
    files: Files,
    interface: Arc<str>,
    /// Added to the times of the link.
    origin: Duration,
    begin: Instant,
    flushed: Instant,
    frames: u64,
    /// The number of frames when the progress was last shown.
    shown: u64,
    missing: u64,
    progress: ProgressBar,
}

impl Recorder<'_> {
    fn record(mut self, link: &mut dyn Link, stop: &AtomicBool) -> Result<Outcome, Failure> {
        let (mut pump, end) = (Pump::new(), self.args.span.map(|span| link.now() + span));
        // In virtual time, waiting takes no time.
        let step = if link.is_real_time() { LOOK } else { Duration::from_secs(3600) };
        while !stop.load(Ordering::Relaxed) && self.args.count.is_none_or(|count| self.frames < count) {
            let until = end.unwrap_or(Instant::MAX).min(link.now() + step);
            match pump.turn(link, &mut Listener, until) {
                Ok(Turn::Event(frame)) => self.frame(link.now(), frame)?,
                Ok(Turn::Bus(state)) => warn(format_args!("the bus is {state}")),
                Ok(Turn::Gap(frames)) => {
                    self.missing += u64::from(frames);
                    warn(missing_frames(frames));
                }
                Ok(Turn::Idle | Turn::Over) => {}
                Err(LinkError::Ended) => break,
                Err(error) => {
                    // Keep what was received before the error.
                    self.files.finish().map_err(|error| write_failure(&self.args.output, error))?;
                    return Err(error.into());
                }
            }
            self.settle(link.now())?;
            if end.is_some_and(|end| link.now() >= end) {
                break;
            }
        }
        let span = link.now() - self.begin;
        self.finish(span)
    }

    fn frame(&mut self, now: Instant, frame: Frame) -> Result<(), Failure> {
        let (id, Args { cob_id, except, .. }) = (frame.id(), self.args);
        if cob_id.as_ref().is_some_and(|ids| !ids.contains(id)) || except.as_ref().is_some_and(|ids| ids.contains(id)) {
            return Ok(());
        }
        let at = now + self.origin;
        let record = Record { at, interface: Arc::clone(&self.interface), direction: Direction::Received, frame };
        self.frames += 1;
        self.files.write(&record).map_err(|error| write_failure(&self.args.output, error))
    }

    /// Writes frames that have waited long enough.
    fn settle(&mut self, now: Instant) -> Result<(), Failure> {
        let passed = now - self.flushed;
        if passed < FLUSH {
            return Ok(());
        }
        self.flushed = now;
        self.files.flush().map_err(|error| write_failure(&self.args.output, error))?;
        let rate = (self.frames - self.shown) as f64 / passed.as_secs_f64();
        self.shown = self.frames;
        let bytes = DecimalBytes(self.files.written());
        self.progress.set_message(format!("{}, {rate:.0}/s, {bytes}", frames(self.frames)));
        Ok(())
    }

    fn finish(self, span: Duration) -> Result<Outcome, Failure> {
        self.progress.finish_and_clear();
        let Recorder { args, files, frames: count, missing, .. } = self;
        let (path, mut bytes) = (files.path(), files.written());
        let before = bytes;
        files.finish().map_err(|error| write_failure(&args.output, error))?;
        if let Ok(data) = std::fs::metadata(&path) {
            // The end that `finish` writes counts as well.
            bytes = before.max(data.len());
        }
        let fields = json!({ "frames": count, "seconds": span.as_secs_f64(), "bytes": bytes,
            "missing": missing, "file": path.display().to_string() });
        let seconds = span.as_secs_f64();
        let mut text = format!("{} in {seconds:.1} s, {}: {}", frames(count), DecimalBytes(bytes), path.display());
        if missing > 0 {
            text += &format!("; {missing} are missing");
        }
        if is_pipe(&args.output) {
            note(text.trim_end_matches(": "));
        } else {
            print_result(args.json, fields, text)?;
        }
        Ok(if missing > 0 { Outcome::Found } else { Outcome::Clean })
    }
}
