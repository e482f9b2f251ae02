//! The states of CiA 402, with their names in manuals.

use lexican_runtime::profile::cia402::State;

pub(crate) const STATES: &[(State, &str)] = &[
    (State::NotReadyToSwitchOn, "Not Ready to Switch On"),
    (State::SwitchOnDisabled, "Switch On Disabled"),
    (State::ReadyToSwitchOn, "Ready to Switch On"),
    (State::SwitchedOn, "Switched On"),
    (State::OperationEnabled, "Operation Enabled"),
    (State::QuickStopActive, "Quick Stop Active"),
    (State::FaultReactionActive, "Fault Reaction Active"),
    (State::Fault, "Fault"),
];

pub(crate) fn state_name(state: State) -> &'static str {
    STATES.iter().find(|(known, _)| *known == state).map_or("", |(_, name)| name)
}
