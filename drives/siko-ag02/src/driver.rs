//! The typed driver: what the drive can do, in its own words.
//!
//! Its sequences and shells are those of all drives of its kind, [`lexican_driver`]; here stands what is particular
//! to this one, as data ([`AG02`]), and its names.
//!
//! How a program ends, and what the drive does then, is in the table of
//! [`lexican_driver`](lexican_driver#how-a-program-ends-and-what-the-drive-does-then). A program that is killed sends
//! nothing, and the drive goes on: [`Drive::connect_protected`](lexican_driver::Drive::connect_protected) arms life
//! guarding (10.2.11), after which the drive goes to SWITCH ON DISABLED. None of this replaces an emergency stop.

use lexican_driver::ByteOrder;
pub use lexican_driver::description::{Approach, Description};
use lexican_driver::description::{Condition, EmergencySwitch, Gear, Identity, Number, Orders, Test, Velocities};
pub use lexican_driver::sequence;
pub use lexican_driver::{
    CancelHandle, Capability, DriveContext, Error, Kind, Missing, Mode, Outcome, Protection, Refusal, Session,
    Supervision, Units, VelocityOutcome,
};
use siko::description::{SIKO, VELOCITIES};
use siko::words::system;

use crate::{fault, od};

/// The SIKO AG02, as chapters 2, 8 and 10 of its manual have it.
pub static AG02: Description = Description {
    name: "SIKO AG02",
    // There is no 1008h, unlike on the AG03/1. The first character of 100Ah is in bits 31 to 24 (10.12.2.6).
    identity: Identity { names: None, characters: ByteOrder::HighFirst, ..SIKO.identity },
    // 23h is the only command that writes (table 18).
    always_four_bytes: true,
    conditions: CONDITIONS,
    codes: fault::CODES,
    velocity: Some(Velocities {
        gear: Some(Gear {
            object: Number::of(od::GEAR_REDUCTION),
            most: &[
                (od::GearReduction::GEAR_55_1.0 as i64, 100),
                (od::GearReduction::GEAR_62_1.0 as i64, 80),
                (od::GearReduction::GEAR_135_1.0 as i64, 35),
            ],
            otherwise: 35,
        }),
        ..VELOCITIES
    }),
    emergencies: Some(EMERGENCIES),
    ..SIKO
};

/// Bit 30 sends them when set; bit 31 is not used (10.12.2.10).
pub(crate) const EMERGENCIES: EmergencySwitch =
    EmergencySwitch { object: Number::of(od::COB_ID_EMERGENCY_MESSAGE), bit: 1 << 30, on_when_set: true };

/// Bits of 1002h (table 1).
const CONDITIONS: &[Condition] = &[
    Condition {
        when: Test::of_system(system::ENABLE_INACTIVE as u32),
        refuses: Orders::MOVE,
        missing: Missing::EnableInput,
    },
    Condition {
        when: Test::of_system((system::POSITIONING | system::MOVING) as u32),
        refuses: Orders::FROM_REST,
        missing: Missing::NoTravel,
    },
    // The manual does not say which switch is at which end: the drive itself refuses to inch the wrong way.
    Condition {
        when: Test::of_system(system::LIMIT_SWITCH_1 as u32),
        refuses: Orders::TRAVEL,
        missing: Missing::OffLimitSwitch(1),
    },
    Condition {
        when: Test::of_system(system::LIMIT_SWITCH_2 as u32),
        refuses: Orders::TRAVEL,
        missing: Missing::OffLimitSwitch(2),
    },
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

/// The AG02, as a kind of drive.
#[derive(Clone, Copy, Debug)]
pub enum Ag02 {}

impl Kind for Ag02 {
    const DESCRIPTION: &'static Description = &AG02;
}

/// An AG02 at the other end of a link. Every method blocks until its operation is over.
pub type Drive<L> = lexican_driver::Drive<L, Ag02>;

/// The driver over the runtime's tokio shell: the same operations, many drives at once on one network.
#[cfg(feature = "tokio")]
pub mod tokio {
    /// An AG02 on a network.
    pub type Drive = lexican_driver::tokio::Drive<super::Ag02>;
}

#[cfg(test)]
mod tests {
    use lexican_driver::description::{Calibration, UnitObjects};

    use super::*;

    #[test]
    fn nothing_is_wrong_with_the_description() {
        assert_eq!(AG02.findings(), [""; 0]);
        assert_eq!((AG02.identity.vendor_id, AG02.identity.profile), (od::VENDOR_ID, od::DEVICE_PROFILE));
    }

    /// The numbers that all drives of SIKO share are entries of this one, with these types and limits.
    #[test]
    fn the_objects_are_those_of_the_data_sheet() {
        let objects = &AG02.objects;
        let UnitObjects { spindle_pitch_10um, numerator, denominator, .. } = AG02.units.unwrap();
        let Some(Calibration::Write(calibration)) = AG02.calibration else { panic!("it is calibrated by a write") };
        let restore = AG02.restore.unwrap();
        for (number, of_data_sheet) in [
            (objects.control_word, Number::of(od::CONTROLWORD)),
            (objects.status_word, Number::of(od::STATUSWORD)),
            (objects.system_word.unwrap(), Number::of(od::MANUFACTURER_STATUS_REGISTER)),
            (objects.actual_position, Number::of(od::POSITION_ACTUAL_VALUE)),
            (objects.actual_velocity, Number::of(od::VELOCITY_ACTUAL_VALUE)),
            (objects.target_position, Number::of(od::TARGET_POSITION).within(-9_999_999, 9_999_999)),
            (objects.position_window.unwrap(), Number::of(od::POSITION_WINDOW)),
            (objects.position_limits.unwrap()[0], Number::of(od::SOFTWARE_POSITION_LIMIT.limit_2())),
            (objects.position_limits.unwrap()[1], Number::of(od::SOFTWARE_POSITION_LIMIT.limit_1())),
            (objects.latest_fault, Number::of(od::PRE_DEFINED_ERROR_FIELD.at(1).unwrap())),
            (AG02.modes.chosen, Number::of(od::MODES_OF_OPERATION)),
            (AG02.velocity.unwrap().target, Number::of(od::TARGET_VELOCITY)),
            (AG02.inching.unwrap().width, Number::of(od::DELTA_JOG)),
            (calibration, Number::of(od::CALIBRATION_VALUE).within(-999_999, 999_999)),
            (AG02.approaches.unwrap().object, Number::of(od::POS_TYPE)),
            (restore.all, Number::of(od::RESTORE_DEFAULT_PARAMETERS.all_parameters())),
            (restore.sets[0].1, Number::of(od::RESTORE_DEFAULT_PARAMETERS.standard_parameters())),
            (restore.sets[1].1, Number::of(od::RESTORE_DEFAULT_PARAMETERS.controller_parameters())),
            (spindle_pitch_10um, Number::of(od::SPINDLE_PITCH)),
            (numerator, Number::of(od::GEAR_RATIO.numerator())),
            (denominator, Number::of(od::GEAR_RATIO.denominator())),
        ] {
            assert_eq!(number, of_data_sheet);
        }
        let targets = (od::TARGET_POSITION.limits().unwrap(), objects.target_position);
        let calibrations = (od::CALIBRATION_VALUE.limits().unwrap(), calibration);
        for (limits, number) in [targets, calibrations] {
            for (value, fits) in [(limits.low.0, true), (limits.high.0, true), (limits.high.0 + 1, false)] {
                assert_eq!(number.check(value.into()).is_ok(), fits, "{value}");
            }
        }
        for parameter in AG02.parameters {
            let entry = od::TABLE.entry(parameter.address).expect("a parameter is an object");
            assert_eq!(parameter.data_type, entry.data_type, "{}", parameter.address);
        }
    }
}
