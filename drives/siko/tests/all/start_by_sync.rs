//! Travels that start by SYNC (AG03/1: 7.2.6.2; AG02: 10.2.6.2), with both drives at once.

use std::sync::{Arc, Mutex};

use lexican_driver::description::Description;
use lexican_driver::{Any, Capability, Drive, Error, Missing, Outcome};
use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::object::{Object, Rw};
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use siko::sim::{Model, SimulatedDrive};

/// 1402h:02, of the PDO with the target.
const TRANSMISSION_TYPE: Object<u8, Rw> = Object::new(0x1402, 2);
const TARGET: i32 = 3000;

type Operation = fn(&mut Drive<VirtualLink, Any>) -> Result<(), Error>;

struct Rig {
    bus: VirtualBus,
    simulated: Vec<Arc<Mutex<SimulatedDrive>>>,
    drives: Vec<Drive<VirtualLink, Any>>,
}

impl Rig {
    /// An AG03/1 and an AG02, enabled, which hold their targets until SYNC.
    fn new() -> Self {
        let kinds: [(&'static Description, &'static Model); 2] = [
            (&siko_ag03_1::driver::AG03_1, &siko_ag03_1::sim::MODEL),
            (&siko_ag02::driver::AG02, &siko_ag02::sim::MODEL),
        ];
        let mut rig = Rig { bus: VirtualBus::with_bit_rate(500), simulated: Vec::new(), drives: Vec::new() };
        for ((description, model), node) in kinds.into_iter().zip([5, 6]) {
            let node = NodeId::literal(node);
            let simulated = Arc::new(Mutex::new(SimulatedDrive::new(model, node)));
            rig.bus.attach(Arc::clone(&simulated));
            let mut drive = Drive::connect_described_unprotected(rig.bus.link(), node, description).unwrap();
            drive.set_start_by_sync(true).unwrap();
            drive.enable().unwrap();
            rig.simulated.push(simulated);
            rig.drives.push(drive);
        }
        rig
    }

    /// Sends SYNC, and lets some time pass.
    fn sync(&self) {
        self.bus.link().send(&Frame::new(CobId::SYNC, &[]).unwrap()).unwrap();
        self.pass();
    }

    fn pass(&self) {
        self.bus.advance(Duration::from_millis(700));
    }

    /// The positions of the drives.
    fn positions(&self) -> Vec<i32> {
        self.simulated.iter().map(|drive| drive.lock().unwrap().position(self.bus.now())).collect()
    }
}

#[test]
fn sync_releases_all_drives_that_have_been_prepared() {
    let mut rig = Rig::new();
    rig.drives.iter_mut().for_each(|drive| drive.prepare_moving_to(TARGET).unwrap());
    rig.pass();
    assert_eq!(rig.positions(), [0, 0]);
    rig.sync();
    assert!(rig.positions().iter().all(|position| *position > 0), "{:?}", rig.positions());
    for drive in &mut rig.drives {
        drive.confirm_start().unwrap();
        assert_eq!(drive.finish().unwrap(), Outcome::Reached { position: TARGET });
        drive.disable().unwrap();
        drive.set_start_by_sync(false).unwrap();
        assert_eq!(drive.read(TRANSMISSION_TYPE).unwrap(), 255);
        drive.enable().unwrap();
        assert_eq!(drive.move_to(0).unwrap(), Outcome::Reached { position: 0 });
    }
}

/// A drive cannot show that it holds an order, and SYNC may come from elsewhere at any time.
#[test]
fn a_target_that_has_been_taken_back_is_not_released_by_a_later_sync() {
    let ways: [(&str, Operation); 6] = [
        ("stop", Drive::stop),
        ("disable", Drive::disable),
        ("stop, then disable", |drive| drive.stop().and_then(|()| drive.disable())),
        ("quick stop", Drive::quick_stop),
        ("no SYNC in time", |drive| match drive.confirm_start() {
            Err(Error::NotTaken { .. }) => Ok(()),
            other => panic!("{other:?}"),
        }),
        ("at once, without preparing", |drive| match drive.stop().and_then(|()| drive.move_to(TARGET)) {
            Err(Error::NotTaken { .. }) => Ok(()),
            other => panic!("{other:?}"),
        }),
    ];
    for (name, way) in ways {
        let mut rig = Rig::new();
        let mut states = Vec::new();
        for drive in &mut rig.drives {
            drive.prepare_moving_to(TARGET).unwrap();
            way(drive).unwrap_or_else(|error| panic!("{name}: {error}"));
            states.push(drive.state().unwrap());
        }
        rig.sync();
        assert_eq!(rig.positions(), [0, 0], "{name}");
        let after: Vec<_> = rig.drives.iter_mut().map(|drive| drive.state().unwrap()).collect();
        assert_eq!(after, states, "{name}: SYNC changes nothing");
    }
}

#[test]
fn a_drive_that_is_dropped_with_its_target_does_not_start_later() {
    for released in [false, true] {
        let mut rig = Rig::new();
        rig.drives.iter_mut().for_each(|drive| drive.prepare_moving_to(TARGET).unwrap());
        if released {
            rig.sync();
        }
        rig.drives.clear();
        rig.sync();
        let stopped = rig.positions();
        rig.pass();
        assert_eq!(rig.positions(), stopped, "{released}");
        assert_eq!(stopped != [0, 0], released);
    }
}

#[test]
fn what_would_start_at_once_or_cannot_wait_is_refused() {
    /// The drive with its orders by SDO.
    static BY_SDO: Description = {
        let mut description = siko_ag03_1::driver::AG03_1;
        description.outputs = lexican_driver::description::Outputs::BY_SDO;
        description
    };
    let mut rig = Rig::new();
    let [drive, _] = &mut rig.drives[..] else { unreachable!("there are two") };
    match drive.set_start_by_sync(false) {
        Err(Error::Refused(refusal)) => assert_eq!(refusal.0, [Missing::Disabled]),
        other => panic!("{other:?}"),
    }
    drive.disable().unwrap();
    drive.set_start_by_sync(false).unwrap();
    drive.enable().unwrap();
    match drive.prepare_moving_to(TARGET) {
        Err(Error::Refused(refusal)) => assert_eq!(refusal.0, [Missing::StartBySync]),
        other => panic!("{other:?}"),
    }
    match drive.confirm_start() {
        Err(Error::Refused(refusal)) => assert_eq!(refusal.0, [Missing::Travel]),
        other => panic!("{other:?}"),
    }
    let mut drive = Drive::connect_described_unprotected(rig.bus.link(), NodeId::literal(5), &BY_SDO).unwrap();
    for refused in [drive.set_start_by_sync(true), drive.prepare_moving_to(TARGET)] {
        assert!(matches!(refused, Err(Error::Unsupported { what: Capability::StartBySync, .. })), "{refused:?}");
    }
}
