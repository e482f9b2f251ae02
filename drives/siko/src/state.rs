//! The drive's state machine (chapter 7.3), a subset of CiA 402, as a table.
//!
//! There is no FAULT REACTION ACTIVE. Quick Stop is a command in OPERATION ENABLED only, and only Disable Voltage
//! leaves its state. Enable Operation does not lead from READY TO SWITCH ON. The driver finds its way through this
//! table, and the simulated drive obeys it.
//!
//! Where the English manual says "motor is enabled", the German one says "freigeschaltet": released,
//! without torque. So the motor has torque in OPERATION ENABLED and QUICK STOP ACTIVE only.

use lexican_runtime::profile::cia402::control;
pub use lexican_runtime::profile::cia402::{Cause, Command, State, Transition, Transitions};

const fn by(number: u8, from: State, to: State, command: Command) -> Transition {
    Transition { number, from, to, cause: Cause::Command(command) }
}

const fn fault(from: State) -> Transition {
    Transition { number: 13, from, to: State::Fault, cause: Cause::Internal }
}

/// The state changes 1 to 14 with the manual's numbers; number 0 is power-on. "Disable Operation" has the
/// pattern of Switch On (table 24).
pub const TRANSITIONS: Transitions = {
    use Command as C;
    use State as S;
    Transitions(&[
        Transition { number: 1, from: S::NotReadyToSwitchOn, to: S::SwitchOnDisabled, cause: Cause::Internal },
        by(2, S::SwitchOnDisabled, S::ReadyToSwitchOn, C::Shutdown),
        by(3, S::ReadyToSwitchOn, S::SwitchedOn, C::SwitchOn),
        by(4, S::SwitchedOn, S::OperationEnabled, C::EnableOperation),
        by(5, S::OperationEnabled, S::SwitchedOn, C::SwitchOn),
        by(6, S::SwitchedOn, S::ReadyToSwitchOn, C::Shutdown),
        by(7, S::ReadyToSwitchOn, S::SwitchOnDisabled, C::DisableVoltage),
        by(8, S::OperationEnabled, S::ReadyToSwitchOn, C::Shutdown),
        by(9, S::OperationEnabled, S::SwitchOnDisabled, C::DisableVoltage),
        by(10, S::SwitchedOn, S::SwitchOnDisabled, C::DisableVoltage),
        by(11, S::OperationEnabled, S::QuickStopActive, C::QuickStop),
        by(12, S::QuickStopActive, S::SwitchOnDisabled, C::DisableVoltage),
        fault(S::NotReadyToSwitchOn),
        fault(S::SwitchOnDisabled),
        fault(S::ReadyToSwitchOn),
        fault(S::SwitchedOn),
        fault(S::OperationEnabled),
        fault(S::QuickStopActive),
        by(14, S::Fault, S::SwitchOnDisabled, C::FaultReset),
    ])
};

/// The transition that a control word makes in `state` when it follows `previous`; `None` if the drive ignores it.
/// While bit 7 stays set, every command is ignored (table 24).
#[must_use]
pub fn commanded(state: State, word: u16, previous: u16) -> Option<Transition> {
    let command = Command::parse(previous, word);
    let held = word & control::FAULT_RESET != 0 && command != Command::FaultReset;
    if held { None } else { TRANSITIONS.follow(state, command) }
}

/// Whether the motor has torque in a state.
#[must_use]
pub const fn has_torque(state: State) -> bool {
    matches!(state, State::OperationEnabled | State::QuickStopActive)
}

/// An operating mode (6060h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// 1: Profile Position Mode.
    Positioning,
    /// 2: Profile Velocity Mode. CiA 402 has 3 for it.
    Velocity,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(state: State, previous: u16, word: u16, number: Option<u8>) {
        let transition = commanded(state, word, previous).map(|transition| transition.number);
        assert_eq!(transition, number, "{state} on {word:04X}");
    }

    #[test]
    fn the_control_words_of_the_examples_lead_up_and_down() {
        check(State::SwitchOnDisabled, 0, 0x0106, Some(2));
        check(State::ReadyToSwitchOn, 0, 0x0107, Some(3));
        check(State::SwitchedOn, 0, 0x010F, Some(4));
        check(State::OperationEnabled, 0, 0x001F, None);
        check(State::OperationEnabled, 0, 0x0107, Some(5));
        check(State::SwitchedOn, 0, 0x0106, Some(6));
        check(State::ReadyToSwitchOn, 0, 0x0100, Some(7));
    }

    #[test]
    fn commands_out_of_place_do_nothing() {
        check(State::SwitchOnDisabled, 0, 0x000F, None);
        check(State::ReadyToSwitchOn, 0, 0x000F, None);
        check(State::SwitchedOn, 0, 0x0002, None);
        check(State::QuickStopActive, 0, 0x000F, None);
        check(State::Fault, 0, 0x0006, None);
    }

    #[test]
    fn a_fault_reset_is_an_edge_and_excludes_other_commands() {
        check(State::Fault, 0x0000, 0x0080, Some(14));
        check(State::Fault, 0x0080, 0x0080, None);
        check(State::SwitchOnDisabled, 0x0080, 0x0086, None);
        check(State::OperationEnabled, 0x0000, 0x0080, None);
    }

    /// Every state on every low byte of the control word, against the rows of tables 22 and 24.
    #[test]
    fn the_whole_machine_is_that_of_the_manual() {
        use State::{Fault, OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};
        for word in 0..=0xFF_u16 {
            let (reset, bits) = (word & 0x80 != 0, word & 0x0F);
            let shutdown = !reset && bits & 0x7 == 0x6;
            let switch_on = !reset && bits == 0x7;
            let disable_voltage = !reset && bits & 0x2 == 0;
            let quick_stop = !reset && bits & 0x6 == 0x2;
            let enable = !reset && bits == 0xF;
            for (from, moves) in [
                (SwitchOnDisabled, &[(shutdown, ReadyToSwitchOn)][..]),
                (ReadyToSwitchOn, &[(switch_on, SwitchedOn), (disable_voltage, SwitchOnDisabled)]),
                (
                    SwitchedOn,
                    &[(enable, OperationEnabled), (shutdown, ReadyToSwitchOn), (disable_voltage, SwitchOnDisabled)],
                ),
                (
                    OperationEnabled,
                    &[
                        (switch_on, SwitchedOn),
                        (shutdown, ReadyToSwitchOn),
                        (disable_voltage, SwitchOnDisabled),
                        (quick_stop, QuickStopActive),
                    ],
                ),
                (QuickStopActive, &[(disable_voltage, SwitchOnDisabled)]),
                (Fault, &[(reset, SwitchOnDisabled)]),
            ] {
                let expected = moves.iter().find(|(given, _)| *given).map(|(_, to)| *to);
                assert_eq!(commanded(from, word, 0).map(|transition| transition.to), expected, "{from} on {word:02X}");
            }
        }
    }

    #[test]
    fn the_driver_finds_its_way() {
        let first = |from, to| TRANSITIONS.next(from, to).map(|transition| transition.number);
        assert_eq!(first(State::SwitchOnDisabled, State::OperationEnabled), Some(2));
        assert_eq!(first(State::QuickStopActive, State::OperationEnabled), Some(12));
        assert_eq!(first(State::OperationEnabled, State::QuickStopActive), Some(11));
        assert_eq!(first(State::SwitchOnDisabled, State::QuickStopActive), Some(2));
        assert_eq!(first(State::OperationEnabled, State::NotReadyToSwitchOn), None);
    }
}
