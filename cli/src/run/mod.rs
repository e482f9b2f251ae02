//! `lexican run`: a sequence of the command's own lines, in one process and on one bus.

mod line;
mod wait;

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use lexican_runtime::host::{Link, Pace};
use lexican_toolbox::text::files::read;
use serde_json::json;

use crate::bus::{BusArgs, share};
use crate::machine::{found, sound_on_bus};
use crate::output::{Failure, Outcome, ctrl_c, plural, print_result};
pub(crate) use line::{Context, Line, Lines, Shell};

/// Run a sequence: a file of the command's own lines, without `lexican`
///
/// All lines are understood before the first one runs: names, options, orders. One bus is open for all of them. A line that fails, or
/// finds something (exit code 1), ends the sequence. However it ends, also by Ctrl-C or a crash, every drive of the machine and of the
/// sequence is told to stop, and the command says so if one could not be.
///
/// Besides the commands there is `wait`: for a time, or until an object of a node of the machine has a value. Exit code: that of the line
/// that has ended it, or 0; 2 also if a drive could not be told to stop.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: BusArgs,

    /// Print one JSON object per line, also by the commands that can
    #[arg(long)]
    json: bool,

    /// The sequence
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
    lexican run morning.seq
    lexican run morning.seq --bus sim --json

A sequence:
    # The first piece of the day
    boot
    drive feeder move-to 50 mm --enable
    wait io.6000:01 = 1 within 2 s
    wait 500 ms
    check feeder";

pub(crate) fn run(args: &Args, shell: Shell) -> Result<Outcome, Failure> {
    let source = read(&args.file)?;
    let machine = found(None).and_then(|path| sound_on_bus(&path)).ok();
    let context = Context { shell, bus: BusArgs::named(args.bus.url().clone()), as_json: args.json, machine };
    let lines = Lines::read(&source, &context)
        .map_err(|wrong| Failure::new("the sequence cannot run: nothing was done").after(wrong + "\n"))?;
    let interrupted = ctrl_c()?;
    share();
    let clock = args.bus.open(Pace::Virtual)?.settled()?.link;
    let seconds = |clock: &dyn Link| clock.now().as_micros() as f64 / 1e6;
    let (begun, mut done) = (seconds(&*clock), 0);
    let mut result = Ok(Outcome::Clean);
    for line in &lines.steps {
        let at = seconds(&*clock) - begun;
        let object = json!({ "event": "line", "line": line.number, "text": line.text, "time": at });
        print_result(args.json, object, format_args!("{at:>10.3}  {}: {}", line.number, line.text))?;
        result = line.step.carry_out(&context, &interrupted);
        if interrupted.load(Ordering::Relaxed) {
            result = Err(Failure::new("interrupted"));
        }
        if !matches!(result, Ok(Outcome::Clean)) {
            break;
        }
        done += 1;
    }
    let mut unstopped = Vec::new();
    for (who, stop) in lines.stops {
        if let Err(failure) = stop.carry_out(&context, &interrupted) {
            failure.report();
            unstopped.push(who);
        }
    }
    let took = seconds(&*clock) - begun;
    let all = lines.steps.len();
    let ended = match (&result, lines.steps.get(done)) {
        (Ok(Outcome::Clean), _) | (_, None) => format!("{} in {took:.3} s", plural(all, "line")),
        (_, Some(line)) => {
            format!("{}:{} has ended it after {took:.3} s: {}", args.file.display(), line.number, line.text)
        }
    };
    let object = json!({
        "event": "summary", "lines": all, "done": done, "time": took, "unstopped": unstopped,
        "outcome": result.as_ref().map_or(2, |outcome| *outcome as u8),
    });
    print_result(args.json, object, &ended)?;
    if !unstopped.is_empty() {
        let who = unstopped.join(", ");
        return Err(
            Failure::new(format_args!("MAY STILL BE MOVING: {who} could not be told to stop")).help("see above")
        );
    }
    result
}
