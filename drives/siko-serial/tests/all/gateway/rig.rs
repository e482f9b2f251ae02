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

use super::noisy::Noisy;

pub(crate) const NODE: NodeId = NodeId::literal(5);

pub(crate) struct Rig {
    pub(crate) node: Arc<Mutex<SerialNode<Noisy>>>,
    pub(crate) drive: Drive<VirtualLink>,
    pub(crate) bus: VirtualBus,
}

impl Rig {
    pub(crate) fn new() -> Self {
        let (node, bus) = Rig::unplugged();
        node.lock().unwrap().line().0.set_fate(|_, byte| Some(byte));
        let drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
        Rig { node, drive, bus }
    }

    /// A gateway whose line carries nothing.
    pub(crate) fn unplugged() -> (Arc<Mutex<SerialNode<Noisy>>>, VirtualBus) {
        let bus = VirtualBus::with_bit_rate(500);
        let settings = Settings { baud: 19_200, ..Settings::default() };
        let mut line = Noisy::new(VirtualLine::with_settings(SerialDrive::default(), settings));
        line.set_fate(|_, _| None);
        let node = Arc::new(Mutex::new(gateway::node(line, settings, NODE)));
        bus.attach(Arc::clone(&node));
        (node, bus)
    }

    pub(crate) fn see<T>(&self, look: impl FnOnce(&mut SimulatedDrive, Instant) -> T) -> T {
        self.node.lock().unwrap().line().0.line.with_drive(|drive, now| look(drive.drive_mut(), now))
    }

    /// Sets what happens to the bytes of the line from now on.
    pub(crate) fn set_fate(&self, fate: impl FnMut(u64, u8) -> Option<u8> + Send + 'static) {
        self.node.lock().unwrap().line().0.set_fate(fate);
    }

    /// The true position and velocity.
    pub(crate) fn shaft(&self) -> (i32, i32) {
        self.see(|drive, now| (drive.position(now), drive.velocity(now)))
    }

    pub(crate) fn world(&self, change: impl FnOnce(&mut Inputs)) {
        self.see(|drive, now| drive.set_inputs(now, change));
    }

    pub(crate) fn pass(&mut self, ms: u64) {
        self.drive.pass(Duration::from_millis(ms)).unwrap();
    }
}
