//! The manager's side of one drive, without I/O: the four verbs, and a sequence that is under way.

use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll, Waker};

use lexican_runtime::service::sdo_client::{Event, Scalar, SdoClient};
use lexican_runtime::wire::emcy::{CodeOrder, Emergency};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, CobId, Frame, Instant, NodeId};

use super::description::Description;
use super::desk::Desk;
use crate::od;

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
        let mut shared = self.desk.lock();
        shared.now = now;
        shared.access = None;
        shared.answer = None;
        shared.restarted = false;
        drop(shared);
        self.sdo.abort(AbortCode::GENERAL);
    }

    /// Lets a sequence go on as far as it can.
    pub fn poll<F: Future>(&mut self, now: Instant, sequence: Pin<&mut F>) -> Poll<F::Output> {
        {
            let mut shared = self.desk.lock();
            shared.now = now;
            shared.wake = None;
        }
        // Nobody needs to be woken: whoever calls this knows when something has happened.
        sequence.poll(&mut Context::from_waker(Waker::noop()))
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let id = frame.id();
        let of = |base| id == CobId::of_node(base, self.node);
        if frame.is_remote() {
            return;
        }
        if of(0x180) || of(0x380) || of(0x480) {
            // All three carry the status word first.
            if let Ok(pdo) = od::Tpdo1::unpack(frame.data()) {
                self.desk.lock().saw_status(pdo.statusword.0);
            }
        } else if of(0x080) {
            if let Some(emergency) = Emergency::parse(frame.data(), CodeOrder::LowByteFirst) {
                self.desk.lock().emergency = Some(emergency.code.0);
            }
        } else if of(0x700) {
            if ErrorControl::parse(frame.data()).is_some_and(|control| control.state == NmtState::Initialising) {
                let mut shared = self.desk.lock();
                shared.restarted = true;
                shared.moving = false;
                shared.running = false;
            }
        } else {
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
