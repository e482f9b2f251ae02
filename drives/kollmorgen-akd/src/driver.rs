//! The typed driver of the AKD.
//!
//! Sequences and shells are those of [`lexican_driver`]; this module has the drive's particulars as data ([`AKD`]), and
//! its names.
//!
//! [`Drive`] uses the factory PDOs of chapters 6.3.1.3 and 6.3.2.3. All of them can be mapped differently:
//! [`FreeDrive`] uses SDO alone, and leaves the PDOs to the application
//! ([`configure_pdos`](lexican_driver::Drive::configure_pdos)).
//!
//! What the drive does when a program ends is in the table of
//! [`lexican_driver`](lexican_driver#how-a-program-ends-and-what-the-drive-does-then). A program that is killed sends
//! nothing. [`Drive::connect`](lexican_driver::Drive::connect) arms the drive's heartbeat consumer (6.2.1.14), which
//! then leads to fault F129 and a stop; a drive of
//! [`Drive::connect_unprotected`](lexican_driver::Drive::connect_unprotected) goes on. None of this replaces an
//! emergency stop.

use lexican_driver::ByteOrder;
use lexican_driver::description::{
    Calibration, Condition, Homing, Identity, Latch, Latches, ModeObjects, Number, Objects, Orders, Outputs, SetPoints,
    StatusBits, Store, Test, Velocities,
};
pub use lexican_driver::description::{Description, Reaction, Trigger};
pub use lexican_driver::sequence;
pub use lexican_driver::{
    CancelHandle, Capability, DriveContext, Error, HomingOutcome, Kind, Missing, Mode, Outcome, Protection, Refusal,
    Session, SetPoint, Succession, Supervision, VelocityOutcome,
};
use lexican_runtime::object::Enumeration;
use lexican_runtime::profile::cia402::{self, Modes, control};

use crate::{fault, od};

/// The Kollmorgen AKD, by its manual.
pub static AKD: Description = Description {
    name: "Kollmorgen AKD",
    identity: Identity {
        vendor_ids: &[od::VENDOR_ID],
        profile: od::DEVICE_PROFILE,
        // Yzzz, where Y is the voltage class (6.2.1.7).
        names: Some(&["L", "M", "H", "U"]),
        characters: ByteOrder::LowFirst,
    },
    objects: Objects {
        system_word: Some(Number::of(od::MANUFACTURER_STATUS_REGISTER)),
        // MT.TPOSWND; there is no 6067h.
        position_window: Some(Number::of(od::IN_POSITION_WINDOW)),
        ..Objects::CIA_402
    },
    // 606Ch is in 1/1000 rev/min (7.1.4); a servo never stands completely still.
    status: StatusBits { standing: 100, velocity_unit: "1/1000 rev/min", ..Description::CIA_402.status },
    conditions: CONDITIONS,
    codes: fault::CODES,
    modes: ModeObjects { codes: MODES, ..Description::CIA_402.modes },
    // The manual does not describe bit 10 of the status word for this mode, but bit 9 of 1002h.
    velocity: Some(Velocities { reached: Test::of_system(system::TARGET_VELOCITY_REACHED), ..Velocities::CIA_402 }),
    homing: Some(Homing { methods: METHODS, ..Homing::CIA_402 }),
    calibration: Some(Calibration::Homing(od::HomingMethod::PRESENT_POSITION.0)),
    // Bit 5 does what bit 9 does in CiA 402: the previous target is passed, not dropped (6.11.2.6).
    set_points: Some(SetPoints {
        relative: Some(control::RELATIVE),
        blended: Some(control::CHANGE_IMMEDIATELY),
        at_once: None,
    }),
    latches: Some(LATCHES),
    // 605Ah to 605Eh do not exist; DRV.DISMODE (35FFh) and CS.DEC (3440h) are left to the application.
    reactions: &[],
    store: Some(Store::CIA_301),
    referenced: Some(Test::of_system(system::HOMING_FINISHED)),
    ..Description::CIA_402
};

/// The same drive by SDO only, with its PDOs left to the application.
pub static AKD_BY_SDO: Description = Description { outputs: Outputs::BY_SDO, inputs: &[], ..AKD };

/// Bits of 1002h (6.2.1.3).
pub(crate) mod system {
    pub(crate) const MOVEMENT_ACTIVE: u32 = 1 << 0;
    pub(crate) const TARGET_VELOCITY_REACHED: u32 = 1 << 9;
    pub(crate) const SAFETY_SELECTED: u32 = 1 << 13;
    pub(crate) const HOMING_FINISHED: u32 = 1 << 23;
    pub(crate) const HARDWARE_ENABLE: u32 = 1 << 29;
}

const CONDITIONS: &[Condition] = &[
    Condition {
        when: Test::of_system(system::MOVEMENT_ACTIVE),
        refuses: Orders::FROM_REST,
        missing: Missing::NoTravel,
    },
    Condition {
        when: Test::of_system(system::SAFETY_SELECTED),
        refuses: Orders::MOVE.and(Orders::ENABLE),
        missing: Missing::SafetyReleased,
    },
    // Transition 3 takes the hardware enable (6.4.1.2).
    Condition {
        when: Test::of_system(system::HARDWARE_ENABLE).clear(),
        refuses: Orders::MOVE.and(Orders::ENABLE),
        missing: Missing::EnableInput,
    },
];

/// 6.4.2.3.
pub(crate) const MODES: Modes = Modes(&[
    (od::OperatingMode::PROFILE_POSITION.0, cia402::Mode::ProfilePosition),
    (od::OperatingMode::PROFILE_VELOCITY.0, cia402::Mode::ProfileVelocity),
    (od::OperatingMode::PROFILE_TORQUE.0, cia402::Mode::ProfileTorque),
    (od::OperatingMode::HOMING.0, cia402::Mode::Homing),
    (od::OperatingMode::INTERPOLATED_POSITION.0, cia402::Mode::InterpolatedPosition),
    (od::OperatingMode::CYCLIC_SYNCHRONOUS_POSITION.0, cia402::Mode::CyclicPosition),
]);

/// The methods of the data sheet (6.10.2.2).
pub(crate) const METHODS: &[i8] = &{
    const NAMES: &[lexican_runtime::object::ValueName<'static>] = od::HomingMethod::NAMES;
    let mut methods = [0; NAMES.len()];
    let mut row = 0;
    while row < NAMES.len() {
        methods[row] = NAMES[row].raw as i8;
        row += 1;
    }
    methods
};

/// Capture engines 0 and 1, and the index pulse, whose position comes in the object of engine 0 (6.2.2.4 to 6.2.2.9).
/// CAP0.TRIGGER and CAP1.TRIGGER choose the input of an engine (3460h).
const LATCHES: Latches = Latches {
    control: Number::of(od::LATCH_CONTROL_REGISTER),
    status: Number::of(od::LATCH_STATUS_REGISTER),
    rows: &[
        latch(Trigger::Rising(1), 0, Number::of(od::LATCH_POSITION_1_POSITIVE_EDGE)),
        latch(Trigger::Falling(1), 1, Number::of(od::LATCH_POSITION_1_NEGATIVE_EDGE)),
        latch(Trigger::Rising(2), 2, Number::of(od::LATCH_POSITION_2_POSITIVE_EDGE)),
        latch(Trigger::Falling(2), 3, Number::of(od::LATCH_POSITION_2_NEGATIVE_EDGE)),
        latch(Trigger::Index, 4, Number::of(od::LATCH_POSITION_1_POSITIVE_EDGE)),
    ],
};

/// The bit that arms a latch and the bit that says that it is valid are at the same place.
const fn latch(trigger: Trigger, bit: u8, position: Number) -> Latch {
    Latch { trigger, enable: 1 << bit, valid: 1 << bit, position }
}

/// The AKD with its factory PDOs, as a kind of drive.
#[derive(Clone, Copy, Debug)]
pub enum Akd {}

impl Kind for Akd {
    const DESCRIPTION: &'static Description = &AKD;
}

/// The AKD by SDO only, as a kind of drive.
#[derive(Clone, Copy, Debug)]
pub enum AkdBySdo {}

impl Kind for AkdBySdo {
    const DESCRIPTION: &'static Description = &AKD_BY_SDO;
}

/// An AKD over a link. Every method blocks until its operation is over.
pub type Drive<L> = lexican_driver::Drive<L, Akd>;

/// An AKD whose PDOs are left to the application.
pub type FreeDrive<L> = lexican_driver::Drive<L, AkdBySdo>;

/// The driver over the runtime's tokio shell: the same operations, many drives at once on one network.
#[cfg(feature = "tokio")]
pub mod tokio {
    /// An AKD on a network.
    pub type Drive = lexican_driver::tokio::Drive<super::Akd>;

    /// An AKD on a network, whose PDOs are left to the application.
    pub type FreeDrive = lexican_driver::tokio::Drive<super::AkdBySdo>;
}

#[cfg(test)]
mod tests {
    use lexican_driver::description::{Signal, Torques};
    use lexican_runtime::object::{BitField, Mapped};

    use super::*;

    #[test]
    fn nothing_is_wrong_with_the_descriptions() {
        assert_eq!((AKD.findings(), AKD_BY_SDO.findings()), (Vec::new(), Vec::new()));
    }

    /// The objects of CiA 402 are in the data sheet, with these types.
    #[test]
    fn the_objects_are_those_of_the_data_sheet() {
        let Objects { control_word, status_word, actual_position, actual_velocity, target_position, .. } = AKD.objects;
        let limits = AKD.objects.position_limits.unwrap();
        let homing = AKD.homing.unwrap();
        let Torques { target, actual } = AKD.torque.unwrap();
        for (number, of_data_sheet) in [
            (control_word, Number::of(od::CONTROLWORD)),
            (status_word, Number::of(od::STATUSWORD)),
            (actual_position, Number::of(od::POSITION_ACTUAL_VALUE)),
            (actual_velocity.unwrap(), Number::of(od::VELOCITY_ACTUAL_VALUE)),
            (target_position, Number::of(od::TARGET_POSITION)),
            (limits[0], Number::of(od::SOFTWARE_POSITION_LIMIT.min_position_limit())),
            (limits[1], Number::of(od::SOFTWARE_POSITION_LIMIT.max_position_limit())),
            (AKD.objects.latest_fault, Number::of(od::PRE_DEFINED_ERROR_FIELD.at(1).unwrap())),
            (AKD.modes.chosen, Number::of(od::MODES_OF_OPERATION)),
            (AKD.modes.shown.unwrap(), Number::of(od::MODES_OF_OPERATION_DISPLAY)),
            (AKD.velocity.unwrap().target, Number::of(od::TARGET_VELOCITY)),
            (target, Number::of(od::TARGET_TORQUE)),
            (actual, Number::of(od::TORQUE_ACTUAL_VALUE)),
            (AKD.interpolated_position.unwrap(), Number::of(od::INTERPOLATION_DATA_RECORD.at(1).unwrap())),
            (homing.method, Number::of(od::HOMING_METHOD)),
            (homing.offset, Number::of(od::HOME_OFFSET)),
            (AKD.store.unwrap().all, Number::of(od::STORE_PARAMETERS.at(1).unwrap())),
        ] {
            assert_eq!(number, of_data_sheet);
        }
        assert_eq!(homing.methods, [1, 2, 8, 12, 17, 18, 24, 28, 33, 34, 35]);
    }

    /// The PDOs that the driver uses are those of chapters 6.3.1.3 and 6.3.2.3.
    #[test]
    fn the_pdos_are_those_of_the_data_sheet() {
        let Outputs { control, position, velocity } = AKD.outputs;
        let inputs = [AKD.inputs[0], AKD.inputs[1], AKD.inputs[2], AKD.inputs[3]];
        for (pdo, mapping) in [
            (control.unwrap(), od::Rpdo1::MAPPING),
            (position.unwrap(), od::Rpdo3::MAPPING),
            (velocity.unwrap(), od::Rpdo4::MAPPING),
            (inputs[0], od::Tpdo1::MAPPING),
            (inputs[1], od::Tpdo2::MAPPING),
            (inputs[2], od::Tpdo3::MAPPING),
            (inputs[3], od::Tpdo4::MAPPING),
        ] {
            let mapped = pdo.signals.iter().zip(mapping).map(|(signal, mapped)| match signal {
                Signal::ControlWord => *mapped == Mapped::new(0x6040, 0, 16),
                Signal::StatusWord => *mapped == Mapped::new(0x6041, 0, 16),
                Signal::TargetPosition => *mapped == Mapped::new(0x607A, 0, 32),
                Signal::TargetVelocity => *mapped == Mapped::new(0x60FF, 0, 32),
                Signal::Other(bytes) => mapped.bits == bytes * 8,
            });
            assert_eq!(mapped.filter(|same| *same).count(), mapping.len(), "{:X}h", pdo.base);
            assert_eq!(pdo.signals.len(), mapping.len(), "{:X}h", pdo.base);
        }
    }

    #[test]
    fn the_bits_are_those_of_the_data_sheet() {
        let bit = |mask: u32| {
            let of = od::ManufacturerStatus::BITS.iter().find(|bit| 1_u32 << bit.low == mask);
            of.map(|bit| bit.name)
        };
        let names = [
            (system::MOVEMENT_ACTIVE, "movement active"),
            (system::TARGET_VELOCITY_REACHED, "target velocity reached"),
            (system::SAFETY_SELECTED, "safety selected"),
            (system::HOMING_FINISHED, "homing move finished"),
            (system::HARDWARE_ENABLE, "hardware enable"),
        ];
        for (mask, name) in names {
            assert_eq!(bit(mask), Some(name));
        }
    }
}
