//! The driver against the simulated drive, in virtual time.

use std::sync::{Arc, Mutex};

use kollmorgen_akd::driver::{
    Drive, Error, FreeDrive, HomingOutcome, Mode, Outcome, SetPoint, Trigger, VelocityOutcome,
};
use kollmorgen_akd::sim::{Inputs, MODEL, Machine, SimulatedServo};
use kollmorgen_akd::{fault, od};
use lexican_driver::sequence::Recovery;
use lexican_driver::{Cause, Kind};
use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::object::{Mapping, Rpdo, Tpdo};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, Duration, NodeId};

const NODE: NodeId = NodeId::literal(3);

/// A driver and a simulated drive on a bus of their own.
struct Bench<K: Kind> {
    bus: VirtualBus,
    servo: Arc<Mutex<SimulatedServo>>,
    drive: lexican_driver::Drive<VirtualLink, K>,
}

impl<K: Kind> Bench<K> {
    fn new() -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let servo = Arc::new(Mutex::new(SimulatedServo::new(bus.now(), &MODEL, NODE)));
        bus.attach(Arc::clone(&servo));
        let drive = lexican_driver::Drive::connect(bus.link(), NODE).unwrap();
        Bench { bus, servo, drive }
    }

    fn set(&self, change: impl FnOnce(&mut Inputs)) {
        self.servo.lock().unwrap().set_inputs(self.bus.now(), change);
    }
}

type ByPdo = Bench<kollmorgen_akd::driver::Akd>;
type BySdo = Bench<kollmorgen_akd::driver::AkdBySdo>;

fn code(label: &str) -> u16 {
    fault::find(label).unwrap().number
}

fn exercise<K: Kind>(mut bench: Bench<K>) {
    let drive = &mut bench.drive;
    drive.enable().unwrap();
    assert_eq!(drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
    drive.start_moving_to(10_000).unwrap();
    drive.add_set_point(SetPoint::to(20_000).blended()).unwrap();
    drive.add_set_point(SetPoint::by(-5000)).unwrap();
    assert_eq!(drive.finish().unwrap(), Outcome::Reached { position: 15_000 });
    drive.set_mode(Mode::Velocity).unwrap();
    assert!(matches!(drive.run_at(300).unwrap(), VelocityOutcome::Reached { velocity: 300_000 }));
    drive.stop().unwrap();
    drive.set_mode(Mode::Torque).unwrap();
    drive.apply_torque(100).unwrap();
    drive.pass(Duration::from_secs(1)).unwrap();
    assert_eq!(drive.torque().unwrap(), 100);
    drive.stop().unwrap();
    drive.set_mode(Mode::Positioning).unwrap();
    drive.calibrate(25_000).unwrap();
    assert_eq!(drive.position().unwrap(), 25_000);
    drive.store().unwrap();
    for mode in [Mode::InterpolatedPosition, Mode::CyclicPosition] {
        drive.set_mode(mode).unwrap();
        assert_eq!((drive.mode().unwrap(), drive.position().unwrap()), (Some(mode), 25_000));
    }
    drive.disable().unwrap();
}

#[test]
fn it_does_what_its_manual_has() {
    exercise(ByPdo::new());
    exercise(BySdo::new());
}

#[test]
fn it_homes_by_every_method() {
    for method in kollmorgen_akd::driver::AKD.homing.unwrap().methods {
        let mut bench = BySdo::new();
        bench.set(|inputs| {
            inputs.machine = Machine {
                negative_limit: Some(-5000.0),
                positive_limit: Some(5000.0),
                home_switch: Some((-200.0, 200.0)),
                index: Some((50.0, 1000.0)),
            };
        });
        bench.drive.enable().unwrap();
        let outcome = bench.drive.home(*method).unwrap();
        assert!(matches!(outcome, HomingOutcome::Attained { .. }), "{method}: {outcome:?}");
        assert_eq!(bench.drive.mode().unwrap(), Some(Mode::Positioning), "{method}");
    }
    let mut bench = BySdo::new();
    bench.drive.enable().unwrap();
    let failed = bench.drive.home(od::HomingMethod::NEGATIVE_LIMIT_SWITCH.0).unwrap();
    assert!(matches!(failed, HomingOutcome::Failed { .. }), "no switch: {failed:?}");
}

/// Its encoder of one turn does not keep its reference without power.
#[test]
fn it_says_whether_it_is_referenced() {
    let mut bench = ByPdo::new();
    let recovery = Recovery::within(Duration::from_secs(10));
    assert_eq!(bench.drive.recover(&recovery).unwrap().referenced, Some(false));
    bench.drive.enable().unwrap();
    bench.drive.home(od::HomingMethod::PRESENT_POSITION.0).unwrap();
    assert_eq!(bench.drive.recover(&recovery).unwrap().referenced, Some(true));
    for on in [false, true] {
        bench.servo.lock().unwrap().set_power(bench.bus.now(), on);
    }
    assert_eq!(bench.drive.recover(&recovery).unwrap().referenced, Some(false));
}

#[test]
fn faults_and_warnings_have_their_numbers() {
    let mut bench = ByPdo::new();
    bench.drive.enable().unwrap();
    bench.set(|inputs| inputs.warning = Some(code("n301")));
    bench.drive.start_moving_to(1_000_000).unwrap();
    assert_eq!(bench.drive.warning().unwrap().unwrap().to_string(), "n301 (7186): Motor overheated");
    bench.set(|inputs| inputs.fault = Some(code("F439")));
    let outcome = bench.drive.finish().unwrap();
    assert!(matches!(outcome, Outcome::Fault(Cause::Fault(code)) if code.label == "F439"), "{outcome:?}");
    assert!(matches!(bench.drive.reset_fault(), Err(Error::Fault(_))), "its cause is still there");
    bench.set(|inputs| (inputs.fault, inputs.warning) = (None, None));
    let was = bench.drive.reset_fault().unwrap().unwrap();
    assert_eq!(was.to_string(), "F439 (8611): Following error");
    assert!(bench.drive.fault_history().unwrap().contains(&was));
    bench.drive.clear_fault_history().unwrap();
    assert_eq!(bench.drive.fault_history().unwrap(), []);
}

#[test]
fn what_is_missing_is_named() {
    let mut bench = ByPdo::new();
    bench.set(|inputs| inputs.enable = false);
    let refused = bench.drive.enable().unwrap_err();
    assert_eq!(refused.to_string(), "the drive would refuse: its enable input is not active");
    bench.set(|inputs| (inputs.enable, inputs.warning) = (true, Some(code("n602"))));
    let refused = bench.drive.enable().unwrap_err();
    assert_eq!(refused.to_string(), "the drive would refuse: a safety function has it");
}

#[test]
fn inputs_latch_positions() {
    let mut bench = ByPdo::new();
    bench.drive.enable().unwrap();
    bench.drive.move_to(3000).unwrap();
    for trigger in [Trigger::Rising(1), Trigger::Falling(1)] {
        bench.drive.arm_latch(trigger).unwrap();
        assert_eq!(bench.drive.latched(trigger).unwrap(), None);
    }
    bench.set(|inputs| inputs.probes[0] = true);
    bench.drive.move_to(4000).unwrap();
    bench.set(|inputs| inputs.probes[0] = false);
    assert_eq!(bench.drive.latched(Trigger::Rising(1)).unwrap(), Some(3000));
    assert_eq!(bench.drive.latched(Trigger::Falling(1)).unwrap(), Some(4000));
    bench.drive.arm_latch(Trigger::Rising(1)).unwrap();
    assert_eq!(bench.drive.latched(Trigger::Rising(1)).unwrap(), None);
}

/// Two of them fill a bus at 500 kbit/s while they move.
#[test]
fn its_pdos_of_the_factory_have_no_inhibit_time() {
    let found = ByPdo::new().drive.unpaced_pdos().unwrap();
    let found: Vec<_> = found.iter().map(|pdo| (pdo.number, pdo.object, pdo.inhibit)).collect();
    let expected = [(3, od::POSITION_ACTUAL_VALUE.address()), (4, od::VELOCITY_ACTUAL_VALUE.address())];
    assert_eq!(found, expected.map(|(number, object)| (number, object, Duration::ZERO)));
}

#[test]
fn its_pdos_are_mapped_freely() {
    const ORDER: Mapping<Rpdo, (od::Position, od::Speed)> =
        Mapping::receive().with(od::TARGET_POSITION).with(od::PROFILE_VELOCITY);
    const ACTUAL: Mapping<Tpdo, (od::Position, od::ManufacturerStatus)> =
        Mapping::transmit().with(od::POSITION_ACTUAL_VALUE).with(od::MANUFACTURER_STATUS_REGISTER);
    let mut bench = BySdo::new();
    let id = |base| PdoCobId::valid(CobId::of_node(base, NODE));
    let settings = [
        PdoSettings::of(2, id(0x300), TransmissionType::EventProfile, &ORDER),
        PdoSettings::of(3, id(0x380), TransmissionType::EventProfile, &ACTUAL),
    ];
    bench.drive.configure_pdos(&settings).unwrap();
    bench.drive.enable().unwrap();
    bench.drive.send_pdo(2, &ORDER, (od::Position(36_000), od::Speed(15_000))).unwrap();
    assert_eq!(bench.drive.read(od::PROFILE_VELOCITY).unwrap(), od::Speed(15_000));
    bench.drive.move_to(700).unwrap();
    let (position, status) = bench.drive.receive_pdo(3, &ACTUAL).unwrap();
    assert_eq!((position, status.hardware_enable()), (od::Position(700), true));
}

#[cfg(feature = "tokio")]
#[tokio::test]
async fn it_travels_and_homes_on_a_network() {
    use lexican_runtime::host::tokio::Network;

    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedServo::new(bus.now(), &MODEL, NODE));
    let network = Network::spawn(bus.link()).unwrap();
    let mut drive = kollmorgen_akd::driver::tokio::Drive::connect(network, NODE).await.unwrap();
    drive.enable().await.unwrap();
    assert_eq!(drive.move_to(5000).await.unwrap(), Outcome::Reached { position: 5000 });
    let homed = drive.home(od::HomingMethod::PRESENT_POSITION.0).await.unwrap();
    assert!(matches!(homed, HomingOutcome::Attained { position: 0 }), "{homed:?}");
    drive.disable().await.unwrap();
}

/// The names of the two kinds are those that programs use.
#[test]
fn both_kinds_connect() {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedServo::new(bus.now(), &MODEL, NODE));
    let drive = Drive::connect(bus.link(), NODE).unwrap();
    FreeDrive::connect(drive.release(), NODE).unwrap();
}
