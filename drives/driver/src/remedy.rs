//! What to do about each error: one list, which the command, the bench and others present in their own form.

use lexican_runtime::service::sdo_client::SdoError;

use crate::error::{Error, Missing, Refusal};

/// What to do about an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Remedy {
    /// In words.
    pub text: &'static str,
    /// The operations of the driver that help, each on its own; none if a person has to do something.
    pub steps: &'static [Step],
}

/// An operation that leads out of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Step {
    /// [`enable`](crate::sequence::enable).
    Enable,
    /// [`disable`](crate::sequence::disable).
    Disable,
    /// [`stop`](crate::sequence::stop).
    Stop,
    /// [`resume`](crate::sequence::resume).
    Resume,
    /// [`drop_travel`](crate::sequence::drop_travel).
    Drop,
    /// [`reset_fault`](crate::sequence::reset_fault).
    ResetFault,
}

impl Step {
    /// The word of `lexican drive`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Step::Enable => "enable",
            Step::Disable => "disable",
            Step::Stop => "stop",
            Step::Resume => "resume",
            Step::Drop => "drop",
            Step::ResetFault => "reset-fault",
        }
    }
}

/// Makes `word` and `remedy` by a match over all variants, and the list of all words: a variant without a row does not
/// compile.
macro_rules! rows {
    ($of:ident, $words:ident: $($word:literal $pattern:pat => $text:literal $(, $step:ident)*;)*) => {
        impl $of {
            /// The word of each variant, for programs and tables.
            pub const $words: &'static [&'static str] = &[$($word),*];

            /// The word of this one.
            #[must_use]
            pub const fn word(&self) -> &'static str {
                match self {
                    $($pattern => $word,)*
                }
            }

            const fn row(&self) -> Remedy {
                match self {
                    $($pattern => Remedy { text: $text, steps: &[$(Step::$step),*] },)*
                }
            }
        }
    };
}

// In the order in which they have to be remedied.
rows! { Missing, WORDS:
    "fault" Missing::NoFault(_) => "remove the cause of its fault, then reset it", ResetFault;
    "safety" Missing::SafetyReleased => "release its safety function, such as STO";
    "supply" Missing::Supply => "switch the supply of its output stage on";
    "enable-input" Missing::EnableInput => "set the input that enables it";
    "interrupted" Missing::TravelResumed => "go on with its travel, or drop the rest of it, which disables it", Resume, Drop;
    "under-way" Missing::NoTravel => "stop it first", Stop;
    "disabled" Missing::Enabled(_) => "enable it first", Enable;
    "enabled" Missing::Disabled => "disable it first", Disable;
    "mode" Missing::Mode(_) => "choose the mode of the order first";
    "unknown-mode" Missing::UnknownMode(_) => "choose the mode of the order first";
    "above-limit" Missing::BelowUpperLimit => "inch it back towards smaller positions, or set its upper limit higher (607Dh)";
    "below-limit" Missing::AboveLowerLimit => "inch it back towards greater positions, or set its lower limit lower (607Dh)";
    "at-upper-limit" Missing::ShortOfUpperLimit => "move it towards smaller positions, or set its upper limit higher (607Dh)";
    "at-lower-limit" Missing::ShortOfLowerLimit => "move it towards greater positions, or set its lower limit lower (607Dh)";
    "limit-switch" Missing::OffLimitSwitch(_) => "inch it off its limit switch, the other way";
    "target" Missing::TargetWithinLimits { .. } => "give a target within its limits, or set them wider (607Dh)";
    "profile-velocity" Missing::ProfileVelocity(_) => "give it a profile velocity that fits the machine (6081h; --velocity of the command)";
    "velocity" Missing::VelocityWithinGear { .. } => "give a velocity that its gear allows";
    "no-travel" Missing::Travel => "order a travel first";
    "start-by-sync" Missing::StartBySync => "have it hold its target until SYNC first, while it is disabled";
}

rows! { Error, WORDS:
    "link" Error::Link(_) => "see whether the bus is up, and the adapter plugged in";
    "aborted" Error::Sdo(SdoError::Aborted { .. }) => "see what its manual says of the object";
    "no-answer" Error::Sdo(_) => "see whether the node is on the bus, with power, and has this node-ID";
    "data-sheet" Error::DataSheet { .. } => "use the data sheet of its firmware";
    "out-of-range" Error::OutOfRange(_) => "stay within the limits of the data sheet";
    "unsupported" Error::Unsupported { .. } => "see its manual for what it has instead";
    "no-parameter" Error::NoParameter { .. } => "leave the object out";
    "refused" Error::Refused(_) => "see to what is missing";
    "fault" Error::Fault(_) => "remove its cause, then reset the fault", ResetFault;
    "no-reaction" Error::NoReaction { .. } => "see in which state it is; then disable it, and begin again", Disable;
    "no-way" Error::NoWay { .. } => "see what holds it in its state: supply, safety function, another manager";
    "not-taken" Error::NotTaken { .. } => "see whether another manager moves it; then give the order again";
    "mode-not-taken" Error::ModeNotTaken { .. } => "disable it, and choose the mode then", Disable;
    "not-calibrated" Error::NotCalibrated { .. } => "give a position within its limits, with the drive at rest", Stop;
    "not-stopped" Error::NotStopped { .. } => "stop it by its emergency stop or its supply";
    "unknown-state" Error::UnknownState(_) => "see whether its data sheet is that of this drive";
    "not-this-drive" Error::NotThisDrive { .. } => "name what it is";
    "other-cob-id" Error::OtherCobId { .. } => "give its PDO the COB-ID that the driver goes by; if it has 1011h, that restores it, before a reset of the node";
    "other-mapping" Error::OtherMapping { .. } => "map its PDO as the driver goes by it; if it has 1011h, that restores it, before a reset of the node";
    "pdo-in-use" Error::PdoInUse { .. } => "take another PDO; if there is none, a description that goes by SDO leaves all of them free";
    "no-pdo" Error::NoPdo { .. } => "see whether the PDO is switched on, and what it waits for";
    "short-pdo" Error::ShortPdo { .. } => "map the PDO as the program has it";
    "heartbeat" Error::HeartbeatExcludesGuarding { .. } => "switch its heartbeats off: write 0 to 1017h";
    "cancelled" Error::Cancelled { .. } => "give the order again";
    "may-be-moving" Error::MayBeMoving { .. } => "stop it; if that fails, by its emergency stop or its supply", Stop;
    "restarted" Error::Restarted => "see why its power has failed, or which node has reset it; then enable it", Enable;
}

impl Missing {
    /// What to do about it.
    #[must_use]
    pub const fn remedy(&self) -> Remedy {
        self.row()
    }
}

impl Refusal {
    /// The missing condition that has to be remedied first.
    #[must_use]
    pub fn first(&self) -> Option<Missing> {
        let place = |missing: &Missing| Missing::WORDS.iter().position(|word| *word == missing.word());
        self.0.iter().copied().min_by_key(place)
    }
}

impl Error {
    /// What to do about the error; for [`Error::Refused`], about the condition that comes first.
    #[must_use]
    pub fn remedy(&self) -> Remedy {
        match self {
            Error::Refused(refusal) => refusal.first().map_or_else(|| self.row(), |missing| missing.remedy()),
            _ => self.row(),
        }
    }
}
