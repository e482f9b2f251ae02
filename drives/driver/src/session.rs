//! The manager's side of one drive, without I/O: the four verbs, and a sequence that is under way.

use std::future::Future;
use std::pin::Pin;
use std::task::Poll;

use lexican_runtime::service::sdo_client::{Event, Scalar, SdoClient};
use lexican_runtime::{AbortCode, Frame, Instant, NodeId};

use crate::description::Description;
use crate::desk::Desk;

/// What happens between a shell and one drive.
#[derive(Debug)]
pub struct Session {
    node: NodeId,
    desk: Desk,
    sdo: SdoClient,
    payload: Scalar,
}

impl Session {
    /// A session with the drive at `node`.
    #[must_use]
    pub fn new(node: NodeId, description: &'static Description) -> Self {
        let desk = Desk::new(node, description);
        Session { node, desk, sdo: SdoClient::of_node(node), payload: Scalar::default() }
    }

    /// The node-ID.
    #[must_use]
    pub fn node(&self) -> NodeId {
        self.node
    }

    /// The desk at which sequences work.
    #[must_use]
    pub fn desk(&self) -> Desk {
        self.desk.clone()
    }

    /// Forgets what an operation before has left behind.
    pub fn begin(&mut self, now: Instant) {
        self.desk.begin(now);
        self.sdo.abort(AbortCode::GENERAL);
    }

    /// Lets a sequence go on as far as it can.
    pub fn poll<F: Future>(&mut self, now: Instant, sequence: Pin<&mut F>) -> Poll<F::Output> {
        self.desk.poll(now, sequence)
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if !self.desk.hear(frame) {
            let event = self.sdo.handle_frame(now, frame, &mut self.payload);
            self.follow(event);
        }
    }

    /// Takes note that a deadline has come.
    pub fn handle_timeout(&mut self, now: Instant) {
        let event = self.sdo.handle_timeout(now);
        self.follow(event);
    }

    /// The next frame to send. What a sequence sends, leaves before what it asks for.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let access = {
            let mut shared = self.desk.lock();
            if let Some(frame) = shared.outbox.pop_front() {
                return Some(frame);
            }
            if self.sdo.is_busy() { None } else { shared.access.take() }
        };
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

    /// When to call [`Session::handle_timeout`] and poll the sequence again.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let wake = self.desk.lock().wake;
        [wake, self.sdo.poll_timeout()].into_iter().flatten().min()
    }

    fn follow(&mut self, event: Option<Event>) {
        let answer = match event {
            Some(Event::Done { .. }) => Ok(self.payload),
            Some(Event::Failed(error)) => Err(error),
            None => return,
        };
        self.desk.lock().answer = Some(answer);
    }
}
