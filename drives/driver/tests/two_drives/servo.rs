//! A servo with its description, mostly as in CiA 402: the state machine with 6061h, orders by SDO or PDO, a status
//! register of 32 bits, a set-point bit that is cleared after its acknowledgement, homing, and parameters that are
//! stored on command.

use lexican_driver::description::{
    Approach, Calibration, Condition, Description, Homing, Identity, ModeObjects, Number, Objects, Orders, Outputs,
    Pdo, Signal, StatusBits, Store, Test, Velocities,
};
use lexican_driver::{ByteOrder, Cause, Code, Codes, Direction, Error, Kind, Missing, Mode, Outcome, VelocityOutcome};
use lexican_runtime::host::VirtualLink;
use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::{self, Modes};
use lexican_runtime::{Duration, NodeId};

#[cfg(feature = "tokio")]
use crate::script::bus;
use crate::script::{Rig, Sheet};

/// The kind whose data all go by SDO.
pub(crate) enum BySdo {}

impl Kind for BySdo {
    const DESCRIPTION: &'static Description = &SERVO;
}

/// The kind whose control word and status word go by PDO.
pub(crate) enum ByPdo {}

impl Kind for ByPdo {
    const DESCRIPTION: &'static Description = &Description {
        outputs: Outputs {
            control: Some(Pdo { base: 0x200, signals: &[Signal::ControlWord] }),
            position: None,
            velocity: None,
        },
        inputs: &[Pdo { base: 0x180, signals: &[Signal::StatusWord] }],
        ..SERVO
    };
}

const SERVO: Description = Description {
    name: "servo",
    identity: Identity {
        vendor_ids: &[0x6A],
        profile: 402,
        names: Some(&["L", "M", "H", "U"]),
        characters: ByteOrder::LowFirst,
    },
    objects: Objects { system_word: Some(Number::new(0x1002, 0x00, DataType::Unsigned32)), ..Objects::CIA_402 },
    outputs: Outputs::BY_SDO,
    inputs: &[],
    status: StatusBits { standing: 100, ..Description::CIA_402.status },
    conditions: &[
        Condition { when: MOVING, refuses: Orders::FROM_REST, missing: Missing::NoTravel },
        Condition { when: SAFE, refuses: Orders::MOVE.and(Orders::ENABLE), missing: Missing::SafetyReleased },
        Condition { when: HARDWARE_ENABLE, refuses: Orders::MOVE.and(Orders::ENABLE), missing: Missing::EnableInput },
    ],
    codes: Codes {
        faults: &[
            Code { number: 0x3110, label: "F523", text: "bus over voltage" },
            Code { number: 0x3120, label: "F247", text: "bus under voltage" },
            Code { number: 0x4310, label: "F235", text: "excess temperature, heat sink" },
            Code { number: 0x8130, label: "F129", text: "life guard or heartbeat" },
            Code { number: 0x8611, label: "F439", text: "following error" },
        ],
        notices: &[Code { number: 0x4390, label: "n234", text: "control temperature sensor 1 high" }],
        order: ByteOrder::LowFirst,
    },
    modes: ModeObjects {
        // Without the velocity mode of frequency converters and the cyclic velocity mode.
        codes: Modes(&[
            (1, cia402::Mode::ProfilePosition),
            (3, cia402::Mode::ProfileVelocity),
            (4, cia402::Mode::ProfileTorque),
            (6, cia402::Mode::Homing),
            (7, cia402::Mode::InterpolatedPosition),
            (8, cia402::Mode::CyclicPosition),
        ]),
        ..Description::CIA_402.modes
    },
    velocity: Some(Velocities { reached: Test::of_system(1 << 9), ..Velocities::CIA_402 }),
    homing: Some(Homing { methods: &[1, 2, 8, 12, 17, 18, 24, 28, 33, 34, 35], ..Homing::CIA_402 }),
    calibration: Some(Calibration::Homing(35)),
    store: Some(Store::CIA_301),
    ..Description::CIA_402
};

const MOVING: Test = Test::of_system(1 << 0);
const SAFE: Test = Test::of_system(1 << 13);
const HARDWARE_ENABLE: Test = Test::of_system(1 << 29).clear();

/// A drive in SWITCH ON DISABLED, in position mode, its hardware enabled.
pub(crate) const SHEET: Sheet = Sheet {
    node: NodeId::literal(3),
    always_four_bytes: false,
    objects: &[
        (0x1000, 0x00, 4, 0x0002_0192),
        (0x1002, 0x00, 4, 0x2000_0000),
        (0x1003, 0x00, 1, 1),
        (0x1003, 0x01, 4, 0),
        (0x1003, 0x02, 4, 0),
        (0x1003, 0x03, 4, 0),
        (0x1008, 0x00, 4, u32::from_le_bytes(*b"M006") as u64),
        (0x100A, 0x00, 4, u32::from_le_bytes(*b"1.03") as u64),
        (0x1010, 0x01, 4, 1),
        (0x1018, 0x01, 4, 0x6A),
        (0x6040, 0x00, 2, 0),
        (0x6041, 0x00, 2, 0x0240),
        (0x605E, 0x00, 2, 2),
        (0x6060, 0x00, 1, 1),
        (0x6061, 0x00, 1, 1),
        (0x6064, 0x00, 4, 0),
        (0x606C, 0x00, 4, 0),
        (0x607A, 0x00, 4, 0),
        (0x607C, 0x00, 4, 0),
        (0x607D, 0x01, 4, 0),
        (0x607D, 0x02, 4, 0),
        (0x6071, 0x00, 2, 0),
        (0x6077, 0x00, 2, 0),
        (0x6098, 0x00, 1, 0),
        (0x60B8, 0x00, 2, 0),
        (0x60B9, 0x00, 2, 0),
        (0x60BA, 0x00, 4, 0),
        (0x60C1, 0x01, 4, 0),
        (0x60FF, 0x00, 4, 0),
    ],
};

pub(crate) type Drive<K> = lexican_driver::Drive<VirtualLink, K>;

/// Operates the drive in SWITCH ON DISABLED.
#[track_caller]
pub(crate) fn check<T: std::fmt::Debug>(
    script: &str,
    operate: impl FnOnce(&mut Drive<BySdo>) -> Result<T, Error>,
) -> Result<T, Error> {
    Rig::<BySdo>::new(SHEET).check(script, operate)
}

/// Operates the drive in OPERATION ENABLED.
#[track_caller]
pub(crate) fn enabled<K: Kind, T: std::fmt::Debug>(
    script: &str,
    operate: impl FnOnce(&mut Drive<K>) -> Result<T, Error>,
) -> Result<T, Error> {
    Rig::<K>::new(SHEET).check(&format!("= 6041:00 0237\n{script}"), operate)
}

#[test]
fn the_device_answers_as_the_manual_prints_it() {
    let rig = Rig::<BySdo>::new(SHEET);
    //
    assert_eq!(rig.device.lock().unwrap().answer_to("603#4041600000000000"), "583#4B41600040020000");
    assert_eq!(check("", Drive::firmware).unwrap(), "1.03", "characters as they come");
}

#[test]
fn it_is_enabled_by_sdo() {
    let script = "
        > 603#2B40600006000000    shutdown
        = 6041:00 0231
        > 603#2B40600007000000    switch on
        = 6041:00 0233
        > 603#2B4060000F000000    operation enable
        = 6041:00 0237
    ";
    check(script, Drive::enable).unwrap();
}

#[test]
fn it_is_enabled_by_pdo() {
    let script = "
        > 000#0103                NMT, as soon as there are PDOs
        > 203#0600                shutdown
        = 6041:00 0231
        < 183#3102
        > 203#0700                switch on
        = 6041:00 0233
        < 183#3302
        > 203#0F00                enable operation
        = 6041:00 0237
        < 183#3702
    ";
    Rig::<ByPdo>::new(SHEET).check(script, Drive::enable).unwrap();
}

#[test]
fn a_setpoint_is_released_as_soon_as_it_is_acknowledged() {
    let script = "
        > 203#0F00
        > 603#237A6000A08C0000    36000, 
        > 203#1F00                new setpoint
        = 6041:00 1237
        < 183#3712                setpoint acknowledge
        > 203#0F00
        = 6041:00 0237
        < 183#3702
        ~ 300
        = 6064:00 8CA0
        = 6041:00 0637
        < 183#3706                target reached
    ";
    let outcome = enabled::<ByPdo, _>(script, |drive| drive.move_to(36_000)).unwrap();
    assert_eq!(outcome, Outcome::Reached { position: 36_000 });
}

/// A new description begins like this: the name of a drive, and its limits of positions, are optional.
#[test]
fn a_description_may_say_no_more_than_whose_drive_it_is() {
    enum Plain {}
    impl Kind for Plain {
        const DESCRIPTION: &'static Description = &Description {
            identity: Identity { vendor_ids: &[0x6A], ..Description::CIA_402.identity },
            outputs: Outputs::BY_SDO,
            inputs: &[],
            ..Description::CIA_402
        };
    }
    let script = "
        = 6041:00 0237
        @ travel-by-sdo 36000 1237
        = 6041:00 0237
        ~ 300
        = 6064:00 8CA0
        = 6041:00 0637
    ";
    for lacking in [&[0x607D][..], &[0x1008, 0x607D]] {
        let objects: Vec<_> = SHEET.objects.iter().copied().filter(|(index, ..)| !lacking.contains(index)).collect();
        let mut rig = Rig::<Plain>::new(Sheet { objects: objects.leak(), ..SHEET });
        let outcome = rig.check(script, |drive| drive.move_to(36_000)).unwrap();
        assert_eq!(outcome, Outcome::Reached { position: 36_000 }, "without {lacking:04X?}");
    }
}

#[test]
fn an_interrupted_travel_is_not_over_although_its_drive_stands() {
    let script = "
        @ travel-by-sdo 36000 1237
        = 6041:00 0237
        = 606C:00 00001000
        > 603#2B4060000F010000    intermediate stop
        = 606C:00 00000000
        = 6041:00 0637            in halt, this bit says that it stands
        ~ 300
        = 6041:00 0637
        > 603#2B4060000F000000
        = 606C:00 00001000
        = 6041:00 0237
        ~ 300
        = 606C:00 00000000
        = 6064:00 8CA0
        = 6041:00 0637
    ";
    let outcome = enabled::<BySdo, _>(script, |drive| {
        drive.start_moving_to(36_000)?;
        drive.interrupt()?;
        let other = drive.move_to(0).unwrap_err();
        assert_eq!(other.to_string(), "the drive would refuse: its travel is interrupted");
        let mode = drive.set_mode(Mode::Velocity).unwrap_err();
        assert_eq!(mode.to_string(), "the drive would refuse: its travel is interrupted");
        drive.set_patience(Duration::from_millis(400));
        assert!(matches!(drive.finish()?, Outcome::TimedOut { .. }));
        drive.resume()?;
        drive.finish()
    });
    assert_eq!(outcome.unwrap(), Outcome::Reached { position: 36_000 });
    let nothing = enabled::<BySdo, _>("", Drive::interrupt);
    assert_eq!(nothing.unwrap_err().to_string(), "the drive would refuse: no travel is under way");
}

#[test]
fn a_travel_that_somebody_else_has_ended_is_forgotten_when_the_drive_is_enabled() {
    let script = "
        @ travel 36000 1237
        = 6041:00 0233            another manager disables operation
        > 000#0103
        > 203#0F00
        = 6041:00 0237
        @ travel 0 1237
        = 6041:00 0637
    ";
    let outcome = enabled::<ByPdo, _>(script, |drive| {
        drive.start_moving_to(36_000)?;
        drive.pass(Duration::from_millis(100))?;
        drive.enable()?;
        drive.move_to(0)
    });
    assert_eq!(outcome.unwrap(), Outcome::Reached { position: 0 });
}

/// The description has no window for settling: the drive's target shows whose travel has ended.
#[test]
fn a_travel_that_another_manager_leads_elsewhere_has_not_reached_its_target() {
    let script = "
        @ travel 36000 1237
        = 6041:00 0237
        ~ 300
        = 607A:00 FFFFFED4        another manager
        = 6064:00 FFFFFED4
        = 6041:00 0637
    ";
    let outcome = enabled::<ByPdo, _>(script, |drive| drive.move_to(36_000)).unwrap();
    assert_eq!(outcome, Outcome::Overridden { position: -300 });
}

/// In Halt, the bit "target reached" means that the drive stands.
#[test]
fn a_travel_that_somebody_else_halts_is_not_over() {
    let script = "
        @ travel 36000 1237
        = 6040:00 010F            another manager
        = 6041:00 0637
        ~ 300
        = 6040:00 000F            it takes back Halt
        = 6041:00 0237
        ~ 300
        = 6064:00 8CA0
        = 6041:00 0637
    ";
    let outcome = enabled::<ByPdo, _>(script, |drive| {
        drive.start_moving_to(36_000)?;
        drive.pass(Duration::from_millis(200))?;
        let other = drive.move_to(0).unwrap_err();
        assert_eq!(other.to_string(), "the drive would refuse: its travel is interrupted");
        drive.finish()
    });
    assert_eq!(outcome.unwrap(), Outcome::Reached { position: 36_000 });
}

/// The next control word without Halt would resume the travel, so it comes only when the travel is resumed or
/// forgotten.
#[test]
fn a_travel_that_is_stopped_is_not_forgotten() {
    let script = "
        @ travel 36000 1237
        = 6041:00 0237
        = 606C:00 00001000
        > 203#0F01
        = 606C:00 00000000
        > 203#0F01            again, since it might not have begun to move
        = 6041:00 0637
        > 203#0F00
        = 606C:00 00001000
        = 6041:00 0237
    ";
    enabled::<ByPdo, _>(script, |drive| {
        drive.start_moving_to(36_000)?;
        drive.stop()?;
        let other = drive.move_to(0).unwrap_err();
        assert_eq!(other.to_string(), "the drive would refuse: its travel is interrupted");
        drive.resume()
    })
    .unwrap();
}

#[test]
fn a_travel_that_a_limit_ends_is_told_as_such() {
    let script = "
        @ travel 36000 1237
        = 6041:00 0A37            internal limit active, and still braking
        = 606C:00 00001000
        ~ 300
        = 6064:00 00000100
        = 606C:00 00000000
    ";
    let outcome = enabled::<ByPdo, _>(script, |drive| drive.move_to(36_000)).unwrap();
    assert_eq!(outcome, Outcome::Limit { position: 0x100 });
}

#[test]
fn an_order_that_is_not_taken_is_forgotten_outside_operation_enabled() {
    let script = "
        > 603#2B4060000F000000
        > 603#237A6000A08C0000
        > 603#2B4060001F000000    nothing happens
        > 603#2B4060000F010000    stop
        > 603#2B40600007000000    disable operation
        = 6041:00 0233
    ";
    let error = enabled::<BySdo, _>(script, |drive| drive.start_moving_to(36_000)).unwrap_err();
    // A present obstacle is reported first.
    assert_eq!(error.to_string(), "the drive would refuse: it is in SWITCHED ON, not in OPERATION ENABLED");
}

#[test]
fn it_runs_with_mode_3_and_tells_so_in_6061h() {
    let script = "
        > 603#23FF600000000000    nothing runs before it is ordered
        > 603#2F60600003000000    profile velocity
        @ run 4100
        > 603#2B4060000F010000    intermediate stop
        = 606C:00 00000030        it never stands quite still
    ";
    let outcome = enabled::<BySdo, _>(script, |drive| {
        drive.set_mode(Mode::Velocity)?;
        let outcome = drive.run_at(0x4100)?;
        drive.stop()?;
        Ok(outcome)
    });
    assert_eq!(outcome.unwrap(), VelocityOutcome::Reached { velocity: 0x4100 });
    let mode = check("> 603#23FF600000000000\n> 603#2F60600003000000", |drive| drive.set_mode(Mode::Velocity));
    assert!(matches!(mode, Err(Error::ModeNotTaken { ordered: 3, shown: 1 })), "{mode:?}");
}

#[test]
fn it_turns_with_a_torque() {
    let script = "
        > 603#2B71600000000000    nothing turns before it is ordered
        > 603#2F60600004000000    profile torque
        = 6061:00 04
        > 603#2B4060000F010000
        > 603#2B71600090010000    torque setpoint
        > 603#2B4060000F000000    enable operation
        = 6077:00 0000018E
        > 603#2B7160006AFF0000
        > 603#2B4060000F000000
        > 603#2B4060000F010000    intermediate stop
    ";
    let turned = enabled::<BySdo, _>(script, |drive| {
        drive.set_mode(Mode::Torque)?;
        drive.apply_torque(400)?;
        let turned = drive.torque()?;
        drive.apply_torque(-150)?;
        drive.stop()?;
        Ok(turned)
    });
    assert_eq!(turned.unwrap(), 398);
    let refused = enabled::<BySdo, _>("", |drive| drive.apply_torque(1));
    assert_eq!(refused.unwrap_err().to_string(), "the drive would refuse: it is in positioning mode");
}

#[test]
fn a_quick_stop_can_be_left_for_operation_enabled() {
    let script = "
        = 606C:00 00004100
        > 603#2B40600002000000
        = 6041:00 0217
        = 606C:00 00000000
        > 603#2B4060000F000000    transition 16: bit 2 is set again
        = 6041:00 0237
    ";
    enabled::<BySdo, _>(script, |drive| {
        drive.quick_stop()?;
        drive.enable()
    })
    .unwrap();
}

#[test]
fn a_fault_is_told_by_its_emergency_or_else_by_the_history() {
    let script = "
        < 081#1043080100000000
        = 6041:00 021F            FAULT REACTION ACTIVE
        ~ 20
        = 6041:00 0218
        > 601#2B40600000000000
        > 601#2B40600080000000
        < 081#0000080000000000
        = 6041:00 0250
        > 601#2B40600000000000    bit 7 is cleared by the host
    ";
    let sheet = Sheet { node: NodeId::literal(1), ..SHEET };
    let cause = Rig::<BySdo>::new(sheet).check(script, Drive::reset_fault).unwrap();
    assert_eq!(cause.unwrap().to_string(), "F235 (4310): excess temperature, heat sink");
    // The upper half of an entry has other data.
    let history = check("= 1003:01 00088611", Drive::cause).unwrap();
    assert!(matches!(history, Cause::Fault(Code { label: "F439", .. })), "{history}");
    let warning = check("= 1003:01 00084390", Drive::cause).unwrap();
    assert!(matches!(warning, Cause::Notice(_)), "{warning}");
}

#[test]
fn what_is_missing_is_named_before_anything_moves() {
    for (system, missing) in [
        ("00000000", "its enable input is not active"),
        ("00002000", "a safety function has it; its enable input is not active"),
    ] {
        let result = check(&format!("= 1002:00 {system}"), Drive::enable);
        assert_eq!(result.unwrap_err().to_string(), format!("the drive would refuse: {missing}"));
    }
    let moving = enabled::<BySdo, _>("= 1002:00 20000001", |drive| drive.set_mode(Mode::Velocity));
    assert_eq!(moving.unwrap_err().to_string(), "the drive would refuse: a travel is under way");
    let faulty = check("= 6041:00 021F\n= 1003:01 00003110", |drive| drive.move_to(0));
    assert_eq!(
        faulty.unwrap_err().to_string(),
        "the drive would refuse: it is in fault (F523 (3110): bus over voltage)"
    );
    let outside = enabled::<BySdo, _>("= 607D:01 FFFFFFFF\n= 607D:02 00000001", |drive| drive.move_to(2));
    assert_eq!(outside.unwrap_err().to_string(), "the drive would refuse: the target 2 is outside its limits, -1 to 1");
}

#[test]
fn what_it_does_not_have_is_refused_before_anything_is_sent() {
    let mut rig = Rig::<BySdo>::new(SHEET);
    rig.check_unsupported("the servo has no inching operation", |drive| drive.inch(Direction::Positive));
    rig.check_unsupported("the servo has no inching operation", Drive::step);
    rig.check_unsupported("the servo has no inching operation", Drive::stop_inching);
    rig.check_unsupported("the servo has no choice of approach", |drive| drive.set_approach(Approach::Positive));
    rig.check_unsupported("the servo has no such factory settings to restore", |drive| drive.restore(None));
    rig.check_unsupported("the servo has no units that are known", Drive::units);
    rig.check_unsupported("the servo has no torque deactivation", Drive::torque_deactivated);
    rig.check_unsupported("the servo has no switch for emergency messages", |drive| drive.set_emergencies(true));
}

#[test]
fn it_is_calibrated_by_homing_on_the_spot() {
    let start = "
        > 603#2F60600006000000    homing
        = 6061:00 06
        > 603#237C6000A8610000    reference offset 25000
        > 603#2F98600023000000    method 35
        > 603#2B4060000F000000    the edge begins below
        > 603#2B4060001F000000    homing operation start
        = 6041:00 0237            homing not finished
        ~ 100
    ";
    let end = "
        > 603#2B4060000F000000
        > 603#2F60600001000000    back to profile position
        = 6061:00 01
    ";
    enabled::<BySdo, _>(&format!("{start} = 6041:00 1637\n{end}"), |drive| drive.calibrate(25_000)).unwrap();
    let failed = enabled::<BySdo, _>(&format!("{start} = 6041:00 2237\n{end}"), |drive| drive.calibrate(25_000));
    assert!(matches!(failed, Err(Error::NotCalibrated { status_word: 0x2237 })), "{failed:?}");
    let disabled = check("", |drive| drive.calibrate(0)).unwrap_err();
    assert_eq!(disabled.to_string(), "the drive would refuse: it is in SWITCH ON DISABLED, not in OPERATION ENABLED");
}

#[test]
fn parameters_are_kept_on_command() {
    // "save"
    check("> 603#2310100173617665", Drive::store).unwrap();
}

#[test]
fn a_driver_that_is_dropped_stops_it_by_sdo() {
    let mut rig = Rig::<BySdo>::new(SHEET);
    let script = "
        = 6041:00 0237
        @ run 4100
    ";
    rig.check(script, |drive| drive.run_at(0x4100)).unwrap();
    rig.follow("> 603#2B4060000F010000");
    rig.check_dropped();
}

#[cfg(feature = "tokio")]
#[tokio::test]
async fn the_other_shell_stops_it_by_sdo_too() {
    use lexican_runtime::host::tokio::Network;

    let (bus, device) = bus(SHEET);
    let network = Network::spawn(bus.link()).unwrap();
    let mut drive = lexican_driver::tokio::Drive::<BySdo>::connect_unprotected(network, SHEET.node).await.unwrap();
    let script = "
        = 6041:00 0237
        @ run 4100
        > 603#2B4060000F010000
    ";
    device.lock().unwrap().follow(bus.now(), script);
    drive.run_at(0x4100).await.unwrap();
    drop(drive);
    for _ in 0..100 {
        tokio::task::yield_now().await;
    }
    bus.advance(Duration::from_millis(10));
    assert!(device.lock().unwrap().is_through());
}
