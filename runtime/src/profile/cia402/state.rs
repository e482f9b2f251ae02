//! The states of a drive, by the status word.

use core::fmt;

use super::word::status;

/// A state of the drive (CiA 402-2, 8.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// The drive initialises itself.
    NotReadyToSwitchOn,
    /// Initialised; parameters may be set.
    SwitchOnDisabled,
    /// High voltage may be switched on.
    ReadyToSwitchOn,
    /// High voltage is on.
    SwitchedOn,
    /// The drive follows its commands.
    OperationEnabled,
    /// The drive stops, or has stopped, quickly.
    QuickStopActive,
    /// The drive reacts to a fault.
    FaultReactionActive,
    /// The drive has a fault.
    Fault,
}

impl State {
    /// All states.
    pub const ALL: [State; 8] = [
        State::NotReadyToSwitchOn,
        State::SwitchOnDisabled,
        State::ReadyToSwitchOn,
        State::SwitchedOn,
        State::OperationEnabled,
        State::QuickStopActive,
        State::FaultReactionActive,
        State::Fault,
    ];

    /// The state in a status word (6041h); `None` for a word that is not in CiA 402-2, table 30.
    #[must_use]
    pub const fn from_status_word(word: u16) -> Option<State> {
        match word & 0x4F {
            0x00 => Some(State::NotReadyToSwitchOn),
            0x40 => Some(State::SwitchOnDisabled),
            0x0F => Some(State::FaultReactionActive),
            0x08 => Some(State::Fault),
            _ => match word & 0x6F {
                0x21 => Some(State::ReadyToSwitchOn),
                0x23 => Some(State::SwitchedOn),
                0x27 => Some(State::OperationEnabled),
                0x07 => Some(State::QuickStopActive),
                _ => None,
            },
        }
    }

    /// The bits of the status word for the state: 0 to 3, 5 and 6. Bit 5 is set where the table leaves it open.
    #[must_use]
    pub const fn status_bits(self) -> u16 {
        match self {
            State::NotReadyToSwitchOn => status::QUICK_STOP,
            State::SwitchOnDisabled => 0x40 | status::QUICK_STOP,
            State::ReadyToSwitchOn => 0x21,
            State::SwitchedOn => 0x23,
            State::OperationEnabled => 0x27,
            State::QuickStopActive => 0x07,
            State::FaultReactionActive => 0x0F | status::QUICK_STOP,
            State::Fault => 0x08 | status::QUICK_STOP,
        }
    }

    pub(super) const fn index(self) -> usize {
        self as usize
    }
}

/// In the spelling of CiA 402: `OPERATION ENABLED`.
impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            State::NotReadyToSwitchOn => "NOT READY TO SWITCH ON",
            State::SwitchOnDisabled => "SWITCH ON DISABLED",
            State::ReadyToSwitchOn => "READY TO SWITCH ON",
            State::SwitchedOn => "SWITCHED ON",
            State::OperationEnabled => "OPERATION ENABLED",
            State::QuickStopActive => "QUICK STOP ACTIVE",
            State::FaultReactionActive => "FAULT REACTION ACTIVE",
            State::Fault => "FAULT",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_status_word_has_its_state() {
        for state in State::ALL {
            assert_eq!(State::from_status_word(state.status_bits()), Some(state));
            // Other bits do not matter.
            assert_eq!(State::from_status_word(state.status_bits() | 0xFF90), Some(state));
        }
    }

    #[test]
    fn bit_5_matters_in_three_states_only() {
        assert_eq!(State::from_status_word(0x08), State::from_status_word(0x28));
        assert_eq!(State::from_status_word(0x40), State::from_status_word(0x60));
        assert_eq!(State::from_status_word(0x01), None);
    }
}
