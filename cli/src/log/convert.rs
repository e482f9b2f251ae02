//! `lexican convert`: a log in another format.

use std::io;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::atomic::Ordering;

use indicatif::{DecimalBytes, ProgressBar};
use lexican_runtime::Instant;
use lexican_toolbox::log::{Facts, Format, UnknownFormat, Writer, parse_time};
use serde_json::json;

use super::{SelectionArgs, format_of, frames, is_pipe, open, remark_on, trace, write_failure};
use crate::output::{Failure, ForceArgs, Outcome, ctrl_c, print_result, progress};

/// Convert a log into another format, or into a trace for `conform`
///
/// The format of IN is recognised by what is in it, that of OUT by its extension. Frames of CAN FD and error frames are
/// left out. What each format keeps of a frame is said below; a channel is a number instead of a name, and a date without its time
/// zone is read and written as UTC.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", kept()))]
pub(crate) struct Args {
    /// The log; - for stdin
    #[arg(value_name = "IN")]
    input: PathBuf,

    /// The file to be written; - for stdout
    #[arg(value_name = "OUT")]
    output: PathBuf,

    #[command(flatten)]
    force: ForceArgs,

    #[arg(long, value_name = "FORMAT", help = format!("The format of IN: {}", Format::kinds()))]
    from: Option<Format>,

    /// The format of OUT, one of those below; or trace, for `conform`
    ///
    /// A trace (OUT.csv) has what was sent to one device, and what the device answered: `lexican conform --trace` asks a device by it.
    /// What cannot be the same again is left open (x): times, counters, and what --device says is measured, else what CiA 301
    /// and 402 say is. Heartbeats, emergencies and PDOs may come at any time.
    #[arg(long, value_name = "FORMAT")]
    to: Option<Target>,

    #[command(flatten)]
    traced: trace::Traced,

    #[command(flatten)]
    selection: SelectionArgs,

    /// Shift all times, so that the first frame of OUT is at this time: 2026-09-30T15:06:13Z, or seconds since 1970
    #[arg(long, value_name = "WHEN", value_parser = parse_time)]
    begin: Option<Instant>,

    /// Print the result as one JSON object, if OUT is a file
    ///
    /// It has frames, bytes, from, to, and what was left out: fd, errors, other and cut.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican convert bus.log bus.pcapng
    lexican convert bus.blf bus.asc --cob-id 185,705 --after 10s --before 20s
    candump -ta can0 | lexican convert - - --to pcap | wireshark -k -i -
    lexican convert trace.trc bus.log --begin 2026-09-30T15:06:13Z
    lexican convert bus.log acceptance.csv --to trace --node 5 --device siko/ag03-1";

/// What each format keeps, one line each.
fn kept() -> String {
    let line = |format: Format| {
        let Facts { times, interface, direction, .. } = format.facts();
        format!("\n    {format:<8} {times}; {interface}; {direction}")
    };
    format!(
        "Formats, and what they keep of times; interfaces; who has sent a frame:{}",
        Format::all().map(line).collect::<String>()
    )
}

/// The target of a conversion.
#[derive(Clone, Copy, Debug)]
enum Target {
    Log(Format),
    Trace,
}

impl FromStr for Target {
    type Err = UnknownFormat;

    fn from_str(text: &str) -> Result<Self, UnknownFormat> {
        if text == "trace" { Ok(Target::Trace) } else { text.parse().map(Target::Log) }
    }
}

/// The number of frames between two updates of the progress bar.
const STEP: u64 = 1 << 14;

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let Args { input, output, .. } = args;
    let is_csv = output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
    let to = match args.to {
        Some(Target::Trace) => None,
        None if is_csv => None,
        None => Some(format_of(output, None, "--to")?),
        Some(Target::Log(format)) => Some(format),
    };
    if !is_pipe(output) {
        args.force.guard(output, [input.as_path()])?;
    }
    let (mut reader, size) = open(input, args.from)?;
    let Some(to) = to else {
        if args.begin.is_some() {
            return Err(Failure::new("a trace has no times of day").help("leave --begin out"));
        }
        return trace::run(&args.traced, reader, &args.selection.selection(), output, &args.force, args.json);
    };
    args.traced.belong_to_a_trace()?;
    let mut writer = if is_pipe(output) {
        Writer::new(io::stdout(), to)
    } else {
        let existing = args.force.existing();
        // Write a pipe's frames as they come, so that an interruption does not lose them.
        let writer = match size {
            Some(_) => Writer::create_whole(output, to, existing),
            None => Writer::create(output, to, existing),
        };
        writer.map_err(|error| Failure::file("write", output, &error))?
    };
    let interrupted = if size.is_some() { Some(ctrl_c()?) } else { None };
    let progress = size.map_or_else(ProgressBar::new_spinner, |size| {
        progress("{bar:40} {decimal_bytes} of {decimal_total_bytes}, {elapsed} {msg}", size)
    });
    let (selection, mut begin, mut first) = (args.selection.selection(), None, None);
    let (mut read, mut written) = (0, 0);
    while let Some(record) = reader.next() {
        let mut record = record?;
        if interrupted.as_ref().is_some_and(|interrupted| interrupted.load(Ordering::Relaxed)) {
            return Err(Failure::new(format_args!("interrupted; {} is as it was", output.display())));
        }
        read += 1;
        if read % STEP == 0 {
            progress.set_position(reader.position());
            progress.set_message(frames(read));
        }
        if !selection.contains(&record, *begin.get_or_insert(record.at)) {
            continue;
        }
        if let Some(begin) = args.begin {
            record.at = begin + record.at.since(*first.get_or_insert(record.at));
        }
        writer.write(&record).map_err(|error| write_failure(output, error))?;
        written += 1;
        // Pass on a log that is still being written without delay.
        if size.is_none() && is_pipe(output) && read % 64 == 0 {
            writer.flush().map_err(|error| write_failure(output, error))?;
        }
    }
    let bytes = writer.written();
    writer.finish().map_err(|error| write_failure(output, error))?;
    progress.finish_and_clear();
    let skipped = reader.skipped();
    remark_on(skipped);
    if is_pipe(output) {
        return Ok(Outcome::Clean);
    }
    let bytes = std::fs::metadata(output).map_or(bytes, |data| data.len());
    let fields = json!({ "frames": written, "bytes": bytes, "from": reader.format().to_string(),
        "to": to.to_string(), "fd": skipped.fd, "errors": skipped.errors, "other": skipped.other, "cut": skipped.cut });
    let text = format!("{}: {}, {}", output.display(), frames(written), DecimalBytes(bytes));
    print_result(args.json, fields, text)?;
    Ok(Outcome::Clean)
}
