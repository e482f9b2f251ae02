//! Running the drive's script.

use lexican_runtime::Instant;
use simulator::script::Following;

use super::drive::SimulatedDrive;
use super::inputs::Inputs;
use super::script::{Change, Condition, Script};
use crate::state::State;
use crate::words::status;

impl SimulatedDrive {
    /// Runs `script` from `now` on, and drops one that still runs.
    pub fn follow(&mut self, now: Instant, script: Script) {
        self.following = Following::new(now, script);
        self.run_script(now);
    }

    /// How many steps of the script have not happened yet.
    #[must_use]
    pub fn steps_left(&self) -> usize {
        self.following.steps_left()
    }

    /// Does every step whose time has come.
    pub(super) fn run_script(&mut self, now: Instant) {
        loop {
            let mut following = std::mem::take(&mut self.following);
            let changes = following.take_step(now, |at, condition| self.is_so(at, condition));
            self.following = following;
            let Some(changes) = changes else { return };
            changes.into_iter().for_each(|change| self.apply(now, change));
        }
    }

    /// When to check the next step again.
    pub(super) fn next_step(&self) -> Option<Instant> {
        let is_so = |at, condition| self.is_so(at, condition);
        self.following.next_step(is_so, |at, condition| self.may_become_so(at, condition))
    }

    /// Whether a condition holds.
    fn is_so(&self, now: Instant, condition: Condition) -> bool {
        let on = self.is_on();
        match condition {
            Condition::Moving => self.controller.motion().is_moving(now),
            Condition::Standing => !self.controller.motion().is_moving(now),
            Condition::Positioning => self.controller.motion().is_positioning(now),
            Condition::TargetReached => on && self.status_word(now) & status::TARGET_REACHED != 0,
            Condition::State(state) => on && self.state() == state,
            Condition::NoFault => on && self.state() != State::Fault,
            Condition::Nmt(state) => on && self.nmt_state() == state,
            Condition::On => on,
            Condition::Off => !on,
            Condition::PositionAbove(position) => self.position(now) > position,
            Condition::PositionBelow(position) => self.position(now) < position,
        }
    }

    /// When the condition may come true by itself after `now`, if nothing else happens before.
    fn may_become_so(&self, now: Instant, condition: Condition) -> Option<Instant> {
        let (motion, parameters) = (self.controller.motion(), &self.controller.parameters);
        match condition {
            Condition::Standing => motion.rest_at().filter(|at| *at > now),
            Condition::TargetReached if self.is_running() => self.controller.next_change(now),
            Condition::PositionAbove(position) => {
                motion.next_change(now, |state| parameters.position(state.position) > position)
            }
            Condition::PositionBelow(position) => {
                motion.next_change(now, |state| parameters.position(state.position) < position)
            }
            // The other conditions change by frames, by steps, and by deadlines that the drive has anyway.
            _ => None,
        }
    }

    /// Makes one change to the drive.
    pub fn apply(&mut self, now: Instant, change: Change) {
        match change {
            Change::OutputStageSupply(supply) => {
                self.set_inputs(now, |inputs| inputs.output_stage_supply_100mv = supply);
            }
            Change::ControlSupply(supply) => self.set_inputs(now, |inputs| inputs.control_supply_100mv = supply),
            Change::Battery(voltage) => self.set_inputs(now, |inputs| inputs.battery_10mv = voltage),
            Change::Temperature(degrees) => self.set_inputs(now, |inputs| inputs.temperature_100mdegc = degrees),
            Change::Load(current) => self.set_inputs(now, |inputs| inputs.load_ma = current),
            Change::Attainable(rpm) => self.set_inputs(now, |inputs| inputs.attainable_rpm = rpm),
            Change::Shaft(shaft) => self.set_inputs(now, |inputs| inputs.shaft = shaft),
            Change::Turn(increments) => {
                // A motor that holds the shaft cannot be turned; that is not an error.
                let _ = self.turn_shaft(now, increments);
            }
            Change::Bus(state) => self.set_inputs(now, |inputs| inputs.bus = state),
            Change::BusError(error) => self.set_inputs(now, |inputs| inputs.bus_error = error),
            Change::BusBitRate(rate) => self.set_inputs(now, |inputs| inputs.bus_bit_rate = rate),
            Change::Enable(active) => self.set_inputs(now, |inputs| inputs.enable = active),
            Change::LimitSwitches(active) => self.set_inputs(now, |inputs| inputs.limit_switches = active),
            Change::CalibrationSwitch(active) => self.set_inputs(now, |inputs| inputs.calibration_switch = active),
            Change::Key(key) => self.set_inputs(now, |inputs| inputs.key = key),
            Change::Fault(fault) => self.set_inputs(now, |inputs| inputs.force(fault)),
            Change::Clear(fault) => self.set_inputs(now, |inputs| inputs.clear(fault)),
            Change::ClearAll => self.set_inputs(now, |inputs| *inputs = Inputs::default()),
            Change::Switches(switches) => self.set_switches(switches),
            Change::Node(node) => self.set_switches(self.switches().with_node(node)),
            Change::Restore(which) => self.set_switches(self.switches().with_restore(which)),
            Change::Termination(active) => self.set_switches(self.switches().with_termination(active)),
            Change::Power(true) => self.switch_on(now),
            Change::Power(false) => self.switch_off(now),
            Change::PowerCycle => self.power_cycle(now),
        }
    }
}
