//! A stop is a state, not a job: the standstill stays wanted until the drive has confirmed it.

use lexican_runtime::{Duration, Instant};

/// The pause after a failed attempt, in which the node can be asked something else. An attempt itself waits for a
/// silent node, so a node that returns is stopped at once.
const PAUSE: Duration = Duration::from_millis(500);

/// How to stop a drive; the stronger way is the greater value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Braking {
    /// With the programmed deceleration.
    Programmed,
    /// With full deceleration.
    Full,
}

/// Whether a standstill is wanted and not confirmed.
#[derive(Debug, Default)]
pub(crate) struct Standstill(Option<Wanted>);

#[derive(Debug)]
struct Wanted {
    /// Since when the standstill has been wanted.
    since: Instant,
    braking: Braking,
    /// The current attempt.
    under_way: Option<Braking>,
    /// The time of the next attempt.
    next: Instant,
    /// Why the last attempt failed.
    why: Option<String>,
}

/// A standstill that is wanted and not confirmed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Unconfirmed {
    pub(crate) since: Instant,
    /// Why the last attempt failed; `None` during the first one.
    pub(crate) why: Option<String>,
}

impl Standstill {
    /// Wants a standstill. If it is wanted already, the answer will be for both; in a pause, the next attempt is due at
    /// once.
    pub(crate) fn want(&mut self, now: Instant, braking: Braking) {
        let new = Wanted { since: now, braking, under_way: None, next: now, why: None };
        let wanted = self.0.get_or_insert(new);
        wanted.braking = wanted.braking.max(braking);
        wanted.next = now;
    }

    /// The attempt that is due now. It counts as begun, and ends with [`handle_outcome`](Self::handle_outcome).
    pub(crate) fn poll_transmit(&mut self, now: Instant) -> Option<Braking> {
        let wanted = self.0.as_mut().filter(|wanted| wanted.under_way.is_none() && wanted.next <= now)?;
        wanted.under_way = Some(wanted.braking);
        wanted.under_way
    }

    /// The time of the next attempt, unless one is being made.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.0.as_ref().filter(|wanted| wanted.under_way.is_none()).map(|wanted| wanted.next)
    }

    /// Handles the end of an attempt: the drive has confirmed its standstill, or why not.
    pub(crate) fn handle_outcome(&mut self, now: Instant, outcome: Result<(), String>) {
        let Some(wanted) = &mut self.0 else { return };
        let braking = wanted.under_way.take();
        match outcome {
            // A stronger stop was wanted meanwhile; it comes next.
            Ok(()) if braking < Some(wanted.braking) => wanted.next = now,
            Ok(()) => self.0 = None,
            Err(why) => (wanted.next, wanted.why) = (now + PAUSE, Some(why)),
        }
    }

    /// The standstill that is not confirmed yet.
    pub(crate) fn unconfirmed(&self) -> Option<Unconfirmed> {
        self.0.as_ref().map(|wanted| Unconfirmed { since: wanted.since, why: wanted.why.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn at(ms: u64) -> Instant {
        Instant::from_micros(ms * 1000)
    }

    #[test]
    fn a_hundred_presses_are_one_attempt_and_share_its_answer() {
        let mut drive = Standstill::default();
        assert_eq!((drive.poll_transmit(at(0)), drive.poll_timeout()), (None, None));
        drive.want(at(0), Braking::Programmed);
        assert_eq!(drive.poll_transmit(at(0)), Some(Braking::Programmed));
        for ms in 1..100 {
            drive.want(at(ms), Braking::Programmed);
            assert_eq!((drive.poll_transmit(at(ms)), drive.poll_timeout()), (None, None));
        }
        assert_eq!(drive.unconfirmed().unwrap().since, at(0));
        drive.handle_outcome(at(100), Ok(()));
        assert_eq!((drive.unconfirmed(), drive.poll_timeout()), (None, None));
    }

    #[test]
    fn it_is_wanted_until_it_is_confirmed() {
        let mut drive = Standstill::default();
        drive.want(at(0), Braking::Full);
        let mut now = at(0);
        for _ in 0..50 {
            assert_eq!(drive.poll_transmit(now), Some(Braking::Full));
            drive.handle_outcome(now, Err("no answer".to_owned()));
            assert_eq!(drive.poll_transmit(now), None, "the node can be asked something else");
            now = drive.poll_timeout().unwrap();
            assert_eq!(drive.unconfirmed(), Some(Unconfirmed { since: at(0), why: Some("no answer".to_owned()) }));
        }
        assert!(drive.poll_transmit(now).is_some());
        drive.handle_outcome(now, Ok(()));
        assert_eq!(drive.unconfirmed(), None);
    }

    #[test]
    fn a_press_in_a_pause_is_sent_at_once() {
        let mut drive = Standstill::default();
        drive.want(at(0), Braking::Programmed);
        drive.poll_transmit(at(0));
        drive.handle_outcome(at(10), Err(String::new()));
        assert_eq!(drive.poll_transmit(at(11)), None);
        drive.want(at(11), Braking::Programmed);
        assert_eq!(drive.poll_transmit(at(11)), Some(Braking::Programmed));
        assert_eq!(drive.unconfirmed().unwrap().since, at(0));
    }

    #[test]
    fn a_quick_stop_follows_a_stop_under_way_and_a_stop_adds_nothing_to_a_quick_stop() {
        let mut drive = Standstill::default();
        drive.want(at(0), Braking::Programmed);
        drive.poll_transmit(at(0));
        drive.want(at(1), Braking::Full);
        drive.handle_outcome(at(2), Ok(()));
        assert_eq!(drive.poll_transmit(at(2)), Some(Braking::Full));
        drive.want(at(3), Braking::Programmed);
        drive.handle_outcome(at(4), Ok(()));
        assert_eq!((drive.poll_transmit(at(9)), drive.unconfirmed()), (None, None));
    }

    #[test]
    fn an_outcome_that_nobody_waits_for_changes_nothing() {
        let mut drive = Standstill::default();
        drive.handle_outcome(at(0), Err(String::new()));
        assert_eq!((drive.poll_transmit(at(0)), drive.unconfirmed()), (None, None));
    }
}
