//! The simulated drive on a simulated PROFIBUS, behind a gateway on a virtual bus.

use lexican_profibus::bus::Bus;
use lexican_profibus::virtual_bus::{self, SlaveId};
use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::{Duration, NodeId};
use siko_ag02::driver::Drive;
use siko_ag02::sim::inputs::Inputs;
use siko_profibus::{AG02, Door, bus, line};

const NODE: NodeId = NodeId::literal(5);

pub(crate) struct Bench {
    segment: Bus<virtual_bus::VirtualBus<Door>>,
    id: SlaveId,
    pub(crate) drive: Drive<VirtualLink>,
}

impl Bench {
    pub(crate) fn new() -> Self {
        let mut segment = virtual_bus::VirtualBus::new();
        let id = bus::attach_unknown(&mut segment, &AG02, NODE.get());
        let segment = Bus::new(segment);
        let can = VirtualBus::with_bit_rate(500);
        can.attach(line::node(&segment, &AG02, NODE).unwrap());
        let drive = Drive::connect_unprotected(can.link(), NODE).unwrap();
        Bench { segment, id, drive }
    }

    pub(crate) fn world(&self, change: impl FnOnce(&mut Inputs)) {
        self.segment.with(|line| {
            let now = line.now();
            line.slave_mut(self.id).application_mut().drive_mut().set_inputs(now, change);
        });
    }

    pub(crate) fn pass(&mut self, ms: u64) {
        self.drive.pass(Duration::from_millis(ms)).unwrap();
    }
}
