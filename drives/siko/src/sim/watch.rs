//! What the controller monitors: its shaft, its current, and the causes of faults (chapters 2.3 and 5).

use lexican_driver::Direction;
use lexican_runtime::{Duration, Instant};

use super::controller::{Controller, Emergency};
use super::inputs::{BusState, Inputs, Shaft};
use super::motion::{FULL_ACCELERATION, Job};
use crate::fault::{Fault, FaultKind, NO_ERROR, register};
use crate::state::State;

/// How long a blocked shaft stands before fault B. The manual gives no number: an assumption.
const BLOCKED_FOR: Duration = Duration::from_millis(500);

impl Controller {
    /// When [`Controller::advance`] has something to do.
    #[must_use]
    pub fn next_event(&self) -> Option<Instant> {
        let overcurrent = self.overcurrent_since.map(|since| since + self.model.overcurrent_for);
        let blocked = self.blocked_since.map(|since| since + BLOCKED_FOR);
        // At rest the overcurrent ends, unless the shaft is blocked.
        let over = self.overcurrent_since.filter(|_| !self.motion.is_blocked()).and_then(|_| self.motion.rest_at());
        [overcurrent, blocked, over].into_iter().flatten().min()
    }

    /// Follows up changes of inputs, motion and time.
    pub(super) fn settle(&mut self, now: Instant) {
        self.hold_shaft(now);
        self.stop_on_switch(now);
        self.deactivate_torque(now);
        self.watch_current(now);
        for fault in self.model.faults {
            if self.is_caused(now, *fault) && !self.faults.contains(fault) {
                self.raise(now, *fault);
            }
        }
    }

    fn hold_shaft(&mut self, now: Instant) {
        let blocked = self.inputs.shaft == Shaft::Blocked;
        if blocked && self.motion.is_moving(now) {
            self.motion.block(now);
        } else if !blocked && self.motion.is_blocked() {
            self.motion.unblock(now, self.parameters.rotation());
        }
        self.blocked_since = self.motion.is_blocked().then(|| self.blocked_since.unwrap_or(now));
    }

    /// On a limit switch, only inching is possible, and only towards the other switch. The manual does not say how the
    /// drive brakes.
    fn stop_on_switch(&mut self, now: Instant) {
        let stops = match self.motion.job() {
            Job::Positioning(_) => self.limit_switches() != [false; 2],
            Job::Inching(direction) => self.is_on_switch(direction),
            Job::Step { target } => self.is_on_switch(Direction::of(target - self.motion.state(now).position)),
            Job::None | Job::Velocity(_) => false,
        };
        if stops && self.motion.is_active(now) {
            self.motion.cancel(now, FULL_ACCELERATION);
        }
    }

    fn watch_current(&mut self, now: Instant) {
        let too_high = self.current_ma(now) > Inputs::OVERCURRENT_MA;
        self.overcurrent_since = too_high.then(|| self.overcurrent_since.unwrap_or(now));
    }

    /// Chapter 2.3: brakes fully and keeps control; the job can be resumed.
    fn deactivate_torque(&mut self, now: Instant) {
        let threshold = u32::from(self.parameters.torque_deactivation);
        let load = u32::from(self.current_ma(now)) * 100 / u32::from(Inputs::RATED_CURRENT_MA);
        let travelling = self.motion.is_positioning(now) && !self.motion.is_interrupted();
        if threshold < 125 && load > threshold && travelling {
            self.motion.interrupt_braking(now, FULL_ACCELERATION);
            self.torque_deactivated = true;
        }
    }

    /// Whether the condition of a fault holds (table 2).
    fn is_caused(&self, now: Instant, fault: Fault) -> bool {
        let inputs = &self.inputs;
        let lasts = |since: Option<Instant>, span| since.is_some_and(|since| since + span <= now);
        if inputs.forced[fault.kind as usize] {
            return true;
        }
        match fault.kind {
            FaultKind::Undervoltage => {
                inputs.output_stage_supply_100mv < Inputs::UNDERVOLTAGE_100MV
                    && self.current_ma(now) > Inputs::UNDERVOLTAGE_CURRENT_MA
            }
            FaultKind::ShaftBlocked => lasts(self.blocked_since, BLOCKED_FOR),
            FaultKind::Overcurrent => lasts(self.overcurrent_since, self.model.overcurrent_for),
            FaultKind::Overtemperature => inputs.temperature_100mdegc > Inputs::OVERTEMPERATURE_100MDEGC,
            FaultKind::Sensor => inputs.sensor_fails,
            FaultKind::Internal => inputs.internal_error,
            FaultKind::Overvoltage => inputs.output_stage_supply_100mv > Inputs::OVERVOLTAGE_100MV,
            // The fault is raised when it happens, during a positioning; its cause ends when the bus recovers.
            FaultKind::BusPassive => inputs.bus != BusState::Active && self.faults.contains(&fault),
            FaultKind::BusOff => inputs.bus == BusState::Off,
            FaultKind::Battery => inputs.battery_10mv < Inputs::BATTERY_EMPTY_10MV,
        }
    }

    /// Transition 13. "Faults induce an immediate stop" (5.2): with full deceleration.
    pub(super) fn raise(&mut self, now: Instant, fault: Fault) {
        self.faults.push(fault);
        self.state = State::Fault;
        self.running = false;
        if self.motion.is_moving(now) || self.motion.is_active(now) {
            self.motion.cancel(now, FULL_ACCELERATION);
        }
        (self.overcurrent_since, self.blocked_since) = (None, None);
        self.emergencies.push_back(Emergency {
            code: fault.code.number,
            register: self.error_register(),
            stored: true,
        });
    }

    /// Transition 14, if no cause is left.
    pub(super) fn reset_fault(&mut self, now: Instant) {
        if !self.model.faults.iter().any(|fault| self.is_caused(now, *fault)) {
            self.faults.clear();
            self.state = State::SwitchOnDisabled;
            self.report(NO_ERROR);
        }
    }

    /// Reports an emergency code that is not a fault, if the drive has it.
    pub(super) fn report(&mut self, code: u16) {
        if code != NO_ERROR && !self.model.notices.iter().any(|notice| notice.number == code) {
            return;
        }
        let own = if code == NO_ERROR { 0 } else { register::GENERAL | register::COMMUNICATION };
        self.emergencies.push_back(Emergency { code, register: self.error_register() | own, stored: false });
    }
}
