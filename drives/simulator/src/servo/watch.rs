//! What the servo monitors over time: windows, its shaft, SYNC; and when its next event is.

use lexican_runtime::profile::cia402::Mode;
use lexican_runtime::{Duration, Instant};

use super::model::Servo;
use super::objects::*;
use super::parts::{CONDITIONS, TINY};
use crate::storage::Storage;
use crate::trajectory::State;

/// The demand has reached the target (6067h, 6068h).
const ARRIVED: usize = 0;
/// The velocity is within its window (606Dh, 606Eh).
const AT_SPEED: usize = 1;
/// The velocity is below its threshold (606Fh, 6070h).
const SLOW: usize = 2;
/// The following error is larger than 6065h for longer than 6066h.
const LAGGING: usize = 3;
/// The shaft is blocked.
const BLOCKED: usize = 4;

impl Servo {
    pub(super) fn watch(&mut self, od: &mut dyn Storage) {
        self.hold_shaft();
        self.rest_cycle();
        let holding = self.bounds(od).conditions(self.demanded());
        let times = self.times(od);
        for (row, holds) in holding.into_iter().enumerate() {
            let since = &mut self.watch.since[row];
            *since = holds.then(|| since.unwrap_or(self.now));
            self.watch.held[row] = since.is_some_and(|since| since + times[row] <= self.now);
        }
        if self.watch.held[LAGGING] {
            self.raise(self.model.codes.following_error, od);
        }
        if self.watch.held[BLOCKED] {
            self.raise(self.model.codes.blocked, od);
        }
        if self.cycle_deadline().is_some_and(|deadline| deadline <= self.now) {
            self.raise(self.model.codes.cycle_missed, od);
        }
    }

    pub(super) fn has_arrived(&self) -> bool {
        self.watch.held[ARRIVED]
    }

    pub(super) fn is_at_speed(&self) -> bool {
        self.watch.held[AT_SPEED]
    }

    pub(super) fn is_slow(&self) -> bool {
        self.watch.held[SLOW]
    }

    pub(super) fn lags(&self) -> bool {
        self.watch.held[LAGGING]
    }

    /// The limits of the conditions.
    fn bounds(&self, od: &dyn Storage) -> Bounds {
        let parameters = self.parameters(od);
        let velocity = |address| parameters.float(address) * parameters.velocity_scale() + TINY;
        Bounds {
            held: self.held,
            target: self.running.map_or(0.0, |running| running[0]),
            window: velocity(VELOCITY_WINDOW),
            threshold: velocity(VELOCITY_THRESHOLD),
            following: parameters.following_window().filter(|_| self.is_obeying()),
        }
    }

    /// How long each condition has to hold.
    fn times(&self, od: &dyn Storage) -> [Duration; CONDITIONS] {
        let parameters = self.parameters(od);
        let [arrived, at_speed, slow, lagging] =
            [POSITION_TIME, VELOCITY_TIME, VELOCITY_THRESHOLD_TIME, FOLLOWING_TIME]
                .map(|address| parameters.milliseconds(address));
        [arrived, at_speed, slow, lagging, self.model.blocked_for]
    }

    /// Holds a blocked shaft where it is.
    pub(super) fn hold_shaft(&mut self) {
        if self.inputs.blocked && self.held.is_none() && self.is_moving(self.now) {
            self.held = Some(self.demanded().position);
        }
    }

    /// When something next changes by itself.
    pub(super) fn find_next(&self, od: &dyn Storage) -> Option<Instant> {
        let times = self.times(od);
        let due = self.watch.since.iter().zip(times).zip(self.watch.held);
        let due = due.filter(|(_, held)| !held).filter_map(|((since, time), _)| Some((*since)? + time));
        let (bounds, awaits) = (self.bounds(od), (self.model.awaits_index)(od));
        let change = self.way.next_change(self.now, |demand| {
            let shaft = if self.held.is_some() { self.shaft(self.now) } else { demand };
            let passed = self.inputs.machine.passed(shaft);
            (bounds.conditions(demand), passed, self.awaited_pulse(shaft.position, awaits))
        });
        let torque = matches!(self.mode, Some(Mode::ProfileTorque)).then(|| self.way.end()).flatten();
        let own = [self.way.end(), change, self.cycle_deadline(), self.points.change, torque];
        own.into_iter().flatten().chain(due).filter(|at| *at > self.now).min()
    }
}

/// The limits of the conditions, in position units and position units/s.
struct Bounds {
    held: Option<f64>,
    target: f64,
    window: f64,
    threshold: f64,
    following: Option<f64>,
}

impl Bounds {
    /// Which conditions hold at a demand. Each is monotone in position or speed, as
    /// [`crate::trajectory::Trajectory::next_change`] needs.
    fn conditions(&self, demand: State) -> [bool; CONDITIONS] {
        let velocity = if self.held.is_some() { 0.0 } else { demand.velocity };
        let lag = self.held.map_or(0.0, |held| (demand.position - held).abs());
        [
            demand.velocity == 0.0 && self.held.is_none(),
            (velocity - self.target).abs() <= self.window,
            velocity.abs() <= self.threshold,
            self.following.is_some_and(|window| lag > window),
            self.held.is_some(),
        ]
    }
}
