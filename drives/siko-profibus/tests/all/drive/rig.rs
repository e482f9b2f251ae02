//! A simulated drive with the driver, behind PROFIBUS or CAN.

use std::sync::{Arc, Mutex};

use lexican_driver::{Drive, Kind};
use lexican_profibus::bus::Bus;
use lexican_profibus::virtual_bus::{SlaveId, VirtualBus};
use lexican_runtime::host::{self, Link};
use lexican_runtime::{Duration, Instant, NodeId};
use siko::sim::SimulatedDrive;
use siko::sim::inputs::Inputs;
use siko_ag02::driver::Ag02;
use siko_ag03_1::driver::Ag03_1;
use siko_profibus::{AG02, AG03_1, Model, ProfibusDrive, bus, line};

pub(crate) const NODE: NodeId = NodeId::literal(5);

/// A kind of drive that is sold with PROFIBUS.
pub(crate) trait Sold: Kind {
    const MODEL: &'static Model;
}

impl Sold for Ag02 {
    const MODEL: &'static Model = &AG02;
}

impl Sold for Ag03_1 {
    const MODEL: &'static Model = &AG03_1;
}

/// Tests of both drives.
macro_rules! both {
    ($($name:ident)*) => {
        mod ag02 {
            $(#[test]
            fn $name() {
                super::$name::<siko_ag02::driver::Ag02>();
            })*
        }
        mod ag03_1 {
            $(#[test]
            fn $name() {
                super::$name::<siko_ag03_1::driver::Ag03_1>();
            })*
        }
    };
}
pub(crate) use both;

type Change<'a> = &'a mut dyn FnMut(&mut SimulatedDrive, Instant);

pub(crate) struct Rig<K> {
    pub(crate) drive: Drive<Box<dyn Link>, K>,
    /// Applies a change to the drive itself.
    simulated: Box<dyn FnMut(Change<'_>)>,
}

/// A segment with a drive on it.
#[derive(Clone)]
pub(crate) struct Segment {
    pub(crate) bus: Bus<VirtualBus<ProfibusDrive>>,
    pub(crate) id: SlaveId,
}

impl Segment {
    pub(crate) fn new<K: Sold>() -> Self {
        let mut line = VirtualBus::new();
        let id = bus::attach_unknown(&mut line, K::MODEL, NODE.get());
        Segment { bus: Bus::new(line), id }
    }

    pub(crate) fn link<K: Sold>(&self) -> impl Link + use<K> {
        line::link(&self.bus, K::MODEL, NODE).unwrap()
    }

    pub(crate) fn simulated(&self, change: Change<'_>) {
        self.bus.with(|line| {
            let now = line.now();
            change(line.slave_mut(self.id).application_mut().drive_mut(), now);
        });
    }

    /// Sets whether the drive's cable is connected, and whether the master is there.
    pub(crate) fn set_works(&self, cable: bool, master: bool) {
        self.bus.with(|line| {
            line.set_connected(self.id, cable);
            line.set_master_online(master);
        });
    }
}

impl<K: Sold> Rig<K> {
    pub(crate) fn over_profibus() -> (Self, Segment) {
        let segment = Segment::new::<K>();
        let drive = Drive::connect_unprotected(Box::new(segment.link::<K>()) as Box<dyn Link>, NODE)
            .expect("the drive is there");
        let of = segment.clone();
        (Rig { drive, simulated: Box::new(move |change| of.simulated(change)) }, segment)
    }

    pub(crate) fn over_can() -> Self {
        let bus = host::VirtualBus::with_bit_rate(500);
        let simulated = Arc::new(Mutex::new(SimulatedDrive::new(K::MODEL.drive, NODE)));
        bus.attach(Arc::clone(&simulated));
        let drive =
            Drive::connect_unprotected(Box::new(bus.link()) as Box<dyn Link>, NODE).expect("the drive is there");
        Rig { drive, simulated: Box::new(move |change| change(&mut simulated.lock().unwrap(), bus.now())) }
    }

    pub(crate) fn world(&mut self, mut change: impl FnMut(&mut Inputs)) {
        (self.simulated)(&mut |drive, now| drive.set_inputs(now, &mut change));
    }

    /// The true position and velocity.
    pub(crate) fn shaft(&mut self) -> (i32, i32) {
        let mut shaft = (0, 0);
        (self.simulated)(&mut |drive, now| shaft = (drive.position(now), drive.velocity(now)));
        shaft
    }

    pub(crate) fn pass_ms(&mut self, ms: u64) {
        self.drive.pass(Duration::from_millis(ms)).expect("time passes");
    }
}
