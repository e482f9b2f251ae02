//! `lexican simulate`: a device that exists only in software, on a real bus.

mod control;
mod device;
mod report;
mod session;

#[cfg(unix)]
use std::io::IsTerminal;
use std::io::{BufRead, Read};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

use lexican_runtime::Duration;
use lexican_runtime::host::{BusUrl, Link, Pace};

use crate::bus::simulation::has_simulator;
use crate::bus::{BusArgs, NodeOrNone};
use crate::device::DeviceArgs;
use crate::duration::seconds;
use crate::output::{Failure, Outcome};
use device::Simulated;
use report::Report;
use session::Session;

/// Simulate a device on a bus
///
/// Any data sheet becomes a node: its defaults are the values, what is written is kept, access rights and limits
/// are enforced, PDOs, heartbeat and EMCY are alive. The SIKO AG03/1 also moves. Runs until it is interrupted.
///
/// Without --bus it makes pseudo-terminals that act as serial adapters, so that every other command can be tried
/// on any machine: it prints what to name as their --bus.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES, after_long_help = LONG_HELP)]
pub(crate) struct Args {
    #[command(flatten)]
    device: DeviceArgs,

    /// The bus: can0, slcan:/dev/ttyACM0?bitrate=500000, or pty for a bus of pseudo-terminals
    ///
    /// pty makes two, so that one can watch while the other acts; pty:4 makes four.
    #[arg(long, value_name = "URL", default_value = "pty")]
    bus: Place,

    /// The node-ID, 1 to 127; none for a device that waits for LSS to give it one
    #[arg(long, value_name = "ID", default_value = "1")]
    node: NodeOrNone,

    /// Keep stored parameters in a file, as a device does in its EEPROM
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,

    /// What happens to a simulated drive, and when: faults, supply, temperature, a blocked shaft (TOML)
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,

    /// Stop after so many seconds
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    span: Option<Duration>,

    /// Tell of reads and PDOs, too
    #[arg(long, short)]
    verbose: bool,

    /// Tell what happens as one JSON object per line, reads and PDOs included
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican simulate siko/ag03-1 --node 5
    lexican read --bus slcan:/dev/pts/3 --node 5 6041      (in another terminal)";

const LONG_HELP: &str = "\
While it runs, lines on stdin control the device; help lists them: get, set, emcy, power, status, and for a drive \
every key of its scripts, such as battery_v = 2.5.

Examples:
    lexican simulate siko/ag03-1 --node 5
    lexican read --bus slcan:/dev/pts/3 --node 5 6041      (in another terminal)
    lexican simulate FILE.eds --bus can0 --node 7 --eeprom kept.txt";

/// Where the device is to be.
#[derive(Clone, Debug)]
enum Place {
    /// On so many pseudo-terminals.
    Ptys(usize),
    Url(BusUrl),
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const MOST: usize = 16;
        match text.split_once(':').unwrap_or((text, "2")) {
            ("pty", count) => match count.parse() {
                Ok(count @ 1..=MOST) => Ok(Place::Ptys(count)),
                _ => Err(format!("{count:?} is not a number of pseudo-terminals: that is 1 to {MOST}")),
            },
            _ => {
                text.parse().map(Place::Url).map_err(|error: lexican_runtime::host::url::BusUrlError| error.to_string())
            }
        }
    }
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let loaded = args.device.load()?;
    let is_drive = has_simulator(args.device.name());
    if args.script.is_some() && !is_drive {
        return Err(Failure::new("only drives that lexican has a simulator of follow a script")
            .help("siko/ag03-1 does; any device can be controlled by lines on stdin"));
    }
    let (link, urls) = open(&args.bus)?;
    let now = link.now();
    let device = match args.node.0 {
        Some(node) if is_drive => Simulated::drive(now, node, args.eeprom.as_deref(), args.script.as_deref())?,
        None if is_drive => {
            return Err(Failure::new("this drive has no LSS: its node-ID is set by DIP switches").help("--node 5"));
        }
        node => Simulated::sheet(now, node, &loaded, args.eeprom.as_deref())?,
    };
    let report = Report::new(&loaded.device, args.json, args.json || args.verbose);
    let mut session = Session::new(link, device, &loaded, report);
    session.introduce(&urls, args)?;
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .map_err(|error| Failure::new(format_args!("cannot take note of Ctrl-C: {error}")))?;
    let end = args.span.map(|span| now + span);
    session.serve(end, &interrupted, &lines())?;
    session.sum_up(now)?;
    Ok(Outcome::Clean)
}

/// The bus, and what others have to name to be on it.
fn open(place: &Place) -> Result<(Box<dyn Link + Send>, Vec<String>), Failure> {
    match place {
        Place::Ptys(count) => open_ptys(*count),
        Place::Url(BusUrl::Log { .. }) => {
            Err(Failure::new("a log takes no frames: nobody there would hear the device"))
        }
        Place::Url(BusUrl::Simulation { .. }) => {
            Err(Failure::new("nobody else can be on a simulated bus: it is inside the command")
                .help("without --bus there will be pseudo-terminals, on which other commands find the device"))
        }
        Place::Url(url) => Ok((BusArgs::named(url.clone()).open(Pace::RealTime)?.link, vec![url.to_string()])),
    }
}

#[cfg(unix)]
fn open_ptys(count: usize) -> Result<(Box<dyn Link + Send>, Vec<String>), Failure> {
    let ptys = crate::bus::pty::Ptys::open(count)?;
    let urls = ptys.urls();
    Ok((Box::new(ptys), urls))
}

#[cfg(not(unix))]
fn open_ptys(_: usize) -> Result<(Box<dyn Link + Send>, Vec<String>), Failure> {
    Err(Failure::new("this system has no pseudo-terminals")
        .help("name a bus, such as --bus slcan:COM3?bitrate=500000; a pair of virtual serial ports will do"))
}

/// The lines that are typed; none when nobody can type any. Who types faster than they are carried out waits.
fn lines() -> Receiver<String> {
    const WAITING: usize = 64;
    let (sender, receiver) = sync_channel(WAITING);
    if is_listening() {
        std::thread::spawn(move || {
            let mut stdin = std::io::stdin().lock();
            while let Ok(Some(line)) = read_line(&mut stdin) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
    }
    receiver
}

/// A line without its end; `None` at the end of the input. Of a line that is too long for any command, the beginning.
fn read_line(input: &mut impl BufRead) -> std::io::Result<Option<String>> {
    const LONGEST: u64 = 4096;
    let mut line = Vec::new();
    if input.by_ref().take(LONGEST).read_until(b'\n', &mut line)? == 0 {
        return Ok(None);
    }
    if !line.ends_with(b"\n") {
        input.skip_until(b'\n')?;
    }
    Ok(Some(String::from_utf8_lossy(&line).trim_end().to_owned()))
}

/// Whether stdin may be read: a process in the background that reads from its terminal is stopped.
#[cfg(unix)]
fn is_listening() -> bool {
    use nix::unistd::{getpgrp, tcgetpgrp};
    let stdin = std::io::stdin();
    !stdin.is_terminal() || tcgetpgrp(stdin).is_ok_and(|foreground| foreground == getpgrp())
}

#[cfg(not(unix))]
fn is_listening() -> bool {
    true
}
