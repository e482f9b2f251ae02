//! The typed driver of the AG02.
//!
//! Sequences and shells are those of [`lexican_driver`]; this module has the drive's particulars as data ([`AG02`]),
//! and its names.
//!
//! What the drive does when a program ends is in the table of
//! [`lexican_driver`](lexican_driver#how-a-program-ends-and-what-the-drive-does-then). A program that is killed sends
//! nothing, and the drive goes on, unless [`Drive::connect`](lexican_driver::Drive::connect) has armed life guarding
//! (10.2.11), after which it goes to SWITCH ON DISABLED. None of this replaces an emergency stop.

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

/// The SIKO AG02, by chapters 2, 8 and 10 of its manual.
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

/// Bit 30 switches them on; bit 31 is not used (10.12.2.10).
const EMERGENCIES: EmergencySwitch =
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
    // The manual does not say which switch is at which end, so refusing the wrong direction of inching is left to the
    // drive.
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

/// An AG02 over a link. Every method blocks until its operation is over.
pub type Drive<L> = lexican_driver::Drive<L, Ag02>;

/// The driver over the runtime's tokio shell: the same operations, many drives at once on one network.
#[cfg(feature = "tokio")]
pub mod tokio {
    /// An AG02 on a network.
    pub type Drive = lexican_driver::tokio::Drive<super::Ag02>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_wrong_with_the_description() {
        assert_eq!(AG02.findings(), [""; 0]);
        assert_eq!((AG02.identity.vendor_ids, AG02.identity.profile), (&[od::VENDOR_ID][..], od::DEVICE_PROFILE));
    }

    /// The objects that all drives of SIKO share are entries of this dictionary, with these types and limits.
    #[test]
    fn the_objects_are_those_of_the_data_sheet() {
        siko::assert_describes!(AG02, od);
        assert_eq!(AG02.velocity.unwrap().target, Number::of(od::TARGET_VELOCITY));
    }
}
