//! What some drives can do and others cannot.

use lexican_runtime::Duration;
use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::{control, status};

use super::{Number, Test};
use crate::parameter::ParameterSet;

/// Velocity and ramps of travels.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// 6081h. With 0 there, a drive takes an order and stands.
    pub velocity: Number,
    /// 6083h.
    pub acceleration: Option<Number>,
    /// 6084h.
    pub deceleration: Option<Number>,
}

/// Velocity mode.
#[derive(Clone, Copy, Debug)]
pub struct Velocities {
    /// 60FFh.
    pub target: Number,
    /// The bit that says that the velocity is reached.
    pub reached: Test,
    /// The object that holds which gear there is, for drives whose gear limits the velocity.
    pub gear: Option<Gear>,
}

/// Which velocity a gear allows.
#[derive(Clone, Copy, Debug)]
pub struct Gear {
    /// The object that holds which gear there is.
    pub object: Number,
    /// Its values, and the highest velocity of each.
    pub most: &'static [(i64, i32)],
    /// The highest velocity of a gear that the table does not have.
    pub otherwise: i32,
}

/// Torque mode. Torques are in 1/1000 of the rated torque.
#[derive(Clone, Copy, Debug)]
pub struct Torques {
    /// 6071h.
    pub target: Number,
    /// 6077h.
    pub actual: Number,
}

/// Inching operation: steps of a set width, and moving while a bit is set.
#[derive(Clone, Copy, Debug)]
pub struct Inching {
    /// The bit of the control word whose edge starts a step.
    pub step: u16,
    /// The bit that moves in positive direction while set.
    pub positive: u16,
    /// The bit that moves in negative direction while set.
    pub negative: u16,
    /// How far a step goes; its sign is the direction.
    pub width: Number,
    /// The bits that say, while inching, that the drive takes no other order. They may say so for other reasons too, such as a
    /// limit that is passed. `None` for a drive whose movement is all that shows.
    pub busy: Option<Test>,
    /// How long inching takes to show that it has begun.
    pub begins: Duration,
}

/// How the actual position is set.
#[derive(Clone, Copy, Debug)]
pub enum Calibration {
    /// The object becomes the actual position as soon as it is written.
    Write(Number),
    /// A homing method that stays where it is ([`Description::homing`](super::Description::homing)).
    Homing(i8),
}

/// Homing.
#[derive(Clone, Copy, Debug)]
pub struct Homing {
    /// The object that chooses the method (6098h).
    pub method: Number,
    /// The methods that the drive has.
    pub methods: &'static [i8],
    /// The position of the reference point (607Ch).
    pub offset: Number,
    /// The bit of the control word that starts it.
    pub start: u16,
    /// The bit of the status word that reports its success.
    pub attained: u16,
    /// The bit of the status word that reports its failure.
    pub error: u16,
}

/// From which side a target is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Approach {
    /// From where the drive comes.
    Direct,
    /// Always in positive direction.
    Positive,
    /// Always in negative direction.
    Negative,
}

/// Set-points that follow one another, by bits of the control word. The one that a drive obeys while it stops at the target
/// before is [`ControlBits::new_setpoint`](super::ControlBits::new_setpoint) alone.
#[derive(Clone, Copy, Debug)]
pub struct SetPoints {
    /// The target is a distance.
    pub relative: Option<u16>,
    /// The target before is passed without stopping.
    pub blended: Option<u16>,
    /// The travel under way is replaced.
    pub at_once: Option<u16>,
}

/// How the approach is chosen.
#[derive(Clone, Copy, Debug)]
pub struct Approaches {
    /// The object.
    pub object: Number,
    /// Its value for each approach.
    pub values: [(i64, Approach); 3],
}

/// Keeping parameters without power.
#[derive(Clone, Copy, Debug)]
pub struct Store {
    /// All parameters (1010h:01).
    pub all: Number,
    /// The signature that is written there.
    pub signature: u32,
}

/// Restoring factory settings.
#[derive(Clone, Copy, Debug)]
pub struct Restore {
    /// All parameters (1011h:01).
    pub all: Number,
    /// The sets that can be restored alone.
    pub sets: &'static [(ParameterSet, Number)],
    /// The signature that is written there.
    pub signature: u32,
}

/// Stopping a travel by its load.
#[derive(Clone, Copy, Debug)]
pub struct TorqueDeactivation {
    /// Holds whether it has stopped the drive.
    pub state: Number,
    /// The bits that say so.
    pub active: u32,
    /// The load, in %, at which it does.
    pub threshold: Number,
    /// The threshold that switches it off.
    pub off: i64,
}

/// A measured quantity.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Where it is read.
    pub object: Number,
    /// How many counts are one unit.
    pub per_unit: u32,
}

/// What one count of a position is worth: [`Units`](crate::Units).
#[derive(Clone, Copy, Debug)]
pub struct UnitObjects {
    /// Increments of one revolution, without a spindle.
    pub increments: u32,
    /// The pitch of the spindle in 1/100 mm; 0 when positions are increments.
    pub spindle_pitch_10um: Number,
    /// Numerator of the external gear.
    pub numerator: Number,
    /// Its denominator.
    pub denominator: Number,
}

/// Switching emergency messages on and off: a bit of 1014h.
#[derive(Clone, Copy, Debug)]
pub struct EmergencySwitch {
    /// 1014h.
    pub object: Number,
    /// The bit.
    pub bit: u32,
    /// Whether it switches them on when set; off, as CiA 301, 7.5.2.17, has it, otherwise.
    pub on_when_set: bool,
}

impl Velocities {
    /// As CiA 402 has it.
    pub const CIA_402: Velocities = Velocities {
        target: Number::new(0x60FF, 0x00, DataType::Integer32),
        reached: Test::of_status(status::TARGET_REACHED),
        gear: None,
    };
}

impl Torques {
    /// As CiA 402 has it.
    pub const CIA_402: Torques = Torques {
        target: Number::new(0x6071, 0x00, DataType::Integer16),
        actual: Number::new(0x6077, 0x00, DataType::Integer16),
    };
}

impl Homing {
    /// As CiA 402-2 has it, with all its methods.
    pub const CIA_402: Homing = Homing {
        method: Number::new(0x6098, 0x00, DataType::Integer8),
        methods: &[
            1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 33,
            34, 35, 37,
        ],
        offset: Number::new(0x607C, 0x00, DataType::Integer32),
        start: control::HOMING_OPERATION_START,
        attained: status::HOMING_ATTAINED,
        error: status::HOMING_ERROR,
    };
}

impl SetPoints {
    /// As CiA 402-2 has it.
    pub const CIA_402: SetPoints = SetPoints {
        relative: Some(control::RELATIVE),
        blended: Some(control::CHANGE_ON_SET_POINT),
        at_once: Some(control::CHANGE_IMMEDIATELY),
    };
}

impl Store {
    /// 1010h:01, "save" (CiA 301, 7.5.2.13).
    pub const CIA_301: Store =
        Store { all: Number::new(0x1010, 0x01, DataType::Unsigned32), signature: u32::from_le_bytes(*b"save") };
}

impl Restore {
    /// 1011h:01, "load" (CiA 301, 7.5.2.14).
    pub const CIA_301: Restore =
        Restore { all: Number::new(0x1011, 0x01, DataType::Unsigned32), sets: &[], signature: Restore::SIGNATURE };

    /// What 1011h is written to restore: "load" (CiA 301, 7.5.2.14).
    pub const SIGNATURE: u32 = u32::from_le_bytes(*b"load");
}

impl EmergencySwitch {
    /// Bit 31 switches them off (CiA 301, 7.5.2.17).
    pub const CIA_301: EmergencySwitch =
        EmergencySwitch { object: Number::new(0x1014, 0x00, DataType::Unsigned32), bit: 1 << 31, on_when_set: false };
}
