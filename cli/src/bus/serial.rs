//! A drive at its own serial interface, as the only node of a bus.

use lexican_runtime::NodeId;
use lexican_runtime::host::schemes::{anything, elsewhere};
use lexican_runtime::host::url::{Parameter, Scheme, Takes};
use lexican_runtime::host::{BusUrl, Pace};
use siko_serial::{Settings, gateway};

use super::kind::{Bus, Kind, Simulated, Terminal};
use super::node_id;
use crate::device::load;
use crate::output::{Failure, reason};

pub(super) const KIND: Kind = Kind {
    scheme: &Scheme {
        name: "serial",
        example: "serial:/dev/ttyUSB0?device=siko/ag02",
        what: "a drive at its own serial interface, alone on its bus",
        parameters: &[
            Parameter { key: "device", what: "what is there", takes: Takes::Text },
            Parameter { key: "baud", what: "the speed of the interface, 9600 by default", takes: Takes::Rate },
            Parameter {
                key: "echo",
                what: "whether an RS-485 adapter with two wires hears what it sends",
                takes: Takes::Words(&["on", "off"]),
            },
            Parameter {
                key: "node",
                what: "its node-ID, 1 by default: the interface has no addresses",
                takes: Takes::Text,
            },
        ],
        check: anything,
        open: elsewhere,
    },
    open,
    simulated: Simulated::AtTerminal(Terminal {
        name: "serial",
        parameters: |plant| match plant.devices.as_slice() {
            [device] if is_known(&device.device) => Ok(format!("device={DEVICE}")),
            _ => Err(Failure::new("this device has no serial interface that lexican knows")
                .help(format!("that of {DEVICE} is known"))),
        },
        connect: |drive, _, _| Ok(drive),
    }),
};

/// The device of the library with a serial interface.
const DEVICE: &str = "siko/ag02";

/// Whether the device has a serial interface that is supported.
fn is_known(device: &str) -> bool {
    lexican_eds::library::find(device).is_some_and(|shipped| shipped.id == DEVICE)
}

fn open(url: &BusUrl, _: Pace) -> Result<Bus, Failure> {
    let port = url.place();
    let node = url.get("node").map_or(Ok(NodeId::literal(1)), node_id).map_err(Failure::new)?;
    let mut settings = Settings { echo: url.get("echo") == Some("on"), ..Settings::default() };
    settings.baud = url.rate("baud").unwrap_or(settings.baud);
    let device = url.get("device").ok_or_else(|| {
        Failure::new("which device is at the serial interface?").help(format!("serial:{port}?device={DEVICE}"))
    })?;
    let sheet = load(device, &[])?;
    if !is_known(device) {
        return Err(Failure::new(format_args!("lexican knows no serial interface of {device}"))
            .help(format!("it knows that of {DEVICE}")));
    }
    let link = gateway::open(port, settings, node)
        .map_err(|error| Failure::new(format_args!("cannot open {port}: {}", reason(&error))))?;
    Ok(Bus::of(Box::new(link), vec![(node, sheet)]))
}
