//! What the sequences need to know of a kind of drive, as data.
//!
//! What every drive has is a field; what only some have is an `Option`, whose absence is reported as
//! [`Error::Unsupported`](crate::Error::Unsupported) before anything is sent. Wherever drives differ in a number, a
//! bit, an order or a method, a field here says so, and no sequence has to ask which drive it is talking to.

mod capability;
mod check;
mod condition;
mod frame;
mod latch;
mod number;
mod pdo;
mod reaction;

use lexican_runtime::Duration;
use lexican_runtime::object::DataType;
use lexican_runtime::profile::cia402::{Command, Modes, Transitions, control, status};

pub use capability::{
    Approach, Approaches, Calibration, EmergencySwitch, Gear, Homing, Inching, Measured, Profile, Restore, SetPoints,
    Store, TorqueDeactivation, Torques, UnitObjects, Velocities,
};
pub use condition::{Condition, Orders, Test, Word};
pub use latch::{Latch, Latches, Trigger};
pub use number::Number;
pub use pdo::{Outputs, Pdo, Signal};
pub use reaction::Reaction;

use crate::fault::{ByteOrder, Codes};
use crate::mode::Mode;
use crate::parameter::Parameter;

/// A kind of drive, as the sequences see it.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// What to call it.
    pub name: &'static str,
    /// How to distinguish it from others.
    pub identity: Identity,
    /// The objects that every drive has.
    pub objects: Objects,
    /// How orders are sent: by PDO or by SDO.
    pub outputs: Outputs,
    /// The PDOs in which it sends its status word by itself.
    pub inputs: &'static [Pdo],
    /// Every SDO write sends four bytes (command 23h), however short the object is.
    pub always_four_bytes: bool,
    /// The state machine.
    pub transitions: Transitions,
    /// Bits of the control word.
    pub control: ControlBits,
    /// Bits of the status word, and what else shows the progress of a travel.
    pub status: StatusBits,
    /// How the handshake of a new set-point goes on after the acknowledgement.
    pub release: Release,
    /// How the operating mode is chosen.
    pub modes: ModeObjects,
    /// What makes the drive refuse orders. The state of the state machine and the operating mode are checked anyway.
    pub conditions: &'static [Condition],
    /// What emergency codes mean.
    pub codes: Codes,
    /// How long things take.
    pub times: Times,
    /// What the application may set, store and compare.
    pub parameters: &'static [Parameter],
    /// Velocity and ramps of travels; `None` for a drive that keeps them in other objects.
    pub profile: Option<Profile>,
    /// Velocity mode.
    pub velocity: Option<Velocities>,
    /// Torque mode, and the set-point of cyclic torque mode.
    pub torque: Option<Torques>,
    /// Where interpolated positions are written (60C1h:01).
    pub interpolated_position: Option<Number>,
    /// Set-points that follow one another while the drive travels.
    pub set_points: Option<SetPoints>,
    /// Positions that inputs latch.
    pub latches: Option<Latches>,
    /// The option codes of its reactions.
    pub reactions: &'static [(Reaction, Number)],
    /// Inching operation.
    pub inching: Option<Inching>,
    /// Homing.
    pub homing: Option<Homing>,
    /// Setting the actual position.
    pub calibration: Option<Calibration>,
    /// Choosing from which side a target is approached, so that play is always taken up on the same side.
    pub approaches: Option<Approaches>,
    /// Storing parameters permanently on command (1010h); `None` also for a drive that does so by itself.
    pub store: Option<Store>,
    /// Restoring factory settings (1011h).
    pub restore: Option<Restore>,
    /// Stopping a travel by its load.
    pub torque_deactivation: Option<TorqueDeactivation>,
    /// Temperature, in °C.
    pub temperature: Option<Measured>,
    /// Voltage of a battery, in V.
    pub battery: Option<Measured>,
    /// What one count of a position is worth.
    pub units: Option<UnitObjects>,
    /// Whether the position is referenced. `None` for a drive that does not say, such as one whose encoder keeps its
    /// position without power.
    pub referenced: Option<Test>,
    /// Switching emergency messages on and off (1014h).
    pub emergencies: Option<EmergencySwitch>,
}

/// How to distinguish a kind of drive from others.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// The vendor-IDs that 1018h:01 may hold; 0 also stands for a drive without the object. Empty if the data sheet
    /// does not say: the drive may then be of any vendor.
    pub vendor_ids: &'static [u32],
    /// The profile in the low half of 1000h.
    pub profile: u16,
    /// How 1008h may begin. `None` for a drive without the object, which distinguishes it from one of the same vendor
    /// and profile that has it. An empty string fits every name, and a drive without the object.
    pub names: Option<&'static [&'static str]>,
    /// Byte order of the texts 100Ah and, if the drive has it, 1008h.
    pub characters: ByteOrder,
}

/// The objects that every drive has.
#[derive(Clone, Copy, Debug)]
pub struct Objects {
    /// 6040h.
    pub control_word: Number,
    /// 6041h.
    pub status_word: Number,
    /// A status register of the manufacturer (1002h), for drives whose conditions are in it.
    pub system_word: Option<Number>,
    /// 6064h.
    pub actual_position: Number,
    /// 606Ch; `None` for a drive without it, whose position shows when it stands.
    pub actual_velocity: Option<Number>,
    /// 607Ah.
    pub target_position: Number,
    /// How far from its target the drive may settle (6067h); `None` if it does not say.
    pub position_window: Option<Number>,
    /// 607Dh, in either order; equal values mean no limits, and so does the lack of the object.
    pub position_limits: Option<[Number; 2]>,
    /// The latest fault (1003h:01): the low 16 bits are its code.
    pub latest_fault: Number,
}

/// Bits of the control word, beyond those of commands.
#[derive(Clone, Copy, Debug)]
pub struct ControlBits {
    /// What the control word has besides the command while nothing is to move.
    pub idle: u16,
    /// Its rising edge starts a positioning.
    pub new_setpoint: u16,
    /// Stops with the programmed deceleration; its falling edge resumes.
    pub stop: u16,
}

/// Bits of the status word, and what else shows the progress of a travel.
#[derive(Clone, Copy, Debug)]
pub struct StatusBits {
    /// Set while the drive obeys the bus.
    pub remote: u16,
    /// Target reached.
    pub target_reached: u16,
    /// Set while there is a warning.
    pub warning: u16,
    /// Set beyond a limit.
    pub internal_limit: u16,
    /// Set once the drive has taken the set-point.
    pub acknowledged: u16,
    /// A positioning is under way, or interrupted. `None` for a drive that does not say so: the travel is then over
    /// when the target is reached, as in CiA 402's profile position mode.
    pub positioning: Option<Test>,
    /// The drive moves; `None` if its velocity has to be read instead.
    pub moving: Option<Test>,
    /// The highest velocity at which the drive counts as standing, in the unit of 606Ch.
    pub standing: u32,
    /// The unit of velocities.
    pub velocity_unit: &'static str,
}

/// How the handshake of a new set-point goes on after the acknowledgement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Release {
    /// The driver clears the bit at once, and the acknowledgement follows, as in CiA 402.
    WhenAcknowledged,
    /// The bit stays set until the travel is over, also while it is interrupted.
    WhenOver,
}

/// How the operating mode is chosen.
#[derive(Clone, Copy, Debug)]
pub struct ModeObjects {
    /// 6060h.
    pub chosen: Number,
    /// Where the drive shows that it has taken the mode (6061h); `None` when 6060h itself does.
    pub shown: Option<Number>,
    /// The number of each mode.
    pub codes: Modes,
}

/// The value of a set-point at which the drive stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Still {
    /// At 0.
    Zero,
    /// At the actual position.
    Here,
}

/// How long things take.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    /// How long a command may take to show in the status word.
    pub reaction: Duration,
    /// For how long after an order the drive may still report its former state, such as that its target is reached. A
    /// bit that has changed since the order is believed at once.
    pub settling: Duration,
    /// How long to wait for a status word before asking for one.
    pub status_period: Duration,
    /// How long stopping may take, from the highest velocity with the gentlest deceleration.
    pub braking: Duration,
}

impl Description {
    /// A drive that does what CiA 402-2 says, with the PDOs of CiA 402-3, and nothing beyond it. Other descriptions
    /// start from it and set at least the vendor, `identity.vendor_ids`.
    pub const CIA_402: Description = Description {
        name: "drive",
        identity: Identity { vendor_ids: &[0], profile: 402, names: Some(&[""]), characters: ByteOrder::LowFirst },
        objects: Objects::CIA_402,
        outputs: Outputs::CIA_402,
        inputs: Pdo::CIA_402_INPUTS,
        always_four_bytes: false,
        transitions: Transitions::CIA_402,
        control: ControlBits { idle: 0, new_setpoint: control::NEW_SET_POINT, stop: control::HALT },
        status: StatusBits {
            remote: status::REMOTE,
            target_reached: status::TARGET_REACHED,
            warning: status::WARNING,
            internal_limit: status::INTERNAL_LIMIT,
            acknowledged: status::SET_POINT_ACKNOWLEDGE,
            positioning: None,
            moving: None,
            standing: 0,
            velocity_unit: "units of 606Ch",
        },
        release: Release::WhenAcknowledged,
        modes: ModeObjects {
            chosen: Number::new(0x6060, 0x00, DataType::Integer8),
            shown: Some(Number::new(0x6061, 0x00, DataType::Integer8)),
            codes: Modes::CIA_402,
        },
        conditions: &[],
        codes: Codes { faults: &[], notices: &[], order: ByteOrder::LowFirst },
        times: Times {
            reaction: Duration::from_millis(500),
            settling: Duration::from_millis(100),
            status_period: Duration::from_millis(150),
            braking: Duration::from_secs(100),
        },
        parameters: &[],
        profile: None,
        velocity: Some(Velocities::CIA_402),
        torque: Some(Torques::CIA_402),
        interpolated_position: Some(Number::new(0x60C1, 0x01, DataType::Integer32)),
        set_points: Some(SetPoints::CIA_402),
        latches: Some(Latches::CIA_402),
        reactions: Reaction::CIA_402,
        inching: None,
        homing: Some(Homing::CIA_402),
        calibration: None,
        approaches: None,
        store: None,
        restore: None,
        torque_deactivation: None,
        temperature: None,
        battery: None,
        units: None,
        referenced: None,
        emergencies: None,
    };

    /// The control word for a command, while nothing is to move.
    #[must_use]
    pub const fn word(&self, command: Command) -> u16 {
        command.apply(self.control.idle)
    }

    /// OPERATION ENABLED, with nothing to move.
    #[must_use]
    pub const fn resting(&self) -> u16 {
        self.word(Command::EnableOperation)
    }

    /// OPERATION ENABLED, with leave to move.
    #[must_use]
    pub const fn moving(&self) -> u16 {
        Command::EnableOperation.apply(0)
    }

    /// OPERATION ENABLED, with all movement to stop.
    #[must_use]
    pub const fn stopping(&self) -> u16 {
        self.resting() | self.control.stop
    }

    /// What the control word has besides the command while a travel is under way.
    #[must_use]
    pub const fn held(&self) -> u16 {
        match self.release {
            Release::WhenAcknowledged => 0,
            Release::WhenOver => self.control.new_setpoint,
        }
    }

    /// Whether orders or status words come by PDO, which takes NMT OPERATIONAL.
    #[must_use]
    pub const fn needs_operational(&self) -> bool {
        self.outputs.any() || !self.inputs.is_empty()
    }

    /// The set-point that a drive obeys without another order as soon as it is enabled in a mode, or changes to the
    /// mode while enabled, and the value at which it stands. `None` for a velocity or torque if Stop is set in the idle
    /// control word, since the drive then waits for its falling edge.
    #[must_use]
    pub fn obeyed_unasked(&self, mode: Mode) -> Option<(Number, Still)> {
        self.code_of(mode)?;
        let velocity = self.velocity.map(|velocities| (velocities.target, Still::Zero));
        let torque = self.torque.map(|torques| (torques.target, Still::Zero));
        let takes_an_edge = self.control.idle & self.control.stop != 0;
        match mode {
            Mode::Positioning | Mode::Homing => None,
            Mode::Velocity => velocity.filter(|_| !takes_an_edge),
            Mode::Torque => torque.filter(|_| !takes_an_edge),
            Mode::InterpolatedPosition => self.interpolated_position.map(|position| (position, Still::Here)),
            Mode::CyclicPosition => Some((self.objects.target_position, Still::Here)),
            Mode::CyclicVelocity => velocity,
            Mode::CyclicTorque => torque,
        }
    }

    /// The number of a mode; `None` if the drive does not have it.
    #[must_use]
    pub fn code_of(&self, mode: Mode) -> Option<i8> {
        self.modes.codes.code(mode.in_profile())
    }

    /// The mode with this number; `None` if the drive does not have it, or the driver does not know it.
    #[must_use]
    pub fn mode_of(&self, code: i64) -> Option<Mode> {
        let in_profile = self.modes.codes.mode(i8::try_from(code).ok()?)?;
        Mode::ALL.iter().copied().find(|mode| mode.in_profile() == in_profile)
    }
}

impl Objects {
    /// The objects of CiA 402-2.
    pub const CIA_402: Objects = Objects {
        control_word: Number::new(0x6040, 0x00, DataType::Unsigned16),
        status_word: Number::new(0x6041, 0x00, DataType::Unsigned16),
        system_word: None,
        actual_position: Number::new(0x6064, 0x00, DataType::Integer32),
        actual_velocity: Some(Number::new(0x606C, 0x00, DataType::Integer32)),
        target_position: Number::new(0x607A, 0x00, DataType::Integer32),
        position_window: Some(Number::new(0x6067, 0x00, DataType::Unsigned32)),
        position_limits: Some([
            Number::new(0x607D, 0x01, DataType::Integer32),
            Number::new(0x607D, 0x02, DataType::Integer32),
        ]),
        latest_fault: Number::new(0x1003, 0x01, DataType::Unsigned32),
    };
}
