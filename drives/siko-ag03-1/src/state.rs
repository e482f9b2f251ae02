//! The drive's state machine (chapter 7.3), as tables: states (22), commands (24), transitions 0 to 14.
//!
//! It is a subset of CiA 402 with differences of its own. There is no FAULT REACTION ACTIVE; Quick Stop is a
//! command in OPERATION ENABLED only and its state is left by Disable Voltage only; "Disable Operation" is
//! the same pattern as "Switch On". The driver finds its way through these tables, and the simulated
//! drive obeys them.
//!
//! Where the English manual says "motor is enabled", the German one says "freigeschaltet": released,
//! without torque. So the motor has torque in OPERATION ENABLED and QUICK STOP ACTIVE only.

use core::fmt;

/// A state of the state machine (table 22).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum State {
    /// NOT READY TO SWITCH ON.
    NotReadyToSwitchOn,
    /// SWITCH ON DISABLED.
    SwitchOnDisabled,
    /// READY TO SWITCH ON.
    ReadyToSwitchOn,
    /// SWITCHED ON.
    SwitchedOn,
    /// OPERATION ENABLED.
    OperationEnabled,
    /// QUICK STOP ACTIVE.
    QuickStopActive,
    /// FAULT.
    Fault,
}

/// A command of the control word (table 24).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Command {
    /// Shutdown.
    Shutdown,
    /// Switch On.
    SwitchOn,
    /// Disable Voltage.
    DisableVoltage,
    /// Quick Stop.
    QuickStop,
    /// Disable Operation: the pattern of Switch On, in another state.
    DisableOperation,
    /// Enable Operation.
    EnableOperation,
    /// Fault Reset: an edge of bit 7.
    FaultReset,
}

/// What causes a transition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// Power on or software reset.
    PowerOn,
    /// Initialization and self-test have succeeded.
    Initialized,
    /// A command of the control word.
    Command(Command),
    /// A fault.
    Fault,
}

/// From which states a transition leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum From {
    /// From no state: the machine starts.
    Start,
    /// From one state.
    One(State),
    /// From every state.
    Any,
}

/// A state change of chapter 7.3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// The number in the manual, 0 to 14.
    pub number: u8,
    /// From where.
    pub from: From,
    /// Where to.
    pub to: State,
    /// By what.
    pub trigger: Trigger,
}

/// Bits of a word that are to have certain values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pattern {
    /// The bits that matter.
    pub mask: u16,
    /// Their values.
    pub value: u16,
}

impl Pattern {
    /// Whether `word` has the pattern.
    #[must_use]
    pub const fn matches(self, word: u16) -> bool {
        word & self.mask == self.value
    }
}

impl State {
    /// All states, in the order of table 22.
    pub const ALL: [State; 7] = [
        State::NotReadyToSwitchOn,
        State::SwitchOnDisabled,
        State::ReadyToSwitchOn,
        State::SwitchedOn,
        State::OperationEnabled,
        State::QuickStopActive,
        State::Fault,
    ];

    /// What the status word's low byte says in this state (table 22).
    #[must_use]
    pub const fn pattern(self) -> Pattern {
        let (mask, value) = match self {
            State::NotReadyToSwitchOn => (0b0100_1111, 0b0000_0000),
            State::SwitchOnDisabled => (0b0100_1111, 0b0100_0000),
            State::ReadyToSwitchOn => (0b0110_1111, 0b0010_0001),
            State::SwitchedOn => (0b0110_1111, 0b0010_0011),
            State::OperationEnabled => (0b0110_1111, 0b0010_0111),
            State::QuickStopActive => (0b0110_1111, 0b0000_0111),
            State::Fault => (0b0100_1111, 0b0000_1000),
        };
        Pattern { mask, value }
    }

    /// The state that a status word tells; `None` when it tells none.
    #[must_use]
    pub fn of_status_word(status_word: u16) -> Option<State> {
        State::ALL.into_iter().find(|state| state.pattern().matches(status_word))
    }

    /// Whether the motor has torque.
    #[must_use]
    pub const fn has_torque(self) -> bool {
        matches!(self, State::OperationEnabled | State::QuickStopActive)
    }
}

impl Command {
    /// All commands, in the order of table 24.
    pub const ALL: [Command; 7] = [
        Command::Shutdown,
        Command::SwitchOn,
        Command::DisableVoltage,
        Command::QuickStop,
        Command::DisableOperation,
        Command::EnableOperation,
        Command::FaultReset,
    ];

    /// What the control word's low byte says for this command (table 24). Of Fault Reset, the pattern after
    /// the edge: before it, bit 7 was 0.
    #[must_use]
    pub const fn pattern(self) -> Pattern {
        let (mask, value) = match self {
            Command::Shutdown => (0b1000_0111, 0b0000_0110),
            Command::SwitchOn | Command::DisableOperation => (0b1000_1111, 0b0000_0111),
            Command::DisableVoltage => (0b1000_0010, 0b0000_0000),
            Command::QuickStop => (0b1000_0110, 0b0000_0010),
            Command::EnableOperation => (0b1000_1111, 0b0000_1111),
            Command::FaultReset => (0b1000_0000, 0b1000_0000),
        };
        Pattern { mask, value }
    }

    /// Whether the control word commands this, coming after `previous`.
    #[must_use]
    pub const fn is_given(self, control_word: u16, previous: u16) -> bool {
        let edge = !matches!(self, Command::FaultReset) || !self.pattern().matches(previous);
        self.pattern().matches(control_word) && edge
    }
}

/// All state changes, by number.
pub const TRANSITIONS: [Transition; 15] = {
    use Command as C;
    use State as S;
    const fn by_command(number: u8, from: State, to: State, command: Command) -> Transition {
        Transition { number, from: From::One(from), to, trigger: Trigger::Command(command) }
    }
    [
        Transition { number: 0, from: From::Start, to: S::NotReadyToSwitchOn, trigger: Trigger::PowerOn },
        Transition {
            number: 1,
            from: From::One(S::NotReadyToSwitchOn),
            to: S::SwitchOnDisabled,
            trigger: Trigger::Initialized,
        },
        by_command(2, S::SwitchOnDisabled, S::ReadyToSwitchOn, C::Shutdown),
        by_command(3, S::ReadyToSwitchOn, S::SwitchedOn, C::SwitchOn),
        by_command(4, S::SwitchedOn, S::OperationEnabled, C::EnableOperation),
        by_command(5, S::OperationEnabled, S::SwitchedOn, C::DisableOperation),
        by_command(6, S::SwitchedOn, S::ReadyToSwitchOn, C::Shutdown),
        by_command(7, S::ReadyToSwitchOn, S::SwitchOnDisabled, C::DisableVoltage),
        by_command(8, S::OperationEnabled, S::ReadyToSwitchOn, C::Shutdown),
        by_command(9, S::OperationEnabled, S::SwitchOnDisabled, C::DisableVoltage),
        by_command(10, S::SwitchedOn, S::SwitchOnDisabled, C::DisableVoltage),
        by_command(11, S::OperationEnabled, S::QuickStopActive, C::QuickStop),
        by_command(12, S::QuickStopActive, S::SwitchOnDisabled, C::DisableVoltage),
        Transition { number: 13, from: From::Any, to: S::Fault, trigger: Trigger::Fault },
        by_command(14, S::Fault, S::SwitchOnDisabled, C::FaultReset),
    ]
};

/// The transition that a control word causes in `state`, coming after `previous`.
#[must_use]
pub fn commanded(state: State, control_word: u16, previous: u16) -> Option<&'static Transition> {
    TRANSITIONS.iter().find(|transition| {
        let given = match transition.trigger {
            Trigger::Command(command) => command.is_given(control_word, previous),
            _ => false,
        };
        given && transition.from == From::One(state)
    })
}

/// The first command on a shortest way from `from` to `to`; `None` when they are the same, or no command leads there.
#[must_use]
pub fn next_command(from: State, to: State) -> Option<Command> {
    let commands = || {
        TRANSITIONS.iter().filter_map(|transition| match (transition.from, transition.trigger) {
            (From::One(from), Trigger::Command(command)) => Some((from, command, transition.to)),
            _ => None,
        })
    };
    // Backwards from the goal, one transition further each round; there are seven states.
    let mut reached = vec![to];
    for _ in State::ALL {
        if let Some((_, command, _)) = commands().find(|(state, _, next)| *state == from && reached.contains(next)) {
            return (from != to).then_some(command);
        }
        let before: Vec<State> = commands().filter(|(.., next)| reached.contains(next)).map(|(s, ..)| s).collect();
        reached.extend(before);
    }
    None
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            State::NotReadyToSwitchOn => "NOT READY TO SWITCH ON",
            State::SwitchOnDisabled => "SWITCH ON DISABLED",
            State::ReadyToSwitchOn => "READY TO SWITCH ON",
            State::SwitchedOn => "SWITCHED ON",
            State::OperationEnabled => "OPERATION ENABLED",
            State::QuickStopActive => "QUICK STOP ACTIVE",
            State::Fault => "FAULT",
        })
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Command::Shutdown => "Shutdown",
            Command::SwitchOn => "Switch On",
            Command::DisableVoltage => "Disable Voltage",
            Command::QuickStop => "Quick Stop",
            Command::DisableOperation => "Disable Operation",
            Command::EnableOperation => "Enable Operation",
            Command::FaultReset => "Fault Reset",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_low_byte_tells_at_most_one_state() {
        for word in 0..=0xFF_u16 {
            let states = State::ALL.into_iter().filter(|state| state.pattern().matches(word)).count();
            assert!(states <= 1, "{word:02X}");
        }
        for state in State::ALL {
            assert_eq!(State::of_status_word(state.pattern().value | 0xFF00), Some(state));
        }
    }

    #[test]
    fn transitions_are_numbered_as_in_the_manual() {
        for (number, transition) in TRANSITIONS.iter().enumerate() {
            assert_eq!(transition.number as usize, number);
        }
    }

    #[track_caller]
    fn check(state: State, control_word: u16, number: Option<u8>) {
        let transition = commanded(state, control_word, 0).map(|transition| transition.number);
        assert_eq!(transition, number, "{state} on {control_word:04X}");
    }

    #[test]
    fn the_control_words_of_the_examples_lead_up_and_down() {
        check(State::SwitchOnDisabled, 0x0106, Some(2));
        check(State::ReadyToSwitchOn, 0x0107, Some(3));
        check(State::SwitchedOn, 0x010F, Some(4));
        check(State::OperationEnabled, 0x001F, None);
        check(State::OperationEnabled, 0x0107, Some(5));
        check(State::SwitchedOn, 0x0106, Some(6));
        check(State::ReadyToSwitchOn, 0x0100, Some(7));
    }

    #[test]
    fn commands_out_of_place_do_nothing() {
        check(State::SwitchOnDisabled, 0x000F, None);
        check(State::ReadyToSwitchOn, 0x000F, None);
        check(State::SwitchedOn, 0x0002, None);
        check(State::QuickStopActive, 0x000F, None);
        check(State::Fault, 0x0006, None);
        check(State::OperationEnabled, 0x0080, None);
    }

    #[test]
    fn a_fault_reset_is_an_edge() {
        assert!(commanded(State::Fault, 0x0080, 0x0000).is_some());
        assert!(commanded(State::Fault, 0x0080, 0x0080).is_none());
    }

    #[test]
    fn the_shortest_way_is_found_from_everywhere() {
        let way = |mut state: State, goal| {
            let mut way = Vec::new();
            while let Some(command) = next_command(state, goal) {
                let transition = TRANSITIONS.iter().find(|transition| {
                    transition.from == From::One(state) && transition.trigger == Trigger::Command(command)
                });
                state = transition.unwrap().to;
                way.push(command);
            }
            assert_eq!(state, goal);
            way
        };
        use Command::{DisableVoltage, EnableOperation, FaultReset, Shutdown, SwitchOn};
        let enabled = State::OperationEnabled;
        assert_eq!(way(State::SwitchOnDisabled, enabled), [Shutdown, SwitchOn, EnableOperation]);
        assert_eq!(way(State::Fault, enabled), [FaultReset, Shutdown, SwitchOn, EnableOperation]);
        assert_eq!(way(State::QuickStopActive, enabled), [DisableVoltage, Shutdown, SwitchOn, EnableOperation]);
        assert_eq!(way(enabled, State::SwitchOnDisabled), [DisableVoltage]);
        assert_eq!(way(enabled, enabled), []);
        assert_eq!(next_command(State::SwitchOnDisabled, State::NotReadyToSwitchOn), None);
    }
}
