//! `profibus:/dev/ttyUSB0?device=siko/ag03-1&address=5`: a drive on PROFIBUS-DP, as the only node of a bus.

use std::path::Path;

use lexican_profibus::bus::{AddressError, Bus, Station};
use lexican_profibus::gsd::{Configuration, GsdError};
use lexican_profibus::master::Segment;
use lexican_profibus::serial_line::{self, SerialSegment};
use lexican_runtime::host::Link;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use profirust::Baudrate;
use siko_profibus::{AG02, AG03_1, Model, PPO, bus, line};

use super::node_id;
use crate::device::load;
use crate::output::{Failure, reason};

/// The devices of the library that are known on PROFIBUS.
const DEVICES: [(&str, &Model); 2] = [("siko/ag03-1", &AG03_1), ("siko/ag02", &AG02)];

/// Bit rates at which a port is quick enough for the gateway.
const BIT_RATES: [Baudrate; 3] = [Baudrate::B93750, Baudrate::B187500, Baudrate::B500000];

/// How long a slave may take until it exchanges data.
const PATIENCE: Duration = Duration::from_secs(3);

/// How often the master is polled.
const POLL: Duration = Duration::from_micros(500);

/// A device that is known on PROFIBUS: its name in the library, and what it is there.
pub(crate) fn known(device: &str) -> Result<(&'static str, &'static Model), Failure> {
    let shipped = lexican_eds::library::find(device);
    let known = DEVICES.into_iter().find(|(id, _)| shipped.is_some_and(|shipped| shipped.id == *id));
    known.ok_or_else(|| {
        Failure::new(format_args!("lexican does not know {device} on PROFIBUS"))
            .help(format!("it knows {}", DEVICES.map(|(id, _)| id).join(" and ")))
    })
}

/// Opens a port by the parameters of its URL: the link, and the node on it, whose node-ID is its address.
pub(super) fn open(
    port: &str,
    parameters: &[(String, String)],
) -> Result<(Box<dyn Link + Send>, NodeId, DataSheet), Failure> {
    let (mut address, mut bit_rate, mut device) = (None, Baudrate::B500000, None);
    let (mut gsd, mut module) = (None, None);
    for (key, value) in parameters {
        match key.as_str() {
            "device" => device = Some(value),
            "address" => address = Some(node_id(value).map_err(Failure::new)?),
            "gsd" => gsd = Some(Path::new(value)),
            "module" => module = Some(value.as_str()),
            "bitrate" => {
                let known = BIT_RATES.into_iter().find(|rate| rate.to_rate().to_string() == *value);
                bit_rate = known.ok_or_else(|| {
                    Failure::new(format_args!("bitrate={value} is not possible; there is 93750, 187500, 500000"))
                })?;
            }
            _ => {
                return Err(Failure::new(format_args!(
                    "PROFIBUS has no parameter {key:?}; there is device, address, bitrate, gsd, module"
                )));
            }
        }
    }
    let (Some(device), Some(address)) = (device, address) else {
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
    let bus = Bus::new(SerialSegment::open(port, serial_line::parameters(bit_rate)).map_err(cannot)?);
    bus.keep(POLL).map_err(cannot)?;
    let mut link = line::link_with(&bus, model, address, options)?;
    await_data(link.carrier()).map_err(|error| cannot(error.into()))?;
    match link.carrier().trouble() {
        Some(trouble) => Err(Failure::new(trouble).help(trouble.remedy())),
        None => Ok((Box::new(link), address, sheet)),
    }
}

/// Waits until data is exchanged, for a while.
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
