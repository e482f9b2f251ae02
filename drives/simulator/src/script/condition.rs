//! The conditions that a step can wait for.

use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::nmt::NmtState;

/// A condition on the servo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// The shaft moves, however slowly.
    Moving,
    /// The shaft does not move.
    Standing,
    /// A positioning is under way, also while it is interrupted (6041h, bit 14).
    Positioning,
    /// The target is reached (6041h, bit 10).
    TargetReached,
    /// The state machine is in this state.
    State(State),
    /// The state machine is not in FAULT.
    NoFault,
    /// NMT is in this state, and the drive is on.
    Nmt(NmtState),
    /// The drive is on.
    On,
    /// The drive is off.
    Off,
    /// 6064h is greater than this.
    PositionAbove(i32),
    /// 6064h is less than this.
    PositionBelow(i32),
}

#[cfg(feature = "script")]
const NAMES: &[(&str, Condition)] = &[
    ("moving", Condition::Moving),
    ("standing", Condition::Standing),
    ("positioning", Condition::Positioning),
    ("target reached", Condition::TargetReached),
    ("switch on disabled", Condition::State(State::SwitchOnDisabled)),
    ("ready to switch on", Condition::State(State::ReadyToSwitchOn)),
    ("switched on", Condition::State(State::SwitchedOn)),
    ("operation enabled", Condition::State(State::OperationEnabled)),
    ("quick stop active", Condition::State(State::QuickStopActive)),
    ("fault", Condition::State(State::Fault)),
    ("no fault", Condition::NoFault),
    ("operational", Condition::Nmt(NmtState::Operational)),
    ("pre-operational", Condition::Nmt(NmtState::PreOperational)),
    ("stopped", Condition::Nmt(NmtState::Stopped)),
    ("on", Condition::On),
    ("off", Condition::Off),
];

#[cfg(feature = "script")]
impl Condition {
    /// The condition with this name in scripts.
    pub(super) fn named(name: &str) -> Option<Self> {
        let position = |words: &str| words.trim().parse().ok();
        match (name.strip_prefix("position above "), name.strip_prefix("position below ")) {
            (Some(number), _) => position(number).map(Condition::PositionAbove),
            (_, Some(number)) => position(number).map(Condition::PositionBelow),
            _ => NAMES.iter().find(|(known, _)| *known == name).map(|(_, condition)| *condition),
        }
    }

    pub(super) fn names() -> impl Iterator<Item = &'static str> {
        NAMES.iter().map(|(name, _)| *name).chain(["position above 0", "position below 0"])
    }
}
