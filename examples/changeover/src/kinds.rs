//! The kinds of drives that a recipe may name. Another kind is another row.

use std::sync::{Arc, Mutex};

use kollmorgen_akd::fault;
use kollmorgen_akd::sim::SimulatedServo;
use lexican_driver::Description;
use lexican_profibus::{bus::Bus, virtual_bus};
use lexican_runtime::host::VirtualBus;
use lexican_runtime::object::Address;
use lexican_runtime::{Instant, NodeId};
use siko_ag03_1::sim::inputs::Shaft;
use siko_ag03_1::sim::{Model, SimulatedDrive};
use siko_profibus::{bus::attach_unknown, line};
use siko_serial::sim::{SerialDrive, VirtualLine};
use siko_serial::{Settings, gateway};

/// A kind of drive.
pub(crate) struct DriveKind {
    /// What a recipe calls it.
    pub(crate) name: &'static str,
    /// What the driver has to know of it.
    pub(crate) description: &'static Description,
    /// Puts a simulated drive on a line.
    pub(crate) simulate: fn(&Lines, NodeId) -> Fail,
}

/// The lines of a simulated machine.
pub(crate) struct Lines {
    pub(crate) can: VirtualBus,
    profibus: Bus<virtual_bus::VirtualBus<siko_profibus::ProfibusDrive>>,
}

impl Lines {
    pub(crate) fn new() -> Self {
        Lines { can: VirtualBus::with_bit_rate(500), profibus: Bus::new(virtual_bus::VirtualBus::new()) }
    }
}

/// Has a simulated drive fail, at this time.
pub(crate) type Fail = Box<dyn FnOnce(Instant) + Send>;

pub(crate) const KINDS: &[DriveKind] = &[
    DriveKind { name: "kollmorgen/akd", description: &kollmorgen_akd::driver::AKD, simulate: akd },
    DriveKind {
        name: "siko/ag02",
        description: &siko_ag02::driver::AG02,
        simulate: |lines, node| siko(&siko_ag02::sim::MODEL, lines, node),
    },
    // The same drive at its serial port, and the same driver: a gateway makes it a node of the bus.
    DriveKind { name: "siko/ag02@serial", description: &siko_ag02::driver::AG02, simulate: at_serial_port },
    DriveKind {
        name: "siko/ag03-1",
        description: &siko_ag03_1::driver::AG03_1,
        simulate: |lines, node| siko(&siko_ag03_1::sim::MODEL, lines, node),
    },
    // All of them share one segment; a node-ID is an address there.
    DriveKind { name: "siko/ag03-1@profibus", description: &siko_ag03_1::driver::AG03_1, simulate: on_profibus },
];

/// Of the PDOs with position and velocity, in 100 us: without one, an AKD that moves sends them as fast as the bus takes
/// them (6.3.2.1), and the drives behind it are not heard.
const INHIBIT_TIMES: [Address; 2] = [Address::new(0x1802, 3), Address::new(0x1803, 3)];

/// An AKD fails when its motor does not follow.
fn akd(Lines { can: bus, .. }: &Lines, node: NodeId) -> Fail {
    let mut drive = SimulatedServo::new(bus.now(), &kollmorgen_akd::sim::MODEL, node);
    drive.with_servo(bus.now(), |_, od| {
        INHIBIT_TIMES.iter().for_each(|address| od.set_raw(*address, 200));
    });
    drive.store(1).expect("all its parameters can be read");
    drive.set_power(bus.now(), false);
    drive.set_power(bus.now(), true);
    let drive = Arc::new(Mutex::new(drive));
    bus.attach(Arc::clone(&drive));
    Box::new(move |now| {
        let mut drive = drive.lock().expect("no simulated drive panics");
        drive.set_inputs(now, |inputs| inputs.faults = fault::find("F439").map(|code| code.number).into());
    })
}

/// A drive of SIKO fails when something holds its shaft.
fn siko(model: &'static Model, lines: &Lines, node: NodeId) -> Fail {
    let drive = Arc::new(Mutex::new(SimulatedDrive::new(model, node)));
    lines.can.attach(Arc::clone(&drive));
    Box::new(move |now| {
        let mut drive = drive.lock().expect("no simulated drive panics");
        drive.set_inputs(now, |inputs| inputs.shaft = Shaft::Blocked);
    })
}

fn at_serial_port(lines: &Lines, node: NodeId) -> Fail {
    let line = VirtualLine::new(SerialDrive::default());
    let gateway = Arc::new(Mutex::new(gateway::node(line, Settings::default(), node)));
    lines.can.attach(Arc::clone(&gateway));
    Box::new(move |_| {
        let mut gateway = gateway.lock().expect("no simulated drive panics");
        gateway.line().0.with_drive(|drive, now| {
            drive.drive_mut().set_inputs(now, |inputs| inputs.shaft = Shaft::Blocked);
        });
    })
}

fn on_profibus(Lines { can, profibus }: &Lines, node: NodeId) -> Fail {
    let model = &siko_profibus::AG03_1;
    let slave = profibus.with(|segment| attach_unknown(segment, model, node.get()));
    can.attach(line::node(profibus, model, node).expect("the machine's addresses are below 127"));
    let segment = profibus.clone();
    Box::new(move |_| {
        segment.with(|segment| {
            let now = segment.now();
            let drive = segment.slave_mut(slave).application_mut().drive_mut();
            drive.set_inputs(now, |inputs| inputs.shaft = Shaft::Blocked);
        });
    })
}
