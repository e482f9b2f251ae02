//! What some drives can do and others cannot.

use lexican_runtime::Duration;
use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::{control, status};

use super::{Number, Test};
use crate::parameter::ParameterSet;

/// Velocity and ramps of travels.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// 6081h. At 0 the drive takes an order but does not move.
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
    /// Says that the velocity is reached.
    pub reached: Test,
    /// For drives whose gear limits the velocity.
    pub gear: Option<Gear>,
}

/// The highest velocity that a gear allows.
#[derive(Clone, Copy, Debug)]
pub struct Gear {
    /// The object that holds the type of the gear.
    pub object: Number,
    /// Its values, and the highest velocity for each.
    pub most: &'static [(i64, i32)],
    /// The highest velocity for a value that is not in the table.
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

/// Inching operation: steps of a set width, and movement for as long as a bit is set.
#[derive(Clone, Copy, Debug)]
pub struct Inching {
    /// The control bit whose edge starts a step.
    pub step: u16,
    /// The control bit that moves in positive direction while set.
    pub positive: u16,
    /// The control bit that moves in negative direction while set.
    pub negative: u16,
    /// The width of a step; its sign is the direction.
    pub width: Number,
    /// Says, while inching, that the drive takes no other order. It may hold for other reasons too, such as a passed
    /// limit. `None` if only the movement shows it.
    pub busy: Option<Test>,
    /// How long inching may take to show that it has begun.
    pub begins: Duration,
}

/// How the actual position is set.
#[derive(Clone, Copy, Debug)]
pub enum Calibration {
    /// The object becomes the actual position as soon as it is written.
    Write(Number),
    /// A homing method that homes on the present position ([`Description::homing`](super::Description::homing)).
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
    /// The control bit that starts it.
    pub start: u16,
    /// The status bit of success.
    pub attained: u16,
    /// The status bit of failure.
    pub error: u16,
}

/// From which side a target is reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Approach {
    /// From wherever the drive comes.
    Direct,
    /// Always in positive direction.
    Positive,
    /// Always in negative direction.
    Negative,
}

/// Set-points that follow one another, by bits of the control word.
/// [`ControlBits::new_setpoint`](super::ControlBits::new_setpoint) alone stops at the previous target first.
#[derive(Clone, Copy, Debug)]
pub struct SetPoints {
    /// The target is a distance.
    pub relative: Option<u16>,
    /// The previous target is passed without stopping.
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

/// Storing parameters permanently.
#[derive(Clone, Copy, Debug)]
pub struct Store {
    /// All parameters (1010h:01).
    pub all: Number,
    /// The value that is written there.
    pub signature: u32,
}

/// Restoring factory settings.
#[derive(Clone, Copy, Debug)]
pub struct Restore {
    /// All parameters (1011h:01).
    pub all: Number,
    /// The sets that can be restored on their own.
    pub sets: &'static [(ParameterSet, Number)],
    /// The value that is written there.
    pub signature: u32,
}

/// Stopping a travel by its load.
#[derive(Clone, Copy, Debug)]
pub struct TorqueDeactivation {
    /// Holds whether the load has stopped the drive.
    pub state: Number,
    /// The bits of `state` that say so.
    pub active: u32,
    /// The load that stops a travel, in %.
    pub threshold: Number,
    /// The threshold that disables it.
    pub off: i64,
}

/// A measured quantity.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Where it is read.
    pub object: Number,
    /// How many counts make one unit.
    pub per_unit: u32,
}

/// What one count of a position is worth: [`Units`](crate::Units).
#[derive(Clone, Copy, Debug)]
pub struct UnitObjects {
    /// Increments per revolution, without a spindle.
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
    /// The bit, as a mask.
    pub bit: u32,
    /// Whether the bit, when set, switches them on; in CiA 301, 7.5.2.17, it switches them off.
    pub on_when_set: bool,
}

impl Velocities {
    /// The objects and bits of CiA 402.
    pub const CIA_402: Velocities = Velocities {
        target: Number::new(0x60FF, 0x00, DataType::Integer32),
        reached: Test::of_status(status::TARGET_REACHED),
        gear: None,
    };
}

impl Torques {
    /// The objects and bits of CiA 402.
    pub const CIA_402: Torques = Torques {
        target: Number::new(0x6071, 0x00, DataType::Integer16),
        actual: Number::new(0x6077, 0x00, DataType::Integer16),
    };
}

impl Homing {
    /// The objects and bits of CiA 402-2, with all its methods.
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
    /// The bits of CiA 402-2.
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

    /// The value that restores when written to 1011h: "load" (CiA 301, 7.5.2.14).
    pub const SIGNATURE: u32 = u32::from_le_bytes(*b"load");
}

impl EmergencySwitch {
    /// Bit 31 switches them off (CiA 301, 7.5.2.17).
    pub const CIA_301: EmergencySwitch =
        EmergencySwitch { object: Number::new(0x1014, 0x00, DataType::Unsigned32), bit: 1 << 31, on_when_set: false };
}
