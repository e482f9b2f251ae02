//! The state machine of CiA 402, for an interface that has none: edges of 6040h become orders, facts become 6041h.

use lexican_driver::Direction;

use super::Facts;
use crate::model::Model;
use crate::order::{Braking, Order};
use crate::state::{Mode, State, commanded, has_torque};
use crate::words::{control, status, system};

/// A control word, with the targets at that time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Control {
    pub(super) word: u16,
    /// Whether the target that came with it was in range.
    pub(super) has_target: bool,
    pub(super) position: i32,
    pub(super) velocity: i32,
}

/// The work that was ordered last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    None,
    Travel,
    Step,
    Inching(Direction),
    Turning(i32),
}

/// An order that a control word asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub(super) order: Order,
    pub(super) target: i32,
    /// The present state, and the one after the order is carried out.
    states: (State, State),
}

/// The state machine, and what it has ordered.
#[derive(Clone, Debug)]
pub(super) struct Face {
    state: State,
    word: u16,
    /// `None` until 6060h has been read.
    mode: Option<Mode>,
    work: Work,
    acknowledged: bool,
    /// The motor has been in control since it was enabled.
    holds: bool,
    /// The last order was refused because another interface has command.
    overruled: bool,
}

const INCHING_2: [(u16, Direction); 2] =
    [(control::INCHING_2_POSITIVE, Direction::Positive), (control::INCHING_2_NEGATIVE, Direction::Negative)];

impl Face {
    pub(super) const fn new() -> Self {
        Face {
            state: State::SwitchOnDisabled,
            word: 0,
            mode: None,
            work: Work::None,
            acknowledged: false,
            holds: false,
            overruled: false,
        }
    }

    pub(super) const fn state(&self) -> State {
        self.state
    }

    pub(super) const fn mode(&self) -> Option<Mode> {
        self.mode
    }

    /// Follows a change of 6060h.
    pub(super) fn set_mode(&mut self, mode: Option<Mode>) {
        if self.mode != mode {
            (self.work, self.acknowledged) = (Work::None, false);
        }
        self.mode = mode;
    }

    /// Whether to read the facts anew before the control word is judged, since it may start something.
    pub(super) fn needs_look(&self, control: Control) -> bool {
        let word = self.word_of(control);
        let starts = word != self.word && word & control::STOP == 0;
        self.state == State::OperationEnabled && starts && commanded(self.state, word, self.word).is_none()
    }

    /// The control word, reduced if its target was out of range: such a word may stop, but starts nothing.
    fn word_of(&self, given: Control) -> u16 {
        match given.has_target {
            true => given.word,
            false => given.word & !control::NEW_SETPOINT | self.word & control::STOP,
        }
    }

    /// Takes a control word; returns the order that it asks for, or changes the state itself.
    pub(super) fn take(&mut self, control: Control, facts: &Facts) -> Option<Step> {
        let (word, Control { position, velocity, .. }) = (self.word_of(control), control);
        let previous = std::mem::replace(&mut self.word, word);
        if word & control::NEW_SETPOINT == 0 {
            self.acknowledged = false;
        }
        if let Some(transition) = commanded(self.state, word, previous) {
            let order = match (self.state, transition.to) {
                (State::Fault, _) => Order::ResetFault,
                (_, State::OperationEnabled) => Order::Enable,
                (_, State::QuickStopActive) => Order::Hold,
                (from, _) if has_torque(from) => Order::Release,
                (_, to) => {
                    self.state = to;
                    return None;
                }
            };
            return Some(Step { order, target: 0, states: (self.state, transition.to) });
        }
        if self.state != State::OperationEnabled {
            return None;
        }
        let (rising, falling) = (word & !previous, previous & !word);
        let (order, target) = match self.mode? {
            Mode::Velocity => (self.turning(word, falling, velocity)?, velocity),
            Mode::Positioning => (self.travelling(word, rising, falling, facts)?, position),
        };
        Some(Step { order, target, states: (self.state, self.state) })
    }

    /// Table 23 in positioning mode: a word gives at most one order.
    fn travelling(&self, word: u16, rising: u16, falling: u16, facts: &Facts) -> Option<Order> {
        if facts.has(system::POSITIONING) {
            return match () {
                () if rising & control::STOP != 0 => Some(Order::Interrupt(Braking::Programmed)),
                () if falling & control::STOP != 0 => Some(Order::Resume),
                () => None,
            };
        }
        if let Work::Inching(under_way) = self.work
            && INCHING_2.iter().any(|(bit, direction)| falling & bit != 0 && *direction == under_way)
        {
            return Some(Order::StopInching);
        }
        if word & control::STOP != 0 || facts.has(system::MOVING) {
            return None;
        }
        if rising & control::NEW_SETPOINT != 0 {
            return Some(Order::Start);
        }
        if rising & control::INCHING_1 != 0 {
            return Some(Order::Step);
        }
        INCHING_2.iter().find(|(bit, _)| rising & bit != 0).map(|(_, direction)| Order::Inch(*direction))
    }

    /// Table 23 in velocity mode. While the drive turns, a new target is an order by itself.
    fn turning(&self, word: u16, falling: u16, velocity: i32) -> Option<Order> {
        match self.work {
            Work::Turning(_) if word & control::STOP != 0 => Some(Order::Interrupt(Braking::Programmed)),
            Work::Turning(current) => (current != velocity).then_some(Order::Start),
            _ => (falling & control::STOP != 0).then_some(Order::Start),
        }
    }

    /// Ends an order. `facts` were measured after it, and decide if it is not known whether the order was carried out.
    pub(super) fn conclude(&mut self, step: Step, outcome: Outcome, facts: &Facts) {
        self.overruled = outcome == Outcome::Overruled;
        let moves = facts.has(system::POSITIONING | system::MOVING);
        let carried_out = match outcome {
            Outcome::Done => true,
            Outcome::Unknown => match step.order {
                Order::Start | Order::Resume | Order::Step | Order::Inch(_) => moves,
                Order::Release => facts.has(system::MOTOR_RELEASED),
                Order::ResetFault => !facts.has(system::FAULT),
                Order::Enable | Order::Hold | Order::Interrupt(_) | Order::Abort(_) | Order::StopInching => false,
            },
            Outcome::Refused | Outcome::Overruled => false,
        };
        // A fault that came meanwhile has precedence.
        if !carried_out || self.state != step.states.0 {
            return;
        }
        match step.order {
            Order::Start if self.mode == Some(Mode::Velocity) => self.work = Work::Turning(step.target),
            Order::Start => (self.work, self.acknowledged) = (Work::Travel, true),
            Order::Step => self.work = Work::Step,
            Order::Inch(direction) => self.work = Work::Inching(direction),
            Order::StopInching => self.work = Work::None,
            Order::Interrupt(_) if matches!(self.work, Work::Turning(_)) => self.work = Work::None,
            Order::Hold | Order::Abort(_) => self.work = Work::None,
            Order::Enable => self.holds = false,
            // Finished work stays known as such.
            Order::Release if moves => self.work = Work::None,
            Order::Release | Order::Resume | Order::Interrupt(_) | Order::ResetFault => {}
        }
        self.state = step.states.1;
    }

    /// Enters SWITCH ON DISABLED after the motor was released in any way, as if no control word had come.
    pub(super) fn disable(&mut self) {
        self.word = 0;
        if self.state != State::Fault {
            self.state = State::SwitchOnDisabled;
        }
        self.acknowledged = false;
    }

    /// Takes facts; returns a change that the drive made by itself, which does not include the release of the motor by
    /// an order under way.
    pub(super) fn see(&mut self, facts: &Facts, is_releasing: bool) -> Option<Change> {
        let released = facts.has(system::MOTOR_RELEASED);
        if facts.has(system::FAULT) {
            let is_new = self.state != State::Fault;
            self.state = State::Fault;
            return is_new.then_some(Change::Fault);
        }
        if self.state == State::Fault {
            self.state = State::SwitchOnDisabled;
            return Some(Change::NoFault);
        }
        if !has_torque(self.state) {
            return None;
        }
        // Without supply or enable input, the motor has no torque in any state.
        let held = std::mem::replace(&mut self.holds, !released);
        let lost = held && released && !is_releasing && !facts.has(system::NO_SUPPLY);
        if lost {
            self.work = Work::None;
            self.disable();
        }
        lost.then_some(Change::Released)
    }

    /// The status word 6041h (tables 21 and 22); `remote` is whether the node takes control words.
    pub(super) fn status_word(&self, model: &Model, facts: &Facts, remote: bool) -> u16 {
        let has = |mask| facts.has(mask);
        let velocity = self.mode == Some(Mode::Velocity);
        let arrived = matches!(self.work, Work::Travel | Work::Step) && !has(system::POSITIONING | system::MOVING);
        let limit = !velocity && has(system::ABOVE_UPPER_LIMIT | system::BELOW_LOWER_LIMIT);
        // Bit 10 of 1002h is the enable input in a drive that has one.
        let supplied = model.enable_input || !has(system::NO_SUPPLY);
        [
            (status::VOLTAGE_ENABLED, supplied),
            (status::WARNING, has(system::BATTERY_LOW | system::OVERCURRENT | system::LAG_ERROR)),
            (status::READY, self.state == State::OperationEnabled && !has(system::NOT_READY)),
            (status::REMOTE, remote && !self.overruled),
            (status::TARGET_REACHED, has(system::IN_POSITION) && (velocity || arrived)),
            (status::INTERNAL_LIMIT, limit),
            (status::STANDSTILL, velocity && !has(system::MOVING)),
            (status::ACKNOWLEDGED, self.acknowledged),
            (status::POSITIONING, !velocity && has(system::POSITIONING)),
            (status::MOVING, !velocity && has(system::MOVING)),
        ]
        .iter()
        .filter(|(_, set)| *set)
        .fold(self.state.status_bits(), |word, (bit, _)| word | bit)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Done,
    Refused,
    Overruled,
    Unknown,
}

/// A change that the drive made by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Fault,
    NoFault,
    Released,
}
