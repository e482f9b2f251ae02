//! A simulated drive on a bus of its own, for the tests that look at frames.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::{Duration, Instant};
use siko_ag03_1::sim::SimulatedDrive;

/// A drive, and a link to it.
pub(crate) struct Bench {
    pub(crate) bus: VirtualBus,
    pub(crate) link: VirtualLink,
    pub(crate) drive: Arc<Mutex<SimulatedDrive>>,
}

impl Bench {
    /// The drive has been powered on, and nothing has been heard of it.
    pub(crate) fn of(drive: SimulatedDrive) -> Self {
        let bus = VirtualBus::new();
        let drive = Arc::new(Mutex::new(drive));
        bus.attach(Arc::clone(&drive));
        let link = bus.link();
        Bench { bus, link, drive }
    }

    /// Lets time pass; what is heard meanwhile.
    pub(crate) fn pass(&mut self, ms: u64) -> Vec<String> {
        let until = self.bus.now() + Duration::from_millis(ms);
        std::iter::from_fn(|| self.link.receive_frame(until).unwrap()).map(|frame| frame.to_string()).collect()
    }

    pub(crate) fn see<T>(&self, look: impl FnOnce(&mut SimulatedDrive, Instant) -> T) -> T {
        look(&mut self.drive.lock().unwrap(), self.bus.now())
    }
}
