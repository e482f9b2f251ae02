//! The manager's side of one drive, without I/O: the four verbs, and the sequence under way.

use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::task::Poll;

use lexican_runtime::host::StateMachine;
#[cfg(feature = "tokio")]
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::service::sdo_client::{Event, SdoClient};
use lexican_runtime::{AbortCode, Duration, Frame, Instant, NodeId};

#[cfg(feature = "tokio")]
use crate::context::Access;
use crate::context::{Bytes, DriveContext};
use crate::description::Description;
use crate::error::Error;
use crate::protection::{KeepAlive, Protection};

/// The state between a shell and one drive.
#[derive(Debug)]
pub struct Session {
    node: NodeId,
    context: DriveContext,
    sdo: SdoClient,
    payload: Bytes,
    protection: Protection,
    keep_alive: KeepAlive,
}

impl Session {
    /// A session with the drive at `node`.
    #[must_use]
    pub fn new(node: NodeId, description: &'static Description) -> Self {
        let context = DriveContext::new(node, description);
        let sdo = SdoClient::of_node(node);
        let (protection, keep_alive) = (Protection::None, KeepAlive::None);
        Session { node, context, sdo, payload: Bytes::of_text(), protection, keep_alive }
    }

    /// For a drive that answers and obeys later than on CAN, by this time: see
    /// [`Link::latency`](lexican_runtime::host::Link::latency).
    #[must_use]
    pub fn with_latency(self, latency: Duration) -> Self {
        self.context.lock().latency = latency;
        let timeout = self.sdo.timeout() + latency;
        Session { sdo: self.sdo.with_timeout(timeout), ..self }
    }

    /// The node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.node
    }

    /// The context in which sequences work.
    #[must_use]
    pub fn context(&self) -> DriveContext {
        self.context.clone()
    }

    /// How the drive notices that the driver is gone.
    #[must_use]
    pub fn protection(&self) -> Protection {
        self.protection
    }

    /// The protection to disarm when a shell drops the drive; `None` if it may move or a follower keeps it alive.
    pub(crate) fn lets_disarm(&self) -> Option<Protection> {
        let is_ours = !self.context.may_move() && !self.context.lock().is_handed_over;
        Some(self.protection).filter(|armed| is_ours && *armed != Protection::None)
    }

    /// From now on sends the signs of life of a drive that has been [protected](crate::sequence::protect).
    pub fn keep_alive(&mut self, now: Instant, protection: Protection) {
        self.protected(protection);
        self.keep_alive = KeepAlive::new(now, self.node, protection);
    }

    /// Notes how the drive is protected; something else sends the signs of life.
    pub(crate) fn protected(&mut self, protection: Protection) {
        self.protection = protection;
    }

    /// The result of an operation: an error becomes [`Error::MayBeMoving`] if the drive may still be moving.
    pub fn conclude<T>(&self, result: Result<T, Error>) -> Result<T, Error> {
        result.map_err(|error| {
            let moving = self.context.may_move() && !error.leaves_at_rest();
            if moving { Error::MayBeMoving { node: self.node, error: Box::new(error) } } else { error }
        })
    }

    /// Discards what the previous operation has left behind.
    pub fn begin(&mut self, now: Instant) {
        self.context.begin(now);
        self.sdo.abort(AbortCode::GENERAL);
    }

    /// Lets a sequence go on as far as it can.
    pub fn poll<F: Future>(&mut self, now: Instant, sequence: Pin<&mut F>) -> Poll<F::Output> {
        self.context.poll(now, sequence)
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.context.hear(frame) {
            // A restart has disarmed the drive.
            if self.protection != Protection::None && self.context.lock().restarted {
                self.keep_alive(now, Protection::None);
            }
        } else {
            let event = self.sdo.handle_frame(now, frame, &mut self.payload);
            self.follow(event);
        }
    }

    /// To be called once the time of [`Session::poll_timeout`] has come.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.keep_alive.handle_timeout(now);
        let event = self.sdo.handle_timeout(now);
        self.follow(event);
    }

    /// The next frame to send. Frames of a sequence leave before its SDO requests.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let order = self.context.lock().outbox.pop_front();
        if let Some(frame) = order.or_else(|| self.keep_alive.poll_transmit(now)) {
            return Some(frame);
        }
        let access = if self.sdo.is_busy() { None } else { self.context.lock().access.take() };
        if let Some(access) = access {
            self.payload = access.payload;
            let begun = if access.writes {
                self.sdo.write(now, access.address, access.payload.len())
            } else {
                self.sdo.read(now, access.address)
            };
            debug_assert!(begun.is_ok(), "the client was not busy");
        }
        self.sdo.poll_transmit(now, &mut self.payload)
    }

    /// The next frame of the sequence, for shells that do SDO transfers by themselves.
    #[cfg(feature = "tokio")]
    pub(crate) fn poll_order(&mut self) -> Option<Frame> {
        self.context.lock().outbox.pop_front()
    }

    /// The SDO access that the sequence waits for, for such shells.
    #[cfg(feature = "tokio")]
    pub(crate) fn poll_access(&mut self) -> Option<Access> {
        self.context.lock().access.take()
    }

    /// Takes the result of that access.
    #[cfg(feature = "tokio")]
    pub(crate) fn handle_answer(&mut self, answer: Result<Bytes, SdoError>) {
        self.context.lock().answer = Some(answer);
    }

    /// When to call [`Session::handle_timeout`] and poll the sequence again.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let wake = self.context.lock().wake;
        [wake, self.sdo.poll_timeout(), self.keep_alive.poll_timeout()].into_iter().flatten().min()
    }

    /// The next sign of life, for shells that have no operation under way.
    pub(crate) fn poll_keep_alive(&mut self, now: Instant) -> Option<Frame> {
        if self.keep_alive.poll_timeout().is_some_and(|deadline| deadline <= now) {
            self.keep_alive.handle_timeout(now);
        }
        self.keep_alive.poll_transmit(now)
    }

    /// When [`Session::poll_keep_alive`] has another frame.
    pub(crate) fn poll_keep_alive_timeout(&self) -> Option<Instant> {
        self.keep_alive.poll_timeout()
    }

    fn follow(&mut self, event: Option<Event>) {
        let answer = match event {
            Some(Event::Done { .. }) => Ok(self.payload),
            Some(Event::Failed(error)) => Err(error),
            None => return,
        };
        self.context.lock().answer = Some(answer);
    }
}

impl StateMachine for Session {
    type Event = Infallible;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Infallible> {
        self.handle_frame(now, frame);
        None
    }
    fn handle_timeout(&mut self, now: Instant) -> Option<Infallible> {
        self.handle_timeout(now);
        None
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        self.poll_transmit(now)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.poll_timeout()
    }
}
