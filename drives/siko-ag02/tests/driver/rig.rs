//! The simulated drive on a virtual bus.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::{Duration, Instant};
use siko_ag02::driver::Drive;
use siko_ag02::sim::inputs::Inputs;
use siko_ag02::sim::{MODEL, SimulatedDrive};
use siko_ag02::worked_examples::NODE;

pub(crate) struct Rig {
    pub(crate) bus: VirtualBus,
    simulated: Arc<Mutex<SimulatedDrive>>,
    pub(crate) drive: Drive<VirtualLink>,
}

impl Rig {
    pub(crate) fn new() -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let simulated = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
        bus.attach(Arc::clone(&simulated));
        let drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
        Rig { bus, simulated, drive }
    }

    pub(crate) fn see<T>(&self, look: impl FnOnce(&mut SimulatedDrive, Instant) -> T) -> T {
        look(&mut self.simulated.lock().unwrap(), self.bus.now())
    }

    pub(crate) fn world(&self, change: impl FnOnce(&mut Inputs)) {
        self.see(|drive, now| drive.set_inputs(now, change));
    }

    pub(crate) fn pass(&mut self, ms: u64) {
        self.drive.pass(Duration::from_millis(ms)).unwrap();
    }
}
