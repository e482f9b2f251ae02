//! The transitions between states: CiA 402-2, figure 8.

use super::state::State;
use super::word::control;
use crate::procedure::{Decision, Steer};

/// A command in bits 0 to 3 and 7 of the control word (CiA 402-2, table 27).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Shutdown: xxxx x110.
    Shutdown,
    /// Switch on: xxxx 0111. In OPERATION ENABLED it means "disable operation".
    SwitchOn,
    /// Disable voltage: xxxx xx0x.
    DisableVoltage,
    /// Quick stop: xxxx x01x.
    QuickStop,
    /// Enable operation: xxxx 1111.
    EnableOperation,
    /// Fault reset: bit 7 rises.
    FaultReset,
}

impl Command {
    /// The control word with this command: the bits of the command are replaced, all others kept.
    #[must_use]
    pub const fn apply(self, word: u16) -> u16 {
        const BITS: u16 = 0x8F;
        let bits = match self {
            Command::Shutdown => control::ENABLE_VOLTAGE | control::QUICK_STOP,
            Command::SwitchOn => control::SWITCH_ON | control::ENABLE_VOLTAGE | control::QUICK_STOP,
            Command::DisableVoltage => 0,
            Command::QuickStop => control::ENABLE_VOLTAGE,
            Command::EnableOperation => 0x0F,
            Command::FaultReset => control::FAULT_RESET,
        };
        word & !BITS | bits
    }

    /// The command in a control word that follows `before`.
    #[must_use]
    pub const fn parse(before: u16, word: u16) -> Command {
        if word & !before & control::FAULT_RESET != 0 {
            return Command::FaultReset;
        }
        match word & 0x0F {
            0x07 => Command::SwitchOn,
            0x0F => Command::EnableOperation,
            bits if bits & 0x02 == 0 => Command::DisableVoltage,
            bits if bits & 0x04 == 0 => Command::QuickStop,
            _ => Command::Shutdown,
        }
    }
}

/// Why a drive changes its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cause {
    /// The manager has commanded it.
    Command(Command),
    /// The drive itself had a reason: initialised, stopped, fault.
    Internal,
}

/// One arrow of the state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Transition {
    /// The number in the device's manual.
    pub number: u8,
    pub from: State,
    pub to: State,
    pub cause: Cause,
}

/// The state machine of a drive.
#[derive(Clone, Copy, Debug)]
pub struct Transitions(pub &'static [Transition]);

const fn arrow(number: u8, from: State, to: State, command: Command) -> Transition {
    Transition { number, from, to, cause: Cause::Command(command) }
}

const fn internal(number: u8, from: State, to: State) -> Transition {
    Transition { number, from, to, cause: Cause::Internal }
}

impl Transitions {
    /// The state machine of CiA 402.
    pub const CIA_402: Transitions = Transitions(&[
        internal(1, State::NotReadyToSwitchOn, State::SwitchOnDisabled),
        arrow(2, State::SwitchOnDisabled, State::ReadyToSwitchOn, Command::Shutdown),
        arrow(3, State::ReadyToSwitchOn, State::SwitchedOn, Command::SwitchOn),
        arrow(4, State::SwitchedOn, State::OperationEnabled, Command::EnableOperation),
        arrow(5, State::OperationEnabled, State::SwitchedOn, Command::SwitchOn),
        arrow(6, State::SwitchedOn, State::ReadyToSwitchOn, Command::Shutdown),
        arrow(7, State::ReadyToSwitchOn, State::SwitchOnDisabled, Command::DisableVoltage),
        arrow(7, State::ReadyToSwitchOn, State::SwitchOnDisabled, Command::QuickStop),
        arrow(8, State::OperationEnabled, State::ReadyToSwitchOn, Command::Shutdown),
        arrow(9, State::OperationEnabled, State::SwitchOnDisabled, Command::DisableVoltage),
        arrow(10, State::SwitchedOn, State::SwitchOnDisabled, Command::DisableVoltage),
        arrow(10, State::SwitchedOn, State::SwitchOnDisabled, Command::QuickStop),
        arrow(11, State::OperationEnabled, State::QuickStopActive, Command::QuickStop),
        arrow(12, State::QuickStopActive, State::SwitchOnDisabled, Command::DisableVoltage),
        internal(13, State::SwitchOnDisabled, State::FaultReactionActive),
        internal(13, State::ReadyToSwitchOn, State::FaultReactionActive),
        internal(13, State::SwitchedOn, State::FaultReactionActive),
        internal(13, State::OperationEnabled, State::FaultReactionActive),
        internal(13, State::QuickStopActive, State::FaultReactionActive),
        internal(14, State::FaultReactionActive, State::Fault),
        arrow(15, State::Fault, State::SwitchOnDisabled, Command::FaultReset),
        arrow(16, State::QuickStopActive, State::OperationEnabled, Command::EnableOperation),
    ]);

    /// The transition that a command makes in a state; `None` if the drive ignores the command.
    #[must_use]
    pub fn follow(&self, from: State, command: Command) -> Option<Transition> {
        self.0.iter().copied().find(|arrow| arrow.from == from && arrow.cause == Cause::Command(command))
    }

    /// The next transition on the shortest way from `state` to `target`; `None` if the drive is there, or no way leads
    /// there. An internal transition has to be waited for, since the drive makes it by itself.
    ///
    /// The way never leads through a fault, which cannot be commanded.
    #[must_use]
    pub fn next(&self, state: State, target: State) -> Option<Transition> {
        // Marks the states near the target, adding one transition at a time.
        let mut near = [false; State::ALL.len()];
        mark(&mut near, target);
        for _ in 0..State::ALL.len() {
            let step = self.0.iter().find(|arrow| {
                arrow.from == state && state != target && self.is_way(arrow) && is_marked(&near, arrow.to)
            });
            if step.is_some() {
                return step.copied();
            }
            let before = near;
            let reaching = self.0.iter().filter(|arrow| self.is_way(arrow) && is_marked(&before, arrow.to));
            reaching.for_each(|arrow| mark(&mut near, arrow.from));
        }
        None
    }

    /// Whether a transition can be part of a way: it is commanded, or the drive makes it in any case.
    fn is_way(&self, arrow: &Transition) -> bool {
        match arrow.cause {
            Cause::Command(_) => true,
            Cause::Internal => matches!(arrow.from, State::NotReadyToSwitchOn | State::FaultReactionActive),
        }
    }
}

fn mark(set: &mut [bool; State::ALL.len()], state: State) {
    if let Some(place) = set.get_mut(state.index()) {
        *place = true;
    }
}

fn is_marked(set: &[bool; State::ALL.len()], state: State) -> bool {
    set.get(state.index()).copied().unwrap_or(false)
}

/// Steers a drive into a state as a [step of a procedure](crate::procedure::Step::Steer): reads 6041h, and writes
/// 6040h.
#[derive(Clone, Copy, Debug)]
pub struct Steering {
    /// The state to reach.
    pub target: State,
    /// The drive's state machine.
    pub transitions: Transitions,
    /// The control word's bits of the mode, which are kept.
    pub control_word: u16,
}

impl Steer for Steering {
    fn decide(&self, status_word: u64, written: Option<u64>) -> Decision {
        let Some(state) = State::from_status_word(status_word as u16) else { return Decision::Wait };
        if state == self.target {
            return Decision::Reached;
        }
        match self.transitions.next(state, self.target).map(|arrow| arrow.cause) {
            Some(Cause::Command(command)) => Decision::Write(self.word(command, written).into()),
            Some(Cause::Internal) => Decision::Wait,
            None => Decision::Impossible,
        }
    }
}

impl Steering {
    /// The control word with a command. A fault is reset by the rising edge of bit 7, so the bit is cleared first if it
    /// may be set, by Disable voltage, which a drive in fault ignores.
    fn word(&self, command: Command, written: Option<u64>) -> u16 {
        let is_low = written.is_some_and(|word| word & u64::from(control::FAULT_RESET) == 0);
        let command = if command == Command::FaultReset && !is_low { Command::DisableVoltage } else { command };
        command.apply(self.control_word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(transitions: &Transitions, mut state: State, target: State) -> std::vec::Vec<u8> {
        let mut numbers = std::vec::Vec::new();
        while let Some(step) = transitions.next(state, target) {
            numbers.push(step.number);
            state = step.to;
            assert!(numbers.len() < 10, "the way does not end");
        }
        assert!(state == target || numbers.is_empty());
        numbers
    }

    #[test]
    fn the_shortest_way_is_taken() {
        let all = Transitions::CIA_402;
        assert_eq!(way(&all, State::SwitchOnDisabled, State::OperationEnabled), [2, 3, 4]);
        assert_eq!(way(&all, State::Fault, State::OperationEnabled), [15, 2, 3, 4]);
        assert_eq!(way(&all, State::FaultReactionActive, State::SwitchOnDisabled), [14, 15]);
        assert_eq!(way(&all, State::NotReadyToSwitchOn, State::ReadyToSwitchOn), [1, 2]);
        assert_eq!(way(&all, State::OperationEnabled, State::SwitchOnDisabled), [9]);
        assert_eq!(way(&all, State::QuickStopActive, State::OperationEnabled), [16]);
        assert_eq!(way(&all, State::OperationEnabled, State::OperationEnabled), [0; 0]);
    }

    #[test]
    fn no_way_leads_into_a_fault() {
        for state in State::ALL {
            if state != State::FaultReactionActive {
                assert_eq!(Transitions::CIA_402.next(state, State::Fault), None, "{state}");
            }
        }
    }

    #[test]
    fn a_drive_with_fewer_states_is_another_table() {
        static DRIVE: Transitions = Transitions(&[
            arrow(2, State::SwitchOnDisabled, State::ReadyToSwitchOn, Command::Shutdown),
            arrow(3, State::ReadyToSwitchOn, State::SwitchedOn, Command::SwitchOn),
            internal(13, State::SwitchedOn, State::Fault),
            arrow(14, State::Fault, State::SwitchOnDisabled, Command::FaultReset),
        ]);
        assert_eq!(way(&DRIVE, State::Fault, State::SwitchedOn), [14, 2, 3]);
        assert_eq!(DRIVE.next(State::Fault, State::OperationEnabled), None);
    }

    #[test]
    fn control_words_give_commands() {
        for command in [
            Command::Shutdown,
            Command::SwitchOn,
            Command::DisableVoltage,
            Command::QuickStop,
            Command::EnableOperation,
            Command::FaultReset,
        ] {
            let word = command.apply(0x0130);
            assert_eq!(word & 0x0130, 0x0130, "bits of the mode stay");
            assert_eq!(Command::parse(0, word), command);
        }
        // Bit 7 takes effect by its rising edge.
        assert_eq!(Command::parse(0x0080, 0x008F), Command::EnableOperation);
        assert_eq!(Command::parse(0x0000, 0x0106), Command::Shutdown);
    }

    #[test]
    fn commands_are_followed_where_the_table_has_them() {
        let all = Transitions::CIA_402;
        assert_eq!(all.follow(State::SwitchedOn, Command::EnableOperation).unwrap().number, 4);
        assert_eq!(all.follow(State::SwitchOnDisabled, Command::EnableOperation), None);
        assert_eq!(all.follow(State::OperationEnabled, Command::SwitchOn).unwrap().to, State::SwitchedOn);
    }
}
