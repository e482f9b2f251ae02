//! The simulated drive behind a gateway at the end of a simulated line, on a virtual bus.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::{Duration, Instant, NodeId};
use siko_ag02::driver::Drive;
use siko_ag02::sim::SimulatedDrive;
use siko_ag02::sim::inputs::Inputs;
use siko_serial::Settings;
use siko_serial::gateway::{self, SerialNode};
use siko_serial::sim::{SerialDrive, VirtualLine};

pub(crate) const NODE: NodeId = NodeId::literal(5);

pub(crate) struct Bench {
    pub(crate) node: Arc<Mutex<SerialNode<VirtualLine>>>,
    pub(crate) drive: Drive<VirtualLink>,
}

impl Bench {
    pub(crate) fn new() -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let settings = Settings { baud: 19_200, ..Settings::default() };
        let line = VirtualLine::with_settings(SerialDrive::default(), settings);
        let node = Arc::new(Mutex::new(gateway::node(line, settings, NODE)));
        bus.attach(Arc::clone(&node));
        let drive = Drive::connect(bus.link(), NODE).unwrap();
        Bench { node, drive }
    }

    pub(crate) fn see<T>(&self, look: impl FnOnce(&mut SimulatedDrive, Instant) -> T) -> T {
        self.node.lock().unwrap().line().0.with_drive(|drive, now| look(drive.drive_mut(), now))
    }

    pub(crate) fn world(&self, change: impl FnOnce(&mut Inputs)) {
        self.see(|drive, now| drive.set_inputs(now, change));
    }

    pub(crate) fn pass(&mut self, ms: u64) {
        self.drive.pass(Duration::from_millis(ms)).unwrap();
    }
}
