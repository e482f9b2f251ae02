//! `serial:/dev/ttyUSB0?device=siko/ag02`: a drive behind its own serial interface, as the only node of a bus. `echo=on`
//! where an RS-485 adapter with two wires hears what it sends.

use lexican_runtime::NodeId;
use lexican_runtime::host::Link;
use lexican_toolbox::data_sheet::DataSheet;
use siko_serial::{Settings, gateway};

use super::node_id;
use crate::device::load;
use crate::output::{Failure, reason};

/// The node-ID of a drive whose URL names none: the interface has no addresses.
const NODE: NodeId = NodeId::literal(1);

/// The device of the library whose interface is known.
pub(crate) const DEVICE: &str = "siko/ag02";

/// Whether the serial interface of a device is known.
pub(crate) fn is_known(device: &str) -> bool {
    lexican_eds::library::find(device).is_some_and(|shipped| shipped.id == DEVICE)
}

/// Opens a port by the parameters of its URL: the link, and the node on it.
pub(super) fn open(
    port: &str,
    parameters: &[(String, String)],
) -> Result<(Box<dyn Link + Send>, NodeId, DataSheet), Failure> {
    let (mut node, mut settings, mut device) = (NODE, Settings::default(), None);
    for (key, value) in parameters {
        match key.as_str() {
            "device" => device = Some(value),
            "node" => node = node_id(value).map_err(Failure::new)?,
            "baud" => {
                let wrong = || Failure::new(format_args!("baud={value} is not a number of bit/s"));
                settings.baud = value.parse().ok().filter(|baud| *baud > 0).ok_or_else(wrong)?;
            }
            "echo" => {
                settings.echo = match value.as_str() {
                    "on" => true,
                    "off" => false,
                    _ => return Err(Failure::new(format_args!("echo={value} is not on or off"))),
                };
            }
            _ => {
                return Err(Failure::new(format_args!(
                    "a serial interface has no parameter {key:?}; there is device, baud, echo, node"
                )));
            }
        }
    }
    let device = device.ok_or_else(|| {
        Failure::new("which device is at the serial interface?").help(format!("serial:{port}?device={DEVICE}"))
    })?;
    let sheet = load(device, &[])?;
    if !is_known(device) {
        return Err(Failure::new(format_args!("lexican knows no serial interface of {device}"))
            .help(format!("it knows that of {DEVICE}")));
    }
    let link = gateway::open(port, settings, node)
        .map_err(|error| Failure::new(format_args!("cannot open {port}: {}", reason(&error))))?;
    Ok((Box::new(link), node, sheet))
}
