//! The SIKO AG02: state changes by PDO only, four bytes in every SDO, an enable bit of EMCY in another place.
//!
//! Numbers in parentheses are lines of the German manual of 02/2018. The frames are those of its table 25 (chapter
//! 10.11) and of the examples of chapter 10.2.8, node 5.

use lexican_driver::description::{
    Approach, Approaches, Calibration, Condition, ControlBits, EmergencySwitch, Gear, Identity, Inching, ModeObjects,
    Number, Objects, Orders, Outputs, Pdo, Release, Restore, Signal, StatusBits, Test, Times, UnitObjects, Velocities,
};
use lexican_driver::{
    ByteOrder, Cause, Code, Codes, Description, Direction, Error, Kind, Missing, Mode, Outcome, Parameter,
    ParameterSet, VelocityOutcome,
};
use lexican_runtime::object::{Address, DataType, Object, Rw};
use lexican_runtime::profile::cia402::{self, Command, Modes, State, Transition, Transitions};
use lexican_runtime::{Duration, NodeId};

use crate::script::{Rig, Sheet, bus};

pub(crate) enum Ag02 {}

impl Kind for Ag02 {
    const DESCRIPTION: &'static Description = &AG02;
}

const U8: DataType = DataType::Unsigned8;
const U16: DataType = DataType::Unsigned16;
const U32: DataType = DataType::Unsigned32;
const I32: DataType = DataType::Integer32;

static AG02: Description = Description {
    name: "SIKO AG02",
    // There is no 1008h, which tells it from the AG03/1, and the first character of 100Ah is in bits 31 to 24 (5884).
    identity: Identity { vendor_id: 0x195, profile: 402, names: None, characters: ByteOrder::HighFirst },
    objects: Objects {
        control_word: Number::new(0x6040, 0x00, U16),
        status_word: Number::new(0x6041, 0x00, U16),
        system_word: Some(Number::new(0x1002, 0x00, U16)),
        actual_position: Number::new(0x6064, 0x00, I32),
        actual_velocity: Number::new(0x606C, 0x00, I32),
        target_position: Number::new(0x607A, 0x00, I32).within(-9_999_999, 9_999_999),
        position_window: Some(Number::new(0x6067, 0x00, U16)),
        position_limits: Some([Number::new(0x607D, 0x01, I32), Number::new(0x607D, 0x02, I32)]),
        latest_fault: Number::new(0x1003, 0x01, U16),
    },
    // State changes by PDO only (4546, 4983); there is no RPDO2 and no TPDO2 (3617).
    outputs: Outputs {
        control: Some(Pdo { base: 0x200, signals: &[Signal::ControlWord] }),
        position: Some(Pdo { base: 0x400, signals: &[Signal::ControlWord, Signal::TargetPosition] }),
        velocity: Some(Pdo { base: 0x500, signals: &[Signal::ControlWord, Signal::TargetVelocity] }),
    },
    inputs: &[
        Pdo { base: 0x180, signals: &[Signal::StatusWord] },
        Pdo { base: 0x380, signals: &[Signal::StatusWord, Signal::Other(4)] },
        Pdo { base: 0x480, signals: &[Signal::StatusWord, Signal::Other(4)] },
    ],
    // 23h is the only command that writes (4034).
    always_four_bytes: true,
    transitions: TRANSITIONS,
    control: ControlBits { idle: 1 << 8, new_setpoint: 1 << 4, stop: 1 << 8 },
    status: StatusBits {
        remote: 1 << 9,
        target_reached: 1 << 10,
        internal_limit: 1 << 11,
        acknowledged: 1 << 12,
        positioning: Some(Test::of_status(1 << 14)),
        moving: Some(Test::of_status(1 << 15)),
        standing: 0,
        velocity_unit: "rev/min",
    },
    release: Release::WhenOver,
    // There is no 6061h, and 2 is profile velocity (8012).
    modes: ModeObjects {
        chosen: Number::new(0x6060, 0x00, U8),
        shown: None,
        codes: Modes(&[(1, cia402::Mode::ProfilePosition), (2, cia402::Mode::ProfileVelocity)]),
    },
    conditions: CONDITIONS,
    codes: Codes {
        faults: &[
            Code { number: 0x3120, label: "A", text: "supply voltage too low" },
            Code { number: 0x7121, label: "B", text: "shaft blocked" },
            Code { number: 0x2100, label: "C", text: "motor current too high" },
            Code { number: 0x4310, label: "D", text: "output stage too hot" },
            Code { number: 0xF000, label: "E", text: "absolute position cannot be read" },
        ],
        notices: &[
            Code { number: 0x8001, label: "", text: "bus: acknowledgement missing" },
            Code { number: 0x8002, label: "", text: "bus: form error" },
            Code { number: 0x8003, label: "", text: "bus: CRC error" },
            Code { number: 0x8004, label: "", text: "bus: stuff error" },
            Code { number: 0x8120, label: "", text: "CAN controller error passive" },
        ],
        // The table calls byte 0 the high byte (4263), which CiA 301 does not.
        order: ByteOrder::Either,
    },
    times: Times {
        reaction: Duration::from_millis(500),
        settling: Duration::from_millis(50),
        status_period: Duration::from_millis(150),
        braking: Duration::from_secs(100),
    },
    parameters: PARAMETERS,
    velocity: Some(Velocities {
        target: Number::new(0x60FF, 0x00, I32),
        reached: Test::of_status(1 << 10),
        gear: Some(Gear { object: Number::new(0x2102, 0x00, U8), most: &[(1, 100), (2, 80), (3, 35)], otherwise: 35 }),
    }),
    inching: Some(Inching {
        step: 1 << 13,
        positive: 1 << 14,
        negative: 1 << 15,
        width: Number::new(0x2415, 0x00, I32),
        busy: None,
        begins: Duration::from_millis(50),
    }),
    calibration: Some(Calibration::Write(Number::new(0x607C, 0x00, I32).within(-999_999, 999_999))),
    approaches: Some(Approaches {
        object: Number::new(0x2413, 0x00, U8),
        values: [(0, Approach::Direct), (1, Approach::Positive), (2, Approach::Negative)],
    }),
    store: None,
    restore: Some(Restore {
        all: Number::new(0x1011, 0x01, U32),
        sets: &[
            (ParameterSet::Standard, Number::new(0x1011, 0x02, U32)),
            (ParameterSet::Controller, Number::new(0x1011, 0x03, U32)),
        ],
        signature: Restore::SIGNATURE,
    }),
    torque_deactivation: None,
    temperature: None,
    battery: None,
    units: Some(UnitObjects {
        increments: 1600,
        spindle_pitch_10um: Number::new(0x2412, 0x00, U16),
        numerator: Number::new(0x6091, 0x01, U16),
        denominator: Number::new(0x6091, 0x02, U16),
    }),
    // Bit 30 sends them when set; bit 31 is not used (6108).
    emergencies: Some(EmergencySwitch { object: Number::new(0x1014, 0x00, U32), bit: 1 << 30, on_when_set: true }),
};

/// Transitions 1 to 14 (4672): no FAULT REACTION ACTIVE, and no way from QUICK STOP ACTIVE to OPERATION ENABLED.
const TRANSITIONS: Transitions = {
    use State as S;
    const fn by(number: u8, from: State, to: State, command: Command) -> Transition {
        Transition { number, from, to, cause: cia402::Cause::Command(command) }
    }
    Transitions(&[
        Transition { number: 1, from: S::NotReadyToSwitchOn, to: S::SwitchOnDisabled, cause: cia402::Cause::Internal },
        by(2, S::SwitchOnDisabled, S::ReadyToSwitchOn, Command::Shutdown),
        by(3, S::ReadyToSwitchOn, S::SwitchedOn, Command::SwitchOn),
        by(4, S::SwitchedOn, S::OperationEnabled, Command::EnableOperation),
        by(5, S::OperationEnabled, S::SwitchedOn, Command::SwitchOn),
        by(6, S::SwitchedOn, S::ReadyToSwitchOn, Command::Shutdown),
        by(7, S::ReadyToSwitchOn, S::SwitchOnDisabled, Command::DisableVoltage),
        by(8, S::OperationEnabled, S::ReadyToSwitchOn, Command::Shutdown),
        by(9, S::OperationEnabled, S::SwitchOnDisabled, Command::DisableVoltage),
        by(10, S::SwitchedOn, S::SwitchOnDisabled, Command::DisableVoltage),
        by(11, S::OperationEnabled, S::QuickStopActive, Command::QuickStop),
        by(12, S::QuickStopActive, S::SwitchOnDisabled, Command::DisableVoltage),
        by(14, S::Fault, S::SwitchOnDisabled, Command::FaultReset),
    ])
};

/// Bits of 1002h (95 to 312).
const CONDITIONS: &[Condition] = &[
    Condition { when: Test::of_system(1 << 10), refuses: Orders::MOVE, missing: Missing::EnableInput },
    Condition { when: Test::of_system(1 << 14 | 1 << 4), refuses: Orders::FROM_REST, missing: Missing::NoTravel },
    // Which switch is at which end is not told: inching away from it is left to the drive to refuse.
    Condition { when: Test::of_system(1 << 0), refuses: Orders::TRAVEL, missing: Missing::OffLimitSwitch(1) },
    Condition { when: Test::of_system(1 << 1), refuses: Orders::TRAVEL, missing: Missing::OffLimitSwitch(2) },
    Condition {
        when: Test::of_system(1 << 5),
        refuses: Orders::TRAVEL.and(Orders::INCH_POSITIVE),
        missing: Missing::BelowUpperLimit,
    },
    Condition {
        when: Test::of_system(1 << 6),
        refuses: Orders::TRAVEL.and(Orders::INCH_NEGATIVE),
        missing: Missing::AboveLowerLimit,
    },
];

const fn row(number: u8, index: u16, sub: u8, data_type: DataType, set: ParameterSet) -> Parameter {
    Parameter { number, address: Address::new(index, sub), data_type, set }
}

/// Chapter 8 (1237), as far as an object holds them.
const PARAMETERS: &[Parameter] = {
    use ParameterSet::{Controller, Standard};
    &[
        row(1, 0x2410, 0x01, U16, Controller),
        row(2, 0x2410, 0x02, U16, Controller),
        row(3, 0x2410, 0x03, U16, Controller),
        row(4, 0x2410, 0x04, U8, Controller),
        row(5, 0x2410, 0x05, U8, Controller),
        row(6, 0x2410, 0x06, U8, Controller),
        row(8, 0x2410, 0x08, U8, Controller),
        row(9, 0x2410, 0x09, U8, Controller),
        row(10, 0x6067, 0x00, U16, Standard),
        row(11, 0x6091, 0x01, U16, Standard),
        row(12, 0x6091, 0x02, U16, Standard),
        row(13, 0x2412, 0x00, U16, Standard),
        row(14, 0x607C, 0x00, I32, Standard),
        row(15, 0x607D, 0x02, I32, Standard),
        row(16, 0x607D, 0x01, I32, Standard),
        row(17, 0x2415, 0x00, I32, Standard),
        row(18, 0x607E, 0x00, U8, Standard),
        row(19, 0x2413, 0x00, U8, Standard),
        row(20, 0x6060, 0x00, U8, Standard),
    ]
};

/// A drive in SWITCH ON DISABLED with the 62:1 gear, at rest within its limits of ±1,000,000.
const SHEET: Sheet = Sheet {
    node: NodeId::literal(5),
    always_four_bytes: true,
    objects: &[
        (0x1000, 0x00, 4, 0x192),
        (0x1002, 0x00, 2, 0x0880),
        (0x1003, 0x01, 2, 0),
        (0x100A, 0x00, 4, 0x312E_3030),
        (0x1011, 0x01, 4, 0),
        (0x1011, 0x02, 4, 0),
        (0x1014, 0x00, 4, 0x85),
        (0x1018, 0x01, 4, 0x195),
        (0x2102, 0x00, 1, 2),
        (0x2410, 0x01, 2, 250),
        (0x2410, 0x02, 2, 5),
        (0x2410, 0x03, 2, 0),
        (0x2410, 0x04, 1, 50),
        (0x2410, 0x05, 1, 30),
        (0x2410, 0x06, 1, 50),
        (0x2410, 0x08, 1, 50),
        (0x2410, 0x09, 1, 30),
        (0x2412, 0x00, 2, 200),
        (0x2413, 0x00, 1, 0),
        (0x2415, 0x00, 4, 1600),
        (0x6041, 0x00, 2, 0x0250),
        (0x6060, 0x00, 1, 1),
        (0x6064, 0x00, 4, 0),
        (0x6067, 0x00, 2, 10),
        (0x606C, 0x00, 4, 0),
        (0x607C, 0x00, 4, 2500),
        (0x607D, 0x01, 4, 0xFFF0_BDC0),
        (0x607D, 0x02, 4, 1_000_000),
        (0x607E, 0x00, 1, 0),
        (0x6091, 0x01, 2, 5),
        (0x6091, 0x02, 2, 1),
        (0x60FF, 0x00, 4, 0),
    ],
};

type Drive = lexican_driver::Drive<lexican_runtime::host::VirtualLink, Ag02>;

/// In SWITCH ON DISABLED.
#[track_caller]
fn check<T: std::fmt::Debug>(script: &str, operate: impl FnOnce(&mut Drive) -> Result<T, Error>) -> Result<T, Error> {
    Rig::<Ag02>::new(SHEET).check(script, operate)
}

/// In OPERATION ENABLED, ready to travel: `0000 0x11 0011 0111` (4991).
#[track_caller]
fn enabled<T: std::fmt::Debug>(script: &str, operate: impl FnOnce(&mut Drive) -> Result<T, Error>) -> Result<T, Error> {
    check(&format!("= 6041:00 0337\n= 1002:00 0000\n{script}"), operate)
}

#[test]
fn the_device_answers_as_the_manual_prints_it() {
    // AG02-SDO-R-RSP (4167): 42h, and 2500 in 607Ch:00.
    let rig = Rig::<Ag02>::new(SHEET);
    assert_eq!(rig.device.lock().unwrap().answer_to("605#407C600000000000"), "585#427C6000C4090000");
    assert_eq!(check("", |drive| drive.read(Object::<i32, Rw>::new(0x607C, 0x00))).unwrap(), 2500);
    assert_eq!(check("", Drive::firmware).unwrap(), "1.00", "characters from the top (5884)");
}

#[test]
fn whatever_is_written_has_four_bytes() {
    // AG02-SDO-W-REQ (4213): 2,000,000 into 607Dh:02.
    let limit = Object::<i32, Rw>::new(0x607D, 0x02);
    check("> 605#237D600280841E00", |drive| drive.write(limit, 2_000_000)).unwrap();
    let gear = Object::<u16, Rw>::new(0x6091, 0x01);
    check("> 605#2391600107000000", |drive| drive.write(gear, 7)).unwrap();
    check("> 605#2360600002000000", |drive| drive.set_mode(Mode::Velocity)).unwrap();
}

#[test]
fn it_is_not_taken_for_a_drive_that_tells_its_name() {
    const NAMED: Sheet =
        Sheet { objects: &[(0x1000, 0, 4, 0x192), (0x1008, 0, 4, 0x4147_3033), (0x1018, 1, 4, 0x195)], ..SHEET };
    let (bus, _) = bus(NAMED);
    let error = Drive::connect(bus.link(), NAMED.node).unwrap_err();
    assert_eq!(error.to_string(), "the node is not a SIKO AG02: vendor 195h, profile 402, name Some(\"AG03\")");
}

#[test]
fn it_is_enabled_by_table_25() {
    let script = "
        > 000#0105    AG02-PPM-01 (5210)
        > 205#0601    AG02-PPM-02 (5212)
        = 6041:00 0231
        > 205#0701    AG02-PPM-03 (5214)
        = 6041:00 0233
        > 205#0F01    AG02-PPM-04 (5216)
        < 185#3703
        = 6041:00 0337
    ";
    check(script, Drive::enable).unwrap();
}

#[test]
fn it_travels_by_table_25() {
    let script = "
        > 205#0F01            the edges begin below
        > 405#1F0088130000    AG02-PPM-05 (5218)
        = 6041:00 D237        the job is active (5040)
        = 1002:00 4810
        ~ 300
        = 6064:00 1388
        = 1002:00 0008
        < 185#3717
        = 6041:00 1737        the target is reached
        > 205#0F01            AG02-PPM-07 (5222)
    ";
    let outcome = enabled(script, |drive| drive.move_to(5000)).unwrap();
    assert_eq!(outcome, Outcome::Reached { position: 5000 });
}

#[test]
fn a_travel_is_interrupted_and_goes_on_by_table_25() {
    let script = "
        > 205#0F01
        > 405#1F0078ECFFFF    AG02-PPM-08 (5224)
        = 6041:00 D237
        = 606C:00 FFFFFFE2
        > 205#1F01            AG02-PPM-09 (5226)
        = 6041:00 5237        standing, and still active (5047)
        = 606C:00 00000000
        > 205#1F01            the order is so young that the drive might stand because of it
        > 205#1F00            AG02-PPM-10 (5228)
        = 6041:00 D237
        = 606C:00 FFFFFFE2
        ~ 300
        = 606C:00 00000000
        = 6064:00 FFFFEC78
        = 6041:00 1737
        > 205#0F01            AG02-PPM-12 (5232)
    ";
    let outcome = enabled(script, |drive| {
        drive.start_moving_to(-5000)?;
        drive.interrupt()?;
        drive.resume()?;
        drive.finish()
    });
    assert_eq!(outcome.unwrap(), Outcome::Reached { position: -5000 });
}

#[test]
fn it_runs_by_table_26() {
    let script = "
        = 6060:00 02          by parameter 20, beforehand (5251)
        > 205#0F01
        > 505#0F0044000000    AG02-PVM-05 (5266)
        = 606C:00 00000044
        = 6041:00 0737
        > 505#0F001E000000    AG02-PVM-07 (5272)
        = 606C:00 0000001E
        > 205#0F01            AG02-PVM-08 (5275)
        = 606C:00 00000000
    ";
    let outcomes = enabled(script, |drive| {
        let outcomes = [drive.run_at(68)?, drive.run_at(30)?];
        drive.stop()?;
        Ok::<_, Error>(outcomes)
    });
    assert_eq!(outcomes.unwrap(), [68, 30].map(|velocity| VelocityOutcome::Reached { velocity }));
}

/// This one tells of inching by its movement only: a shaft that settles is not taken for it.
#[test]
fn inching_has_begun_when_the_drive_turns_as_it_was_told() {
    let script = "
        > 205#0F00
        > 205#0F40
        = 6064:00 A           within the window
        ~ 100
        = 6064:00 FFFFFF00    the other way
        ~ 100
        = 606C:00 1E
        > 205#0F01
        = 606C:00 0
    ";
    enabled(script, |drive| {
        drive.inch(Direction::Positive)?;
        assert_eq!(drive.velocity()?, 30);
        drive.stop_inching()
    })
    .unwrap();
}

#[test]
fn it_stops_quickly_and_is_switched_off() {
    let script = "
        = 606C:00 00000044
        > 205#0201            quick stop; bit 8 stays, nothing is to move
        = 6041:00 0217
        = 606C:00 00000000
        > 205#0001            AG02-PPM-15 (5238)
        = 6041:00 0250
    ";
    enabled(script, |drive| {
        drive.quick_stop()?;
        drive.disable()
    })
    .unwrap();
}

#[test]
fn a_fault_is_told_by_its_letter_and_reset_by_an_edge() {
    let script = "
        = 6041:00 0218
        = 1003:01 7121
        > 000#0105
        > 205#0001
        > 205#8001
        = 6041:00 0250
        > 205#0001
    ";
    let cause = enabled(script, Drive::reset_fault);
    assert_eq!(cause.unwrap().unwrap().to_string(), "B (7121): shaft blocked");
    // In an emergency the table has the high byte first, and CiA 301 the low one: both are understood.
    for emergency in ["< 085#7121210000000000", "< 085#2171210000000000"] {
        let cause = enabled(emergency, |drive| {
            drive.pass(Duration::from_millis(2))?;
            drive.cause()
        });
        assert!(matches!(cause, Ok(Cause::Fault(Code { number: 0x7121, .. }))), "{cause:?}");
    }
}

#[test]
fn what_is_missing_is_named_before_anything_moves() {
    let refused = |system: &str, missing: &str, order: fn(&mut Drive) -> Result<(), Error>| {
        let result = enabled(&format!("= 1002:00 {system}"), order);
        assert_eq!(result.unwrap_err().to_string(), format!("the drive would refuse: {missing}"));
    };
    refused("0401", "its enable input is not active; its limit switch 1 is active", |drive| drive.start_moving_to(0));
    refused("0400", "its enable input is not active", |drive| drive.inch(Direction::Negative));
    refused("0020", "its position is above the upper limit", |drive| drive.inch(Direction::Positive));
    refused("4010", "a travel is under way", |drive| drive.calibrate(0));
    refused("0000", "it is in positioning mode; the velocity 81 is more than its gear allows, 80", |drive| {
        drive.run_at(81).map(drop)
    });
}

#[test]
fn what_only_the_ag03_has_is_refused_before_anything_is_sent() {
    let mut rig = Rig::<Ag02>::new(SHEET);
    rig.check_unsupported("the SIKO AG02 has no temperature to read", Drive::temperature);
    rig.check_unsupported("the SIKO AG02 has no battery voltage to read", Drive::battery_voltage);
    rig.check_unsupported("the SIKO AG02 has no torque deactivation", Drive::torque_threshold);
    rig.check_unsupported("the SIKO AG02 has no command that keeps parameters", Drive::store);
}

#[test]
fn it_is_set_up() {
    check("> 605#237C6000C5090000", |drive| drive.calibrate(2501)).unwrap();
    check("> 605#2313240002000000", |drive| drive.set_approach(Approach::Negative)).unwrap();
    // AG02-OBJ-02 (6054): "load".
    check("> 605#231110026C6F6164", |drive| drive.restore(Some(ParameterSet::Standard))).unwrap();
    // Bit 30, not bit 31 (6108).
    check("> 605#2314100085000040", |drive| drive.set_emergencies(true)).unwrap();
    let units = check("", Drive::units).unwrap();
    assert_eq!((units.millimetres(250), units.shaft_revolutions(200)), (Some(2.5), 5.0));
    let mut settings = check("", Drive::read_parameters).unwrap();
    assert_eq!(settings.len(), PARAMETERS.len());
    settings[0].value = 300;
    check("> 605#231024012C010000", |drive| drive.write_parameters(&settings)).unwrap();
    settings[0].value = 0x1_0005;
    let cut = check("", |drive| drive.write_parameters(&settings));
    assert!(matches!(cut, Err(Error::OutOfRange(_))), "not 5: {cut:?}");
}

#[test]
fn a_driver_that_is_dropped_stops_it() {
    let mut rig = Rig::<Ag02>::new(SHEET);
    let script = "
        = 6041:00 0337
        = 1002:00 0000
        > 205#0F01
        > 405#1F0088130000
        = 6041:00 D237
    ";
    rig.check(script, |drive| drive.start_moving_to(5000)).unwrap();
    rig.follow("> 205#0F01");
    rig.check_dropped();
}

#[cfg(feature = "tokio")]
#[tokio::test]
async fn the_other_shell_does_the_same() {
    use lexican_runtime::host::tokio::Network;

    let (bus, device) = bus(SHEET);
    let network = Network::spawn(bus.link()).unwrap();
    let mut drive = lexican_driver::tokio::Drive::<Ag02>::connect(network, SHEET.node).await.unwrap();
    let script = "
        > 000#0105    AG02-PPM-01 (5210)
        > 205#0601    AG02-PPM-02 (5212)
        = 6041:00 0231
        > 205#0701    AG02-PPM-03 (5214)
        = 6041:00 0233
        > 205#0F01    AG02-PPM-04 (5216)
        = 6041:00 0218
        < 085#7121210000000000
        > 605#2360600002000000
    ";
    device.lock().unwrap().follow(bus.now(), script);
    match drive.enable().await {
        // The high byte came first.
        Err(Error::Fault(cause)) => assert_eq!(cause.to_string(), "B (7121): shaft blocked"),
        other => panic!("{other:?}"),
    }
    drive.set_mode(Mode::Velocity).await.unwrap();
    assert!(matches!(drive.temperature().await, Err(Error::Unsupported { .. })));
    assert!(device.lock().unwrap().is_through());
}
