//! The objects of CiA 402 that a servo uses.

use lexican_runtime::object::Address;

macro_rules! objects {
    ($($name:ident = $index:literal, $sub:literal;)*) => {
        $(pub(super) const $name: Address = Address::new($index, $sub);)*
    };
}

objects! {
    DEVICE_TYPE = 0x1000, 0;
    ABORT_CONNECTION = 0x6007, 0;
    ERROR_CODE = 0x603F, 0;
    CONTROL_WORD = 0x6040, 0;
    STATUS_WORD = 0x6041, 0;
    QUICK_STOP_OPTION = 0x605A, 0;
    SHUTDOWN_OPTION = 0x605B, 0;
    DISABLE_OPTION = 0x605C, 0;
    HALT_OPTION = 0x605D, 0;
    FAULT_OPTION = 0x605E, 0;
    MODE = 0x6060, 0;
    SHOWN_MODE = 0x6061, 0;
    POSITION_DEMAND = 0x6062, 0;
    POSITION_INTERNAL = 0x6063, 0;
    POSITION = 0x6064, 0;
    FOLLOWING_WINDOW = 0x6065, 0;
    FOLLOWING_TIME = 0x6066, 0;
    POSITION_TIME = 0x6068, 0;
    VELOCITY_SENSOR = 0x6069, 0;
    VELOCITY_DEMAND = 0x606B, 0;
    VELOCITY = 0x606C, 0;
    VELOCITY_WINDOW = 0x606D, 0;
    VELOCITY_TIME = 0x606E, 0;
    VELOCITY_THRESHOLD = 0x606F, 0;
    VELOCITY_THRESHOLD_TIME = 0x6070, 0;
    TARGET_TORQUE = 0x6071, 0;
    MAX_TORQUE = 0x6072, 0;
    MAX_CURRENT = 0x6073, 0;
    TORQUE_DEMAND = 0x6074, 0;
    TORQUE = 0x6077, 0;
    CURRENT = 0x6078, 0;
    TARGET_POSITION = 0x607A, 0;
    RANGE_MIN = 0x607B, 1;
    RANGE_MAX = 0x607B, 2;
    HOME_OFFSET = 0x607C, 0;
    LIMIT_MIN = 0x607D, 1;
    LIMIT_MAX = 0x607D, 2;
    POLARITY = 0x607E, 0;
    MAX_PROFILE_VELOCITY = 0x607F, 0;
    MAX_MOTOR_SPEED = 0x6080, 0;
    PROFILE_VELOCITY = 0x6081, 0;
    PROFILE_ACCELERATION = 0x6083, 0;
    PROFILE_DECELERATION = 0x6084, 0;
    QUICK_STOP_DECELERATION = 0x6085, 0;
    TORQUE_SLOPE = 0x6087, 0;
    ENCODER_INCREMENTS = 0x608F, 1;
    ENCODER_REVOLUTIONS = 0x608F, 2;
    GEAR_MOTOR = 0x6091, 1;
    GEAR_SHAFT = 0x6091, 2;
    FEED = 0x6092, 1;
    FEED_REVOLUTIONS = 0x6092, 2;
    HOMING_METHOD = 0x6098, 0;
    HOMING_FAST = 0x6099, 1;
    HOMING_SLOW = 0x6099, 2;
    HOMING_ACCELERATION = 0x609A, 0;
    VELOCITY_UNIT = 0x60A9, 0;
    ACCELERATION_UNIT = 0x60AA, 0;
    POSITION_OFFSET = 0x60B0, 0;
    VELOCITY_OFFSET = 0x60B1, 0;
    TORQUE_OFFSET = 0x60B2, 0;
    PROBE_FUNCTION = 0x60B8, 0;
    PROBE_STATUS = 0x60B9, 0;
    SET_POINT_1 = 0x60C1, 1;
    CYCLE_UNITS = 0x60C2, 1;
    CYCLE_EXPONENT = 0x60C2, 2;
    MAX_ACCELERATION = 0x60C5, 0;
    MAX_DECELERATION = 0x60C6, 0;
    HOMING_METHODS = 0x60E3, 0;
    POSITIONING_OPTION = 0x60F2, 0;
    FOLLOWING_ERROR = 0x60F4, 0;
    MAX_SLIPPAGE = 0x60F8, 0;
    POSITION_DEMAND_INTERNAL = 0x60FC, 0;
    INPUTS = 0x60FD, 0;
    TARGET_VELOCITY = 0x60FF, 0;
    SUPPORTED_MODES = 0x6502, 0;
    SYNC_PERIOD = 0x1006, 0;
}

/// The positions that the probes stored: at the positive and negative edge of each (60BAh to 60BDh).
pub(super) const PROBED: [Address; 4] =
    [Address::new(0x60BA, 0), Address::new(0x60BB, 0), Address::new(0x60BC, 0), Address::new(0x60BD, 0)];

/// From this place of [`MEASURED`] on, values change while the axis moves; the earlier ones change by events only.
pub(super) const FIRST_MOVING: usize = 3;

/// What the servo measures, in the order of its values.
pub(super) const MEASURED: [Address; 15] = [
    STATUS_WORD,
    SHOWN_MODE,
    ERROR_CODE,
    POSITION,
    POSITION_INTERNAL,
    POSITION_DEMAND,
    POSITION_DEMAND_INTERNAL,
    FOLLOWING_ERROR,
    VELOCITY,
    VELOCITY_SENSOR,
    VELOCITY_DEMAND,
    TORQUE,
    TORQUE_DEMAND,
    CURRENT,
    INPUTS,
];
