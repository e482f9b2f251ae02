//! The state machine: commands, option codes, faults.

use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::{Cause, Command, Mode, State, control};
use lexican_runtime::wire::emcy::ErrorRegister;

use super::model::Servo;
use super::objects::*;
use super::parameters::Parameters;
use super::parts::{Emergency, Ending};
use crate::storage::Storage;
use crate::trajectory::Trajectory;

/// How an option code stops the axis (605Ah to 605Eh).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stop {
    /// The motor loses its torque.
    Coast,
    SlowDown,
    Quick,
    /// At the current or voltage limit.
    Strongest,
}

/// The meaning of an option code: 1 to 4 in 605Ah, 605Dh and 605Eh, 1 in 605Bh and 605Ch.
fn stop(option: i64) -> Stop {
    match option {
        1 => Stop::SlowDown,
        2 => Stop::Quick,
        3 | 4 => Stop::Strongest,
        _ => Stop::Coast,
    }
}

impl Servo {
    /// Follows supply, enable input, blocked shaft and injected faults.
    pub(super) fn follow_world(&mut self, od: &dyn Storage) {
        let shaft = self.shaft(self.now);
        if self.inputs.blocked && self.held.is_none() && self.is_moving(self.now) {
            self.held = Some(shaft.position);
        } else if !self.inputs.blocked && self.held.is_some() {
            self.held = None;
            self.way = Trajectory::rest(self.now, shaft.position);
            self.plan_again(od);
        }
        let switched_on = matches!(self.state, State::SwitchedOn | State::OperationEnabled | State::QuickStopActive);
        if switched_on && !self.inputs.enable {
            self.enter(State::SwitchOnDisabled);
        }
        if switched_on && !self.inputs.supply {
            self.raise(self.model.codes.undervoltage, od);
        }
        self.inputs.faults.iter().for_each(|code| self.raise(Some(code), od));
        let before = std::mem::replace(&mut self.causes, self.inputs.faults);
        for code in before.without(self.causes).iter() {
            // The last fault stays until it is reset.
            if self.faults.len() > 1 && self.faults.contains(&code) {
                self.faults.retain(|other| *other != code);
                self.end_error();
            }
        }
        let before = std::mem::replace(&mut self.warnings, self.inputs.warnings);
        for code in self.warnings.without(before).iter() {
            self.emergencies.push_back(Emergency { code, remaining: ErrorRegister::NONE, recorded: false });
        }
        before.without(self.warnings).iter().for_each(|_| self.end_error());
    }

    /// Reports that an error is over, with the errors that are left (CiA 301, 7.2.7.1, transitions 2 and 4).
    fn end_error(&mut self) {
        self.emergencies.push_back(Emergency { code: 0, remaining: self.error_register(), recorded: false });
    }

    /// Follows the control word (6040h).
    pub(super) fn take_control(&mut self, od: &mut dyn Storage) {
        let Some(word) = od.raw(CONTROL_WORD).map(|word| word as u16) else { return };
        let before = std::mem::replace(&mut self.control, word);
        if before == word {
            return;
        }
        let was_obeying = self.is_obeying();
        self.command(Command::parse(before, word), od);
        if was_obeying && self.is_obeying() {
            self.take_bits(before, word, od);
        }
    }

    fn command(&mut self, command: Command, od: &mut dyn Storage) {
        let parameters = self.parameters(od);
        let Some(arrow) = self.model.transitions.follow(self.state, command) else {
            if self.state == State::OperationEnabled && command == Command::EnableOperation && self.ending.is_some() {
                // The command to enable takes back Disable operation, while the axis still brakes for it.
                self.ending = None;
            }
            return;
        };
        let enabled = self.state == State::OperationEnabled;
        match (arrow.to, command) {
            (State::SwitchedOn, _) if enabled => self.leave(State::SwitchedOn, parameters.number(DISABLE_OPTION), od),
            (State::ReadyToSwitchOn, _) if enabled => {
                self.leave(State::ReadyToSwitchOn, parameters.number(SHUTDOWN_OPTION), od);
            }
            (State::QuickStopActive, _) => self.stop_quickly(parameters.number(QUICK_STOP_OPTION), od),
            (State::OperationEnabled, _) if self.state == State::QuickStopActive => {
                if matches!(parameters.number(QUICK_STOP_OPTION), 5..=8) {
                    self.enable(od);
                }
            }
            (State::OperationEnabled, _) => self.enable(od),
            (State::SwitchedOn, _) if !(self.inputs.supply && self.inputs.enable) => {}
            (to, Command::FaultReset) => self.reset_fault(to),
            (to, _) => {
                self.enter(to);
                if self.has_torque() && self.is_moving(self.now) {
                    self.brake(self.parameters(od).slow_down());
                }
            }
        }
    }

    /// Enables the drive function: a moving axis is braked, and then held.
    fn enable(&mut self, od: &dyn Storage) {
        self.state = State::OperationEnabled;
        self.ending = None;
        self.forget_orders();
        if self.is_moving(self.now) {
            self.brake(self.parameters(od).slow_down());
        }
    }

    /// Enters a state without torque, unless it is a fault reaction, or SWITCHED ON in a drive that has torque there.
    fn enter(&mut self, state: State) {
        let had_torque = self.has_torque();
        self.state = state;
        self.ending = None;
        self.forget_orders();
        if self.held.is_some() || (had_torque && self.is_moving(self.now)) {
            self.brake(self.model.coasting);
        }
    }

    /// Transitions 5 and 8, by 605Ch and 605Bh: at once, or after a ramp.
    fn leave(&mut self, to: State, option: i64, od: &dyn Storage) {
        match stop(option) {
            Stop::Coast => self.enter(to),
            kind => {
                self.stop_with(kind, od);
                self.ending = Some(Ending::Enter(to));
            }
        }
    }

    /// Transition 11, by 605Ah.
    fn stop_quickly(&mut self, option: i64, od: &dyn Storage) {
        let stays = matches!(option, 5..=8);
        match stop(if stays { option - 4 } else { option }) {
            Stop::Coast => self.enter(State::SwitchOnDisabled),
            kind => {
                self.stop_with(kind, od);
                self.state = State::QuickStopActive;
                self.ending = Some(if stays { Ending::Stay } else { Ending::Enter(State::SwitchOnDisabled) });
            }
        }
    }

    /// Halt, by 605Dh.
    pub(super) fn halt(&mut self, od: &dyn Storage) {
        let kind = stop(self.parameters(od).number(HALT_OPTION).max(1));
        self.brake(self.deceleration(kind, od));
    }

    fn stop_with(&mut self, kind: Stop, od: &dyn Storage) {
        self.brake(self.deceleration(kind, od));
        self.forget_orders();
    }

    fn deceleration(&self, kind: Stop, od: &dyn Storage) -> f64 {
        let parameters = self.parameters(od);
        match kind {
            Stop::Coast => self.model.coasting,
            Stop::SlowDown if self.mode == Some(Mode::Homing) => parameters.homing(HOMING_SLOW).deceleration,
            Stop::SlowDown if self.mode.is_some_and(Mode::is_torque) => self.torque_slope(&parameters),
            Stop::SlowDown => parameters.slow_down(),
            Stop::Quick => parameters.quick_stop(),
            Stop::Strongest => self.model.strongest,
        }
    }

    /// Ends what is over once the axis stands.
    pub(super) fn end_what_is_over(&mut self) {
        if !self.is_moving(self.now) {
            match self.ending {
                Some(Ending::Enter(state)) => self.enter(state),
                Some(Ending::Stay) | None => {}
            }
            self.end_homing();
        }
    }

    /// Transitions 13 and 14: the fault reaction is that of 605Eh, or ends at once if there is no torque.
    pub(super) fn raise(&mut self, code: Option<u16>, od: &dyn Storage) {
        let Some(code) = code.filter(|code| !self.faults.contains(code)) else { return };
        self.faults.push(code);
        self.emergencies.push_back(Emergency { code, remaining: ErrorRegister::NONE, recorded: true });
        if matches!(self.state, State::Fault | State::FaultReactionActive) {
            return;
        }
        let arrow = self.model.transitions.0.iter().find(|arrow| {
            arrow.from == self.state
                && arrow.cause == Cause::Internal
                && matches!(arrow.to, State::FaultReactionActive | State::Fault)
        });
        let to = arrow.map_or(State::Fault, |arrow| arrow.to);
        let kind = if self.has_torque() && self.inputs.supply {
            stop(self.parameters(od).number(FAULT_OPTION))
        } else {
            Stop::Coast
        };
        if kind == Stop::Coast || to == State::Fault || !self.is_moving(self.now) {
            self.enter(State::Fault);
        } else {
            self.stop_with(kind, od);
            self.state = to;
            self.ending = Some(Ending::Enter(State::Fault));
        }
    }

    /// Transition 15, if no cause is left.
    fn reset_fault(&mut self, to: State) {
        if self.inputs.faults.is_empty() {
            self.faults.clear();
            self.end_error();
            self.enter(to);
        }
    }

    /// To call when a heartbeat or guarding request of the manager is missing.
    pub fn lose_manager(&mut self, now: Instant, od: &mut dyn Storage) {
        if !self.model.lost_manager_is_fault {
            return self.lose_connection(now, od);
        }
        self.update(now, od);
        self.raise(self.model.codes.connection_lost, od);
        self.update(now, od);
    }

    /// To call when the connection is lost, as by a missing heartbeat; reacts by 6007h.
    pub fn lose_connection(&mut self, now: Instant, od: &mut dyn Storage) {
        self.update(now, od);
        if !matches!(self.state, State::OperationEnabled | State::QuickStopActive) {
            return;
        }
        match self.parameters(od).number(ABORT_CONNECTION) {
            1 => self.raise(self.model.codes.connection_lost, od),
            2 => self.enter(State::SwitchOnDisabled),
            3 if self.state == State::OperationEnabled => {
                let option = self.parameters(od).number(QUICK_STOP_OPTION);
                self.stop_quickly(option, od);
            }
            _ => {}
        }
        self.update(now, od);
    }

    /// Follows bits 4 to 6, 8 and 9 of the control word.
    fn take_bits(&mut self, before: u16, word: u16, od: &mut dyn Storage) {
        let rises = |bit| word & !before & bit != 0;
        let falls = |bit| before & !word & bit != 0;
        if rises(control::HALT) {
            self.halt(od);
            self.running = None;
        }
        match self.mode {
            Some(Mode::ProfilePosition) if rises(control::NEW_SET_POINT) => self.take_set_point(word, od),
            Some(Mode::Homing) if rises(control::NEW_SET_POINT) => self.start_homing(od),
            Some(Mode::Homing) if falls(control::NEW_SET_POINT) => self.interrupt_homing(od),
            _ => {}
        }
        if falls(control::HALT) {
            self.plan_again(od);
        }
    }

    /// Plans the ordered motion anew, from the present position.
    pub(super) fn plan_again(&mut self, od: &dyn Storage) {
        if !self.is_obeying() || self.is_halted() {
            return;
        }
        match self.mode {
            Some(Mode::ProfilePosition) => self.travel(od),
            Some(Mode::Homing) if self.homing.running => self.plan_homing(od),
            Some(Mode::ProfileVelocity | Mode::ProfileTorque) => self.running = None,
            _ => {}
        }
    }

    /// The slope of torque (6087h) as an acceleration.
    pub(super) fn torque_slope(&self, parameters: &Parameters<'_>) -> f64 {
        let slope = parameters.float(TORQUE_SLOPE);
        if slope > 0.0 { slope * self.model.speed_per_torque } else { self.model.strongest }
    }
}

/// The bit of the error register for an EMCY code (CiA 301, tables 26 and 48).
pub(super) fn register_of(code: u16) -> ErrorRegister {
    match code >> 8 {
        0x20..=0x2F => ErrorRegister::CURRENT,
        0x30..=0x3F => ErrorRegister::VOLTAGE,
        0x40..=0x4F => ErrorRegister::TEMPERATURE,
        0x81 | 0x82 => ErrorRegister::COMMUNICATION,
        0x71 | 0x73 | 0x83..=0x8F => ErrorRegister::PROFILE,
        0xFF => ErrorRegister::MANUFACTURER,
        _ => ErrorRegister::GENERIC,
    }
}
