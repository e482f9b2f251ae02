//! A simulated drive with the typed driver.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use siko_ag03_1::driver::{Drive, Error, Missing, Mode};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::inputs::Inputs;
use siko_ag03_1::sim::{Setup, SimulatedDrive};

pub(crate) const NODE: NodeId = NodeId::literal(5);

pub(crate) struct Rig {
    pub(crate) bus: VirtualBus,
    pub(crate) simulated: Arc<Mutex<SimulatedDrive>>,
    pub(crate) drive: Drive<VirtualLink>,
}

impl Rig {
    pub(crate) fn new() -> Self {
        Rig::with(Setup::new(&MODEL, NODE))
    }

    pub(crate) fn with(setup: Setup) -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let simulated = Arc::new(Mutex::new(SimulatedDrive::power_on(bus.now(), setup)));
        bus.attach(Arc::clone(&simulated));
        let drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
        Rig { bus, simulated, drive }
    }

    pub(crate) fn enabled() -> Self {
        let mut rig = Rig::new();
        rig.drive.enable().unwrap();
        rig
    }

    pub(crate) fn running() -> Self {
        let mut rig = Rig::new();
        rig.drive.set_mode(Mode::Velocity).unwrap();
        rig.drive.enable().unwrap();
        rig
    }

    pub(crate) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        self.simulated.lock().unwrap().set_inputs(self.bus.now(), change);
    }

    /// Another manager sends a control word.
    pub(crate) fn control(&mut self, word: u16) {
        let frame = Frame::from_array(CobId::of_node(0x200, NODE), word.to_le_bytes());
        self.bus.link().send(&frame).unwrap();
        self.pass_ms(1);
    }

    pub(crate) fn pass_ms(&mut self, ms: u64) {
        self.drive.pass(Duration::from_millis(ms)).unwrap();
    }

    pub(crate) fn position(&self) -> i32 {
        self.simulated.lock().unwrap().position(self.bus.now())
    }

    pub(crate) fn velocity(&self) -> i32 {
        self.simulated.lock().unwrap().velocity(self.bus.now())
    }
}

#[track_caller]
pub(crate) fn refused<T: std::fmt::Debug>(result: Result<T, Error>, missing: &[Missing]) {
    match result {
        Err(Error::Refused(refusal)) => assert_eq!(refusal.0, missing),
        other => panic!("not refused: {other:?}"),
    }
}
