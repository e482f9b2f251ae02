//! A timer that stays set: mostly one waits for a frame, and for its absence only in the distance.

use std::boxed::Box;
use std::pin::Pin;

use tokio::time::Sleep;

use crate::time::{Duration, Instant};

#[derive(Default)]
pub(super) struct Alarm(Option<(Instant, Pin<Box<Sleep>>)>);

impl Alarm {
    /// Rings at `deadline`, or after `at_most`; perhaps before, but not at once again and again.
    pub(super) async fn ring(&mut self, now: Instant, deadline: Option<Instant>, at_most: Duration) {
        // A deadline at the end of time never comes.
        let deadline = deadline.filter(|deadline| *deadline < Instant::MAX);
        let span = deadline.map_or(at_most, |deadline| deadline.since(now).min(at_most));
        let at = now + span;
        if self.0.as_ref().is_none_or(|(set, _)| *set > at) {
            self.0 = Some((at, Box::pin(tokio::time::sleep(span.into()))));
        }
        if let Some((_, sleep)) = &mut self.0 {
            sleep.await;
        }
        self.0 = None;
    }
}
