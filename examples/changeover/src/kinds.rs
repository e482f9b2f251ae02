//! The kinds of drives that a recipe may name. Another kind is another row.

use std::sync::{Arc, Mutex};

use lexican_driver::Description;
use lexican_runtime::host::VirtualBus;
use lexican_runtime::{Instant, NodeId};
use siko_ag03_1::sim::inputs::Shaft;
use siko_ag03_1::sim::{Model, SimulatedDrive};

/// A kind of drive.
pub(crate) struct DriveKind {
    /// What a recipe calls it.
    pub(crate) name: &'static str,
    /// What the driver has to know of it.
    pub(crate) description: &'static Description,
    /// Puts a simulated drive on a bus.
    pub(crate) simulate: fn(&VirtualBus, NodeId) -> Fail,
}

/// Has a simulated drive fail, at this time.
pub(crate) type Fail = Box<dyn FnOnce(Instant) + Send>;

pub(crate) const KINDS: &[DriveKind] = &[
    DriveKind {
        name: "siko/ag02",
        description: &siko_ag02::driver::AG02,
        simulate: |bus, node| siko(&siko_ag02::sim::MODEL, bus, node),
    },
    DriveKind {
        name: "siko/ag03-1",
        description: &siko_ag03_1::driver::AG03_1,
        simulate: |bus, node| siko(&siko_ag03_1::sim::MODEL, bus, node),
    },
];

/// A drive of SIKO fails when something holds its shaft.
fn siko(model: &'static Model, bus: &VirtualBus, node: NodeId) -> Fail {
    let drive = Arc::new(Mutex::new(SimulatedDrive::new(model, node)));
    bus.attach(Arc::clone(&drive));
    Box::new(move |now| {
        let mut drive = drive.lock().expect("no simulated drive panics");
        drive.set_inputs(now, |inputs| inputs.shaft = Shaft::Blocked);
    })
}
