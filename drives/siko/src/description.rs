//! What the descriptions of SIKO's drives share: objects, PDOs, status bits, inching, units.
//!
//! The drives have these objects at the same addresses with the same types; each drive's crate compares [`SIKO`] with its
//! data sheet.

use lexican_driver::description::{
    Approach, Approaches, Calibration, ControlBits, Description, EmergencySwitch, Identity, Inching, ModeObjects,
    Number, Objects, Outputs, Pdo, Release, Restore, Signal, StatusBits, Test, Times, UnitObjects, Velocities,
};
use lexican_driver::{ByteOrder, Codes, Parameter, ParameterSet};
use lexican_runtime::Duration;
use lexican_runtime::object::{Address, DataType};
use lexican_runtime::profile::cia402::{Mode, Modes};

use crate::state::TRANSITIONS;
use crate::words::{control, status};

const U8: DataType = DataType::Unsigned8;
const U16: DataType = DataType::Unsigned16;
const U32: DataType = DataType::Unsigned32;
const I32: DataType = DataType::Integer32;

/// What all drives share. A drive adds its name, its identity, its conditions, codes and gears, and its further
/// capabilities.
pub const SIKO: Description = Description {
    name: "SIKO",
    identity: Identity { vendor_ids: &[0x195], profile: 402, names: None, characters: ByteOrder::LowFirst },
    objects: Objects {
        control_word: Number::new(0x6040, 0x00, U16),
        status_word: Number::new(0x6041, 0x00, U16),
        system_word: Some(Number::new(0x1002, 0x00, U16)),
        actual_position: Number::new(0x6064, 0x00, I32),
        actual_velocity: Some(Number::new(0x606C, 0x00, I32)),
        target_position: Number::new(0x607A, 0x00, I32).within(-9_999_999, 9_999_999),
        position_window: Some(Number::new(0x6067, 0x00, U16)),
        position_limits: Some([Number::new(0x607D, 0x01, I32), Number::new(0x607D, 0x02, I32)]),
        latest_fault: Number::new(0x1003, 0x01, U16),
    },
    outputs: OUTPUTS,
    inputs: INPUTS,
    always_four_bytes: false,
    transitions: TRANSITIONS,
    control: ControlBits { idle: control::STOP, new_setpoint: control::NEW_SETPOINT, stop: control::STOP },
    status: StatusBits {
        remote: status::REMOTE,
        target_reached: status::TARGET_REACHED,
        warning: status::WARNING,
        internal_limit: status::INTERNAL_LIMIT,
        acknowledged: status::ACKNOWLEDGED,
        positioning: Some(Test::of_status(status::POSITIONING)),
        moving: Some(Test::of_status(status::MOVING)),
        standing: 0,
        velocity_unit: "rev/min",
    },
    // Table 25 clears New Setpoint when a travel is over, and keeps it during an interruption.
    release: Release::WhenOver,
    // There is no 6061h, and mode number 2 is velocity mode.
    modes: ModeObjects {
        chosen: Number::new(0x6060, 0x00, U8),
        shown: None,
        codes: Modes(&[(1, Mode::ProfilePosition), (2, Mode::ProfileVelocity)]),
    },
    conditions: &[],
    codes: Codes { faults: &[], notices: &[], order: ByteOrder::Either },
    times: Times {
        reaction: Duration::from_millis(500),
        settling: Duration::from_millis(50),
        status_period: Duration::from_millis(150),
        // 200 rev/min with 0.04 rev/s² take 83 s.
        braking: Duration::from_secs(100),
    },
    parameters: PARAMETERS,
    profile: None,
    velocity: Some(VELOCITIES),
    torque: None,
    interpolated_position: None,
    set_points: None,
    latches: None,
    reactions: &[],
    inching: Some(INCHING),
    homing: None,
    calibration: Some(Calibration::Write(Number::new(0x607C, 0x00, I32).within(-999_999, 999_999))),
    approaches: Some(Approaches {
        object: Number::new(0x2413, 0x00, U8),
        values: [(0, Approach::Direct), (1, Approach::Positive), (2, Approach::Negative)],
    }),
    // The drive stores every parameter as it is written.
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
    referenced: None,
    emergencies: Some(EmergencySwitch::CIA_301),
};

/// Velocity mode, for any gear.
pub const VELOCITIES: Velocities =
    Velocities { target: Number::new(0x60FF, 0x00, I32), reached: Test::of_status(status::TARGET_REACHED), gear: None };

/// Inching; only the movement shows that it is under way.
pub const INCHING: Inching = Inching {
    step: control::INCHING_1,
    positive: control::INCHING_2_POSITIVE,
    negative: control::INCHING_2_NEGATIVE,
    width: Number::new(0x2415, 0x00, I32),
    busy: None,
    begins: Duration::from_millis(50),
};

/// RPDO1, RPDO3, RPDO4 (figures 20 to 22). There is no RPDO2.
const OUTPUTS: Outputs = Outputs {
    control: Some(Pdo { base: 0x200, signals: &[Signal::ControlWord] }),
    position: Some(Pdo { base: 0x400, signals: &[Signal::ControlWord, Signal::TargetPosition] }),
    velocity: Some(Pdo { base: 0x500, signals: &[Signal::ControlWord, Signal::TargetVelocity] }),
};

/// TPDO1, TPDO3 with the position, TPDO4 with the velocity (figures 17 to 19). There is no TPDO2.
const INPUTS: &[Pdo] = &[
    Pdo { base: 0x180, signals: &[Signal::StatusWord] },
    Pdo { base: 0x380, signals: &[Signal::StatusWord, Signal::Other(4)] },
    Pdo { base: 0x480, signals: &[Signal::StatusWord, Signal::Other(4)] },
];

/// The parameters of all drives, by number. Number 24 is one parameter in two objects, one for each operating mode. `*`
/// in the manuals' tables marks the set [`Controller`](ParameterSet::Controller) (1011h:03).
pub const PARAMETERS: &[Parameter; 21] = {
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
        row(24, 0x607A, 0x00, I32, Standard),
        row(24, 0x60FF, 0x00, I32, Standard),
    ]
};

/// A row of a table of parameters.
#[must_use]
pub const fn row(number: u8, index: u16, sub: u8, data_type: DataType, set: ParameterSet) -> Parameter {
    Parameter { number, address: Address::new(index, sub), data_type, set }
}

/// [`PARAMETERS`], followed by a drive's own.
#[must_use]
pub const fn parameters<const N: usize>(own: &[Parameter]) -> [Parameter; N] {
    let mut all = [PARAMETERS[0]; N];
    let mut at = 0;
    while at < N {
        all[at] = if at < PARAMETERS.len() { PARAMETERS[at] } else { own[at - PARAMETERS.len()] };
        at += 1;
    }
    all
}

/// Asserts that the objects of a description are entries of a drive's generated dictionary, with their types and
/// limits: for the tests of the drives' crates.
#[doc(hidden)]
#[macro_export]
macro_rules! assert_describes {
    ($description:ident, $od:ident) => {{
        use lexican_driver::description::{Calibration, Number, UnitObjects};
        let objects = &$description.objects;
        let UnitObjects { spindle_pitch_10um, numerator, denominator, .. } = $description.units.unwrap();
        let Some(Calibration::Write(calibration)) = $description.calibration else {
            panic!("it is calibrated by a write")
        };
        let restore = $description.restore.unwrap();
        for (number, of_data_sheet) in [
            (objects.control_word, Number::of($od::CONTROLWORD)),
            (objects.status_word, Number::of($od::STATUSWORD)),
            (objects.system_word.unwrap(), Number::of($od::MANUFACTURER_STATUS_REGISTER)),
            (objects.actual_position, Number::of($od::POSITION_ACTUAL_VALUE)),
            (objects.actual_velocity.unwrap(), Number::of($od::VELOCITY_ACTUAL_VALUE)),
            (objects.target_position, Number::of($od::TARGET_POSITION).within(-9_999_999, 9_999_999)),
            (objects.position_window.unwrap(), Number::of($od::POSITION_WINDOW)),
            (objects.position_limits.unwrap()[0], Number::of($od::SOFTWARE_POSITION_LIMIT.limit_2())),
            (objects.position_limits.unwrap()[1], Number::of($od::SOFTWARE_POSITION_LIMIT.limit_1())),
            (objects.latest_fault, Number::of($od::PRE_DEFINED_ERROR_FIELD.at(1).unwrap())),
            ($description.modes.chosen, Number::of($od::MODES_OF_OPERATION)),
            ($crate::description::VELOCITIES.target, Number::of($od::TARGET_VELOCITY)),
            ($description.inching.unwrap().width, Number::of($od::DELTA_JOG)),
            (calibration, Number::of($od::CALIBRATION_VALUE).within(-999_999, 999_999)),
            ($description.approaches.unwrap().object, Number::of($od::POS_TYPE)),
            (restore.all, Number::of($od::RESTORE_DEFAULT_PARAMETERS.all_parameters())),
            (restore.sets[0].1, Number::of($od::RESTORE_DEFAULT_PARAMETERS.standard_parameters())),
            (restore.sets[1].1, Number::of($od::RESTORE_DEFAULT_PARAMETERS.controller_parameters())),
            (spindle_pitch_10um, Number::of($od::SPINDLE_PITCH)),
            (numerator, Number::of($od::GEAR_RATIO.numerator())),
            (denominator, Number::of($od::GEAR_RATIO.denominator())),
        ] {
            assert_eq!(number, of_data_sheet);
        }
        let targets = ($od::TARGET_POSITION.limits().unwrap(), objects.target_position);
        let calibrations = ($od::CALIBRATION_VALUE.limits().unwrap(), calibration);
        for (limits, number) in [targets, calibrations] {
            for (value, fits) in [(limits.low.0, true), (limits.high.0, true), (limits.high.0 + 1, false)] {
                assert_eq!(number.check(value.into()).is_ok(), fits, "{value}");
            }
        }
        for parameter in $description.parameters {
            let entry = $od::TABLE.entry(parameter.address).expect("a parameter is an object");
            assert_eq!(parameter.data_type, entry.data_type, "{}", parameter.address);
        }
    }};
}
