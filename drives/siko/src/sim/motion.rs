//! The motion of the drive's shaft: travel jobs, as in chapter 2.2 of the manual.
//!
//! Only motion: no objects, no user units, no clock. Positions are increments in the counting direction. Each job is a
//! [`Trajectory`] from start to end, so its state can be asked for at any time, in any order, and deadlines are exact.

use lexican_driver::Direction;
use lexican_runtime::Instant;

use super::trajectory::{Profile, State, Trajectory};

/// Increments of one revolution of the drive's shaft (chapter 6, parameter 13).
pub const INCREMENTS_PER_REVOLUTION: f64 = 1600.0;
/// An acceleration of 100 %: 4 rev/s² (chapter 6, parameter 4), in increments/s².
pub const FULL_ACCELERATION: f64 = 4.0 * INCREMENTS_PER_REVOLUTION;
/// One rev/min, in increments/s.
pub const REVOLUTION_PER_MINUTE: f64 = INCREMENTS_PER_REVOLUTION / 60.0;
/// The deceleration of a shaft without torque. The manual says that it coasts (chapter 2.5), but not how fast; half the
/// full deceleration is an assumption.
pub const RUN_OUT_DECELERATION: f64 = FULL_ACCELERATION / 2.0;
/// A shaft slower than 2 rev/min counts as standing (table 1, bit 4); in increments/s.
pub const STANDSTILL: f64 = 2.0 * REVOLUTION_PER_MINUTE;

/// Loop positioning (chapter 2.2.1.1): every target is approached in the same direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loop {
    /// The direction of approach.
    pub approach: Direction,
    /// How far the drive travels beyond a target that lies against that direction, in increments.
    pub length: f64,
}

/// The present job, or the last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Job {
    /// None since power-on, or the last job was cancelled.
    None,
    /// Travelling to a position (chapter 2.2.1).
    Positioning(Travel),
    /// Inching operation 1: a step of a given width.
    Step {
        /// The end of the step, in increments.
        target: f64,
    },
    /// Inching operation 2: moving for as long as it is commanded.
    Inching(Direction),
    /// Velocity mode: turning at a velocity, in increments/s.
    Velocity(f64),
}

/// A travel order, with the parameters at its start: later changes do not affect it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Increments.
    pub target: f64,
    /// How to travel.
    pub profile: Profile,
    /// Where to turn first, if the target is to be approached from there.
    turn: Option<f64>,
    interrupted: bool,
}

/// Limits 1 and 2 (parameters 15 and 16), ascending, in increments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The lower one.
    pub low: f64,
    /// The upper one.
    pub high: f64,
}

impl Limits {
    fn ahead(self, direction: Direction) -> f64 {
        match direction {
            Direction::Positive => self.high,
            Direction::Negative => self.low,
        }
    }
}

/// The parameters at the start of inching: later changes do not affect it.
#[derive(Clone, Copy, Debug)]
struct Inching {
    profile: Profile,
    limits: Option<Limits>,
}

/// The position of the shaft, and the job that moves it.
#[derive(Clone, Debug)]
pub struct Motion {
    way: Trajectory,
    job: Job,
    /// The parameters of an inching job.
    inching: Inching,
    /// Inching operation 2 has been ordered to end.
    ending: bool,
    /// The shaft cannot follow: the trajectory is at rest, but the job is not finished.
    blocked: bool,
    /// The velocity that the load allows, in increments/s.
    ceiling: f64,
}

impl Motion {
    /// A shaft at rest.
    #[must_use]
    pub fn at_rest(now: Instant, position: f64) -> Self {
        Motion {
            way: Trajectory::rest(now, position),
            job: Job::None,
            inching: Inching { profile: Profile { speed: 0.0, acceleration: 1.0, deceleration: 1.0 }, limits: None },
            ending: false,
            blocked: false,
            ceiling: f64::INFINITY,
        }
    }

    /// Position and velocity.
    #[must_use]
    pub fn state(&self, now: Instant) -> State {
        self.way.at(now)
    }

    /// The present job, or the last one if it is finished.
    #[must_use]
    pub fn job(&self) -> Job {
        self.job
    }

    /// Whether the shaft moves at all, however slowly.
    #[must_use]
    pub fn is_moving(&self, now: Instant) -> bool {
        self.way.end().is_none_or(|end| now < end)
    }

    /// Whether a job is under way: a positioning until its target is reached, also during an interruption; any other
    /// job until the shaft rests.
    #[must_use]
    pub fn is_active(&self, now: Instant) -> bool {
        match self.job {
            Job::None => false,
            Job::Positioning(travel) => travel.interrupted || self.blocked || self.is_moving(now),
            Job::Step { .. } | Job::Inching(_) | Job::Velocity(_) => self.blocked || self.is_moving(now),
        }
    }

    /// Whether a positioning is under way (status word bit 14).
    #[must_use]
    pub fn is_positioning(&self, now: Instant) -> bool {
        matches!(self.job, Job::Positioning(_)) && self.is_active(now)
    }

    /// Whether a positioning has been interrupted and waits to be resumed.
    #[must_use]
    pub fn is_interrupted(&self) -> bool {
        matches!(self.job, Job::Positioning(Travel { interrupted: true, .. }))
    }

    /// Whether the drive travels against the direction of its approach (table 1, bit 9).
    #[must_use]
    pub fn is_before_turn(&self, now: Instant) -> bool {
        let Job::Positioning(Travel { turn: Some(turn), interrupted, .. }) = self.job else { return false };
        // An interruption replaces the trajectory; whether the turn was already passed was noted before.
        interrupted || self.blocked || self.way.arrival_at(turn).is_some_and(|at| now < at)
    }

    /// When the shaft comes to rest; `None` if it never does.
    #[must_use]
    pub fn rest_at(&self) -> Option<Instant> {
        self.way.end()
    }

    /// Travels to `target`.
    pub fn move_to(&mut self, now: Instant, target: f64, profile: Profile, by_loop: Option<Loop>) {
        let from = self.state(now).position;
        let turn = by_loop
            .filter(|by_loop| (target - from) * by_loop.approach.sign() < 0.0)
            .map(|by_loop| target - by_loop.length * by_loop.approach.sign());
        self.travel(now, Travel { target, profile, turn, interrupted: false });
    }

    /// Stops a positioning with the deceleration of its profile; it can be resumed (control word bit 8).
    pub fn interrupt(&mut self, now: Instant) {
        if let Job::Positioning(travel) = self.job {
            self.interrupt_braking(now, travel.profile.deceleration);
        }
    }

    /// Stops a positioning with another deceleration; it can be resumed: torque deactivation (chapter 2.3).
    pub fn interrupt_braking(&mut self, now: Instant, deceleration: f64) {
        if let Job::Positioning(travel) = self.job
            && self.is_active(now)
            && !travel.interrupted
        {
            let travel = Travel { interrupted: true, ..self.ahead(now, travel) };
            let way = Trajectory::ramp(now, self.state(now), 0.0, deceleration);
            self.begin(Job::Positioning(travel), way);
        }
    }

    /// Resumes an interrupted positioning.
    pub fn resume(&mut self, now: Instant) {
        if let Job::Positioning(travel) = self.job
            && travel.interrupted
        {
            self.travel(now, Travel { interrupted: false, ..travel });
        }
    }

    /// Inching operation 1: a step from the present position. A limit ahead ends it early.
    pub fn step(&mut self, now: Instant, width: f64, profile: Profile, limits: Option<Limits>) {
        self.inching = Inching { profile, limits };
        self.step_to(now, self.state(now).position + width);
    }

    /// Inching operation 2: moves until [`Motion::stop_inching`], or until it passes a limit ahead.
    pub fn inch(&mut self, now: Instant, direction: Direction, profile: Profile, limits: Option<Limits>) {
        self.inching = Inching { profile, limits };
        self.keep_inching(now, direction);
    }

    /// Ends inching operation 2.
    pub fn stop_inching(&mut self, now: Instant, deceleration: f64) {
        if matches!(self.job, Job::Inching(_)) {
            self.brake(now, deceleration);
            self.ending = true;
        }
    }

    /// Velocity mode: changes from the present velocity to `velocity`.
    pub fn run_at(&mut self, now: Instant, velocity: f64, acceleration: f64) {
        let attained = velocity.clamp(-self.ceiling, self.ceiling);
        self.begin(Job::Velocity(velocity), Trajectory::ramp(now, self.state(now), attained, acceleration));
    }

    /// Brakes to a standstill and drops the job.
    pub fn cancel(&mut self, now: Instant, deceleration: f64) {
        self.job = Job::None;
        self.brake(now, deceleration);
    }

    /// Stops the shaft at once, because it is blocked. The job stays, if there is one.
    pub fn block(&mut self, now: Instant) {
        if let Job::Positioning(travel) = self.job {
            self.job = Job::Positioning(self.ahead(now, travel));
        }
        self.way = Trajectory::rest(now, self.state(now).position);
        self.blocked = self.job != Job::None;
    }

    /// Whether the shaft is blocked in the middle of a job.
    #[must_use]
    pub fn is_blocked(&self) -> bool {
        self.blocked
    }

    /// Continues the job that was blocked, except inching.
    pub fn unblock(&mut self, now: Instant, acceleration: f64) {
        match self.job {
            Job::Positioning(travel) if !travel.interrupted => self.travel(now, self.ahead(now, travel)),
            Job::Velocity(velocity) => self.run_at(now, velocity, acceleration),
            _ => self.blocked = false,
        }
    }

    /// Limits the velocity to what the load allows, in increments/s; the job continues with that at once.
    pub fn set_ceiling(&mut self, now: Instant, velocity: f64, acceleration: f64) {
        self.ceiling = velocity;
        if !self.is_moving(now) || self.ending {
            return;
        }
        match self.job {
            Job::Step { target } => self.step_to(now, target),
            Job::Inching(direction) => self.keep_inching(now, direction),
            _ => self.unblock(now, acceleration),
        }
    }

    /// Whether the shaft turns more slowly than ordered, because of its load.
    #[must_use]
    pub fn lags(&self, state: State) -> bool {
        let ordered = match self.job {
            Job::Positioning(travel) => travel.profile.speed,
            Job::Velocity(velocity) => velocity.abs(),
            Job::Step { .. } | Job::Inching(_) if !self.ending => self.inching.profile.speed,
            Job::None | Job::Step { .. } | Job::Inching(_) => return false,
        };
        ordered > self.ceiling && state.velocity.abs() >= self.ceiling - TINY
    }

    /// Gives the present position another number, for calibration or a change of the sense of rotation.
    pub fn renumber(&mut self, now: Instant, position: f64) {
        *self = Motion { ceiling: self.ceiling, ..Motion::at_rest(now, position) };
    }

    /// Turns the shaft from outside, instantly; a finished job stays known.
    pub fn displace(&mut self, now: Instant, increments: f64) {
        self.way = Trajectory::rest(now, self.state(now).position + increments);
    }

    /// The first time after `now` at which `key` of the state changes, with the keys that [`Trajectory::next_change`]
    /// allows. The beginning and the end of jobs always count as changes.
    pub fn next_change<K: PartialEq>(&self, now: Instant, key: impl Fn(State) -> K) -> Option<Instant> {
        let turn = match self.job {
            Job::Positioning(Travel { turn: Some(turn), interrupted: false, .. }) => self.way.arrival_at(turn),
            _ => None,
        };
        let ends = [self.way.end(), turn];
        let ends = ends.into_iter().flatten().filter(|end| *end > now);
        ends.chain(self.way.next_change(now, key)).min()
    }

    /// The rest of a travel under way: a turn that was made is left out.
    fn ahead(&self, now: Instant, travel: Travel) -> Travel {
        Travel { turn: travel.turn.filter(|_| self.is_before_turn(now)), ..travel }
    }

    fn travel(&mut self, now: Instant, travel: Travel) {
        let state = self.state(now);
        let profile = self.within_ceiling(travel.profile);
        let way = match travel.turn {
            Some(turn) => Trajectory::through(now, state, &[turn, travel.target], profile),
            None => Trajectory::through(now, state, &[travel.target], profile),
        };
        self.begin(Job::Positioning(travel), way);
    }

    fn step_to(&mut self, now: Instant, target: f64) {
        let (state, profile) = (self.state(now), self.within_ceiling(self.inching.profile));
        let way = Trajectory::through(now, state, &[target], profile);
        let way = self.stopping_behind(way, Direction::of(target - state.position));
        self.begin(Job::Step { target }, way);
    }

    fn keep_inching(&mut self, now: Instant, direction: Direction) {
        let (state, profile) = (self.state(now), self.within_ceiling(self.inching.profile));
        let way = Trajectory::ramp(now, state, profile.speed * direction.sign(), profile.acceleration);
        let way = self.stopping_behind(way, direction);
        self.begin(Job::Inching(direction), way);
    }

    /// Ends the motion after a limit ahead. A limit behind the shaft does not matter.
    fn stopping_behind(&self, way: Trajectory, direction: Direction) -> Trajectory {
        let Inching { profile, limits } = self.inching;
        match limits {
            Some(limits) => way.stopping_behind(limits.ahead(direction), direction.sign(), profile.deceleration),
            None => way,
        }
    }

    fn brake(&mut self, now: Instant, deceleration: f64) {
        self.begin(self.job, Trajectory::ramp(now, self.state(now), 0.0, deceleration));
    }

    fn within_ceiling(&self, profile: Profile) -> Profile {
        Profile { speed: profile.speed.min(self.ceiling), ..profile }
    }

    fn begin(&mut self, job: Job, way: Trajectory) {
        (self.way, self.job) = (way, job);
        (self.ending, self.blocked) = (false, false);
    }
}

/// In increments/s: a tolerance for rounding errors.
const TINY: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;
    use lexican_runtime::Duration;

    // 50 % and 30 rev/min, as the drive leaves the factory.
    const PROFILE: Profile = Profile {
        speed: 30.0 * REVOLUTION_PER_MINUTE,
        acceleration: FULL_ACCELERATION / 2.0,
        deceleration: FULL_ACCELERATION / 2.0,
    };

    fn ms(ms: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(ms)
    }

    fn drive() -> Motion {
        Motion::at_rest(Instant::ZERO, 0.0)
    }

    #[test]
    fn an_interrupted_travel_stays_active_and_ends_at_the_same_target() {
        let mut motion = drive();
        motion.move_to(ms(0), 5000.0, PROFILE, None);
        motion.interrupt(ms(3000));
        assert_eq!(motion.rest_at(), Some(ms(3250)));
        assert!(motion.is_positioning(ms(100_000)) && motion.is_interrupted());
        // 2300 increments until the interruption, 100 more to stop.
        assert!((motion.state(ms(4000)).position - 2400.0).abs() < 1e-6);
        motion.resume(ms(4000));
        assert_eq!(motion.state(ms(60_000)).position, 5000.0);
        assert!(!motion.is_active(ms(60_000)));
    }

    #[test]
    fn a_loop_turns_beyond_a_target_that_lies_against_the_approach() {
        let by_loop = Some(Loop { approach: Direction::Positive, length: 800.0 });
        let mut motion = drive();
        motion.move_to(ms(0), -1000.0, PROFILE, by_loop);
        // 1800 increments take 2.5 s with these ramps.
        assert!(motion.is_before_turn(ms(2499)) && !motion.is_before_turn(ms(2500)));
        assert_eq!(motion.state(ms(2500)).position, -1800.0);
        assert_eq!(motion.next_change(ms(1), |_| ()), Some(ms(2500)));
        assert_eq!(motion.state(ms(60_000)).position, -1000.0);
        motion.move_to(ms(60_000), 1000.0, PROFILE, by_loop);
        assert!(!motion.is_before_turn(ms(60_001)), "a target in the direction of approach is reached directly");
    }

    #[test]
    fn a_loop_interrupted_before_its_turn_still_turns() {
        let by_loop = Some(Loop { approach: Direction::Positive, length: 800.0 });
        let mut motion = drive();
        motion.move_to(ms(0), -1000.0, PROFILE, by_loop);
        motion.interrupt(ms(1000));
        assert!(motion.is_before_turn(ms(2000)));
        motion.resume(ms(2000));
        let turned = motion.next_change(ms(2000), |_| ()).unwrap();
        assert_eq!(motion.state(turned).position, -1800.0);
        assert_eq!(motion.rest_at().map(|end| motion.state(end).position), Some(-1000.0));
    }

    #[test]
    fn a_loop_interrupted_after_its_turn_does_not_turn_again() {
        let by_loop = Some(Loop { approach: Direction::Positive, length: 800.0 });
        let mut motion = drive();
        motion.move_to(ms(0), -1000.0, PROFILE, by_loop);
        motion.interrupt(ms(2600));
        assert!(!motion.is_before_turn(ms(3000)));
        motion.resume(ms(3000));
        let first = motion.next_change(ms(3000), |_| ()).unwrap();
        assert_eq!(motion.state(first).position, -1000.0);
    }

    #[test]
    fn inching_stops_behind_a_limit_and_may_return() {
        let limits = Some(Limits { low: -1000.0, high: 1000.0 });
        let mut motion = drive();
        motion.inch(ms(0), Direction::Positive, PROFILE, limits);
        assert!((motion.state(ms(60_000)).position - 1100.0).abs() < 1e-6);
        assert!(!motion.is_active(ms(60_000)));
        motion.inch(ms(60_000), Direction::Negative, PROFILE, limits);
        assert!(motion.state(ms(61_000)).position < 1000.0);
        motion.stop_inching(ms(61_000), FULL_ACCELERATION);
        assert_eq!(motion.rest_at(), Some(ms(61_125)));
    }

    #[test]
    fn a_step_is_relative() {
        let mut motion = Motion::at_rest(ms(0), 123.0);
        motion.step(ms(0), -1600.0, PROFILE, None);
        assert_eq!(motion.state(ms(10_000)).position, -1477.0);
        assert!(!motion.is_positioning(ms(1)) && motion.is_active(ms(1)));
    }

    #[test]
    fn velocity_is_changed_by_ramps_from_what_it_is() {
        let mut motion = drive();
        motion.run_at(ms(0), 68.0 * REVOLUTION_PER_MINUTE, FULL_ACCELERATION / 2.0);
        assert!((motion.state(ms(5000)).velocity - 68.0 * REVOLUTION_PER_MINUTE).abs() < 1e-6);
        motion.run_at(ms(5000), -30.0 * REVOLUTION_PER_MINUTE, FULL_ACCELERATION / 2.0);
        // 98 rev/min at 2 rev/s2 take 49/60 s.
        let reached = |state: State| state.velocity <= -30.0 * REVOLUTION_PER_MINUTE + 1e-9;
        let at = motion.next_change(ms(5000), reached).unwrap();
        assert_eq!(at.since(ms(5000)).as_micros(), 816_667);
        assert!(motion.is_active(ms(1_000_000)));
    }

    #[test]
    fn a_heavy_load_slows_the_travel_down_and_lags_at_its_ceiling() {
        let mut motion = drive();
        motion.move_to(ms(0), 5000.0, PROFILE, None);
        assert!(!motion.lags(motion.state(ms(3000))));
        motion.set_ceiling(ms(3000), 400.0, FULL_ACCELERATION);
        assert!(motion.lags(motion.state(ms(4000))) && motion.state(ms(4000)).velocity == 400.0);
        assert_eq!(motion.rest_at().map(|end| motion.state(end).position), Some(5000.0));
        motion.set_ceiling(ms(5000), f64::INFINITY, FULL_ACCELERATION);
        assert!(!motion.lags(motion.state(ms(6000))) && motion.state(ms(6000)).velocity == 800.0);
    }

    #[test]
    fn a_cancelled_job_is_forgotten() {
        let mut motion = drive();
        motion.move_to(ms(0), 5000.0, PROFILE, None);
        motion.cancel(ms(1000), FULL_ACCELERATION);
        assert_eq!((motion.job(), motion.is_active(ms(1001))), (Job::None, false));
        assert!(motion.is_moving(ms(1001)));
        motion.resume(ms(2000));
        assert!(!motion.is_moving(ms(2000)));
    }
}
