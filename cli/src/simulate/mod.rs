//! `lexican simulate`: simulated devices on a bus.

mod args;
mod input;
mod report;
mod session;
mod station;

use lexican_runtime::host::{BusUrl, Link, Pace};
use lexican_simulation::{Plant, PlantDevice};
use siko_profibus::Model;

use crate::bus::BusArgs;
#[cfg(unix)]
use crate::bus::serial_terminal::Alone;
use crate::bus::serial_terminal::SerialTerminal;
use crate::bus::{profibus, serial};
use crate::output::{Failure, Outcome, ctrl_c};
pub(crate) use args::Args;
use args::Place;
#[cfg(unix)]
pub(crate) use args::PlantArgs;
use input::lines;
use report::Report;
use session::Session;
use station::Station;

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let plant = args.plant.plant()?;
    let (link, serial, urls) = open(&args.bus, &plant)?;
    let now = link.now();
    let several = plant.devices.len() > 1;
    let mut stations = Vec::new();
    for device in &plant.devices {
        let report = Report::new(&device.sheet.device, args.json, args.json || args.verbose);
        let report = if several { report.among_others(device.node, device.name.as_deref()) } else { report };
        let mut simulated = device.simulate(now)?;
        if matches!(args.bus, Place::Profibus) {
            simulated = simulated.on_profibus(now, profibus::known(&device.device)?.1);
        }
        stations.push(Station::new(device, simulated, report));
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

fn open(place: &Place, plant: &Plant) -> Result<Opened, Failure> {
    match place {
        Place::Ptys(count) => open_ptys(*count),
        Place::Serial => match plant.devices.as_slice() {
            [device] if serial::is_known(&device.device) => open_terminal("serial", serial::DEVICE, ""),
            _ => Err(Failure::new("this device has no serial interface that lexican knows")
                .help(format!("that of {} is known", serial::DEVICE))),
        },
        Place::Profibus => match plant.devices.as_slice() {
            [PlantDevice { device, node: Some(node), .. }] => {
                let address = Model::address(node.get());
                open_terminal("profibus", profibus::known(device)?.0, &format!("&address={address}"))
            }
            _ => Err(Failure::new("one drive at a time is simulated on PROFIBUS, with an address: --node 5")),
        },
        Place::Url(BusUrl::Serial { .. }) => {
            Err(Failure::new("a simulated drive makes the terminal of its serial interface itself")
                .help("--bus serial"))
        }
        Place::Url(BusUrl::Profibus { .. }) => {
            Err(Failure::new("a simulated drive makes the terminal of its PROFIBUS itself").help("--bus profibus"))
        }
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

/// The bus of a drive whose other interface is used: nothing else is on it.
#[cfg(unix)]
fn open_terminal(scheme: &str, device: &str, parameters: &str) -> Result<Opened, Failure> {
    let terminal = SerialTerminal::open()?;
    let url = format!("{scheme}:{}?device={device}{parameters}", terminal.path());
    Ok((Box::new(Alone::new()), Some(terminal), vec![url]))
}

#[cfg(not(unix))]
fn open_ptys(_: usize) -> Result<Opened, Failure> {
    Err(no_terminals())
}

#[cfg(not(unix))]
fn open_terminal(_: &str, _: &str, _: &str) -> Result<Opened, Failure> {
    Err(no_terminals())
}

#[cfg(not(unix))]
fn no_terminals() -> Failure {
    Failure::new("this system has no pseudo-terminals")
        .help("name a bus, such as --bus slcan:COM3?bitrate=500000; a pair of virtual serial ports will do")
}
