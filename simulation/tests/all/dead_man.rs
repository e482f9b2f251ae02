//! How long a drive goes on whose manager is gone: the table of the library, which `drives/README.md` shows.

use std::sync::{Arc, Mutex};

use lexican_driver::cyclic::{AxisSettings, Follower, Settings, Supply, follow};
use lexican_driver::{Any, CancelHandle, Drive, Mode, Protection};
use lexican_registry::kollmorgen_akd::driver::AKD_BY_SDO;
use lexican_registry::kollmorgen_akd::sim::{MODEL, SimulatedServo};
use lexican_registry::siko_ag03_1::sim::SimulatedDrive;
use lexican_registry::{DRIVES, DriveModel, KnownDrive};
use lexican_runtime::host::{Fate, VirtualBus};
use lexican_runtime::object::{Object, Rw};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{CobId, Duration, NodeId};

const NODE: NodeId = NodeId::literal(5);

/// Its row of the page: it stands within the time of the table, and not much sooner, else the table would say too much.
fn row(known: &KnownDrive) -> String {
    let bus = VirtualBus::with_bit_rate(500);
    let (ms, protection, state) = match known.model {
        DriveModel::Siko(model) => {
            let drive = Arc::new(Mutex::new(SimulatedDrive::new(model, NODE)));
            bus.attach(Arc::clone(&drive));
            dead_man(&bus, known, &|| drive.lock().unwrap().velocity(bus.now()).into())
        }
        DriveModel::Servo(model) => {
            let servo = Arc::new(Mutex::new(SimulatedServo::new(bus.now(), model, NODE)));
            bus.attach(Arc::clone(&servo));
            dead_man(&bus, known, &|| {
                servo.lock().unwrap().with_servo(bus.now(), |servo, _| servo.shaft(bus.now()).velocity)
            })
        }
    };
    let KnownDrive { library, description, stands_within: within, .. } = known;
    let most = within.as_micros() / 1000;
    assert!((most - 200..=most).contains(&ms), "{library}: {ms} ms, {protection}");
    format!("| {} (`{library}`) | {protection} | {within} | {state} |\n", description.name)
}

/// From the last sign of life to standstill, in milliseconds, in the middle of a travel; what the drive has noticed it by, and
/// its state then.
fn dead_man(bus: &VirtualBus, known: &KnownDrive, velocity: &dyn Fn() -> f64) -> (u64, Protection, State) {
    let description = known.description;
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
    let ms = bus.now().since(killed).as_micros() / 1000;
    bus.set_fate(|_, _| Fate::Deliver);
    let again = Drive::<_, Any>::connect_described_unprotected(bus.link(), NODE, description);
    (ms, protection, again.unwrap().state().unwrap())
}

/// The drives' rows are made; others, which follow, are written by hand.
#[test]
fn golden_page_has_the_dead_man_time_of_each_drive() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../drives/README.md");
    let page = std::fs::read_to_string(path).unwrap();
    let head = "| drive | protected by | stands within | state then |\n| --- | --- | --- | --- |\n";
    let (before, after) = page.split_once(head).expect("the page has the table");
    let others = after.split_inclusive('\n').skip_while(|line| line.contains("(`"));
    let made = format!("{before}{head}{}{}", DRIVES.iter().map(row).collect::<String>(), others.collect::<String>());
    if std::env::var_os("LEXICAN_BLESS").is_some() {
        return std::fs::write(path, made).unwrap();
    }
    assert!(made == page, "{path} is out of date: LEXICAN_BLESS=1 cargo test -p lexican-simulation golden");
}

/// A follower disarms as a drive does: what another tool has set up is there again.
#[test]
fn an_axis_that_stands_at_the_end_of_its_path_holds_what_it_held_before() {
    // A node without a time, which watches over nothing; and the manager with the time of its machine.
    [0x0005_0000, 0x007F_0258].into_iter().for_each(holds_again);
}

fn holds_again(before: u32) {
    let consumer = Object::<u32, Rw>::new(0x1016, 0x01);
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedServo::new(bus.now(), &MODEL, NODE));
    let connect = || Drive::<_, Any>::connect_described_unprotected(bus.link(), NODE, &AKD_BY_SDO).unwrap();
    let mut drive = connect();
    drive.write(consumer, before).unwrap();
    let settings = AxisSettings::new(Mode::InterpolatedPosition, Duration::from_millis(4), 100);
    let axis = drive.prepare_cyclic(settings).unwrap();
    assert!(matches!(axis.protection(), Protection::Heartbeat { entry: 1, .. }), "{}", axis.protection());
    assert_ne!(drive.read(consumer).unwrap(), before);
    drop(drive);
    let path = |cycle: u64, _: &mut [i32]| if cycle < 100 { Supply::Ready } else { Supply::End };
    let mut follower = Follower::new(vec![axis], path, Settings::default()).unwrap();
    let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
    assert_eq!(report.reason, None, "{report}");
    assert_eq!(connect().read(consumer).unwrap(), before);
}
