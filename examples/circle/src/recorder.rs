//! Records set-points and positions of the axes in each cycle, from the frames on the bus.

use lexican_driver::cyclic::Axis;
use lexican_runtime::host::{Incoming, Link, LinkError};
use lexican_runtime::{CobId, Duration, Frame, Instant};

/// Wraps a link and records what passes through it.
pub(crate) struct Recorder<L> {
    link: L,
    /// The PDOs of x and y with set-points; below, those with positions.
    set_points: [CobId; 2],
    positions: [CobId; 2],
    cycles: Vec<Cycle>,
}

/// The cycle from one SYNC to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cycle {
    pub(crate) at: Instant,
    /// The set-points sent in this cycle, which the next SYNC activates.
    pub(crate) set_points: [i32; 2],
    /// The positions at this SYNC.
    pub(crate) positions: [i32; 2],
}

/// All cycles, relative to the centre of the circle.
pub(crate) struct Recording {
    pub(crate) cycles: Vec<Cycle>,
    pub(crate) radius: f64,
}

impl<L> Recorder<L> {
    pub(crate) fn new(link: L, axes: &[Axis]) -> Self {
        let of_both = |pdo: fn(&Axis) -> CobId| [pdo(&axes[0]), pdo(&axes[1])];
        Recorder { link, set_points: of_both(Axis::rpdo), positions: of_both(Axis::tpdo), cycles: Vec::new() }
    }

    /// The recording of a circle that began at its lowest point.
    pub(crate) fn finish(self, start: [i32; 2], radius: f64) -> Recording {
        let centre = [start[0], start[1].saturating_add(radius as i32)];
        let from_centre = |at: [i32; 2]| [at[0].saturating_sub(centre[0]), at[1].saturating_sub(centre[1])];
        let cycles = self.cycles.into_iter().map(|cycle| Cycle {
            set_points: from_centre(cycle.set_points),
            positions: from_centre(cycle.positions),
            ..cycle
        });
        Recording { cycles: cycles.collect(), radius }
    }

    fn note(&mut self, now: Instant, frame: &Frame) {
        let Some(last) = self.cycles.last().copied() else {
            if frame.id() == CobId::SYNC {
                self.cycles.push(Cycle { at: now, set_points: [0; 2], positions: [0; 2] });
            }
            return;
        };
        if frame.id() == CobId::SYNC {
            self.cycles.push(Cycle { at: now, ..last });
            return;
        }
        let &[_, _, a, b, c, d] = frame.data() else { return };
        let value = i32::from_le_bytes([a, b, c, d]);
        let Some(cycle) = self.cycles.last_mut() else { return };
        for axis in 0..2 {
            if frame.id() == self.set_points[axis] {
                cycle.set_points[axis] = value;
            } else if frame.id() == self.positions[axis] {
                cycle.positions[axis] = value;
            }
        }
    }
}

impl<L: Link> Link for Recorder<L> {
    fn now(&self) -> Instant {
        self.link.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(frame)?;
        self.note(self.link.now(), frame);
        Ok(())
    }

    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.try_send(frame)?;
        self.note(self.link.now(), frame);
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let incoming = self.link.receive(until)?;
        if let Some(Incoming::Frame(frame)) = &incoming {
            self.note(self.link.now(), frame);
        }
        Ok(incoming)
    }

    fn is_real_time(&self) -> bool {
        self.link.is_real_time()
    }

    fn latency(&self) -> Duration {
        self.link.latency()
    }
}

impl Recording {
    /// Seconds since the first SYNC.
    pub(crate) fn seconds(&self, cycle: &Cycle) -> f64 {
        let first = self.cycles.first().map_or(cycle.at, |first| first.at);
        cycle.at.since(first).as_secs_f64()
    }

    /// How far the axes are outside of the circle; negative if inside.
    pub(crate) fn outside(&self, cycle: &Cycle) -> f64 {
        let [x, y] = cycle.positions.map(f64::from);
        x.hypot(y) - self.radius
    }

    /// The intervals between SYNCs, in milliseconds: minimum, median, 99th percentile and maximum.
    pub(crate) fn periods(&self) -> Option<[f64; 4]> {
        let between = |pair: &[Cycle]| pair[1].at.since(pair[0].at).as_secs_f64() * 1000.0;
        let mut periods: Vec<f64> = self.cycles.windows(2).map(between).collect();
        periods.sort_unstable_by(f64::total_cmp);
        let last = periods.len().checked_sub(1)?;
        Some([0, last / 2, last * 99 / 100, last].map(|at| periods[at]))
    }

    pub(crate) fn farthest(&self) -> f64 {
        // In the first cycles, the axes have not sent their positions yet.
        self.cycles.iter().skip(2).map(|cycle| self.outside(cycle).abs()).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A link with latency.
    struct Slow;

    impl Link for Slow {
        fn now(&self) -> Instant {
            Instant::ZERO
        }
        fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
            Ok(())
        }
        fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
            Ok(None)
        }
        fn is_real_time(&self) -> bool {
            true
        }
        fn latency(&self) -> Duration {
            Duration::from_millis(700)
        }
    }

    #[test]
    fn what_is_recorded_takes_as_long_as_without_a_recorder() {
        let (set_points, positions) = ([CobId::SYNC; 2], [CobId::SYNC; 2]);
        let recorder = Recorder { link: Slow, set_points, positions, cycles: Vec::new() };
        assert_eq!(recorder.latency(), Slow.latency());
        assert!(recorder.is_real_time());
    }
}
