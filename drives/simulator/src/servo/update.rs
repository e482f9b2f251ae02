//! Bringing a servo up to date with time and dictionary.

use std::collections::VecDeque;

use lexican_runtime::Instant;
use lexican_runtime::profile::cia402::{Mode, State, control};

use super::inputs::{Causes, Inputs};
use super::model::{Servo, ServoModel};
use super::objects::*;
use super::parameters::Parameters;
use super::parts::{Cycle, Cyclic, Emergency, Homing, Last, Limit, Points, Probe, Watch};
use crate::storage::Storage;
use crate::trajectory::{self, Trajectory};

impl Servo {
    /// A servo that is switched on at `now`.
    #[must_use]
    pub fn new(now: Instant, model: &'static ServoModel) -> Self {
        Servo {
            model,
            now,
            next: Some(now),
            inputs: Inputs::default(),
            state: State::SwitchOnDisabled,
            control: 0,
            ending: None,
            faults: Vec::new(),
            causes: Causes::NONE,
            warnings: Causes::NONE,
            emergencies: VecDeque::new(),
            mode: None,
            mode_code: 0,
            way: Trajectory::rest(now, 0.0),
            held: None,
            zero: 0.0,
            limits: None,
            limit: Limit::None,
            points: Points::default(),
            running: None,
            homing: Homing::default(),
            cyclic: Cyclic::default(),
            cycle: Cycle::default(),
            probes: [Probe::default(); 2],
            watch: Watch::default(),
            last: Last::default(),
            sampled: (None, false),
            sample: None,
        }
    }

    /// Powers the servo on again, or resets it as a node: it drops its orders and, without an absolute encoder, its
    /// position. The axis coasts, and the inputs stay.
    pub fn restart(&mut self, now: Instant) {
        let state = self.shaft(now);
        let fresh = Servo::new(now, self.model);
        *self = Servo {
            inputs: self.inputs,
            zero: if self.model.absolute_encoder { self.zero } else { state.position },
            way: Trajectory::ramp(now, state, 0.0, self.model.coasting),
            ..fresh
        };
    }

    /// Which servo it is.
    #[must_use]
    pub fn model(&self) -> &'static ServoModel {
        self.model
    }

    /// The state of the state machine.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// The mode of operation as in 6061h; `None` before one is chosen.
    #[must_use]
    pub fn mode(&self) -> Option<Mode> {
        self.mode
    }

    /// The codes of the faults, oldest first. A fault whose cause ends is removed if others are left; the last one
    /// stays until it is reset.
    #[must_use]
    pub fn faults(&self) -> &[u16] {
        &self.faults
    }

    /// Whether the last homing since power-on has attained the home position.
    #[must_use]
    pub fn is_homed(&self) -> bool {
        self.homing.attained
    }

    /// 60FDh at the last update, for [`ServoModel::publish`].
    #[must_use]
    pub fn inputs_before(&self) -> u32 {
        self.last.inputs
    }

    /// Whether the shaft has passed an index pulse since the last update, for [`ServoModel::publish`].
    #[must_use]
    pub fn passed_index(&self) -> bool {
        self.last.passed_index
    }

    /// The world around the servo.
    #[must_use]
    pub fn inputs(&self) -> &Inputs {
        &self.inputs
    }

    /// Changes the world around the servo.
    pub fn set_inputs(&mut self, now: Instant, od: &mut dyn Storage, change: impl FnOnce(&mut Inputs)) {
        self.update(now, od);
        let machine = self.inputs.machine;
        change(&mut self.inputs);
        if machine != self.inputs.machine {
            self.plan_again(od);
        }
        self.update(now, od);
    }

    /// Position and velocity of the shaft, in position units from where it stood when it was first switched on.
    #[must_use]
    pub fn shaft(&self, now: Instant) -> trajectory::State {
        match self.held {
            Some(position) => trajectory::State { position, velocity: 0.0 },
            None => self.way.at(now),
        }
    }

    /// The demanded position and velocity, in the same units.
    #[must_use]
    pub fn demand(&self, now: Instant) -> trajectory::State {
        self.way.at(now)
    }

    /// Whether the shaft turns.
    #[must_use]
    pub fn is_moving(&self, now: Instant) -> bool {
        self.held.is_none() && self.way.end().is_none_or(|end| now < end)
    }

    /// Turns the shaft by hand. Returns whether it turned: a motor with torque holds it.
    pub fn turn(&mut self, now: Instant, od: &mut dyn Storage, by: f64) -> bool {
        self.update(now, od);
        let free = !self.has_torque() && !self.is_moving(now);
        if free {
            self.way = Trajectory::rest(now, self.shaft(now).position + by);
            self.update(now, od);
        }
        free
    }

    /// Sets 6064h to `position` without moving the axis, as homing on the present position does.
    pub fn set_position(&mut self, now: Instant, od: &mut dyn Storage, position: f64) {
        self.zero = self.shaft(now).position - position * Parameters::new(od, self.model).position_sign();
        self.update(now, od);
    }

    /// When [`Servo::update`] has something to do.
    #[must_use]
    pub fn next_event(&self) -> Option<Instant> {
        [self.next, self.sample].into_iter().flatten().min()
    }

    /// The next emergency to send.
    pub fn next_emergency(&mut self) -> Option<Emergency> {
        self.emergencies.pop_front()
    }

    /// Takes the orders in the dictionary, and writes the values measured at `now` into it.
    pub fn update(&mut self, now: Instant, od: &mut dyn Storage) {
        // First brings the servo through its own events, each at its time, so that the result does not depend on when
        // this is called.
        while let Some(at) = self.next.filter(|at| *at < now) {
            self.step(at, od);
        }
        self.step(now, od);
    }

    /// As [`Servo::update`], but does nothing if it was called at this time already: for calls before which nothing was
    /// written.
    pub fn measure(&mut self, now: Instant, od: &mut dyn Storage) {
        if now != self.now {
            self.update(now, od);
        }
    }

    fn step(&mut self, now: Instant, od: &mut dyn Storage) {
        self.now = now;
        self.limits = self.limits.or_else(|| Some(self.parameters(od).range(LIMIT_MIN, LIMIT_MAX)));
        self.follow_world(od);
        self.end_what_is_over();
        self.take_cycle_period(od);
        self.take_mode(od);
        self.take_control(od);
        // An order for the position where the axis already stands ends at once.
        self.end_what_is_over();
        self.take_targets(od);
        self.watch(od);
        self.take_probes(od);
        let pulses = self.count_pulses(self.shaft(now).position);
        let passed_index = self.last.pulses.is_some() && self.last.pulses != pulses;
        self.last = Last { inputs: od.raw(INPUTS).unwrap_or_default() as u32, pulses, passed_index };
        self.publish(od);
        self.next = self.find_next(od);
    }

    pub(super) fn parameters<'a>(&self, od: &'a dyn Storage) -> Parameters<'a> {
        Parameters::new(od, self.model)
    }

    /// Follows the mode of operation (6060h).
    fn take_mode(&mut self, od: &dyn Storage) {
        let Some(code) = od.number(MODE).and_then(|code| i8::try_from(code).ok()) else { return };
        let waits = !self.model.changes_mode_while_moving && self.is_moving(self.now);
        if code == self.mode_code || waits {
            return;
        }
        let supported = od.number(SUPPORTED_MODES).filter(|_| self.model.obeys_supported_modes && code > 0);
        let refused = supported.is_some_and(|modes| modes != 0 && modes >> (code - 1).min(31) & 1 == 0);
        let Some(mode) = self.model.modes.mode(code).filter(|_| !refused) else { return };
        (self.mode, self.mode_code) = (Some(mode), code);
        self.forget_orders();
        let keeps_velocity = [TARGET_VELOCITY, TARGET_TORQUE].iter().any(|target| target.index() == mode.object());
        if self.state == State::OperationEnabled && self.ending.is_none() && !keeps_velocity {
            self.brake(self.parameters(od).slow_down());
        }
    }

    /// Drops all orders; the present motion goes on.
    pub(super) fn forget_orders(&mut self) {
        self.points.clear();
        self.running = None;
        self.homing.running = false;
        self.cyclic = Cyclic::default();
        self.limit = Limit::None;
        self.watch = Watch::default();
    }

    pub(super) fn brake(&mut self, deceleration: f64) {
        let state = self.shaft(self.now);
        if let Some(position) = self.held.take() {
            self.way = Trajectory::rest(self.now, position);
        } else {
            self.way = Trajectory::ramp(self.now, state, 0.0, deceleration);
        }
    }

    /// Whether the axis follows the orders of its mode.
    pub(super) fn is_obeying(&self) -> bool {
        self.state == State::OperationEnabled && self.ending.is_none()
    }

    pub(super) fn is_halted(&self) -> bool {
        self.control & control::HALT != 0
    }

    /// Whether the motor holds or moves the shaft.
    #[must_use]
    pub fn has_torque(&self) -> bool {
        matches!(self.state, State::OperationEnabled | State::QuickStopActive)
            || (self.state == State::SwitchedOn && self.model.holds_when_switched_on)
            || (self.state == State::FaultReactionActive && self.ending.is_some())
    }
}
