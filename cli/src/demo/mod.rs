//! `lexican demo`: the two worked examples of the AG03/1's manual, from the first frame to the last.

mod bench;
mod checks;
mod console;
mod play;
mod plot;

use std::path::PathBuf;

use lexican_runtime::host::candump::Line;
use siko_ag03_1::worked_examples::{POSITIONING, VELOCITY};

use crate::device::Loaded;
use crate::output::{Failure, Outcome, write_all_whole};
use bench::Bench;
use console::Console;
use play::Played;

/// Runs the two worked examples of the SIKO AG03/1's manual against a simulated drive
///
/// Every frame of the manual's tables 25 (positioning) and 26 (velocity) goes over a bus inside the process,
/// byte for byte; every frame on the bus is printed with its time and in words. The run checks itself: exit
/// code 1 when anything is not as the manual says. Writes demo.svg (the motion as a picture) and demo.log (all
/// frames, as candump -L writes them).
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Run at the drive's own pace instead of as fast as possible
    #[arg(long)]
    realtime: bool,

    /// Where demo.svg and demo.log go
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

/// The data sheet by which frames are put into words.
const DEVICE: &str = "siko/ag03-1";
/// Named so that `canplayer -I demo.log` replays it where people try things out.
const INTERFACE: &str = "vcan0";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    std::fs::create_dir_all(&args.out).map_err(|error| Failure::file("create", &args.out, &error))?;
    let device = Loaded::named(DEVICE)?.device;
    let examples = [&POSITIONING, &VELOCITY];
    let rows = examples.iter().map(|example| example.rows.len()).sum();
    let mut bench = Bench::new(&device, Console::new(args.realtime, rows), args.realtime);
    let played = play::all(&mut bench, &examples)?;
    let recording = bench.finish();

    let checks = checks::all(&played, &recording);
    checks::print(&checks)?;
    write_files(args, &played, &recording)?;
    Ok(if checks.iter().all(|check| check.passed) { Outcome::Clean } else { Outcome::Found })
}

fn write_files(args: &Args, played: &[Played], recording: &bench::Recording) -> Result<(), Failure> {
    let courses: Vec<_> = played.iter().map(|played| played.course(&recording.samples)).collect();
    let picture = plot::svg("SIKO AG03/1, node 5: the worked examples of the manual", &courses);
    let picture = picture.map_err(|error| Failure::new(format_args!("cannot draw the picture: {error}")))?;
    let line = |&(at, frame)| Line { at, interface: INTERFACE.to_owned(), frame }.to_string() + "\n";
    let log: String = recording.frames.iter().map(line).collect();
    write_all_whole(&[(args.out.join("demo.svg"), picture.into_bytes()), (args.out.join("demo.log"), log.into_bytes())])
}
