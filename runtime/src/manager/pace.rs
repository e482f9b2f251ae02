//! How often a node is reset or booted again.

use crate::time::{Duration, Instant};

/// Limits how often the manager resets and configures a node that boots again and again, or ignores its resets.
///
/// After each attempt there is a pause, which doubles up to half a minute. So neither new frames of the node, nor old
/// ones that arrive late, make the manager fill the bus.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    attempts: u8,
    /// How often the node would have been reset or booted without pauses.
    occasions: u8,
    /// When the last occasion was.
    last: Instant,
    /// When the next attempt may be made.
    next: Instant,
    /// A loop is to be reported.
    is_loop: bool,
}

/// The pause after the first attempt. By then, a reset node has discarded the frames sent to it before.
const SHORTEST: Duration = Duration::from_secs(1);
/// How often the pause doubles.
const DOUBLINGS: u8 = 5;
/// The longest pause.
const LONGEST: Duration = SHORTEST.times(1 << DOUBLINGS);
/// After this time without an occasion, counting starts anew.
const CALM: Duration = LONGEST.times(2);
/// How many occasions in a row make a loop.
const LOOP: u8 = 3;

impl Pace {
    /// Notes an occasion to reset or boot the node.
    pub fn note(&mut self, now: Instant) {
        if now.since(self.last) >= CALM {
            *self = Pace::default();
        }
        self.last = now;
        self.occasions = self.occasions.saturating_add(1);
        self.is_loop |= self.occasions == LOOP;
    }

    /// Whether an attempt may begin.
    pub(super) fn allows(&self, now: Instant) -> bool {
        self.next <= now
    }

    /// Begins an attempt.
    ///
    /// Errors: the earliest time at which it may begin.
    pub fn attempt(&mut self, now: Instant) -> Result<(), Instant> {
        if !self.allows(now) {
            return Err(self.next);
        }
        self.next = now + SHORTEST.times(1 << self.attempts);
        self.attempts = DOUBLINGS.min(self.attempts + 1);
        Ok(())
    }

    pub(super) const fn is_loop(&self) -> bool {
        self.is_loop
    }

    /// Whether a loop is to be reported; true only once.
    pub(super) const fn take_loop(&mut self) -> bool {
        core::mem::replace(&mut self.is_loop, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pause_doubles_to_its_bound_and_begins_anew_when_it_was_calm() {
        let (mut pace, mut attempts, mut loops) = (Pace::default(), std::vec::Vec::new(), 0);
        let mut pass = |pace: &mut Pace, seconds: core::ops::Range<u64>| {
            for now in seconds.map(|s| Instant::ZERO + Duration::from_secs(s)) {
                pace.note(now);
                loops += u32::from(pace.take_loop());
                attempts.extend(pace.attempt(now).map(|()| now.as_micros() / 1_000_000));
            }
        };
        pass(&mut pace, 0..130);
        pass(&mut pace, 192..200);
        pass(&mut pace, 263..266);
        assert_eq!(attempts, [0, 1, 3, 7, 15, 31, 63, 95, 127, 192, 263, 264]);
        assert_eq!(loops, 2);
    }
}
