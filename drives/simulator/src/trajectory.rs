//! Motion along one axis in closed form: pieces of constant acceleration, solved when they are planned.
//!
//! Nothing is integrated step by step, so the answer for one time does not depend on earlier calls. Positions are
//! increments, velocities increments/s, accelerations increments/s².

use lexican_runtime::{Duration, Instant};

/// Position and velocity of the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Increments.
    pub position: f64,
    /// Increments per second.
    pub velocity: f64,
}

/// Limits of a travel; all three are positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// The highest velocity, in increments/s.
    pub speed: f64,
    /// Increments/s².
    pub acceleration: f64,
    /// Increments/s².
    pub deceleration: f64,
}

/// A planned motion. It has no end: after the last change of velocity the axis goes on unchanged.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    start: Instant,
    // Never empty, ascending by time; within a piece the velocity does not change its sign, so that
    // position and speed are monotone there. The last piece has no acceleration.
    pieces: Vec<Piece>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    /// Seconds after the start of the trajectory.
    from_s: f64,
    state: State,
    acceleration: f64,
}

impl Trajectory {
    /// Standing still.
    #[must_use]
    pub fn rest(start: Instant, position: f64) -> Self {
        Plan::new(start, State { position, velocity: 0.0 }).finish()
    }

    /// From `state` to a standstill at the last of `stops`, with a momentary standstill at each of the others.
    #[must_use]
    pub fn through(start: Instant, state: State, stops: &[f64], profile: Profile) -> Self {
        let legs: Vec<_> = stops.iter().map(|stop| (*stop, profile)).collect();
        Trajectory::legs(start, state, &legs)
    }

    /// The same with a profile for each stop.
    #[must_use]
    pub fn legs(start: Instant, state: State, legs: &[(f64, Profile)]) -> Self {
        let mut plan = Plan::new(start, state);
        for &(stop, profile) in legs {
            plan.travel_to(stop, profile);
        }
        plan.finish()
    }

    /// At the velocity of `state`, without end.
    #[must_use]
    pub fn steady(start: Instant, state: State) -> Self {
        Plan::new(start, state).finish()
    }

    /// From `state` to the velocity of `profile` in the direction of `sign`, with acceleration and deceleration of
    /// `profile`.
    #[must_use]
    pub fn run(start: Instant, state: State, sign: f64, profile: Profile) -> Self {
        let mut plan = Plan::new(start, state);
        if state.velocity * sign < 0.0 {
            plan.change_velocity(0.0, profile.deceleration);
        }
        let slower = plan.state.velocity.abs() > profile.speed;
        plan.change_velocity(sign * profile.speed, if slower { profile.deceleration } else { profile.acceleration });
        plan.finish()
    }

    /// From `state` to a constant velocity.
    #[must_use]
    pub fn ramp(start: Instant, state: State, velocity: f64, acceleration: f64) -> Self {
        let mut plan = Plan::new(start, state);
        plan.change_velocity(velocity, acceleration);
        plan.finish()
    }

    /// The same motion until it passes `limit` in the direction of `sign`, and from there to a standstill; from the
    /// start, if it begins beyond `limit`.
    #[must_use]
    pub fn stopping_behind(mut self, limit: f64, sign: f64, deceleration: f64) -> Self {
        let Some((from_s, state)) = self.passing(limit, sign) else { return self };
        self.pieces.retain(|piece| piece.from_s < from_s);
        let mut plan = Plan { start: self.start, pieces: self.pieces, time_s: from_s, state };
        plan.change_velocity(0.0, deceleration);
        plan.finish()
    }

    /// The state at `now`; before the start, that at the start.
    #[must_use]
    pub fn at(&self, now: Instant) -> State {
        let time_s = now.since(self.start).as_secs_f64();
        let after = self.pieces.partition_point(|piece| piece.from_s <= time_s);
        let piece = self.pieces[after.saturating_sub(1)];
        piece.at(time_s - piece.from_s)
    }

    /// When the axis comes to rest for good; `None` if it never does.
    #[must_use]
    pub fn end(&self) -> Option<Instant> {
        let last = self.last();
        (last.state.velocity == 0.0).then(|| self.instant(last.from_s))
    }

    /// Where the axis comes to rest; `None` if it never does.
    #[must_use]
    pub fn rest_position(&self) -> Option<f64> {
        let last = self.last();
        (last.state.velocity == 0.0).then_some(last.state.position)
    }

    /// When the axis turns around or stands still for the first time at `position`.
    #[must_use]
    pub fn arrival_at(&self, position: f64) -> Option<Instant> {
        let stop = self.pieces.iter().find(|piece| piece.state == State { position, velocity: 0.0 })?;
        Some(self.instant(stop.from_s))
    }

    /// When the motion first passes `position` in the direction of `sign`; its start, if that is beyond it.
    #[must_use]
    pub fn passes(&self, position: f64, sign: f64) -> Option<Instant> {
        self.passing(position, sign).map(|(from_s, _)| self.instant(from_s))
    }

    /// The first time after `now` at which `key` of the state differs from its present value. Every part of `key` must
    /// be monotone in position or speed, as comparisons with a threshold are.
    pub fn next_change<K: PartialEq>(&self, now: Instant, key: impl Fn(State) -> K) -> Option<Instant> {
        let current = key(self.at(now));
        let changed = |at: u64| key(self.at(Instant::from_micros(at))) != current;
        let mut from = now.as_micros();
        let boundaries = self.pieces.iter().skip(1).map(|piece| self.instant(piece.from_s).as_micros());
        // Within a piece, the key changes at most once: comparing both ends shows whether it does, and bisection finds
        // when.
        for boundary in boundaries.chain([from.saturating_add(HORIZON.as_micros())]) {
            if boundary <= from {
                continue;
            }
            for (low, high) in [(from, boundary - 1), (boundary - 1, boundary)] {
                if changed(high) {
                    return Some(Instant::from_micros(first_change(low, high, changed)));
                }
            }
            from = boundary;
        }
        None
    }

    fn last(&self) -> Piece {
        *self.pieces.last().expect("a trajectory has at least one piece")
    }

    /// The first microsecond not before `time_s`.
    fn instant(&self, time_s: f64) -> Instant {
        self.start + Duration::from_micros((time_s * 1e6).ceil() as u64)
    }

    /// When and in which state the motion passes `limit` in the direction of `sign`.
    fn passing(&self, limit: f64, sign: f64) -> Option<(f64, State)> {
        let first = self.pieces.first()?;
        if (limit - first.state.position) * sign <= 0.0 {
            return Some((first.from_s, first.state));
        }
        for (row, piece) in self.pieces.iter().enumerate() {
            let distance = (limit - piece.state.position) * sign;
            let speed = piece.state.velocity * sign;
            let square = speed * speed + 2.0 * piece.acceleration * sign * distance;
            let dt = 2.0 * distance / (speed + square.sqrt());
            let within = self.pieces.get(row + 1).is_none_or(|next| piece.from_s + dt <= next.from_s);
            // For a motion that never gets there, `dt` is NaN or infinite.
            if distance >= 0.0 && dt >= 0.0 && dt.is_finite() && within {
                return Some((piece.from_s + dt, piece.at(dt)));
            }
        }
        None
    }
}

/// How far ahead changes are searched: twelve days.
const HORIZON: Duration = Duration::from_micros(1 << 40);

/// The first number in `low..=high` for which `changed` holds; it holds for `high`, and not for `low`.
fn first_change(mut low: u64, mut high: u64, changed: impl Fn(u64) -> bool) -> u64 {
    while low + 1 < high {
        let middle = low + (high - low) / 2;
        *(if changed(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

impl Piece {
    fn at(&self, dt: f64) -> State {
        let State { position, velocity } = self.state;
        State {
            position: position + velocity * dt + self.acceleration * dt * dt / 2.0,
            velocity: velocity + self.acceleration * dt,
        }
    }
}

struct Plan {
    start: Instant,
    pieces: Vec<Piece>,
    time_s: f64,
    state: State,
}

impl Plan {
    fn new(start: Instant, state: State) -> Self {
        Plan { start, pieces: Vec::new(), time_s: 0.0, state }
    }

    /// Adds the motion to a standstill at `target`.
    fn travel_to(&mut self, target: f64, profile: Profile) {
        let braking = |state: State| state.velocity * state.velocity / (2.0 * profile.deceleration);
        let sign = (target - self.state.position).signum();
        let too_fast = braking(self.state) > (target - self.state.position).abs() + TINY;
        if self.state.velocity * sign < 0.0 || too_fast {
            self.change_velocity(0.0, profile.deceleration);
        }
        let distance = (target - self.state.position).abs();
        let sign = (target - self.state.position).signum();
        let speed = self.state.velocity.abs();
        // Without a speed limit, accelerating to the peak and braking from it takes the whole distance.
        let (a, d) = (profile.acceleration, profile.deceleration);
        let peak = ((2.0 * a * d * distance + d * speed * speed) / (a + d)).sqrt().min(profile.speed);
        self.change_velocity(sign * peak, if peak < speed { d } else { a });
        let remaining = (target - self.state.position) * sign - braking(self.state);
        if remaining > 0.0 && peak > 0.0 {
            self.go(remaining / peak, 0.0);
        }
        self.change_velocity(0.0, profile.deceleration);
        // Removes the rounding error, far below an increment.
        self.state.position = target;
    }

    /// Adds a change to `velocity`; a change of direction makes two pieces.
    fn change_velocity(&mut self, velocity: f64, acceleration: f64) {
        if self.state.velocity * velocity < 0.0 {
            self.change_velocity(0.0, acceleration);
        }
        let change = velocity - self.state.velocity;
        if change != 0.0 {
            self.go(change.abs() / acceleration, acceleration * change.signum());
            self.state.velocity = velocity;
        }
    }

    fn go(&mut self, duration_s: f64, acceleration: f64) {
        let piece = Piece { from_s: self.time_s, state: self.state, acceleration };
        self.pieces.push(piece);
        self.time_s += duration_s;
        self.state = piece.at(duration_s);
    }

    fn finish(mut self) -> Trajectory {
        self.pieces.push(Piece { from_s: self.time_s, state: self.state, acceleration: 0.0 });
        Trajectory { start: self.start, pieces: self.pieces }
    }
}

/// Far below an increment: a tolerance for rounding errors.
const TINY: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at_ms(ms: u64) -> Instant {
        Instant::from_micros(ms * 1000)
    }

    fn profiles() -> impl Strategy<Value = Profile> {
        (20.0..6000.0, 64.0..6400.0, 64.0..6400.0).prop_map(|(speed, acceleration, deceleration)| Profile {
            speed,
            acceleration,
            deceleration,
        })
    }

    proptest! {
        #[test]
        fn every_way_is_continuous_and_keeps_its_profile(
            position in -1e6..1e6, velocity in -6000.0..6000.0, stops in proptest::collection::vec(-1e6..1e6, 1..3),
            profile in profiles(),
        ) {
            let way = Trajectory::through(Instant::ZERO, State { position, velocity }, &stops, profile);
            let speed = profile.speed.max(f64::abs(velocity)) + 1e-3;
            for pair in way.pieces.windows(2) {
                let arrived = pair[0].at(pair[1].from_s - pair[0].from_s);
                prop_assert!((arrived.position - pair[1].state.position).abs() < 1e-2, "{pair:?}");
                prop_assert!((arrived.velocity - pair[1].state.velocity).abs() < 1e-2, "{pair:?}");
                prop_assert!(pair[1].state.velocity.abs() <= speed);
                prop_assert!(pair[0].acceleration.abs() <= profile.acceleration.max(profile.deceleration) + 1e-9);
                prop_assert!(pair[0].state.velocity * pair[1].state.velocity >= 0.0, "{pair:?}");
            }
            prop_assert_eq!(way.rest_position(), stops.last().copied());
        }

        #[test]
        fn a_way_does_not_depend_on_the_questions(cut_ms in 0_u64..20_000, target in -1e5..1e5, profile in profiles()) {
            let whole = Trajectory::through(Instant::ZERO, State::default(), &[target], profile);
            let cut = at_ms(cut_ms);
            let again = Trajectory::through(cut, whole.at(cut), &[target], profile);
            for later_ms in [0, 1, 10, 500, 5000, 100_000] {
                let later = at_ms(cut_ms + later_ms);
                prop_assert!((whole.at(later).position - again.at(later).position).abs() < 0.5);
            }
        }

        /// A limit in the middle of a travel: the same way up to it, and then a stop.
        #[test]
        fn a_way_that_passes_a_limit_comes_to_rest_behind_it(
            velocity in -3000.0..3000.0, stops in proptest::collection::vec(-1e5..1e5, 1..3), limit in -1e5..1e5,
            sign in prop::sample::select(vec![-1.0, 1.0]), profile in profiles(),
        ) {
            let whole = Trajectory::through(Instant::ZERO, State { position: 0.0, velocity }, &stops, profile);
            let way = whole.clone().stopping_behind(limit, sign, profile.deceleration);
            let Some(passed) = whole.passes(limit, sign) else {
                prop_assert_eq!(way, whole);
                return Ok(());
            };
            for part in 0..=10 {
                let before = Instant::from_micros(passed.as_micros().saturating_sub(1) * part / 10);
                prop_assert!((way.at(before).position - whole.at(before).position).abs() < 1e-3);
            }
            let there = whole.at(passed);
            let braking = there.velocity * there.velocity.abs() / (2.0 * profile.deceleration);
            let end = way.rest_position().expect("it stops");
            prop_assert!((end - there.position - braking).abs() < 1.0, "{} instead of {}", end, there.position + braking);
            if limit * sign > 0.0 {
                prop_assert!((there.position - limit).abs() < 0.1, "{} at {}", there.position, limit);
            }
        }
    }
}
