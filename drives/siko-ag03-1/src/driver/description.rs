//! The AG03/1 as data for the driver.

use lexican_driver::Missing;
use lexican_driver::description::{
    Condition, Description, Gear, Identity, Inching, Measured, Number, Orders, Test, TorqueDeactivation, Velocities,
};
use lexican_runtime::object::Limits;
use siko::description::{INCHING, SIKO, VELOCITIES};

use crate::od;
use crate::words::{status, system};
use crate::{fault, parameter};

/// The SIKO AG03/1, by its manual: tables 1, 6, 20 to 24, figures 17 to 22, and the examples of 7.8.
pub static AG03_1: Description = Description {
    name: "SIKO AG03/1",
    // The AG02 has the same vendor and profile, but no device name.
    identity: Identity { names: Some(&["AG03"]), ..SIKO.identity },
    conditions: CONDITIONS,
    codes: fault::CODES,
    parameters: parameter::PARAMETERS,
    velocity: Some(Velocities {
        target: velocities(Number::of(od::TARGET_VELOCITY), od::TARGET_VELOCITY.limits()),
        gear: Some(Gear {
            object: Number::of(od::GEAR_REDUCTION),
            most: &[(od::GearReduction::GEAR_24_1.0 as i64, 200)],
            otherwise: 100,
        }),
        ..VELOCITIES
    }),
    // "No active travel job" is a condition of the ready bit (table 21).
    inching: Some(Inching { busy: Some(Test::of_status(status::READY).clear()), ..INCHING }),
    torque_deactivation: Some(TorqueDeactivation {
        state: Number::of(od::TORQUE_DEACTIVATION_STATE),
        active: 1,
        threshold: Number::of(od::TORQUE_DEACTIVATION).within(20, 125),
        off: 125,
    }),
    temperature: Some(Measured { object: Number::of(od::OUTPUT_STAGE_TEMPERATURE), per_unit: 10 }),
    battery: Some(Measured { object: Number::of(od::BATTERY_VOLTAGE), per_unit: 100 }),
    ..SIKO
};

/// From chapters 2.2.1, 2.2.1.2 and 2.2.2, with the bits of 1002h (table 1).
const CONDITIONS: &[Condition] = &[
    Condition {
        when: Test::of_system(system::NO_SUPPLY as u32),
        refuses: Orders::MOVE.and(Orders::ENABLE),
        missing: Missing::Supply,
    },
    // Inching shows by the moving bit only.
    Condition {
        when: Test::of_system((system::POSITIONING | system::MOVING) as u32),
        refuses: Orders::FROM_REST,
        missing: Missing::NoTravel,
    },
    // Beyond a limit, only inching back is possible.
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

    /// The objects that all drives of SIKO share are entries of this dictionary, with these types and limits.
    #[test]
    fn the_objects_are_those_of_the_data_sheet() {
        siko::assert_describes!(AG03_1, od);
    }

    #[test]
    fn the_limits_are_those_of_the_data_sheet() {
        let target = AG03_1.objects.target_position;
        assert_eq!(target.check(9_999_999), od::TARGET_POSITION.check(od::Position(9_999_999)));
        assert_eq!(target.check(-10_000_000), od::TARGET_POSITION.check(od::Position(-10_000_000)));
    }
}
