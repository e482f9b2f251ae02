//! What a step can wait for.

use lexican_runtime::Instant;
use lexican_runtime::wire::nmt::NmtState;

use crate::sim::SimulatedDrive;
use crate::state::State;
use crate::words::status;

/// Something that is so, or is not so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// The shaft moves, however slowly.
    Moving,
    /// It does not.
    Standing,
    /// A positioning is under way, also while it is interrupted (6041h, bit 14).
    Positioning,
    /// The target is reached (6041h, bit 10).
    TargetReached,
    /// The state machine is in this state.
    State(State),
    /// It is not in the state FAULT.
    NoFault,
    /// NMT is in this state, and the drive is on.
    Nmt(NmtState),
    /// The drive is on.
    On,
    /// It is off.
    Off,
    /// 6064h is greater than this.
    PositionAbove(i32),
    /// 6064h is less than this.
    PositionBelow(i32),
}

impl Condition {
    pub(super) fn holds(self, drive: &SimulatedDrive, now: Instant) -> bool {
        let on = drive.is_on();
        match self {
            Condition::Moving => drive.controller.motion().is_moving(now),
            Condition::Standing => !drive.controller.motion().is_moving(now),
            Condition::Positioning => drive.controller.motion().is_positioning(now),
            Condition::TargetReached => on && drive.status_word(now) & status::TARGET_REACHED != 0,
            Condition::State(state) => on && drive.state() == state,
            Condition::NoFault => on && drive.state() != State::Fault,
            Condition::Nmt(state) => on && drive.nmt_state() == state,
            Condition::On => on,
            Condition::Off => !on,
            Condition::PositionAbove(position) => drive.position(now) > position,
            Condition::PositionBelow(position) => drive.position(now) < position,
        }
    }

    /// When it may come true by itself, later than `now`, if nothing else happens before.
    pub(super) fn next(self, drive: &SimulatedDrive, now: Instant) -> Option<Instant> {
        let (motion, parameters) = (drive.controller.motion(), &drive.controller.parameters);
        match self {
            Condition::Standing => motion.rest_at().filter(|at| *at > now),
            Condition::TargetReached if drive.is_running() => drive.controller.next_change(now),
            Condition::PositionAbove(position) => {
                motion.next_change(now, |state| parameters.position(state.position) > position)
            }
            Condition::PositionBelow(position) => {
                motion.next_change(now, |state| parameters.position(state.position) < position)
            }
            // All else follows from frames, from steps, and from deadlines that the drive has anyway.
            _ => None,
        }
    }
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
    /// The condition that a script calls `name`.
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
