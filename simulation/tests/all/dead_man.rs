//! How long a drive goes on whose manager is gone: the table of the library, which `drives/README.md` shows.

use std::sync::{Arc, Mutex};

use kollmorgen_akd::driver::{AKD, AKD_BY_SDO};
use kollmorgen_akd::sim::SimulatedServo;
use lexican_driver::cyclic::{AxisSettings, Follower, Settings, Supply, follow};
use lexican_driver::{Any, CancelHandle, Description, Drive, Mode, Protection};
use lexican_registry::{DRIVES, KnownDrive};
use lexican_runtime::host::{Fate, VirtualBus};
use lexican_runtime::object::{Object, Rw};
use lexican_runtime::{CobId, Duration, NodeId};
use siko_ag02::driver::AG02;
use siko_ag03_1::driver::AG03_1;
use siko_ag03_1::sim::SimulatedDrive;

const NODE: NodeId = NodeId::literal(5);

/// From the last sign of life to standstill, in milliseconds, in the middle of a travel; and what the drive has.
fn dead_man(bus: &VirtualBus, description: &'static Description, velocity: &dyn Fn() -> f64) -> (u64, Protection) {
    let mut drive = Drive::<_, Any>::connect_described(bus.link(), NODE, description).unwrap();
    let protection = drive.protection();
    drive.set_mode(Mode::Positioning).unwrap();
    drive.enable().unwrap();
    drive.start_moving_to(1_000_000).unwrap();
    drive.pass(Duration::from_secs(2)).unwrap();
    assert!(velocity() != 0.0);
    // As if it had been killed: no frame of it arrives any more.
    let own = [CobId::of_node(0x600, NODE), CobId::of_node(0x200, NODE), CobId::of_node(0x300, NODE)];
    let signs = [CobId::of_node(0x700, NODE), CobId::of_node(0x700, NodeId::literal(127))];
    let killed = bus.now();
    bus.set_fate(move |_, frame| {
        let is_sign = signs.contains(&frame.id()) && (frame.is_remote() || frame.id() == signs[1]);
        if is_sign || own.contains(&frame.id()) || frame.id() == CobId::NMT { Fate::Lose } else { Fate::Deliver }
    });
    while velocity() != 0.0 {
        assert!(bus.now().since(killed) < Duration::from_secs(10), "it goes on");
        let next = Duration::from_millis(1);
        if drive.run(async |drive| drive.pass(next).await).is_err() {
            bus.advance(next);
        }
    }
    (bus.now().since(killed).as_micros() / 1000, protection)
}

fn siko(model: &'static siko_ag03_1::sim::Model, description: &'static Description) -> (u64, Protection) {
    let bus = VirtualBus::with_bit_rate(500);
    let drive = Arc::new(Mutex::new(SimulatedDrive::new(model, NODE)));
    bus.attach(Arc::clone(&drive));
    dead_man(&bus, description, &|| drive.lock().unwrap().velocity(bus.now()).into())
}

/// It stands within the time of the table, and not much sooner: else the table would say too much.
#[track_caller]
fn check(id: &str, (ms, protection): (u64, Protection)) {
    let most = lexican_registry::find(id).unwrap().stands_within.as_micros() / 1000;
    assert!((most - 200..=most).contains(&ms), "{id}: {ms} ms, {protection}");
}

#[test]
fn each_drive_stands_within_its_dead_man_time() {
    let ag03_1 = siko(&siko_ag03_1::sim::MODEL, &AG03_1);
    let ag02 = siko(&siko_ag02::sim::MODEL, &AG02);
    let bus = VirtualBus::with_bit_rate(500);
    let servo = Arc::new(Mutex::new(SimulatedServo::new(bus.now(), &kollmorgen_akd::sim::MODEL, NODE)));
    bus.attach(Arc::clone(&servo));
    let akd = dead_man(&bus, &AKD, &|| {
        servo.lock().unwrap().with_servo(bus.now(), |servo, _| servo.shaft(bus.now()).velocity)
    });
    assert!([ag03_1.1, ag02.1].iter().all(|protection| matches!(protection, Protection::LifeGuarding { .. })));
    assert!(matches!(akd.1, Protection::Heartbeat { .. }));
    check("siko/ag03-1", ag03_1);
    check("siko/ag02", ag02);
    check("kollmorgen/akd", akd);
}

#[test]
fn the_page_has_the_dead_man_time_of_each_drive() {
    let page = include_str!("../../../drives/README.md");
    for KnownDrive { library: id, stands_within: within, .. } in DRIVES {
        let row = page.lines().find(|line| line.starts_with('|') && line.contains(&format!("(`{id}`)")));
        let row = row.unwrap_or_else(|| panic!("drives/README.md has no row with (`{id}`)"));
        assert!(row.contains(&format!("| {within} |")), "{id}: {within}, and the page has {row}");
    }
}

/// A follower disarms as a drive does: what another tool has set up is there again.
#[test]
fn an_axis_that_stands_at_the_end_of_its_path_holds_what_it_held_before() {
    // A node without a time, which watches over nothing.
    const BEFORE: u32 = 0x0005_0000;
    let consumer = Object::<u32, Rw>::new(0x1016, 0x01);
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedServo::new(bus.now(), &kollmorgen_akd::sim::MODEL, NODE));
    let connect = || Drive::<_, Any>::connect_described_unprotected(bus.link(), NODE, &AKD_BY_SDO).unwrap();
    let mut drive = connect();
    drive.write(consumer, BEFORE).unwrap();
    let settings = AxisSettings::new(Mode::InterpolatedPosition, Duration::from_millis(4), 100);
    let axis = drive.prepare_cyclic(settings).unwrap();
    assert!(matches!(axis.protection(), Protection::Heartbeat { entry: 1, .. }), "{}", axis.protection());
    assert_ne!(drive.read(consumer).unwrap(), BEFORE);
    drop(drive);
    let path = |cycle: u64, _: &mut [i32]| if cycle < 100 { Supply::Ready } else { Supply::End };
    let mut follower = Follower::new(vec![axis], path, Settings::default()).unwrap();
    let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
    assert_eq!(report.reason, None, "{report}");
    assert_eq!(connect().read(consumer).unwrap(), BEFORE);
}
