//! `lexican simulate`: simulated devices on a bus.

mod args;
mod input;
mod report;
mod session;
mod station;

use lexican_runtime::host::{Link, Pace};
use lexican_simulation::Plant;

use crate::bus::BusArgs;
use crate::bus::kind::{Kind, Simulated, Terminal};
#[cfg(unix)]
use crate::bus::serial_terminal::Alone;
use crate::bus::serial_terminal::SerialTerminal;
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
        if let Place::Terminal(terminal) = &args.bus {
            simulated = (terminal.connect)(simulated, &device.device, now)?;
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

/// The bus, the pseudo-terminal if the device uses its other interface, and the URLs for other commands.
type Opened = (Box<dyn Link + Send>, Option<SerialTerminal>, Vec<String>);

fn open(place: &Place, plant: &Plant) -> Result<Opened, Failure> {
    match place {
        Place::Ptys(count) => open_ptys(*count),
        Place::Terminal(terminal) => open_terminal(terminal.name, &(terminal.parameters)(plant)?),
        Place::Url(url) => match Kind::of(url).simulated {
            Simulated::Shared | Simulated::Alone => {
                Ok((BusArgs::named(url.clone()).open(Pace::RealTime)?.link, None, vec![url.to_string()]))
            }
            Simulated::AtTerminal(Terminal { name, .. }) => {
                Err(Failure::new(format_args!("a simulated drive makes the terminal of its {name} interface itself"))
                    .help(format_args!("--bus {name}")))
            }
            Simulated::Never(why, help) => Err(Failure::new(why).help_if(help.map(str::to_owned))),
        },
    }
}

#[cfg(unix)]
fn open_ptys(count: usize) -> Result<Opened, Failure> {
    let ptys = crate::bus::pty::Ptys::open(count)?;
    let urls = ptys.urls();
    Ok((Box::new(ptys), None, urls))
}

/// Opens the bus of a drive that uses its other interface; no other node is on it.
#[cfg(unix)]
fn open_terminal(scheme: &str, parameters: &str) -> Result<Opened, Failure> {
    let terminal = SerialTerminal::open()?;
    let url = format!("{scheme}:{}?{parameters}", terminal.path());
    Ok((Box::new(Alone::new()), Some(terminal), vec![url]))
}

#[cfg(not(unix))]
fn open_ptys(_: usize) -> Result<Opened, Failure> {
    Err(no_terminals())
}

#[cfg(not(unix))]
fn open_terminal(_: &str, _: &str) -> Result<Opened, Failure> {
    Err(no_terminals())
}

#[cfg(not(unix))]
fn no_terminals() -> Failure {
    Failure::new("this system has no pseudo-terminals")
        .help("name a bus, such as --bus slcan:COM3?bitrate=500000; a pair of virtual serial ports will do")
}
