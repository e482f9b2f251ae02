//! Takes times: many short batches, the contenders in turn, so that other work of the machine meets all of
//! them alike.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// How long a batch takes at least, so that reading the clock costs nothing beside it.
const BATCH: Duration = Duration::from_micros(500);

/// A piece of work, done as often as asked.
pub(crate) struct Contender {
    pub(crate) name: &'static str,
    /// CAN frames, in both directions, that the piece of work takes.
    pub(crate) frames: u64,
    batch: Box<dyn FnMut(u64) -> Duration>,
}

/// What a contender needed for one piece of work.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    pub(crate) name: &'static str,
    pub(crate) frames: u64,
    pub(crate) best_ns: f64,
    pub(crate) median_ns: f64,
}

impl Contender {
    /// Does the work by `once`.
    pub(crate) fn new(name: &'static str, mut once: impl FnMut() + 'static) -> Self {
        Contender::in_batches(name, move |times| {
            for _ in 0..times {
                once();
            }
        })
    }

    /// Does the work many times by one call.
    pub(crate) fn in_batches(name: &'static str, mut batch: impl FnMut(u64) + 'static) -> Self {
        Contender::with_own_clock(name, move |times| {
            let start = now();
            batch(times);
            start.elapsed()
        })
    }

    /// Is outside of this process, and says itself how long it took.
    pub(crate) fn with_own_clock(name: &'static str, batch: impl FnMut(u64) -> Duration + 'static) -> Self {
        scatter();
        Contender { name, frames: 0, batch: Box::new(batch) }
    }

    pub(crate) fn with_frames(self, frames: u64) -> Self {
        Contender { frames, ..self }
    }

    /// How many times the work fits into a batch.
    fn calibrate(&mut self) -> u64 {
        let mut times = 1;
        while (self.batch)(times) < BATCH {
            times *= 2;
        }
        times
    }
}

/// Lets the contenders work in turn. Each element of `copies` has the same contenders, made anew; in each round it
/// is the turn of the next one.
pub(crate) fn race(mut copies: Vec<Vec<Contender>>, rounds: usize) -> Vec<Figure> {
    let times: Vec<u64> = copies[0].iter_mut().map(Contender::calibrate).collect();
    let mut samples: Vec<Vec<f64>> = vec![Vec::with_capacity(rounds); times.len()];
    let copies_count = copies.len();
    for round in 0..rounds {
        let contenders = &mut copies[round % copies_count];
        for turn in 0..contenders.len() {
            // No contender always follows the same one, whose traces are in the caches.
            let at = (turn + round / copies_count) % contenders.len();
            let spent = (contenders[at].batch)(times[at]);
            samples[at].push(spent.as_nanos() as f64 / times[at] as f64);
        }
    }
    copies[0].iter().zip(samples).map(|(contender, samples)| figure(contender, samples)).collect()
}

/// Leaves a gap in the heap, of another size each time, so that copies of a contender do not all have their memory
/// at the same distances.
pub(crate) fn scatter() {
    static GAP: AtomicUsize = AtomicUsize::new(1);
    // All multiples of 16 below a page come before any comes again.
    let gap = (GAP.fetch_add(1, Ordering::Relaxed) * 97 % 256) * 16;
    std::hint::black_box(Vec::<u8>::with_capacity(gap + 16).leak());
}

fn figure(contender: &Contender, mut samples: Vec<f64>) -> Figure {
    samples.sort_by(f64::total_cmp);
    Figure {
        name: contender.name,
        frames: contender.frames,
        best_ns: samples[0],
        median_ns: samples[samples.len() / 2],
    }
}

#[expect(clippy::disallowed_methods, reason = "taking the time is what a benchmark is for")]
fn now() -> Instant {
    Instant::now()
}
