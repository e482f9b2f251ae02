//! Two servo drives, x and y, follow a circle in cyclic synchronous position mode.
//!
//! ```text
//! path      the circle, as set-points of each cycle
//! recorder  what the axes were sent and where they were, cycle by cycle
//! plot      the same as a picture
//! ```

mod path;
mod plot;
mod recorder;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use kollmorgen_akd::driver::FreeDrive;
use lexican_driver::cyclic::{AxisSettings, Follower, Report, Settings, Stop, follow};
use lexican_driver::{CancelHandle, Mode};
use lexican_eds::Source;
use lexican_machine::{Files, Machine};
use lexican_runtime::host::{self, BusUrl, Link};
use lexican_runtime::{Duration, NodeId};
use lexican_simulation::Plant;

use path::Circle;
use recorder::{Recorder, Recording};

/// Follow a circle with two servo drives, by SYNC
///
/// The axes begin where they stand, which is the lowest point of the circle. Exits with 0 if it has been followed to its end,
/// with 1 if the axes were stopped before, and with 2 if nothing has moved because something was wrong.
#[derive(Parser)]
#[command(version)]
struct Args {
    /// The machine, whose nodes x and y are the axes; that of this example without it
    machine: Option<PathBuf>,

    /// The bus: can0, or slcan:/dev/ttyACM0?bitrate=1000000. Without it, both drives are simulated
    #[arg(long, value_name = "URL")]
    bus: Option<BusUrl>,

    /// From one SYNC to the next, in milliseconds
    #[arg(long, value_name = "MS", default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=10))]
    period: u64,

    #[command(flatten)]
    circle: Circle,

    /// How the axes are stopped before the end: together along the circle, or each by its quick stop
    #[arg(long, value_enum, default_value_t)]
    stop: Way,

    /// Stop after so many seconds on the circle
    #[arg(long, value_name = "SECONDS")]
    stop_at: Option<f64>,

    /// Draw the circle as it was followed into this file, as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// How fast the time of simulated drives passes
    #[arg(long, value_enum, default_value_t, conflicts_with = "bus")]
    pace: Pace,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Way {
    #[default]
    Ramp,
    Quick,
}

/// How fast simulated time passes.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum Pace {
    /// As fast as the machine can compute it
    #[default]
    Virtual,
    /// As fast as on a real machine, to watch
    Real,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

/// Whether the circle was completed; an error if nothing has moved.
fn run(args: &Args) -> Result<bool, String> {
    let machine = match &args.machine {
        Some(path) => Machine::open(path).map_err(|error| error.to_string())?,
        None => Machine::parse(Source::new("machine.toml", include_str!("../machine.toml")), Files::Embedded(&[])),
    };
    let machine = machine.sound().map_err(|error| error.to_string())?;
    let nodes = [node(&machine, "x")?, node(&machine, "y")?];
    let mut link = open(args, &machine)?;
    let period = Duration::from_millis(args.period);
    // The limits of the axes: somewhat more than the circle needs.
    let max_step = (args.circle.greatest_step(period) * 1.5) as u32 + 1;
    let settings = AxisSettings::new(Mode::CyclicPosition, period, max_step);
    let mut axes = Vec::new();
    for node in nodes {
        let axis = FreeDrive::connect_unprotected(&mut link, node).and_then(|mut drive| drive.prepare_cyclic(settings));
        axes.push(axis.map_err(|error| format!("node {node}: {error}"))?);
    }
    let start = [axes[0].position(), axes[1].position()];
    let cancel = CancelHandle::default();
    let signal = cancel.clone();
    // Called for SIGINT and SIGTERM.
    ctrlc::set_handler(move || signal.cancel()).map_err(|error| error.to_string())?;
    let mut recorder = Recorder::new(link, &axes);
    let path = args.circle.path(start, period, args.stop_at, cancel.clone());
    let stop = match args.stop {
        Way::Ramp => Stop::Ramp(Duration::from_millis(300)),
        Way::Quick => Stop::Quick,
    };
    let settings = Settings { stop, ..Settings::default() };
    eprintln!("x is node {}, y is node {}; Ctrl-C stops both", nodes[0], nodes[1]);
    let mut follower = Follower::new(axes, path, settings).map_err(|error| error.to_string())?;
    let report = follow(&mut recorder, &mut follower, &cancel).map_err(|error| error.to_string())?;
    let recording = recorder.finish(start, args.circle.radius);
    print(&report, &recording);
    // In simulated time, SYNC is never late.
    if let (Some(_), Some([least, median, most_of, greatest])) = (&args.bus, recording.periods()) {
        println!(
            "from SYNC to SYNC: {least:.3} ms at least, median {median:.3} ms, 99 % within {most_of:.3} ms, {greatest:.3} ms at most"
        );
    }
    if let Some(path) = &args.plot {
        std::fs::write(path, plot::svg(summary(args, &report), &recording))
            .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    }
    Ok(report.reason.is_none())
}

/// The node-ID of an axis.
fn node(machine: &Machine, name: &str) -> Result<NodeId, String> {
    let id = machine.node(name).and_then(|node| node.id);
    id.ok_or_else(|| format!("{}: there is no node {name:?} with a node-ID", machine.input.eds.name()))
}

/// Opens the named bus, or a simulation of the machine.
fn open(args: &Args, machine: &Machine) -> Result<Box<dyn Link>, String> {
    if let Some(url) = &args.bus {
        return Ok(url.open().map_err(|error| format!("cannot open {url}: {error}"))?);
    }
    let pace = match args.pace {
        Pace::Virtual => host::Pace::Virtual,
        Pace::Real => host::Pace::RealTime,
    };
    let link = Plant::of_machine(machine).and_then(|plant| plant.link(pace));
    Ok(Box::new(link.map_err(|error| error.to_string())?))
}

/// The result in one line.
fn summary(args: &Args, report: &Report) -> String {
    match (report.reason, args.stop) {
        (Some(reason), Way::Ramp) => format!("both axes are stopped, along the circle: {reason}"),
        (Some(reason), Way::Quick) => format!("both axes are stopped, each by its quick stop: {reason}"),
        (None, _) => format!("followed to its end, with a SYNC every {} ms", args.period),
    }
}

fn print(report: &Report, recording: &Recording) {
    println!("{report}");
    println!("farthest from the circle: {:.1} increments", recording.farthest());
}
