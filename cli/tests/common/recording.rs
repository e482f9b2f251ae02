//! A recorded log of two drives.

use std::path::Path;

use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Incoming, Link, VirtualBus};
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use lexican_simulation::{Files, Plant};
use lexican_toolbox::log::{Direction, Format, INTERFACE, Record, Writer};

const MACHINE: &str = "
[node.feeder]
id = 5
sheet = 'siko/ag03-1'

[node.cutter]
id = 6
sheet = 'kollmorgen/akd'

[simulate]
feeder.settings = { 1017 = 'raw:100' }
cutter.settings = { 1017 = 100 }
";

/// Records a second with two drives that are identified and started, and then a frame without meaning.
pub(crate) fn record(path: &Path) {
    let plant = Plant::parse(MACHINE, "machine.toml", Files::Embedded(&[])).unwrap();
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(plant.segment(bus.now()).unwrap());
    let (mut listener, mut network) = (bus.link(), Network::new(bus.link()));
    for node in [5, 6].map(|node| NodeId::new(node).unwrap()) {
        for (index, sub) in [(0x1018, 1), (0x1018, 2), (0x1008, 0), (0x6041, 0), (0x6064, 0), (0x5FFF, 1)] {
            // Some of these are refused.
            let _ = network.read_bytes(node, Address::new(index, sub));
        }
    }
    network.write_bytes(NodeId::new(6).unwrap(), Address::new(0x6081, 0), &[1, 0, 0, 0]).unwrap();
    network.command(NmtCommand::Start, None).unwrap();
    let mut talker = bus.link();
    let strange: [(u16, &[u8]); 6] = [
        (0x000, &[1]),
        (0x085, &[0x10, 0x43, 0x01, 0, 0, 0, 0, 0]),
        (0x605, &[0x40, 0x41, 0x60, 0, 0, 0, 0]),
        (0x123, &[1, 2, 3]),
        (0x080, &[]),
        (0x7E5, &[4, 1, 0, 0, 0, 0, 0, 0]),
    ];
    for (id, data) in strange {
        talker.send(&Frame::new(CobId::standard(id).unwrap(), data).unwrap()).unwrap();
    }
    let end = bus.now() + Duration::from_secs(1);
    let mut writer = Writer::new(std::fs::File::create(path).unwrap(), Format::Candump);
    while let Some(incoming) = listener.receive(end).unwrap() {
        if let Incoming::Frame(frame) = incoming {
            let at = listener.now();
            let record = Record { at, interface: INTERFACE.into(), direction: Direction::Received, frame };
            writer.write(&record).unwrap();
        }
    }
    writer.finish().unwrap();
}
