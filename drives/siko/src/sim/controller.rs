//! The drive's controller: state machine, travel commands, faults. It knows parameters and inputs as numbers, and has
//! no objects or frames.

use std::collections::VecDeque;

use lexican_driver::Direction;
use lexican_runtime::Instant;

use super::inputs::{BusState, Inputs, Key, Shaft};
use super::motion::{FULL_ACCELERATION, Job, Motion, REVOLUTION_PER_MINUTE, RUN_OUT_DECELERATION};
use super::parameters::{Mode, Parameters};
use super::require::require;
use crate::fault::{ERROR_PASSIVE, Fault, FaultKind, RECOVERED_FROM_BUS_OFF};
use crate::model::Model;
use crate::order::Refused;
use crate::state::{State, Transition, commanded, has_torque};
use crate::words::control;

/// What the NMT state allows the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Network {
    /// NMT INITIALISATION or PRE-OPERATIONAL: the operator keys work, the state machine does not.
    PreOperational,
    /// NMT OPERATIONAL: commands are taken.
    Operational,
    /// NMT STOPPED.
    Stopped,
}

/// What the output stage does with the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motor {
    /// It holds or moves the shaft.
    InControl,
    /// Its windings are shorted: it brakes without current.
    Shorted,
    /// It has no torque: the shaft can be turned by hand.
    Released,
}

/// An emergency to report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// The code (table 20).
    pub code: u16,
    /// The error register that is sent with it.
    pub register: u8,
    /// Whether it goes into the fault buffer 1003h.
    pub stored: bool,
}

/// The controller with its motor.
#[derive(Clone, Debug)]
pub struct Controller {
    pub(super) model: &'static Model,
    pub(super) parameters: Parameters,
    pub(super) inputs: Inputs,
    pub(super) network: Network,
    pub(super) state: State,
    pub(super) motion: Motion,
    pub(super) acknowledged: bool,
    pub(super) torque_deactivated: bool,
    /// In velocity mode: the falling edge of bit 8 has started the drive, and it has not been stopped since.
    pub(super) running: bool,
    control_word: u16,
    pub(super) overcurrent_since: Option<Instant>,
    pub(super) blocked_since: Option<Instant>,
    pub(super) faults: Vec<Fault>,
    pub(super) emergencies: VecDeque<Emergency>,
}

impl Controller {
    /// A controller that is powered on with its shaft at `position`.
    #[must_use]
    pub fn new(model: &'static Model, now: Instant, parameters: Parameters, inputs: Inputs, position: i32) -> Self {
        Controller::start(model, now, parameters, inputs, Motion::at_rest(now, parameters.shaft(position)))
    }

    /// The same drive after power-on or a reset: a moving shaft coasts to a standstill.
    #[must_use]
    pub(super) fn restarted(&self, now: Instant, inputs: Inputs) -> Self {
        let mut motion = self.motion.clone();
        motion.cancel(now, RUN_OUT_DECELERATION);
        Controller::start(self.model, now, self.parameters, inputs, motion)
    }

    fn start(model: &'static Model, now: Instant, parameters: Parameters, inputs: Inputs, mut motion: Motion) -> Self {
        motion.set_ceiling(now, ceiling(&inputs), parameters.rotation());
        let mut controller = Controller {
            model,
            parameters,
            inputs,
            network: Network::PreOperational,
            state: State::SwitchOnDisabled,
            motion,
            acknowledged: false,
            torque_deactivated: false,
            running: false,
            control_word: 0,
            overcurrent_since: None,
            blocked_since: None,
            faults: Vec::new(),
            emergencies: VecDeque::new(),
        };
        controller.settle(now);
        controller
    }

    /// The state of the state machine.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// The faults that have not been reset, in the order in which they came.
    #[must_use]
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// The motion, for plots.
    #[must_use]
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// The next emergency to report.
    pub fn next_emergency(&mut self) -> Option<Emergency> {
        self.emergencies.pop_front()
    }

    /// The error register 1001h.
    #[must_use]
    pub fn error_register(&self) -> u8 {
        self.faults.iter().fold(0, |register, fault| register | fault.register)
    }

    /// Whether a travel job is under way, which forbids changing the parameters that it uses.
    #[must_use]
    pub fn is_travelling(&self, now: Instant) -> bool {
        self.motion.is_active(now)
    }

    /// Whether the motor can have torque: the output stage is supplied, and the enable input, if there is one, is
    /// active.
    pub(super) fn is_powered(&self) -> bool {
        self.inputs.supply_is_present() && (self.inputs.enable || !self.model.enable_input)
    }

    /// The active limit switches; none in a drive without them, nor in velocity mode, which ignores them.
    pub(super) fn limit_switches(&self) -> [bool; 2] {
        let count = self.model.switches && self.parameters.mode == Mode::Positioning;
        if count { self.inputs.limit_switches } else { [false; 2] }
    }

    /// Whether the limit switch in this direction is active.
    pub(super) fn is_on_switch(&self, direction: Direction) -> bool {
        let [upper, lower] = self.limit_switches();
        match direction {
            Direction::Positive => upper,
            Direction::Negative => lower,
        }
    }

    /// The motor current in mA.
    #[must_use]
    pub fn current_ma(&self, now: Instant) -> u16 {
        if !self.inputs.supply_is_present() {
            0
        } else if self.motion.is_moving(now) || self.motion.is_blocked() {
            self.inputs.load_ma
        } else if self.motor(now) == Motor::InControl {
            Inputs::HOLDING_CURRENT_MA
        } else {
            0
        }
    }

    /// What the output stage does with the motor.
    #[must_use]
    pub fn motor(&self, now: Instant) -> Motor {
        // In a state without torque, only an operator key can start a job.
        let inching_by_key = self.motion.is_active(now);
        let arrived = matches!(self.motion.job(), Job::Positioning(_)) && !self.motion.is_active(now);
        if !self.is_powered() || !has_torque(self.state) && !inching_by_key {
            return Motor::Released;
        }
        // Parameter 26: what the motor does in position.
        match self.parameters.in_position_mode {
            1 if arrived => Motor::Shorted,
            2 if arrived => Motor::Released,
            _ => Motor::InControl,
        }
    }

    /// Turns the shaft by hand, instantly. Returns whether it turned: a motor that is not released holds it.
    pub fn turn_shaft(&mut self, now: Instant, increments: i32) -> bool {
        let turns =
            self.motor(now) == Motor::Released && !self.motion.is_moving(now) && self.inputs.shaft == Shaft::Free;
        if turns {
            self.motion.displace(now, f64::from(increments));
        }
        turns
    }

    /// Takes new parameters from the objects.
    pub fn set_parameters(&mut self, now: Instant, parameters: Parameters) {
        let before = std::mem::replace(&mut self.parameters, parameters);
        if before.counts_down != parameters.counts_down {
            self.motion.renumber(now, -self.motion.state(now).position);
        }
        if before.mode != parameters.mode {
            self.acknowledged = false;
            self.release(now);
        }
        if self.running && before.target_velocity != parameters.target_velocity {
            self.motion.run_at(now, parameters.velocity(), parameters.rotation());
        }
        self.settle(now);
    }

    /// Makes `position` the actual position. The caller makes sure that nothing moves.
    pub fn calibrate(&mut self, now: Instant, position: i32) {
        self.motion.renumber(now, self.parameters.shaft(position));
    }

    /// Follows a change of the inputs.
    pub fn set_inputs(&mut self, now: Instant, inputs: Inputs) {
        let before = std::mem::replace(&mut self.inputs, inputs);
        if !self.is_powered() {
            self.release(now);
        }
        match (before.bus, inputs.bus) {
            (BusState::Off, BusState::Active | BusState::Passive) => self.report(RECOVERED_FROM_BUS_OFF),
            (BusState::Active, BusState::Passive) => match self.model.fault(FaultKind::BusPassive) {
                Some(fault) if self.motion.is_positioning(now) => self.raise(now, fault),
                _ => self.report(ERROR_PASSIVE),
            },
            _ => {}
        }
        if let Some(error) = inputs.bus_error.filter(|_| inputs.bus_error != before.bus_error) {
            self.report(error.code());
        }
        let calibrates = self.model.switches && inputs.calibration_switch && !before.calibration_switch;
        if calibrates && !self.motion.is_active(now) {
            self.calibrate(now, self.parameters.calibration_value);
        }
        if self.model.keys && before.key != inputs.key {
            self.inch_by_key(now);
        }
        if before.attainable_rpm != inputs.attainable_rpm {
            self.motion.set_ceiling(now, ceiling(&inputs), self.parameters.rotation());
        }
        self.settle(now);
    }

    /// Follows the NMT state: outside OPERATIONAL the motor is released (7.2.2.3, 7.2.2.5).
    pub fn set_network(&mut self, now: Instant, network: Network) {
        let enters = std::mem::replace(&mut self.network, network) != network;
        // A motor that was controlled by another interface is released: the bus starts in SWITCH ON DISABLED.
        if network == Network::Operational && !(enters && has_torque(self.state)) {
            // The keys are locked in OPERATIONAL (2.2.1.2).
            self.motion.stop_inching(now, self.parameters.inching().deceleration);
        } else {
            self.disable(now);
        }
        self.settle(now);
    }

    /// Goes to SWITCH ON DISABLED.
    fn disable(&mut self, now: Instant) {
        self.control_word = 0;
        // A fault has already stopped and released the motor.
        if self.state != State::Fault {
            self.state = State::SwitchOnDisabled;
            self.release(now);
        }
    }

    /// Takes a control word.
    pub fn control(&mut self, now: Instant, word: u16) {
        if self.network != Network::Operational {
            return;
        }
        let previous = std::mem::replace(&mut self.control_word, word);
        // Travel commands count in OPERATION ENABLED only: a control word that enables does not start a motion as well.
        let was_enabled = self.state == State::OperationEnabled;
        if let Some(transition) = commanded(self.state, word, previous) {
            self.take(now, transition);
        }
        if word & control::NEW_SETPOINT == 0 {
            self.acknowledged = false;
        }
        if was_enabled && self.state == State::OperationEnabled {
            let edges = Edges { rising: word & !previous, falling: previous & !word };
            match self.parameters.mode {
                Mode::Positioning => self.control_positioning(now, word, edges),
                Mode::Velocity => self.control_velocity(now, word, edges),
            }
        }
        self.settle(now);
    }

    /// Takes a control word whose target is out of range: it may stop, but starts nothing, since the previous target
    /// does not belong to it.
    pub fn control_without_target(&mut self, now: Instant, word: u16) {
        let stop = (word | self.control_word) & control::STOP;
        self.control(now, word & !control::NEW_SETPOINT | stop);
    }

    /// Brings the controller to `now`: some faults take time.
    pub fn advance(&mut self, now: Instant) {
        self.settle(now);
    }

    fn take(&mut self, now: Instant, transition: Transition) {
        match (self.state, transition.to) {
            (State::Fault, _) => return self.reset_fault(now),
            (_, State::QuickStopActive) => {
                self.motion.cancel(now, FULL_ACCELERATION);
                self.running = false;
            }
            (State::OperationEnabled | State::QuickStopActive, _) => self.release(now),
            _ => {}
        }
        self.state = transition.to;
    }

    fn control_positioning(&mut self, now: Instant, word: u16, edges: Edges) {
        if self.motion.is_positioning(now) {
            if edges.rising & control::STOP != 0 {
                self.motion.interrupt(now);
            } else if edges.falling & control::STOP != 0 {
                self.torque_deactivated = false;
                self.motion.resume(now);
            }
            return;
        }
        for (bit, direction) in INCHING_2 {
            if edges.falling & bit != 0 && self.motion.job() == Job::Inching(direction) {
                self.motion.stop_inching(now, self.parameters.inching().deceleration);
            }
        }
        let may_start = !self.motion.is_active(now) && self.is_powered() && word & control::STOP == 0;
        if may_start {
            self.start_positioning(now, edges.rising);
        }
    }

    /// An order that cannot be started is ignored: a control word is answered by the status word only.
    fn start_positioning(&mut self, now: Instant, rising: u16) {
        let inching = INCHING_2.into_iter().filter(|(bit, _)| rising & bit != 0);
        let _started = if rising & control::NEW_SETPOINT != 0 {
            self.acknowledged = self.start_travel(now).is_ok();
            self.acknowledged
        } else if rising & control::INCHING_1 != 0 {
            self.start_step(now).is_ok()
        } else {
            inching.map(|(_, direction)| direction).any(|direction| self.start_inching(now, direction).is_ok())
        };
    }

    /// Travels to the target position, if both it and the actual position are within the limits.
    pub(super) fn start_travel(&mut self, now: Instant) -> Result<(), Refused> {
        let Parameters { target_position, .. } = self.parameters;
        let shown = self.parameters.position(self.motion.state(now).position);
        for direction in [Direction::Positive, Direction::Negative] {
            require(!self.is_on_switch(direction), Refused::Switch(direction))?;
        }
        if let Some((low, high)) = self.parameters.position_limits() {
            require(shown <= high, Refused::Limit(Direction::Positive))?;
            require(shown >= low, Refused::Limit(Direction::Negative))?;
            require((low..=high).contains(&target_position), Refused::Target)?;
        }
        let target = self.parameters.shaft(target_position);
        self.motion.move_to(now, target, self.parameters.positioning(), self.parameters.by_loop());
        self.torque_deactivated = false;
        Ok(())
    }

    pub(super) fn start_velocity(&mut self, now: Instant) {
        self.running = true;
        self.motion.run_at(now, self.parameters.velocity(), self.parameters.rotation());
    }

    pub(super) fn start_step(&mut self, now: Instant) -> Result<(), Refused> {
        let width = self.parameters.shaft(self.parameters.delta_inch);
        self.may_inch(now, Direction::of(width))?;
        self.motion.step(now, width, self.parameters.step(), self.parameters.shaft_limits());
        Ok(())
    }

    pub(super) fn start_inching(&mut self, now: Instant, direction: Direction) -> Result<(), Refused> {
        self.may_inch(now, direction)?;
        self.motion.inch(now, direction, self.parameters.inching(), self.parameters.shaft_limits());
        Ok(())
    }

    /// From an active limit switch, or at or beyond a limit, inching only leads back (table 1).
    fn may_inch(&self, now: Instant, direction: Direction) -> Result<(), Refused> {
        require(!self.is_on_switch(direction), Refused::Switch(direction))?;
        let shown = self.parameters.position(self.motion.state(now).position);
        let free = self.parameters.position_limits().is_none_or(|(low, high)| match direction {
            Direction::Positive => shown < high,
            Direction::Negative => shown > low,
        });
        require(free, Refused::Limit(direction))
    }

    fn control_velocity(&mut self, now: Instant, word: u16, edges: Edges) {
        if edges.falling & control::STOP != 0 && self.is_powered() {
            self.start_velocity(now);
        } else if word & control::STOP != 0 && self.running {
            self.running = false;
            self.motion.run_at(now, 0.0, self.parameters.rotation());
        }
    }

    fn inch_by_key(&mut self, now: Instant) {
        self.motion.stop_inching(now, self.parameters.inching().deceleration);
        let Some(key) = self.inputs.key else { return };
        let direction = match (key, self.parameters.counts_down) {
            (Key::CounterClockwise, false) | (Key::Clockwise, true) => Direction::Positive,
            (Key::Clockwise, false) | (Key::CounterClockwise, true) => Direction::Negative,
        };
        let allowed = self.network == Network::PreOperational
            && self.state != State::Fault
            && self.parameters.mode == Mode::Positioning
            && self.is_powered();
        if allowed && !self.motion.is_active(now) {
            // At a limit the key has no effect.
            let _ = self.start_inching(now, direction);
        }
    }

    /// Takes the torque away. A moving shaft coasts, even if it was braking; a finished job stays known as such.
    pub(super) fn release(&mut self, now: Instant) {
        self.running = false;
        if self.motion.is_active(now) || self.motion.is_moving(now) {
            self.motion.cancel(now, RUN_OUT_DECELERATION);
        }
    }
}

/// The velocity that the load allows, in increments/s.
fn ceiling(inputs: &Inputs) -> f64 {
    inputs.attainable_rpm.map_or(f64::INFINITY, |rpm| f64::from(rpm.max(1)) * REVOLUTION_PER_MINUTE)
}

const INCHING_2: [(u16, Direction); 2] =
    [(control::INCHING_2_POSITIVE, Direction::Positive), (control::INCHING_2_NEGATIVE, Direction::Negative)];

/// The bits of the control word that have changed.
#[derive(Clone, Copy)]
struct Edges {
    rising: u16,
    falling: u16,
}
