//! Orders from other interfaces than control words, for the same controller.

use lexican_runtime::Instant;

use super::controller::Controller;
use super::motion::{FULL_ACCELERATION, Job};
use super::parameters::Mode;
use super::require::require;
use crate::order::{Braking, Order, Refused};
use crate::state::State;

impl Controller {
    /// Takes an order; the caller has checked that its interface has command.
    ///
    /// Errors: the reason; nothing has changed then.
    pub fn order(&mut self, now: Instant, order: Order) -> Result<(), Refused> {
        let result = self.take_order(now, order);
        self.settle(now);
        result
    }

    fn take_order(&mut self, now: Instant, order: Order) -> Result<(), Refused> {
        require(self.state != State::Fault || order == Order::ResetFault, Refused::Fault)?;
        match order {
            Order::Enable => {
                // Without supply, no state is reached in which operation can be enabled (figure 13 of the AG02).
                require(self.inputs.supply_is_present(), Refused::NoPower)?;
                self.state = State::OperationEnabled;
            }
            Order::Hold => {
                require(self.state == State::OperationEnabled, Refused::NotEnabled)?;
                self.state = State::QuickStopActive;
                self.running = false;
                self.motion.cancel(now, FULL_ACCELERATION);
            }
            Order::Release => {
                self.state = State::SwitchOnDisabled;
                self.release(now);
            }
            Order::Start if self.parameters.mode == Mode::Velocity => {
                self.may_start(now, Mode::Velocity)?;
                self.start_velocity(now);
            }
            Order::Start => {
                self.may_start(now, Mode::Positioning)?;
                self.start_travel(now)?;
            }
            Order::Interrupt(braking) if self.motion.is_positioning(now) => match braking {
                Braking::Full => self.motion.interrupt_braking(now, FULL_ACCELERATION),
                Braking::Programmed => self.motion.interrupt(now),
            },
            Order::Interrupt(braking) | Order::Abort(braking) => {
                self.running = false;
                if matches!(self.motion.job(), Job::Velocity(_)) {
                    self.motion.run_at(now, 0.0, self.deceleration(braking));
                } else if self.motion.is_active(now) {
                    self.motion.cancel(now, self.deceleration(braking));
                }
            }
            Order::Resume => {
                require(self.motion.is_interrupted(), Refused::Busy)?;
                require(self.is_powered(), Refused::NoPower)?;
                self.torque_deactivated = false;
                self.motion.resume(now);
            }
            Order::Step => {
                self.may_start(now, Mode::Positioning)?;
                self.start_step(now)?;
            }
            Order::Inch(direction) => {
                self.may_start(now, Mode::Positioning)?;
                self.start_inching(now, direction)?;
            }
            Order::StopInching => self.motion.stop_inching(now, self.parameters.inching().deceleration),
            Order::ResetFault => {
                self.reset_fault(now);
                require(self.state != State::Fault, Refused::Fault)?;
            }
        }
        Ok(())
    }

    fn may_start(&self, now: Instant, mode: Mode) -> Result<(), Refused> {
        require(self.parameters.mode == mode, Refused::Mode)?;
        require(self.state == State::OperationEnabled, Refused::NotEnabled)?;
        require(self.is_powered(), Refused::NoPower)?;
        // In velocity mode, another start changes the velocity.
        require(mode == Mode::Velocity || !self.motion.is_active(now), Refused::Busy)
    }

    fn deceleration(&self, braking: Braking) -> f64 {
        match (braking, self.motion.job()) {
            (Braking::Full, _) => FULL_ACCELERATION,
            (Braking::Programmed, Job::Positioning(travel)) => travel.profile.deceleration,
            (Braking::Programmed, Job::Velocity(_)) => self.parameters.rotation(),
            (Braking::Programmed, _) => self.parameters.step().deceleration,
        }
    }
}
