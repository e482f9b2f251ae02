//! What the sequences need to know of a drive of this kind, as data.
//!
//! The SIKO AG02 and the Kollmorgen AKD do the same things with other bits, mode numbers and codes: they
//! come with a description of their own. No sequence asks which drive it is talking to.

use lexican_runtime::Duration;

use crate::fault::{Cause, cause_of};
use crate::state::{Command, TRANSITIONS, Transitions};
use crate::words::{control, status, system};

/// A drive, as the sequences see it.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// What to call it.
    pub name: &'static str,
    /// 1018h:01.
    pub vendor_id: u32,
    /// The profile in the low half of 1000h.
    pub profile: u16,
    /// 1008h, four characters; `None` for a drive that does not have the object. It tells the AG03/1 from the
    /// AG02, which has the same vendor and profile.
    pub device_name: Option<[u8; 4]>,
    /// The state machine.
    pub transitions: Transitions,
    /// What the control word holds beside a command while nothing is to move.
    pub idle: u16,
    /// Bits of the control word.
    pub control: ControlBits,
    /// Bits of the status word.
    pub status: StatusBits,
    /// Bits of the manufacturer's status register 1002h.
    pub system: SystemBits,
    /// What an emergency code means.
    pub cause_of: fn(u16) -> Cause,
    /// How long a command may take to show in the status word.
    pub reaction: Duration,
    /// How long to wait for a status word before asking for one.
    pub status_period: Duration,
    /// How long it may take to stop, with the gentlest deceleration from the highest velocity.
    pub braking: Duration,
    /// How long inching takes to show that it has begun.
    pub inching_begins: Duration,
}

/// Bits of the control word.
#[derive(Clone, Copy, Debug)]
pub struct ControlBits {
    /// Its edge starts a positioning.
    pub new_setpoint: u16,
    /// Interrupts a positioning; its falling edge resumes it, and starts velocity mode.
    pub stop: u16,
    /// Its edge starts a step (inching operation 1).
    pub step: u16,
    /// Moves in positive direction while set (inching operation 2).
    pub inch_positive: u16,
    /// Moves in negative direction while set.
    pub inch_negative: u16,
}

/// Bits of the status word.
#[derive(Clone, Copy, Debug)]
pub struct StatusBits {
    /// The supply is good.
    pub voltage_enabled: u16,
    /// Ready to travel.
    pub ready: u16,
    /// The drive obeys the bus.
    pub remote: u16,
    /// Target reached.
    pub target_reached: u16,
    /// Beyond a limit.
    pub internal_limit: u16,
    /// Positioning: the setpoint has been taken.
    pub acknowledged: u16,
    /// Velocity: standing still.
    pub standstill: u16,
    /// Positioning under way.
    pub positioning: u16,
    /// Positioning: moving.
    pub moving: u16,
}

/// Bits of the manufacturer's status register that refuse travels.
#[derive(Clone, Copy, Debug)]
pub struct SystemBits {
    /// Above the upper limit.
    pub above_upper_limit: u16,
    /// Below the lower limit.
    pub below_lower_limit: u16,
    /// Moving, in whichever mode.
    pub moving: u16,
    /// The output stage is not supplied.
    pub no_supply: u16,
    /// A positioning is under way.
    pub positioning: u16,
    /// Not ready to travel, for whichever reason.
    pub not_ready: u16,
}

impl Description {
    /// The control word for a command, while nothing is to move.
    #[must_use]
    pub const fn word(&self, command: Command) -> u16 {
        command.apply(self.idle)
    }
}

/// The SIKO AG03/1, as tables 1, 21, 23 and 24 and the examples of 7.8 have it.
pub const AG03_1: Description = Description {
    name: "SIKO AG03/1",
    vendor_id: 0x195,
    profile: 402,
    device_name: Some(*b"AG03"),
    transitions: TRANSITIONS,
    idle: control::STOP,
    control: ControlBits {
        new_setpoint: control::NEW_SETPOINT,
        stop: control::STOP,
        step: control::INCHING_1,
        inch_positive: control::INCHING_2_POSITIVE,
        inch_negative: control::INCHING_2_NEGATIVE,
    },
    status: StatusBits {
        voltage_enabled: status::VOLTAGE_ENABLED,
        ready: status::READY,
        remote: status::REMOTE,
        target_reached: status::TARGET_REACHED,
        internal_limit: status::INTERNAL_LIMIT,
        acknowledged: status::ACKNOWLEDGED,
        standstill: status::STANDSTILL,
        positioning: status::POSITIONING,
        moving: status::MOVING,
    },
    system: SystemBits {
        above_upper_limit: system::ABOVE_UPPER_LIMIT,
        below_lower_limit: system::BELOW_LOWER_LIMIT,
        moving: system::MOVING,
        no_supply: system::NO_SUPPLY,
        positioning: system::POSITIONING,
        not_ready: system::NOT_READY,
    },
    cause_of,
    reaction: Duration::from_millis(500),
    status_period: Duration::from_millis(150),
    // 200 rev/min with 0.04 rev/s² take 83 s.
    braking: Duration::from_secs(100),
    inching_begins: Duration::from_millis(50),
};
