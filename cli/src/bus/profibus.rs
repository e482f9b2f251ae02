//! `profibus:/dev/ttyUSB0?device=siko/ag03-1&address=5`: a drive on PROFIBUS-DP, as the only node of a bus.

use lexican_profibus::bus::Bus;
use lexican_profibus::serial_line::{self, SerialSegment};
use lexican_runtime::host::Link;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use profirust::Baudrate;
use siko_profibus::{AG02, AG03_1, Model, line};

use super::node_id;
use crate::device::load;
use crate::output::{Failure, reason};

/// The devices of the library that are known on PROFIBUS.
const DEVICES: [(&str, &Model); 2] = [("siko/ag03-1", &AG03_1), ("siko/ag02", &AG02)];

/// Bit rates at which a port is quick enough for the gateway.
const BIT_RATES: [Baudrate; 3] = [Baudrate::B93750, Baudrate::B187500, Baudrate::B500000];

/// How often the master is polled.
const POLL: Duration = Duration::from_micros(500);

/// Opens a port by the parameters of its URL: the link, and the node on it, whose node-ID is its address.
pub(super) fn open(
    port: &str,
    parameters: &[(String, String)],
) -> Result<(Box<dyn Link + Send>, NodeId, DataSheet), Failure> {
    let (mut address, mut bit_rate, mut device) = (None, Baudrate::B500000, None);
    for (key, value) in parameters {
        match key.as_str() {
            "device" => device = Some(value),
            "address" => address = Some(node_id(value).map_err(Failure::new)?),
            "bitrate" => {
                let known = BIT_RATES.into_iter().find(|rate| rate.to_rate().to_string() == *value);
                bit_rate = known.ok_or_else(|| {
                    Failure::new(format_args!("bitrate={value} is not possible; there is 93750, 187500, 500000"))
                })?;
            }
            _ => {
                return Err(Failure::new(format_args!(
                    "PROFIBUS has no parameter {key:?}; there is device, address, bitrate"
                )));
            }
        }
    }
    let (Some(device), Some(address)) = (device, address) else {
        return Err(Failure::new("which drive, and at which address of the PROFIBUS?")
            .help(format!("profibus:{port}?device={}&address=5", DEVICES[0].0)));
    };
    let sheet = load(device, &[])?;
    let shipped = lexican_eds::library::find(device);
    let known = DEVICES.into_iter().find(|(id, _)| shipped.is_some_and(|shipped| shipped.id == *id));
    let (_, model) = known.ok_or_else(|| {
        Failure::new(format_args!("lexican does not know {device} on PROFIBUS"))
            .help(format!("it knows {}", DEVICES.map(|(id, _)| id).join(" and ")))
    })?;
    let cannot = |error: std::io::Error| Failure::new(format_args!("cannot open {port}: {}", reason(&error)));
    let bus = Bus::new(SerialSegment::open(port, serial_line::parameters(bit_rate)).map_err(cannot)?);
    bus.keep(POLL).map_err(cannot)?;
    Ok((Box::new(line::link(&bus, model, address)), address, sheet))
}
