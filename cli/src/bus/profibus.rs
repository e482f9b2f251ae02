//! A drive on PROFIBUS-DP, as the only node of a bus.

use std::path::Path;

use lexican_profibus::bus::{self as segment, AddressError, Station};
use lexican_profibus::gsd::{Configuration, GsdError};
use lexican_profibus::master::Segment;
use lexican_profibus::serial_line::{self, SerialSegment};
use lexican_runtime::Duration;
use lexican_runtime::host::schemes::{anything, elsewhere};
use lexican_runtime::host::url::{Parameter, Scheme, Takes};
use lexican_runtime::host::{BusUrl, Pace};
use lexican_simulation::PlantDevice;
use profirust::Baudrate;
use siko_profibus::{AG02, AG03_1, Model, PPO, bus, line};

use super::kind::{Bus, Kind, Simulated, Terminal};
use super::node_id;
use crate::device::load;
use crate::output::{Failure, reason};

pub(super) const KIND: Kind = Kind {
    scheme: &Scheme {
        name: "profibus",
        example: "profibus:/dev/ttyUSB0?device=siko/ag03-1&address=5",
        what: "a drive on PROFIBUS-DP, alone on its bus; its node-ID is its address",
        parameters: &[
            Parameter { key: "device", what: "what is there", takes: Takes::Text },
            Parameter { key: "address", what: "its address", takes: Takes::Text },
            Parameter {
                key: "bitrate",
                what: "that of the PROFIBUS, 500000 by default",
                takes: Takes::Words(&["93750", "187500", "500000"]),
            },
            Parameter {
                key: "gsd",
                what: "the GSD file of the drive, in place of the one that is known",
                takes: Takes::Text,
            },
            Parameter { key: "module", what: "the modules of the GSD file, with | between", takes: Takes::Text },
        ],
        check: anything,
        open: elsewhere,
    },
    open,
    simulated: Simulated::AtTerminal(Terminal {
        name: "profibus",
        parameters: |plant| match plant.devices.as_slice() {
            [PlantDevice { device, node: Some(node), .. }] => {
                Ok(format!("device={}&address={}", known(device)?.0, Model::address(node.get())))
            }
            _ => Err(Failure::new("one drive at a time is simulated on PROFIBUS, with an address: --node 5")),
        },
        connect: |drive, device, now| Ok(drive.on_profibus(now, known(device)?.1)),
    }),
};

/// The devices of the library that have a model on PROFIBUS.
const DEVICES: [(&str, &Model); 2] = [("siko/ag03-1", &AG03_1), ("siko/ag02", &AG02)];

/// Bit rates at which a serial port is fast enough for the gateway.
const BIT_RATES: [Baudrate; 3] = [Baudrate::B93750, Baudrate::B187500, Baudrate::B500000];

/// The time until a slave must exchange data.
const PATIENCE: Duration = Duration::from_secs(3);

/// The interval of polling the master.
const POLL: Duration = Duration::from_micros(500);

/// The name in the library and the PROFIBUS model of a device.
fn known(device: &str) -> Result<(&'static str, &'static Model), Failure> {
    let shipped = lexican_eds::library::find(device);
    let known = DEVICES.into_iter().find(|(id, _)| shipped.is_some_and(|shipped| shipped.id == *id));
    known.ok_or_else(|| {
        Failure::new(format_args!("lexican does not know {device} on PROFIBUS"))
            .help(format!("it knows {}", DEVICES.map(|(id, _)| id).join(" and ")))
    })
}

fn open(url: &BusUrl, _: Pace) -> Result<Bus, Failure> {
    let (port, gsd, module) = (url.place(), url.get("gsd").map(Path::new), url.get("module"));
    let address = url.get("address").map(node_id).transpose().map_err(Failure::new)?;
    let given = BIT_RATES.into_iter().find(|rate| url.rate("bitrate") == Some(rate.to_rate() as u32));
    let bit_rate = given.unwrap_or(Baudrate::B500000);
    let (Some(device), Some(address)) = (url.get("device"), address) else {
        return Err(Failure::new("which drive, and at which address of the PROFIBUS?")
            .help(format!("profibus:{port}?device={}&address=5", DEVICES[0].0)));
    };
    if let (None, Some(module)) = (gsd, module) {
        return Err(Failure::new(format_args!("of which GSD file is {module:?} a module?"))
            .help(format!("gsd=FILE&module={module}")));
    }
    let sheet = load(device, &[])?;
    let (_, model) = known(device)?;
    let options = match gsd {
        Some(file) => Configuration::read(file, module, PPO.lengths(), bit_rate)?.into_options(),
        None => bus::options(model),
    };
    let cannot = |error: std::io::Error| Failure::new(format_args!("cannot open {port}: {}", reason(&error)));
    let bus = segment::Bus::new(SerialSegment::open(port, serial_line::parameters(bit_rate)).map_err(cannot)?);
    bus.keep(POLL).map_err(cannot)?;
    let mut link = line::link_with(&bus, model, address, options)?;
    await_data(link.carrier()).map_err(|error| cannot(error.into()))?;
    match link.carrier().trouble() {
        Some(trouble) => Err(Failure::new(trouble).help(trouble.remedy())),
        None => Ok(Bus::of(Box::new(link), vec![(address, sheet)])),
    }
}

/// Waits for data exchange, for a limited time.
fn await_data<S: Segment>(station: &mut Station<S>) -> Result<(), std::io::ErrorKind> {
    let end = station.now() + PATIENCE;
    while station.exchanges() == 0 && station.now() < end {
        station.wait(end)?;
    }
    Ok(())
}

impl From<AddressError> for Failure {
    fn from(error: AddressError) -> Self {
        Failure::new(error).help("drives whose switches say 127 have the address 126")
    }
}

impl From<GsdError> for Failure {
    fn from(error: GsdError) -> Self {
        let help = match &error {
            GsdError::File { .. } => "it has to be the GSD file of the drive's maker",
            GsdError::NoModule { .. } | GsdError::WhichModule { .. } => {
                "module=NAME; several of them, in the order of their slots, with | in between"
            }
            GsdError::OtherLengths { .. } => "the drive has a PPO with PKW and three words: name the module of that",
            _ => return Failure::new(error),
        };
        Failure::new(&error).help(help)
    }
}
