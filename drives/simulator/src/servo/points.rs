//! Profile position mode: set-points, one under way and one waiting (CiA 402-2, 10.3.3).

use lexican_runtime::profile::cia402::control;

use super::model::Servo;
use super::objects::*;
use super::parts::{Limit, Points, SetPoint, TINY};
use crate::storage::Storage;
use crate::trajectory::Trajectory;

impl Servo {
    /// Bit 4 of the control word has been set.
    pub(super) fn take_set_point(&mut self, word: u16, od: &dyn Storage) {
        if self.points.acknowledged {
            return;
        }
        let point = self.read_set_point(word & control::RELATIVE != 0, od);
        self.points.acknowledged = true;
        if self.points.travels && word & self.model.at_once == 0 {
            self.points.buffered = Some(point);
            if word & self.model.on_set_point != 0 && !self.is_halted() {
                self.travel_past(od);
            }
            return;
        }
        self.points = Points { active: Some(point), travels: true, acknowledged: true, ..Points::default() };
        if !self.is_halted() {
            self.travel(od);
        }
    }

    /// The set-point of 607Ah, with the present profile.
    fn read_set_point(&self, relative: bool, od: &dyn Storage) -> SetPoint {
        let parameters = self.parameters(od);
        let sign = parameters.position_sign();
        let ordered = parameters.float(TARGET_POSITION);
        let target = if relative {
            // 60F2h, bits 0 and 1: relative to the last target, to the demand, or to the actual position.
            let last = self.points.buffered.or(self.points.active).map(|point| point.target);
            let base = match parameters.number(POSITIONING_OPTION) & 3 {
                0 => last.unwrap_or_else(|| self.way.at(self.now).position),
                1 => self.way.at(self.now).position,
                _ => self.shaft(self.now).position,
            };
            base + ordered * sign
        } else if let Some((low, high)) = parameters.range(RANGE_MIN, RANGE_MAX) {
            // `ordered` is brought into the range of 6064h, which wraps around.
            let ordered = low + (ordered - low).rem_euclid(high - low + 1.0);
            let shaft = self.shaft(self.now).position;
            shaft + (ordered - self.shown(shaft, &parameters)) * sign
        } else {
            ordered * sign + self.zero
        };
        let limited = self.within_limits(target, &parameters);
        SetPoint { target: limited, profile: parameters.profile(), limited: limited != target }
    }

    /// Plans the travel to the set-point under way, from the present position.
    pub(super) fn travel(&mut self, od: &dyn Storage) {
        let Some(point) = self.points.active.filter(|_| self.points.travels) else { return };
        self.points.change = None;
        let state = self.shaft(self.now);
        self.limit = if point.limited { Limit::AtEnd } else { Limit::None };
        if point.profile.speed < TINY {
            return self.brake(point.profile.deceleration);
        }
        let way = Trajectory::through(self.now, state, &[point.target], point.profile);
        self.begin(way, (point.target - state.position).signum(), od);
    }

    /// Plans to pass the set-point under way at its speed, if the next one waits.
    fn travel_past(&mut self, od: &dyn Storage) {
        let Some(point) = self.points.active.filter(|point| point.profile.speed >= TINY) else { return };
        let state = self.shaft(self.now);
        let sign = (point.target - state.position).signum();
        let way = Trajectory::run(self.now, state, sign, point.profile);
        self.points.change = way.passes(point.target, sign).filter(|change| *change > self.now);
        if self.points.change.is_some() {
            self.begin(way, sign, od);
        }
    }

    /// Ends a travel that is over, and begins the next one.
    pub(super) fn follow_set_points(&mut self, od: &dyn Storage) {
        let passed = self.points.change.is_some_and(|change| change <= self.now);
        let stands = !self.is_moving(self.now) && self.held.is_none() && !self.is_halted();
        let arrives = self.points.active.is_some_and(|point| point.profile.speed >= TINY);
        if self.points.travels && (passed || (stands && arrives)) {
            let next = self.points.buffered.take();
            self.points.active = next.or(self.points.active);
            self.points.travels = next.is_some();
            self.travel(od);
        }
        if self.control & control::NEW_SET_POINT == 0 && self.points.buffered.is_none() {
            self.points.acknowledged = false;
        }
    }
}
