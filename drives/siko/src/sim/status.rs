//! What the drive reports about itself: 1002h, 6041h, 2420h, 2422h, positions and velocities, and when any of them
//! changes.

use lexican_runtime::Instant;

use super::controller::{Controller, Motor, Network};
use super::inputs::Inputs;
use super::motion::{Job, REVOLUTION_PER_MINUTE, STANDSTILL};
use super::parameters::Mode;
use super::trajectory;
use crate::state::State;
use crate::words::{generic, status, system};

/// What the words depend on, as far as it is position and velocity. Each field is a comparison with a threshold, so
/// that [`Motion::next_change`](super::motion::Motion::next_change) can find its next change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Observation {
    moving: bool,
    lags: bool,
    reaches_window: bool,
    leaves_window: bool,
    above_upper_limit: bool,
    below_lower_limit: bool,
}

impl Observation {
    fn in_window(self) -> bool {
        self.reaches_window && !self.leaves_window
    }

    fn beyond_limit(self) -> bool {
        self.above_upper_limit || self.below_lower_limit
    }
}

impl Controller {
    /// The position as in 6064h.
    #[must_use]
    pub fn position(&self, now: Instant) -> i32 {
        self.parameters.position(self.motion.state(now).position)
    }

    /// The velocity as in 606Ch, in rev/min.
    #[must_use]
    pub fn velocity(&self, now: Instant) -> i32 {
        revolutions_per_minute(self.motion.state(now)).round() as i32
    }

    /// The system status word 1002h (table 1).
    #[must_use]
    pub fn system_status(&self, now: Instant) -> u16 {
        let seen = self.observe(self.motion.state(now));
        let not_ready = self.state == State::Fault || self.is_unready(now, seen);
        let [switch_1, switch_2] = self.limit_switches();
        let not_enabled = if self.model.enable_input { !self.inputs.enable } else { !self.is_powered() };
        bits(&[
            (system::LIMIT_SWITCH_1, switch_1),
            (system::LIMIT_SWITCH_2, switch_2),
            (system::CALIBRATION_SWITCH, self.model.switches && self.inputs.calibration_switch),
            (system::IN_POSITION, seen.in_window()),
            (system::MOVING, seen.moving),
            (system::ABOVE_UPPER_LIMIT, seen.above_upper_limit),
            (system::BELOW_LOWER_LIMIT, seen.below_lower_limit),
            (system::MOTOR_RELEASED, self.motor(now) == Motor::Released),
            (system::FAULT, self.state == State::Fault),
            (system::AGAINST_APPROACH, self.motion.is_before_turn(now)),
            (system::NO_SUPPLY, not_enabled),
            (system::NOT_READY, not_ready),
            (system::BATTERY_LOW, self.inputs.battery_is_low()),
            (system::OVERCURRENT, self.has_overcurrent(now)),
            (system::POSITIONING, self.motion.is_positioning(now)),
            (system::LAG_ERROR, seen.lags),
        ])
    }

    /// The status word 6041h (tables 21 and 22).
    #[must_use]
    pub fn status_word(&self, now: Instant) -> u16 {
        let seen = self.observe(self.motion.state(now));
        let ready = self.state == State::OperationEnabled && !self.is_unready(now, seen);
        let common = self.state.status_bits()
            | bits(&[
                (status::VOLTAGE_ENABLED, self.inputs.supply_is_good()),
                (status::WARNING, self.has_warning(now, seen)),
                (status::READY, ready),
                (status::REMOTE, self.network != Network::PreOperational),
                (status::INTERNAL_LIMIT, seen.beyond_limit()),
            ]);
        common
            | match self.parameters.mode {
                Mode::Positioning => bits(&[
                    (status::TARGET_REACHED, self.has_arrived(now) && seen.in_window()),
                    (status::ACKNOWLEDGED, self.acknowledged),
                    (status::POSITIONING, self.motion.is_positioning(now)),
                    (status::MOVING, seen.moving),
                ]),
                Mode::Velocity => {
                    bits(&[(status::TARGET_REACHED, seen.in_window()), (status::STANDSTILL, !seen.moving)])
                }
            }
    }

    /// The generic status register 2420h.
    #[must_use]
    pub fn generic_status(&self) -> u8 {
        let bit = |mask, set| if set { mask } else { 0 };
        bit(generic::SUPPLY_PRESENT, self.inputs.supply_is_present())
            | bit(generic::TORQUE_DEACTIVATED, self.torque_deactivated)
    }

    /// The state of torque deactivation 2422h.
    #[must_use]
    pub fn torque_deactivation_state(&self) -> u8 {
        u8::from(self.torque_deactivated)
    }

    /// The first time after `now` at which one of the words changes by itself.
    #[must_use]
    pub fn next_change(&self, now: Instant) -> Option<Instant> {
        let motion = self.motion.next_change(now, |state| self.observe(state));
        motion.into_iter().chain(self.next_event()).min()
    }

    /// The first time after `now` at which the value of position or velocity, or one of the words, changes.
    #[must_use]
    pub fn next_reading(&self, now: Instant) -> Option<Instant> {
        let shown = |state: trajectory::State| {
            (self.parameters.position(state.position), revolutions_per_minute(state).round() as i32)
        };
        self.motion.next_change(now, shown).into_iter().chain(self.next_change(now)).min()
    }

    /// Whether the last positioning or step has ended at its target.
    fn has_arrived(&self, now: Instant) -> bool {
        matches!(self.motion.job(), Job::Positioning(_) | Job::Step { .. }) && !self.motion.is_active(now)
    }

    fn is_unready(&self, now: Instant, seen: Observation) -> bool {
        let on_switch = self.limit_switches() != [false; 2];
        // If the bus is not in command, an interrupted travel can be started again (AG02, figure 4).
        let waits = self.network == Network::PreOperational && self.motion.is_interrupted() && !seen.moving;
        self.motion.is_active(now) && !waits || !self.is_powered() || seen.beyond_limit() || on_switch
    }

    fn has_overcurrent(&self, now: Instant) -> bool {
        self.current_ma(now) > Inputs::OVERCURRENT_MA
    }

    /// Whether there is a warning (chapter 5.1).
    fn has_warning(&self, now: Instant, seen: Observation) -> bool {
        self.inputs.battery_is_low() || self.has_overcurrent(now) || seen.lags
    }

    fn observe(&self, state: trajectory::State) -> Observation {
        let window = i32::from(self.parameters.window);
        let moving = state.velocity.abs() >= STANDSTILL;
        let lags = self.motion.is_blocked() || self.motion.lags(state);
        match self.parameters.mode {
            Mode::Positioning => {
                let position = self.parameters.position(state.position);
                let target = self.reference();
                let limits = self.parameters.position_limits();
                Observation {
                    moving,
                    lags,
                    reaches_window: position >= target.saturating_sub(window),
                    leaves_window: position > target.saturating_add(window),
                    above_upper_limit: limits.is_some_and(|(_, high)| position > high),
                    below_lower_limit: limits.is_some_and(|(low, _)| position < low),
                }
            }
            Mode::Velocity => {
                let velocity = revolutions_per_minute(state);
                let target = f64::from(self.parameters.target_velocity);
                Observation {
                    moving,
                    lags,
                    reaches_window: velocity >= target - f64::from(window) - ROUNDING,
                    leaves_window: velocity > target + f64::from(window) + ROUNDING,
                    above_upper_limit: false,
                    below_lower_limit: false,
                }
            }
        }
    }

    /// The position that "in position" refers to: the target of the job, even if it is finished, or else the programmed
    /// target.
    fn reference(&self) -> i32 {
        match self.motion.job() {
            Job::Positioning(travel) => self.parameters.position(travel.target),
            Job::Step { target } => self.parameters.position(target),
            Job::None | Job::Inching(_) | Job::Velocity(_) => self.parameters.target_position,
        }
    }
}

/// In rev/min: a tolerance far below the resolution of 606Ch.
const ROUNDING: f64 = 1e-6;

fn revolutions_per_minute(state: trajectory::State) -> f64 {
    state.velocity / REVOLUTION_PER_MINUTE
}

fn bits(bits: &[(u16, bool)]) -> u16 {
    bits.iter().filter(|(_, set)| *set).fold(0, |word, (bit, _)| word | bit)
}
