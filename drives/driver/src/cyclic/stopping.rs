//! The ramp along a path, and the rest of a stop.

use lexican_runtime::{Duration, Instant};

#[derive(Debug)]
pub(super) enum Stage {
    /// The path is followed ever more slowly.
    Ramp(Ramp),
    /// The set-points stay the same; the axes come to rest.
    Settle,
    /// The axes brake by their quick stop.
    Quick,
    /// The motors are released.
    Release,
}

/// Slows down from the pace of the path to 0, at a constant rate.
#[derive(Debug)]
pub(super) struct Ramp {
    step: u32,
    of: u32,
    /// Where the axes are between two set-points of the path: 0 is `here`, 1 is `there`.
    fraction: f64,
    pub(super) here: Vec<i32>,
    pub(super) there: Vec<i32>,
}

impl Ramp {
    /// Starts at `here`, which has been sent, towards `there`.
    pub(super) fn new(within: Duration, period: Duration, here: Vec<i32>, there: Vec<i32>) -> Self {
        let cycles = within.as_micros().div_ceil(period.as_micros().max(1));
        Ramp { step: 0, of: u32::try_from(cycles).unwrap_or(u32::MAX), fraction: 0.0, here, there }
    }

    /// Goes on by a cycle, and returns the pace, which is 1 on the path; `None` when the ramp is over. `next` gives the
    /// set-points after those in its first argument.
    pub(super) fn advance(&mut self, next: impl FnOnce(&[i32], &[i32]) -> Vec<i32>) -> Option<f64> {
        self.step += 1;
        if self.step >= self.of {
            return None;
        }
        let pace = 1.0 - f64::from(self.step) / f64::from(self.of);
        self.fraction += pace;
        if self.fraction >= 1.0 {
            self.fraction -= 1.0;
            let beyond = next(&self.there, &self.here);
            self.here = std::mem::replace(&mut self.there, beyond);
        }
        Some(pace)
    }

    /// The position of an axis between the two set-points.
    pub(super) fn between(&self, axis: usize) -> i32 {
        let at = |of: &[i32]| of.get(axis).copied().unwrap_or_default();
        let (here, there) = (at(&self.here), at(&self.there));
        let way = f64::from(there) - f64::from(here);
        // An `i32`, since it lies between two of them.
        (f64::from(here) + way * self.fraction).round() as i32
    }
}

/// The set-point after `last` if the axis goes on as from `before` to `last`: straight on, but not beyond its limits.
/// An axis beyond its limits stays where it is or comes back, since clamping to the limit would be a leap.
pub(super) fn straight_on(last: i32, before: i32, limits: Option<[i32; 2]>) -> i32 {
    let next = i64::from(last) * 2 - i64::from(before);
    let [low, high] = limits.unwrap_or([i32::MIN, i32::MAX]).map(i64::from);
    next.clamp(low.min(last.into()), high.max(last.into())) as i32
}

#[derive(Debug)]
pub(super) struct Stopping {
    pub(super) stage: Stage,
    pub(super) since: Instant,
}

impl Stopping {
    pub(super) const fn new(stage: Stage, since: Instant) -> Self {
        Stopping { stage, since }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_slows_down_along_the_path_and_ends_in_time() {
        let (within, period) = (Duration::from_millis(10), Duration::from_millis(1));
        // The path goes on by 100 in each cycle, then turns.
        let mut path = [1200, 1300, 1250, 1200, 1150].into_iter();
        let mut ramp = Ramp::new(within, period, vec![1000], vec![1100]);
        let mut sent = vec![];
        while let Some(pace) = ramp.advance(|_, _| vec![path.next().unwrap()]) {
            sent.push((ramp.between(0), (pace * 10.0).round() as i32));
        }
        let expected =
            [(1090, 9), (1170, 8), (1240, 7), (1300, 6), (1275, 5), (1255, 4), (1240, 3), (1230, 2), (1225, 1)];
        assert_eq!(sent, expected, "4.5 cycles of the path in 10");
    }

    #[test]
    fn straight_on_ends_at_the_limits() {
        assert_eq!(straight_on(10, 7, None), 13);
        assert_eq!(straight_on(10, 7, Some([0, 12])), 12);
        // Beyond them already: no further, and back by its own steps.
        assert_eq!(straight_on(500, 490, Some([0, 12])), 500);
        assert_eq!(straight_on(500, 510, Some([0, 12])), 490);
        assert_eq!(straight_on(-500, -490, Some([0, 12])), -500);
        assert_eq!(straight_on(i32::MIN, i32::MAX, None), i32::MIN);
    }
}
