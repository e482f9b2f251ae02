//! Homing mode (CiA 402-2, 11). Every method is described by a switch edge, the direction in which it is finally
//! crossed, and whether the first index pulse after it counts.

use lexican_runtime::object::Address;
use lexican_runtime::profile::cia402::State;

use super::model::Servo;
use super::objects::*;
use super::parts::{Homing, Limit, TINY};
use crate::storage::Storage;
use crate::trajectory::{Profile, Trajectory};

#[derive(Clone, Copy)]
enum Edge {
    NegativeLimit,
    PositiveLimit,
    /// The negative end of the home switch.
    HomeLow,
    /// The positive end of the home switch.
    HomeHigh,
    /// No switch: the index pulse only.
    None,
    /// The present position.
    Here,
}

#[derive(Clone, Copy)]
struct Method {
    edge: Edge,
    /// The direction in which the edge is finally crossed.
    last: f64,
    /// The direction in which the home switch is searched if it is not active.
    first: f64,
    index: bool,
}

/// Figures 19 to 33. Methods 17 to 30 are 1 to 14 without the index pulse.
fn method(number: i64) -> Option<Method> {
    let (row, index) = match number {
        1..=14 => (number, true),
        17..=30 => (number - 16, false),
        33 => return Some(Method { edge: Edge::None, last: -1.0, first: -1.0, index: true }),
        34 => return Some(Method { edge: Edge::None, last: 1.0, first: 1.0, index: true }),
        35 | 37 => return Some(Method { edge: Edge::Here, last: 1.0, first: 1.0, index: false }),
        _ => return None,
    };
    let (edge, last, first) = match row {
        1 => (Edge::NegativeLimit, 1.0, -1.0),
        2 => (Edge::PositiveLimit, -1.0, 1.0),
        3 => (Edge::HomeLow, -1.0, 1.0),
        4 => (Edge::HomeLow, 1.0, 1.0),
        5 => (Edge::HomeHigh, 1.0, -1.0),
        6 => (Edge::HomeHigh, -1.0, -1.0),
        7 => (Edge::HomeLow, -1.0, 1.0),
        8 => (Edge::HomeLow, 1.0, 1.0),
        9 => (Edge::HomeHigh, -1.0, 1.0),
        10 => (Edge::HomeHigh, 1.0, 1.0),
        11 => (Edge::HomeHigh, 1.0, -1.0),
        12 => (Edge::HomeHigh, -1.0, -1.0),
        13 => (Edge::HomeLow, 1.0, -1.0),
        _ => (Edge::HomeLow, -1.0, -1.0),
    };
    Some(Method { edge, last, first, index })
}

impl Servo {
    /// Bit 4 of the control word has been set.
    pub(super) fn start_homing(&mut self, od: &mut dyn Storage) {
        self.homing = Homing { running: true, ..Homing::default() };
        if !self.is_halted() {
            self.plan_homing(od);
        }
    }

    /// Bit 4 was cleared before the end.
    pub(super) fn interrupt_homing(&mut self, od: &dyn Storage) {
        if std::mem::take(&mut self.homing.running) {
            self.brake(self.parameters(od).homing(HOMING_SLOW).deceleration);
        }
    }

    /// Plans the whole way from the present position.
    pub(super) fn plan_homing(&mut self, od: &dyn Storage) {
        let parameters = self.parameters(od);
        let number = parameters.number(HOMING_METHOD);
        let [fast, slow] = [HOMING_FAST, HOMING_SLOW].map(|speed| parameters.homing(speed));
        let offset = parameters.float(HOME_OFFSET) * parameters.position_sign();
        let still = fast.speed < TINY || slow.speed < TINY;
        let way = method(number)
            .filter(|method| self.has_homing_method(number, od) && (!still || matches!(method.edge, Edge::Here)))
            .and_then(|method| self.homing_legs(method, fast, slow));
        self.limit = Limit::None;
        let Some(legs) = way else {
            self.homing = Homing { failed: true, ..Homing::default() };
            return self.brake(fast.deceleration);
        };
        let state = self.shaft(self.now);
        self.homing.home = (legs.last().map_or(state.position, |leg| leg.0), offset);
        self.way = Trajectory::legs(self.now, state, &legs);
    }

    /// Whether the servo has a method, by 60E3h or else by the model.
    fn has_homing_method(&self, number: i64, od: &dyn Storage) -> bool {
        if let Some(count) = od.number(HOMING_METHODS).filter(|count| *count > 0) {
            let sub = |sub| Address::new(HOMING_METHODS.index(), sub);
            return (1..=count.min(254) as u8).any(|row| od.number(sub(row)) == Some(number));
        }
        self.model.homing_methods.is_none_or(|methods| methods.iter().any(|method| i64::from(*method) == number))
    }

    /// The stops on the way to the home position; `None` if a switch or pulse that the method needs is missing.
    fn homing_legs(&self, method: Method, fast: Profile, slow: Profile) -> Option<Vec<(f64, Profile)>> {
        let machine = self.inputs.machine;
        let here = self.shaft(self.now).position;
        // The axis notices a switch when it passes it, and needs this distance to turn around.
        let [overshoot, margin] = [fast, slow].map(|way| way.speed * way.speed / (2.0 * way.deceleration) + 1.0);
        let mut legs = Vec::new();
        let mut at = here;
        let edge = match method.edge {
            Edge::Here => return Some(vec![(here, slow)]),
            Edge::None => here,
            Edge::NegativeLimit | Edge::PositiveLimit => {
                let limit = machine.limit(method.first)?;
                if (limit - at) * method.first > 0.0 {
                    at = limit + method.first * overshoot;
                    legs.push((at, fast));
                }
                limit
            }
            Edge::HomeLow | Edge::HomeHigh => {
                let (low, high) = machine.home_switch?;
                let edge = if matches!(method.edge, Edge::HomeLow) { low } else { high };
                if !(low..=high).contains(&at) {
                    // The end of the switch that is reached, and the side from which it is reached.
                    let is_ahead = if method.first > 0.0 { at < low } else { at > high };
                    if !is_ahead {
                        at = machine.limit(method.first)? + method.first * overshoot;
                        legs.push((at, fast));
                    }
                    let (near, towards) = if at < low { (low, 1.0) } else { (high, -1.0) };
                    at = near + towards * overshoot;
                    legs.push((at, fast));
                }
                // To the side from which the edge is finally crossed.
                if (edge - at) * method.last <= 0.0 {
                    at = edge - method.last * margin;
                    legs.push((at, fast));
                }
                edge
            }
        };
        let home = if method.index { machine.index_beyond(edge, method.last)? } else { edge };
        legs.push((home, slow));
        legs.iter().all(|(stop, _)| stop.is_finite()).then_some(legs)
    }

    /// Ends homing if the axis stands at the home position.
    pub(super) fn end_homing(&mut self) {
        let obeying = self.state == State::OperationEnabled && self.ending.is_none();
        let planned = !self.is_halted() && self.held.is_none() && obeying;
        if self.homing.running && planned && self.way.end().is_some_and(|end| end <= self.now) {
            let (home, offset) = self.homing.home;
            self.homing = Homing { attained: true, ..Homing::default() };
            self.zero = home - offset;
        }
    }
}
