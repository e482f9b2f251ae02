//! How operations of the driver fail: refused, or by an error.

use std::fmt;

use lexican_runtime::host::LinkError;
use lexican_runtime::object::{
    Address, Direction as PdoDirection, LengthMismatch, Mapped, MappedLengthMismatch, OutOfRange,
};
use lexican_runtime::profile::cia402::{Command, State};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{CobId, NodeId};

use crate::description::{Reaction, Trigger};
use crate::fault::Cause;
use crate::mode::Mode;
use crate::set_point::Succession;

/// Why an operation failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Error {
    /// The link to the bus failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Access to an object failed.
    #[error(transparent)]
    Sdo(#[from] SdoError),
    /// The value of an object has another length than the data sheet says.
    #[error("{address}: the drive and its data sheet differ: {error}")]
    DataSheet { address: Address, error: LengthMismatch },
    /// A value is outside the limits of the data sheet; nothing was sent.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// This kind of drive cannot do it at all; nothing was sent.
    #[error("the {drive} has no {what}")]
    Unsupported { drive: &'static str, what: Capability },
    /// A setting names an object that is not a parameter of the drive; nothing was sent.
    #[error("{address} is no parameter of the {drive}")]
    NoParameter { drive: &'static str, address: Address },
    /// A condition is not met; nothing has moved.
    #[error("the drive would refuse: {0}")]
    Refused(Refusal),
    /// The drive is in the state FAULT.
    #[error("the drive is in fault: {0}")]
    Fault(Cause),
    /// The drive has not followed a command in time.
    #[error("the drive stays in {state} on the command {command:?}")]
    NoReaction { state: State, command: Command },
    /// No command leads to the target state, and the drive does not go there by itself; or it falls back again and
    /// again.
    #[error("no command leads from {from} to {to}")]
    NoWay { from: State, to: State },
    /// All conditions are met, but the drive has not taken an order in time.
    #[error("the drive does not take the order, and shows no reason (status word {status_word:04X})")]
    NotTaken { status_word: u16 },
    /// The drive shows another operating mode than the one that was written.
    #[error("the drive does not take the operating mode {ordered}, and shows {shown}")]
    ModeNotTaken {
        /// What was written to 6060h.
        ordered: i8,
        shown: i64,
    },
    /// The drive has not taken over the position that it was given.
    #[error("the drive has not been calibrated (status word {status_word:04X})")]
    NotCalibrated { status_word: u16 },
    /// The drive has been sent a stop, and still moves after the braking time.
    #[error("the drive does not stop: it runs at {velocity} {unit}")]
    NotStopped {
        /// As in 606Ch.
        velocity: i32,
        /// The unit of 606Ch.
        unit: &'static str,
    },
    /// The status word matches no state of the state machine.
    #[error("the status word {0:04X} has no state of the state machine")]
    UnknownState(u16),
    /// The node is another device.
    #[error(
        "the node is not a {expected}: vendor {vendor_id:X}h, profile {profile}, {}",
        name.as_ref().map_or_else(|| "no name".to_owned(), |name| format!("name {name:?}"))
    )]
    NotThisDrive {
        expected: &'static str,
        /// 1018h:01.
        vendor_id: u32,
        /// The low half of 1000h.
        profile: u16,
        /// 1008h, if the device has it.
        name: Option<String>,
    },
    /// A PDO of the node does not exist, or has another COB-ID than the one that the driver uses, of the predefined
    /// connection set (CiA 301, 7.3.5).
    #[error("{address}: the driver goes by COB-ID {:X}h, and the node is set up with {found:08X}h", expected.raw())]
    OtherCobId {
        /// Such as 1400h:01.
        address: Address,
        /// The COB-ID that the driver uses.
        expected: CobId,
        /// What the object holds; bit 31 set means that the PDO does not exist.
        found: u32,
    },
    /// A PDO that the driver uses carries something else in the drive (CiA 301, 7.5.2.36 and 7.5.2.38): another tool
    /// has mapped it, and perhaps stored the mapping. Nothing was ordered.
    #[error(
        "{direction:?} PDO {number} is mapped to {}, and the driver goes by {}: restore the mapping of the drive, or use \
         a description that goes by SDO",
        mapping(found),
        mapping(expected)
    )]
    OtherMapping {
        /// The direction, as the drive sees it.
        direction: PdoDirection,
        /// 1 to 4.
        number: u16,
        /// The mapping that the driver expects; index 0 stands for an object unknown to it.
        expected: Vec<Mapped>,
        /// The mapping in the drive, as far as the driver uses it.
        found: Vec<Mapped>,
    },
    /// The driver itself uses this PDO, or there is no PDO of this number; nothing was sent.
    #[error("{direction:?} PDO {number} is not free")]
    PdoInUse {
        /// The direction, as the drive sees it.
        direction: PdoDirection,
        /// 1 to 4.
        number: u16,
    },
    /// The drive has not sent a PDO that was waited for.
    #[error("transmit PDO {number} does not come")]
    NoPdo {
        /// 1 to 4.
        number: u16,
    },
    /// The drive sends a PDO with fewer bytes than are mapped.
    #[error("transmit PDO {number}: {error}")]
    ShortPdo {
        /// 1 to 4.
        number: u16,
        error: MappedLengthMismatch,
    },
    /// The drive sends heartbeats, which exclude life guarding (CiA 301, 7.2.8.2.1), and does not consume any.
    #[error(
        "the drive sends heartbeats (1017h is {heartbeat_ms} ms), which exclude life guarding: write 0 there first"
    )]
    HeartbeatExcludesGuarding {
        /// 1017h.
        heartbeat_ms: u16,
    },
    /// The operation was cancelled by a [`CancelHandle`](crate::CancelHandle).
    #[error("cancelled: the drive at node {node} {}", if *.stopped { "has been stopped" } else { "was not moving" })]
    Cancelled {
        node: NodeId,
        /// Whether it may have been moving; it stands now.
        stopped: bool,
    },
    /// An operation failed and the drive may be moving: it was ordered to, and has not been seen to stand.
    #[error("{error}; the drive at node {node} may still be moving")]
    MayBeMoving { node: NodeId, error: Box<Error> },
    /// The drive has booted in the middle of an operation: it was reset, or its power failed.
    #[error("the drive has restarted")]
    Restarted,
}

impl Error {
    /// The error itself, taken out of [`Error::MayBeMoving`].
    #[must_use]
    pub fn into_cause(self) -> Error {
        match self {
            Error::MayBeMoving { error, .. } => error.into_cause(),
            error => error,
        }
    }

    /// Whether trying again may help: the drive does not answer yet, or the bus carries no frames.
    pub(crate) fn is_passing(&self) -> bool {
        match self {
            Error::Restarted | Error::Sdo(SdoError::TimedOut { .. }) => true,
            Error::Link(error) => !error.is_final(),
            Error::MayBeMoving { error, .. } => error.is_passing(),
            _ => false,
        }
    }

    /// Whether the operation ended before it changed anything, or the drive does not move.
    pub(crate) const fn leaves_at_rest(&self) -> bool {
        matches!(
            self,
            Error::OutOfRange(_)
                | Error::Unsupported { .. }
                | Error::NoParameter { .. }
                | Error::PdoInUse { .. }
                | Error::Refused(_)
                | Error::Fault(_)
                | Error::Cancelled { .. }
                | Error::MayBeMoving { .. }
        )
    }
}

fn mapping(mapping: &[Mapped]) -> String {
    let entry = |mapped: &Mapped| match mapped.address.index() {
        0 => format!("{} bits", mapped.bits),
        _ => format!("{} ({} bits)", mapped.address, mapped.bits),
    };
    match mapping {
        [] => "nothing".to_owned(),
        _ => mapping.iter().map(entry).collect::<Vec<_>>().join(", "),
    }
}

/// Something that not every kind of drive can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Capability {
    /// An operating mode.
    Mode(Mode),
    /// Following a path in an operating mode.
    Path(Mode),
    /// Inching operation.
    Inching,
    /// A homing method (6098h).
    HomingMethod(i8),
    /// Setting the actual position.
    Calibration,
    /// Set-points that follow one another.
    SetPoints,
    /// One way in which set-points follow one another.
    Succession(Succession),
    /// Set-points that are distances.
    RelativeSetPoints,
    /// A position latch.
    Latch(Trigger),
    /// A reaction with an option code.
    Reaction(Reaction),
    /// Choosing the side of approach.
    Approach,
    /// Storing parameters on command.
    Store,
    /// Restoring factory settings.
    Restore,
    /// Stopping a travel by its load.
    TorqueDeactivation,
    /// Measuring its temperature.
    Temperature,
    /// Measuring the voltage of a battery.
    Battery,
    /// Units of position that are known.
    Units,
    /// Switching emergency messages.
    EmergencySwitch,
    /// Noticing that its manager is gone.
    Protection,
    /// Holding a target until SYNC.
    StartBySync,
    /// A known profile velocity and acceleration (6081h, 6083h).
    Profile,
}

/// Which conditions are not met.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal(pub Vec<Missing>);

/// A condition that is not met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Missing {
    /// The drive is in fault.
    NoFault(Cause),
    /// The drive is not in OPERATION ENABLED.
    Enabled(State),
    /// The output stage has no supply.
    Supply,
    /// The input that enables the drive is not active.
    EnableInput,
    /// A safety function, such as STO, holds the drive.
    SafetyReleased,
    /// A travel is under way.
    NoTravel,
    /// The travel under way is interrupted.
    TravelResumed,
    /// No travel is under way that could be interrupted.
    Travel,
    /// The position is above the upper limit.
    BelowUpperLimit,
    /// The position is below the lower limit.
    AboveLowerLimit,
    /// The position is at the upper limit.
    ShortOfUpperLimit,
    /// The position is at the lower limit.
    ShortOfLowerLimit,
    /// A limit switch is active.
    OffLimitSwitch(u8),
    /// The target is outside the limits.
    TargetWithinLimits {
        /// The target.
        target: i32,
        /// The lower limit.
        low: i32,
        /// The upper limit.
        high: i32,
    },
    /// The profile velocity (6081h) is 0: the drive would take the order and not move.
    ProfileVelocity(Address),
    /// The velocity is higher than the gear allows.
    VelocityWithinGear {
        /// As in 60FFh.
        velocity: i32,
        /// The highest that the gear allows.
        most: i32,
    },
    /// The drive is enabled.
    Disabled,
    /// The drive would start at once, and not with SYNC.
    StartBySync,
    /// The operating mode is another one.
    Mode(Mode),
    /// The driver does not know the operating mode; 0 means none.
    UnknownMode(i64),
}

impl fmt::Display for Capability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Capability::Mode(mode) => write!(f, "{mode} mode"),
            Capability::Path(mode) => write!(f, "{mode} mode in which to follow a path"),
            Capability::Inching => f.write_str("inching operation"),
            Capability::HomingMethod(method) => write!(f, "homing method {method}"),
            Capability::Calibration => f.write_str("calibration"),
            Capability::SetPoints => f.write_str("set-points that follow one another"),
            Capability::Succession(Succession::Stopped) => f.write_str("set-points after a stop"),
            Capability::Succession(Succession::Blended) => f.write_str("set-points without a stop"),
            Capability::Succession(Succession::AtOnce) => f.write_str("set-points at once"),
            Capability::RelativeSetPoints => f.write_str("set-points that are distances"),
            Capability::Latch(trigger) => write!(f, "latch for a {trigger}"),
            Capability::Reaction(reaction) => write!(f, "choice of what it does on {reaction}"),
            Capability::Approach => f.write_str("choice of approach"),
            Capability::Store => f.write_str("command that keeps parameters"),
            Capability::Restore => f.write_str("such factory settings to restore"),
            Capability::TorqueDeactivation => f.write_str("torque deactivation"),
            Capability::Temperature => f.write_str("temperature to read"),
            Capability::Battery => f.write_str("battery voltage to read"),
            Capability::Units => f.write_str("units that are known"),
            Capability::Protection => {
                f.write_str("life guarding, and no heartbeat consumer that is free and takes a node-ID")
            }
            Capability::Profile => f.write_str("profile velocity and acceleration that are known"),
            Capability::StartBySync => f.write_str("PDO that holds its target until SYNC"),
            Capability::EmergencySwitch => f.write_str("switch for emergency messages"),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (row, missing) in self.0.iter().enumerate() {
            let separator = if row == 0 { "" } else { "; " };
            write!(f, "{separator}{missing}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Missing::NoFault(cause) => write!(f, "it is in fault ({cause})"),
            Missing::Enabled(state) => write!(f, "it is in {state}, not in OPERATION ENABLED"),
            Missing::Supply => f.write_str("its output stage has no supply"),
            Missing::EnableInput => f.write_str("its enable input is not active"),
            Missing::SafetyReleased => f.write_str("a safety function has it"),
            Missing::NoTravel => f.write_str("a travel is under way"),
            Missing::TravelResumed => f.write_str("its travel is interrupted"),
            Missing::Travel => f.write_str("no travel is under way"),
            Missing::BelowUpperLimit => f.write_str("its position is above the upper limit"),
            Missing::AboveLowerLimit => f.write_str("its position is below the lower limit"),
            Missing::ShortOfUpperLimit => f.write_str("its position is at the upper limit"),
            Missing::ShortOfLowerLimit => f.write_str("its position is at the lower limit"),
            Missing::OffLimitSwitch(number) => write!(f, "its limit switch {number} is active"),
            Missing::TargetWithinLimits { target, low, high } => {
                write!(f, "the target {target} is outside its limits, {low} to {high}")
            }
            Missing::ProfileVelocity(object) => {
                write!(f, "its profile velocity ({object}) is 0, with which it would not move: set it")
            }
            Missing::VelocityWithinGear { velocity, most } => {
                write!(f, "the velocity {velocity} is more than its gear allows, {most}")
            }
            Missing::Disabled => f.write_str("it is enabled"),
            Missing::StartBySync => f.write_str("it does not hold its target until SYNC"),
            Missing::Mode(mode) => write!(f, "it is in {mode} mode"),
            Missing::UnknownMode(0) => f.write_str("it is in no mode: `set_mode` chooses one"),
            Missing::UnknownMode(number) => write!(f, "it is in an unknown mode, {number}"),
        }
    }
}
