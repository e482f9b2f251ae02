//! The driver against the simulated drive, in virtual time.

use std::sync::{Arc, Mutex};

use kollmorgen_akd::driver::DriveContext;
use kollmorgen_akd::driver::{
    AKD, AKD_BY_SDO, Description, Drive, Error, FreeDrive, HomingOutcome, Mode, Outcome, SetPoint, Trigger,
    VelocityOutcome,
};
use kollmorgen_akd::sim::{Causes, Inputs, MODEL, Machine, SimulatedServo, Storage};
use kollmorgen_akd::{ascii, fault, od};
use lexican_driver::description::{Number, SetPoints, Test};
use lexican_driver::sequence::Recovery;
use lexican_driver::{Any, Cause};
use lexican_runtime::host::{Fate, VirtualBus, VirtualLink};
use lexican_runtime::object::{Address, Mapping, Rpdo, Tpdo};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, Duration, NodeId};
use simulator::servo::FaultCodes;

const NODE: NodeId = NodeId::literal(3);

/// A driver and a simulated drive on a bus of their own.
struct Rig {
    bus: VirtualBus,
    servo: Arc<Mutex<SimulatedServo>>,
    drive: lexican_driver::Drive<VirtualLink, Any>,
}

impl Rig {
    fn by_pdo() -> Self {
        Rig::described(&AKD)
    }

    fn by_sdo() -> Self {
        Rig::described(&AKD_BY_SDO)
    }

    fn described(description: &'static Description) -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let servo = Arc::new(Mutex::new(SimulatedServo::new(bus.now(), &MODEL, NODE)));
        bus.attach(Arc::clone(&servo));
        let drive = lexican_driver::Drive::connect_described_unprotected(bus.link(), NODE, description).unwrap();
        Rig { bus, servo, drive }
    }

    fn storage(&self, look: impl FnOnce(&mut dyn Storage)) {
        self.servo.lock().unwrap().with_servo(self.bus.now(), |_, od| look(od));
    }

    fn set(&self, change: impl FnOnce(&mut Inputs)) {
        self.servo.lock().unwrap().set_inputs(self.bus.now(), change);
    }
}

fn code(label: &str) -> u16 {
    fault::find(label).unwrap().number
}

fn exercise(mut rig: Rig) {
    let drive = &mut rig.drive;
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
    exercise(Rig::by_pdo());
    exercise(Rig::by_sdo());
}

#[test]
fn it_homes_by_every_method() {
    for method in kollmorgen_akd::driver::AKD.homing.unwrap().methods {
        let mut rig = Rig::by_sdo();
        rig.set(|inputs| {
            inputs.machine = Machine {
                negative_limit: Some(-5000.0),
                positive_limit: Some(5000.0),
                home_switch: Some((-200.0, 200.0)),
                index: Some((50.0, 1000.0)),
            };
        });
        rig.drive.enable().unwrap();
        let outcome = rig.drive.home(*method).unwrap();
        assert!(matches!(outcome, HomingOutcome::Attained { .. }), "{method}: {outcome:?}");
        assert_eq!(rig.drive.mode().unwrap(), Some(Mode::Positioning), "{method}");
    }
    let mut rig = Rig::by_sdo();
    rig.drive.enable().unwrap();
    let failed = rig.drive.home(od::HomingMethod::NEGATIVE_LIMIT_SWITCH.0).unwrap();
    assert!(matches!(failed, HomingOutcome::Failed { .. }), "no switch: {failed:?}");
}

/// Its single-turn encoder does not keep the reference without power.
#[test]
fn it_says_whether_it_is_referenced() {
    let mut rig = Rig::by_pdo();
    let recovery = Recovery::within(Duration::from_secs(10));
    assert_eq!(rig.drive.recover(&recovery).unwrap().referenced, Some(false));
    rig.drive.enable().unwrap();
    rig.drive.home(od::HomingMethod::PRESENT_POSITION.0).unwrap();
    assert_eq!(rig.drive.recover(&recovery).unwrap().referenced, Some(true));
    for on in [false, true] {
        rig.servo.lock().unwrap().set_power(rig.bus.now(), on);
    }
    assert_eq!(rig.drive.recover(&recovery).unwrap().referenced, Some(false));
}

#[test]
fn faults_and_warnings_have_their_numbers() {
    let mut rig = Rig::by_pdo();
    rig.drive.enable().unwrap();
    rig.set(|inputs| inputs.warnings = code("n301").into());
    rig.drive.start_moving_to(1_000_000).unwrap();
    assert_eq!(rig.drive.warning().unwrap().unwrap().to_string(), "n301 (7186): Motor overheated");
    rig.set(|inputs| inputs.faults = code("F439").into());
    let outcome = rig.drive.finish().unwrap();
    assert!(matches!(outcome, Outcome::Fault(Cause::Fault(code)) if code.label == "F439"), "{outcome:?}");
    assert!(matches!(rig.drive.reset_fault(), Err(Error::Fault(_))), "its cause is still there");
    rig.set(|inputs| (inputs.faults, inputs.warnings) = (Causes::NONE, Causes::NONE));
    let was = rig.drive.reset_fault().unwrap().unwrap();
    assert_eq!(was.to_string(), "F439 (8611): Following error");
    assert!(rig.drive.fault_history().unwrap().contains(&was));
    rig.drive.clear_fault_history().unwrap();
    assert_eq!(rig.drive.fault_history().unwrap(), []);
}

#[test]
fn what_is_missing_is_named() {
    let mut rig = Rig::by_pdo();
    rig.set(|inputs| inputs.enable = false);
    let refused = rig.drive.enable().unwrap_err();
    assert_eq!(refused.to_string(), "the drive would refuse: its enable input is not active");
    rig.set(|inputs| (inputs.enable, inputs.warnings) = (true, code("n602").into()));
    let refused = rig.drive.enable().unwrap_err();
    assert_eq!(refused.to_string(), "the drive would refuse: a safety function has it");
}

#[test]
fn inputs_latch_positions() {
    for input in [1, 2] {
        let mut rig = Rig::by_pdo();
        let level = |rig: &Rig, level| rig.set(|inputs| inputs.probes[usize::from(input) - 1] = level);
        rig.drive.enable().unwrap();
        rig.drive.move_to(2000).unwrap();
        // No latch is armed.
        [true, false].into_iter().for_each(|on| level(&rig, on));
        rig.drive.move_to(3000).unwrap();
        for trigger in [Trigger::Rising(input), Trigger::Falling(input)] {
            rig.drive.arm_latch(trigger).unwrap();
            assert_eq!(rig.drive.latched(trigger).unwrap(), None);
        }
        level(&rig, true);
        rig.drive.move_to(4000).unwrap();
        level(&rig, false);
        let latched = |rig: &mut Rig| {
            [Trigger::Rising(input), Trigger::Falling(input)].map(|trigger| rig.drive.latched(trigger).unwrap())
        };
        assert_eq!(latched(&mut rig), [Some(3000), Some(4000)], "input {input}");
        rig.drive.move_to(5000).unwrap();
        [true, false].into_iter().for_each(|on| level(&rig, on));
        assert_eq!(latched(&mut rig), [Some(3000), Some(4000)], "input {input}: valid ones are kept");
        rig.drive.arm_latch(Trigger::Rising(input)).unwrap();
        assert_eq!(rig.drive.latched(Trigger::Rising(input)).unwrap(), None);
    }
}

/// 6.2.2.3 and 7.2.1.9: the drive answers in parts of four characters; how often it is asked.
#[test]
fn an_answer_ends_with_an_empty_line() {
    for (shown, reads, answer) in [
        ("\r\n\r\n", 1, String::new()),
        ("x\n\r\n", 1, "x".to_owned()),
        (">-ok", 1024, "ok".to_owned() + &">-ok".repeat(1023)),
        ("\0", 1, String::new()),
    ] {
        let mut rig = Rig::by_sdo();
        rig.storage(|od| {
            let entry = od.entry(od::ASCII_CHANNEL.response().address()).unwrap();
            od.write(&entry, 0, shown.as_bytes(), true).unwrap();
        });
        let asked = Arc::new(Mutex::new(0));
        let count = Arc::clone(&asked);
        rig.bus.set_fate(move |_, frame| {
            let read = frame.data().starts_with(&[0x40, 0x26, 0x20, 2]);
            let mut count = count.lock().unwrap();
            *count += u32::from(read);
            assert!(*count <= 1024, "it asks again and again");
            Fate::Deliver
        });
        let said = rig.drive.run(async |drive: DriveContext| ascii::ask(&drive, "DRV.FAULTS").await).unwrap();
        assert_eq!((said, *asked.lock().unwrap()), (answer, reads), "{shown:?}");
    }
}

/// 6.2.1.7: Y is L, M, H or U.
#[test]
fn other_drives_are_refused() {
    for (name, fits) in [("L006", true), ("M024", true), ("H003", true), ("U012", true), ("X006", false)] {
        let bus = VirtualBus::with_bit_rate(500);
        let mut servo = SimulatedServo::new(bus.now(), &MODEL, NODE);
        servo.with_servo(bus.now(), |_, od| {
            let entry = od.entry(od::MANUFACTURER_DEVICE_NAME.address()).unwrap();
            od.write(&entry, 0, name.as_bytes(), true).unwrap();
        });
        bus.attach(servo);
        let connected = lexican_driver::Drive::connect_described_unprotected(bus.link(), NODE, &AKD);
        assert_eq!(connected.is_ok(), fits, "{name}");
    }
}

/// The numbers of chapters 6.2, 6.4, 6.5 and 7.1.
#[test]
fn the_description_is_that_of_the_manual() {
    let akd: &Description = &AKD;
    assert_eq!((akd.name, MODEL.name), ("Kollmorgen AKD", "AKD"));
    assert_eq!(akd.objects.position_window, Some(Number::of(od::IN_POSITION_WINDOW)));
    assert_eq!((akd.status.standing, akd.status.velocity_unit), (100, "1/1000 rev/min"));
    assert_eq!(akd.velocity.unwrap().reached, Test::of_system(1 << 9));
    let SetPoints { relative, blended, at_once } = akd.set_points.unwrap();
    assert_eq!((relative, blended, at_once), (Some(1 << 6), Some(1 << 5), None));
    assert_eq!(akd.reactions.len(), 0);
    let index = akd.latches.unwrap().rows.iter().find(|row| matches!(row.trigger, Trigger::Index)).unwrap();
    assert_eq!(index.position, Number::of(od::LATCH_POSITION_1_POSITIVE_EDGE));
}

/// 6.1: faults that the servo notices by itself.
#[test]
fn the_simulated_drive_raises_the_faults_of_the_manual() {
    let FaultCodes { following_error, blocked, undervoltage, cycle_missed, connection_lost } = MODEL.codes;
    let codes = [following_error, blocked, undervoltage, cycle_missed, connection_lost];
    assert_eq!(codes, [Some(code("F439")), None, Some(0x3220), Some(0x8780), Some(0x8130)]);
    let mut rig = Rig::by_sdo();
    rig.drive.enable().unwrap();
    rig.drive.write(od::FOLLOWING_ERROR_WINDOW, od::PositionWindow(100)).unwrap();
    rig.set(|inputs| inputs.blocked = true);
    let outcome = rig.drive.move_to(5000).unwrap();
    assert!(matches!(outcome, Outcome::Fault(Cause::Fault(code)) if code.label == "F439"), "{outcome:?}");
    rig.storage(|od| assert_eq!(od.raw(Address::new(0x1001, 0)), Some(0x20), "no generic error"));
    assert_eq!(fault::find("F535").unwrap().text, "without a description");
}

#[test]
fn a_moving_drive_keeps_its_mode() {
    let mut rig = Rig::by_sdo();
    rig.drive.enable().unwrap();
    rig.drive.start_moving_to(100_000).unwrap();
    let refused = rig.drive.calibrate(0).unwrap_err();
    assert_eq!(refused.to_string(), "the drive would refuse: a travel is under way");
    // A travel ordered by another manager counts as one, too.
    rig.drive.finish().unwrap();
    for (index, value) in [(0x607A, 200_000), (0x6040, 0x0F), (0x6040, 0x1F)] {
        rig.storage(|od| od.set_raw(Address::new(index, 0), value));
    }
    let refused = rig.drive.calibrate(0).unwrap_err();
    assert_eq!(refused.to_string(), "the drive would refuse: a travel is under way");
    rig.drive.write(od::MODES_OF_OPERATION, od::OperatingMode::PROFILE_VELOCITY).unwrap();
    assert_eq!(rig.drive.read(od::MODES_OF_OPERATION_DISPLAY).unwrap(), od::OperatingMode::PROFILE_POSITION);
    rig.bus.advance(Duration::from_secs(60));
    assert_eq!(rig.drive.read(od::MODES_OF_OPERATION_DISPLAY).unwrap(), od::OperatingMode::PROFILE_VELOCITY);
    rig.drive.set_mode(Mode::Positioning).unwrap();
    assert!(matches!(rig.drive.set_mode(Mode::CyclicVelocity), Err(Error::Unsupported { .. })));
    rig.set(|inputs| inputs.warnings = code("n602").into());
    let refused = rig.drive.move_to(0).unwrap_err();
    assert_eq!(refused.to_string(), "the drive would refuse: a safety function has it");
    rig.set(|inputs| (inputs.warnings, inputs.enable) = (Causes::NONE, false));
    let refused = rig.drive.move_to(0).unwrap_err().to_string();
    assert!(refused.ends_with("; its enable input is not active"), "{refused}");
    // The velocity mode of frequency converters is not supported.
    rig.storage(|od| od.set_raw(Address::new(0x6060, 0), 2));
    rig.storage(|od| assert_eq!(od.raw(Address::new(0x6061, 0)), Some(1)));
}

/// Two such drives fill a bus at 500 kbit/s while they move.
#[test]
fn its_pdos_of_the_factory_have_no_inhibit_time() {
    let found = Rig::by_pdo().drive.unpaced_pdos().unwrap();
    let found: Vec<_> = found.iter().map(|pdo| (pdo.number, pdo.object, pdo.inhibit)).collect();
    let expected = [(3, od::POSITION_ACTUAL_VALUE.address()), (4, od::VELOCITY_ACTUAL_VALUE.address())];
    assert_eq!(found, expected.map(|(number, object)| (number, object, Duration::ZERO)));
}

#[test]
fn its_pdos_are_mapped_freely() {
    const ORDER: Mapping<Rpdo, (od::Position, od::Speed), od::Device> =
        Mapping::receive().with(od::TARGET_POSITION).with(od::PROFILE_VELOCITY);
    const ACTUAL: Mapping<Tpdo, (od::Position, od::ManufacturerStatus), od::Device> =
        Mapping::transmit().with(od::POSITION_ACTUAL_VALUE).with(od::MANUFACTURER_STATUS_REGISTER);
    let mut rig = Rig::by_sdo();
    let id = |base| PdoCobId::valid(CobId::of_node(base, NODE));
    let settings = [
        PdoSettings::of(2, id(0x300), TransmissionType::EventProfile, &ORDER),
        PdoSettings::of(3, id(0x380), TransmissionType::EventProfile, &ACTUAL),
    ];
    rig.drive.configure_pdos(&settings).unwrap();
    rig.drive.enable().unwrap();
    rig.drive.send_pdo(2, &ORDER, (od::Position(36_000), od::Speed(15_000))).unwrap();
    assert_eq!(rig.drive.read(od::PROFILE_VELOCITY).unwrap(), od::Speed(15_000));
    rig.drive.move_to(700).unwrap();
    let (position, status) = rig.drive.receive_pdo(3, &ACTUAL).unwrap();
    assert_eq!((position, status.hardware_enable()), (od::Position(700), true));
}

#[cfg(feature = "tokio")]
#[tokio::test]
async fn it_travels_and_homes_on_a_network() {
    use lexican_runtime::host::tokio::Network;

    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedServo::new(bus.now(), &MODEL, NODE));
    let network = Network::spawn(bus.link()).unwrap();
    let mut drive = kollmorgen_akd::driver::tokio::Drive::connect_unprotected(network, NODE).await.unwrap();
    drive.enable().await.unwrap();
    assert_eq!(drive.move_to(5000).await.unwrap(), Outcome::Reached { position: 5000 });
    let homed = drive.home(od::HomingMethod::PRESENT_POSITION.0).await.unwrap();
    assert!(matches!(homed, HomingOutcome::Attained { position: 0 }), "{homed:?}");
    drive.disable().await.unwrap();
}

/// The two kinds have the names that programs use.
#[test]
fn both_kinds_connect() {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedServo::new(bus.now(), &MODEL, NODE));
    let drive = Drive::connect_unprotected(bus.link(), NODE).unwrap();
    FreeDrive::connect_unprotected(drive.release(), NODE).unwrap();
}

#[test]
fn a_drive_of_another_vendor_is_not_taken_for_this_one() {
    let rig = Rig::by_pdo();
    rig.storage(|od| od.set_raw(Address::new(0x1018, 1), 0x195));
    let other = lexican_driver::Drive::<_, Any>::connect_described_unprotected(rig.bus.link(), NODE, &AKD);
    assert!(matches!(other, Err(Error::NotThisDrive { vendor_id: 0x195, .. })), "{:?}", other.err());
}
