//! `lexican simulate`: simulated devices on a bus.

mod args;
mod input;
mod report;
mod session;
mod station;

#[cfg(unix)]
use lexican_runtime::host::VirtualBus;
use lexican_runtime::host::{BusUrl, Link, Pace};
use lexican_toolbox::simulation::PlantDevice;

use crate::bus::BusArgs;
use crate::bus::serial;
use crate::bus::serial_terminal::SerialTerminal;
use crate::output::{Failure, Outcome, ctrl_c};
use args::Place;
pub(crate) use args::{Args, PlantArgs};
use input::lines;
use report::Report;
use session::Session;
use station::Station;

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let plant = args.plant.plant()?;
    let is_known = |device: &PlantDevice| serial::is_known(&device.device);
    if matches!(args.bus, Place::Serial) && !matches!(plant.devices.as_slice(), [device] if is_known(device)) {
        return Err(Failure::new("this device has no serial interface that lexican knows")
            .help(format!("that of {} is known", serial::DEVICE)));
    }
    let (link, serial, urls) = open(&args.bus)?;
    let now = link.now();
    let several = plant.devices.len() > 1;
    let mut stations = Vec::new();
    for device in &plant.devices {
        let report = Report::new(&device.sheet.device, args.json, args.json || args.verbose);
        let report = if several { report.among_others(device.node, device.name.as_deref()) } else { report };
        stations.push(Station::new(device, device.simulate(now)?, report));
    }
    let mut session = Session::new((link, serial), plant.wire(stations), args.json);
    session.introduce(&urls, args)?;
    let interrupted = ctrl_c()?;
    let end = args.span.map(|span| now + span);
    session.serve(end, &interrupted, &lines())?;
    session.sum_up(now)?;
    Ok(Outcome::Clean)
}

/// The bus, the serial interface if that is what the device is on, and the URLs for other commands.
type Opened = (Box<dyn Link + Send>, Option<SerialTerminal>, Vec<String>);

fn open(place: &Place) -> Result<Opened, Failure> {
    match place {
        Place::Ptys(count) => open_ptys(*count),
        Place::Serial => open_serial(),
        Place::Url(BusUrl::Serial { .. }) => {
            Err(Failure::new("a simulated drive makes the terminal of its serial interface itself")
                .help("--bus serial"))
        }
        Place::Url(BusUrl::Profibus { .. }) => Err(Failure::new("a simulated drive is not put on PROFIBUS")),
        Place::Url(BusUrl::Log { .. }) => Err(Failure::new("a log takes no frames: there is no bus for the device")),
        Place::Url(BusUrl::Simulation { .. }) => {
            Err(Failure::new("a simulated bus is inside the command: no other command could reach the device")
                .help("without --bus the device is on pseudo-terminals, which other commands can use"))
        }
        Place::Url(url) => Ok((BusArgs::named(url.clone()).open(Pace::RealTime)?.link, None, vec![url.to_string()])),
    }
}

#[cfg(unix)]
fn open_ptys(count: usize) -> Result<Opened, Failure> {
    let ptys = crate::bus::pty::Ptys::open(count)?;
    let urls = ptys.urls();
    Ok((Box::new(ptys), None, urls))
}

/// The bus of a drive whose serial interface is used: nothing else is on it.
#[cfg(unix)]
fn open_serial() -> Result<Opened, Failure> {
    let bus = VirtualBus::new();
    bus.set_pace(Pace::RealTime);
    let terminal = SerialTerminal::open()?;
    let url = format!("serial:{}?device={}", terminal.path(), serial::DEVICE);
    Ok((Box::new(bus.link()), Some(terminal), vec![url]))
}

#[cfg(not(unix))]
fn open_ptys(_: usize) -> Result<Opened, Failure> {
    Err(no_terminals())
}

#[cfg(not(unix))]
fn open_serial() -> Result<Opened, Failure> {
    Err(no_terminals())
}

#[cfg(not(unix))]
fn no_terminals() -> Failure {
    Failure::new("this system has no pseudo-terminals")
        .help("name a bus, such as --bus slcan:COM3?bitrate=500000; a pair of virtual serial ports will do")
}
