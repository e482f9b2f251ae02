//! What is particular to the AG03/1, as data.

use lexican_driver::description::{
    Approach, Approaches, Calibration, Condition, ControlBits, Description, EmergencySwitch, Gear, Identity, Inching,
    Measured, ModeObjects, Number, Objects, Orders, Outputs, Pdo, Release, Restore, Signal, StatusBits, Test, Times,
    TorqueDeactivation, UnitObjects, Velocities,
};
use lexican_driver::{ByteOrder, Missing, ParameterSet};
use lexican_runtime::Duration;
use lexican_runtime::object::Limits;
use lexican_runtime::profile::cia402::{Mode, Modes};

use crate::od;
use crate::state::TRANSITIONS;
use crate::words::{control, status, system};
use crate::{fault, parameter};

/// The SIKO AG03/1, as its manual has it: tables 1, 6, 20 to 24, figures 17 to 22, and the examples of 7.8.
pub static AG03_1: Description = Description {
    name: "SIKO AG03/1",
    identity: Identity {
        vendor_id: od::VENDOR_ID,
        profile: od::DEVICE_PROFILE,
        // The AG02 has the same vendor and profile, but no device name.
        names: Some(&["AG03"]),
        characters: ByteOrder::LowFirst,
    },
    objects: Objects {
        control_word: Number::of(od::CONTROLWORD),
        status_word: Number::of(od::STATUSWORD),
        system_word: Some(Number::of(od::MANUFACTURER_STATUS_REGISTER)),
        actual_position: Number::of(od::POSITION_ACTUAL_VALUE),
        actual_velocity: Number::of(od::VELOCITY_ACTUAL_VALUE),
        target_position: positions(Number::of(od::TARGET_POSITION), od::TARGET_POSITION.limits()),
        position_window: Some(Number::of(od::POSITION_WINDOW)),
        position_limits: Some([
            Number::of(od::SOFTWARE_POSITION_LIMIT.limit_1()),
            Number::of(od::SOFTWARE_POSITION_LIMIT.limit_2()),
        ]),
        latest_fault: Number::of(match od::PRE_DEFINED_ERROR_FIELD.at(1) {
            Some(latest) => latest,
            None => panic!("1003h has entries"),
        }),
    },
    outputs: OUTPUTS,
    inputs: INPUTS,
    always_four_bytes: false,
    transitions: TRANSITIONS,
    control: ControlBits { idle: control::STOP, new_setpoint: control::NEW_SETPOINT, stop: control::STOP },
    status: StatusBits {
        remote: status::REMOTE,
        target_reached: status::TARGET_REACHED,
        internal_limit: status::INTERNAL_LIMIT,
        acknowledged: status::ACKNOWLEDGED,
        positioning: Some(Test::of_status(status::POSITIONING)),
        moving: Some(Test::of_status(status::MOVING)),
        standing: 0,
        velocity_unit: "rev/min",
    },
    // Table 25 clears New Setpoint when a travel is over, and keeps it while one is interrupted.
    release: Release::WhenOver,
    modes: ModeObjects {
        chosen: Number::of(od::MODES_OF_OPERATION),
        shown: None,
        codes: Modes(&[(1, Mode::ProfilePosition), (2, Mode::ProfileVelocity)]),
    },
    conditions: CONDITIONS,
    codes: fault::CODES,
    times: Times {
        reaction: Duration::from_millis(500),
        settling: Duration::from_millis(50),
        status_period: Duration::from_millis(150),
        // 200 rev/min with 0.04 rev/s² take 83 s.
        braking: Duration::from_secs(100),
    },
    parameters: parameter::PARAMETERS,
    velocity: Some(Velocities {
        target: velocities(Number::of(od::TARGET_VELOCITY), od::TARGET_VELOCITY.limits()),
        reached: Test::of_status(status::TARGET_REACHED),
        gear: Some(Gear {
            object: Number::of(od::GEAR_REDUCTION),
            most: &[(od::GearReduction::GEAR_24_1.0 as i64, 200)],
            otherwise: 100,
        }),
    }),
    inching: Some(Inching {
        step: control::INCHING_1,
        positive: control::INCHING_2_POSITIVE,
        negative: control::INCHING_2_NEGATIVE,
        width: Number::of(od::DELTA_JOG),
        // "No active travel job" is a condition for readiness (table 21).
        busy: Some(Test::of_status(status::READY).clear()),
        begins: Duration::from_millis(50),
    }),
    calibration: Some(Calibration::Write(positions(Number::of(od::CALIBRATION_VALUE), od::CALIBRATION_VALUE.limits()))),
    approaches: Some(Approaches {
        object: Number::of(od::POS_TYPE),
        values: [
            (od::PositioningType::DIRECT.0 as i64, Approach::Direct),
            (od::PositioningType::LOOP_PLUS.0 as i64, Approach::Positive),
            (od::PositioningType::LOOP_MINUS.0 as i64, Approach::Negative),
        ],
    }),
    // What is written is kept (table 6).
    store: None,
    restore: Some(Restore {
        all: Number::of(od::RESTORE_DEFAULT_PARAMETERS.all_parameters()),
        sets: &[
            (ParameterSet::Standard, Number::of(od::RESTORE_DEFAULT_PARAMETERS.standard_parameters())),
            (ParameterSet::Controller, Number::of(od::RESTORE_DEFAULT_PARAMETERS.controller_parameters())),
        ],
        signature: od::RestoreSignature::LOAD.0,
    }),
    torque_deactivation: Some(TorqueDeactivation {
        state: Number::of(od::TORQUE_DEACTIVATION_STATE),
        active: 1,
        threshold: Number::of(od::TORQUE_DEACTIVATION).within(20, 125),
        off: 125,
    }),
    temperature: Some(Measured { object: Number::of(od::OUTPUT_STAGE_TEMPERATURE), per_unit: 10 }),
    battery: Some(Measured { object: Number::of(od::BATTERY_VOLTAGE), per_unit: 100 }),
    units: Some(UnitObjects {
        increments: 1600,
        spindle_pitch_10um: Number::of(od::SPINDLE_PITCH),
        numerator: Number::of(od::GEAR_RATIO.numerator()),
        denominator: Number::of(od::GEAR_RATIO.denominator()),
    }),
    emergencies: Some(EmergencySwitch::CIA_301),
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

/// Chapters 2.2.1, 2.2.1.2 and 2.2.2, by the bits of 1002h (table 1).
const CONDITIONS: &[Condition] = &[
    Condition {
        when: Test::of_system(system::NO_SUPPLY as u32),
        refuses: Orders::MOVE.and(Orders::ENABLE),
        missing: Missing::Supply,
    },
    // Inching shows as movement only.
    Condition {
        when: Test::of_system((system::POSITIONING | system::MOVING) as u32),
        refuses: Orders::FROM_REST,
        missing: Missing::NoTravel,
    },
    // Beyond a limit, inching leads back only, and nothing else leads anywhere.
    Condition {
        when: Test::of_system(system::ABOVE_UPPER_LIMIT as u32),
        refuses: Orders::TRAVEL.and(Orders::INCH_POSITIVE),
        missing: Missing::BelowUpperLimit,
    },
    Condition {
        when: Test::of_system(system::BELOW_LOWER_LIMIT as u32),
        refuses: Orders::TRAVEL.and(Orders::INCH_NEGATIVE),
        missing: Missing::AboveLowerLimit,
    },
];

/// With the limits of the data sheet.
const fn positions(object: Number, limits: Option<Limits<od::Position>>) -> Number {
    match limits {
        Some(Limits { low, high }) => object.within(low.0 as i64, high.0 as i64),
        None => object,
    }
}

/// The same for a velocity.
const fn velocities(object: Number, limits: Option<Limits<od::Velocity>>) -> Number {
    match limits {
        Some(Limits { low, high }) => object.within(low.0 as i64, high.0 as i64),
        None => object,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_wrong_with_the_description() {
        assert_eq!(AG03_1.findings(), [""; 0]);
    }

    #[test]
    fn the_limits_are_those_of_the_data_sheet() {
        let target = AG03_1.objects.target_position;
        assert_eq!(target.check(9_999_999), od::TARGET_POSITION.check(od::Position(9_999_999)));
        assert_eq!(target.check(-10_000_000), od::TARGET_POSITION.check(od::Position(-10_000_000)));
    }
}
