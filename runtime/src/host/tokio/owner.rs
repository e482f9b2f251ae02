//! The task that owns the link and the manager.

use std::boxed::Box;
use std::sync::{Arc, OnceLock};
use std::vec::Vec;

use tokio::sync::mpsc::error::TryRecvError;
use tokio::sync::{broadcast, mpsc, oneshot};

use super::outgoing::{Outgoing, Reply, reply_to};
use super::transfers::{Transfer, Transfers};
use super::wait::Wait;
use crate::frame::Frame;
use crate::host::boot::{Kept, NotReady, Plan, is_booting};
use crate::host::filter::FrameFilter;
use crate::host::pump::{Backlog, MOST_SENT};
use crate::host::{BusState, Incoming, Link, LinkError, trace};
use crate::id::{CobId, NodeId};
use crate::manager::{self, Manager, NetworkEvent};
use crate::time::{Duration, Instant, earliest};

/// How many frames are received before requests are handled again, and other tasks have their turn.
const MOST_RECEIVED: usize = 256;

/// How many requests are handled before frames are received again: as many as wait at most.
const MOST_REQUESTS: usize = 64;

/// An event of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// An event of the manager.
    Manager(manager::Event),
    /// The bus is in another state.
    Bus(BusState),
    /// This many frames are missing here: see [`Incoming::Gap`].
    Gap(u32),
}

/// What a handle asks the task for.
pub(super) enum Request {
    Transfer(NodeId, Transfer),
    Send(Frame, Reply),
    WithManager(WithManager),
    Boot(Box<Plan>, Duration, oneshot::Sender<Result<(), NotReady>>),
    Listen(Option<Vec<CobId>>),
    /// Reply at this time.
    Alarm(Instant, oneshot::Sender<Instant>),
}

pub(super) type WithManager = Box<dyn FnOnce(&mut Manager<127>, Instant) + Send>;

/// The state of the task.
pub(super) struct Owner<L: Link> {
    link: L,
    wait: Wait,
    /// The clock was read last then.
    now: Instant,
    manager: Box<Manager<127>>,
    kept: Option<Kept>,
    /// The call that waits for the network to be ready.
    booting: Option<oneshot::Sender<Result<(), NotReady>>>,
    transfers: Transfers,
    outgoing: Outgoing,
    backlog: Backlog,
    filter: FrameFilter,
    events: broadcast::Sender<Event>,
    requests: mpsc::Receiver<Request>,
    posted: mpsc::Receiver<Frame>,
    /// Calls that wait for a time.
    alarms: Vec<(Instant, oneshot::Sender<Instant>)>,
    /// There may be more to receive or to send, so the task does not wait.
    has_more: bool,
}

/// Frames that the task has accepted are sent, however it ends: one may stop a machine. All of them together
/// wait for room no longer than one frame would.
impl<L: Link> Drop for Owner<L> {
    fn drop(&mut self) {
        let mut is_full = false;
        let mut send = |link: &mut L, frame: Frame, reply| {
            let outcome = if is_full { link.try_send(&frame) } else { link.send(&frame) };
            is_full |= matches!(outcome, Err(LinkError::Full));
            reply_to(reply, outcome);
        };
        while let Ok(frame) = self.posted.try_recv() {
            send(&mut self.link, frame, None);
        }
        for (frame, reply) in self.outgoing.take() {
            send(&mut self.link, frame, reply);
        }
        while let Ok(request) = self.requests.try_recv() {
            if let Request::Send(frame, reply) = request {
                send(&mut self.link, frame, Some(reply));
            }
        }
    }
}

impl<L: Link> Owner<L> {
    pub(super) fn new(
        link: L,
        requests: mpsc::Receiver<Request>,
        posted: mpsc::Receiver<Frame>,
        events: broadcast::Sender<Event>,
    ) -> std::io::Result<Self> {
        Ok(Owner {
            wait: Wait::new(&link)?,
            now: link.now(),
            filter: FrameFilter::new(&link),
            link,
            manager: Box::default(),
            kept: None,
            booting: None,
            transfers: Transfers::default(),
            outgoing: Outgoing::default(),
            backlog: Backlog::default(),
            events,
            requests,
            posted,
            alarms: Vec::new(),
            // The link may have read something already.
            has_more: true,
        })
    }

    /// Runs until the last handle is dropped, or until the link is gone for good, which is written to `failure`.
    pub(super) async fn run(mut self, failure: Arc<OnceLock<LinkError>>) {
        loop {
            match self.turn().await {
                Ok(true) => {}
                Ok(false) => return,
                // Before the calls are dropped that wait for an answer.
                Err(error) => return drop(failure.set(error)),
            }
        }
    }

    /// Waits for a request, a frame or a deadline, and handles it. Returns `false` when the last handle is dropped.
    ///
    /// An answer takes two turns, and each of them reads the clock once: one handles the request of a handle and sends that to the node,
    /// the other one receives.
    async fn turn(&mut self) -> Result<bool, LinkError> {
        let deadline = self.poll_timeout();
        let mut receives = self.has_more;
        let mut first = None;
        // The link first, so that requests hold up neither frames nor deadlines: they are handled in either case.
        tokio::select! {
            biased;
            () = self.wait.for_link(self.now, deadline), if !self.has_more => receives = true,
            () = tokio::task::yield_now(), if self.has_more => {}
            Some(frame) = self.posted.recv() => self.outgoing.post(&mut self.link, frame),
            request = self.requests.recv(), if self.outgoing.is_free() => match request {
                Some(request) => first = Some(request),
                None => return Ok(false),
            },
        }
        match self.handle_all(first) {
            Handled::None => {}
            Handled::Some => {
                // Before a request is sent, so that its answer is received.
                self.filter.apply(&self.manager, &mut self.link)?;
                self.has_more |= !self.transmit();
            }
            Handled::Closed => return Ok(false),
        }
        if receives {
            self.receive()?;
        }
        self.filter.apply(&self.manager, &mut self.link)?;
        self.wait.update(&self.link)?;
        Ok(true)
    }

    /// Handles the requests that wait, at most 64.
    fn handle_all(&mut self, first: Option<Request>) -> Handled {
        let mut first = first;
        for count in 0..MOST_REQUESTS {
            // A frame that waits for room holds up all requests.
            let next = match first.take() {
                Some(request) => Ok(request),
                None if self.outgoing.is_free() => self.requests.try_recv(),
                None => Err(TryRecvError::Empty),
            };
            match next {
                Ok(request) => {
                    if count == 0 {
                        self.now = self.link.now();
                        self.send_posted();
                    }
                    self.handle(request);
                }
                Err(_) if count > 0 => return Handled::Some,
                Err(TryRecvError::Disconnected) => return Handled::Closed,
                Err(TryRecvError::Empty) => return Handled::None,
            }
        }
        Handled::Some
    }

    fn handle(&mut self, request: Request) {
        match request {
            Request::WithManager(what) => {
                what(&mut self.manager, self.now);
                // It may have taken long.
                self.now = self.link.now();
                self.filter.invalidate();
                self.transfers.restart_lost(&mut self.manager, &mut self.filter, self.now);
            }
            Request::Send(frame, reply) => self.outgoing.send(&mut self.link, self.now, frame, Some(reply)),
            Request::Transfer(node, transfer) => {
                self.filter.include(node, &mut self.manager, self.now);
                self.transfers.hold(node, is_booting(self.kept.as_ref(), node));
                self.transfers.add(node, transfer, &mut self.manager, self.now);
            }
            Request::Boot(plan, boot_time, reply) => {
                let kept = self.kept.insert(Kept::new(*plan));
                for node in kept.network.nodes() {
                    self.filter.include(node, &mut self.manager, self.now);
                }
                kept.network.start(self.now, boot_time);
                self.booting = Some(reply);
            }
            Request::Listen(others) => self.filter.choose(others),
            Request::Alarm(at, reply) => {
                self.alarms.push((at, reply));
                self.ring(self.now);
            }
        }
    }

    fn send_posted(&mut self) {
        while let Ok(frame) = self.posted.try_recv() {
            self.outgoing.post(&mut self.link, frame);
        }
    }

    /// Sends what is to be sent, at most four frames. Returns whether that was all, or the rest waits for room.
    fn transmit(&mut self) -> bool {
        self.send_posted();
        self.outgoing.retry(&mut self.link, self.now);
        for _ in 0..MOST_SENT {
            if !self.outgoing.is_free() {
                return true;
            }
            let frame = self.manager.poll_transmit(self.now, &mut self.transfers);
            let kept = || self.kept.as_mut()?.network.poll_transmit(self.now);
            let Some(frame) = frame.or_else(kept) else { return true };
            self.outgoing.send(&mut self.link, self.now, frame, None);
        }
        false
    }

    /// Handles the frames that have come by now and the deadlines, and sends what they lead to. A flood does not hold up
    /// the rest.
    fn receive(&mut self) -> Result<(), LinkError> {
        let until = match self.has_more {
            // With work left, no time has been waited.
            true => self.link.now(),
            false => {
                let latest = self.wait.patience(&self.link);
                self.poll_timeout().map_or(latest, |deadline| deadline.min(latest))
            }
        };
        self.has_more = true;
        for _ in 0..MOST_RECEIVED {
            let incoming = self.link.receive_at(self.now, until)?;
            self.now = self.link.now();
            trace::received(self.now, incoming.as_ref());
            let may_have_more = incoming.is_some() && !self.link.is_drained();
            self.backlog.note(self.now, may_have_more);
            match incoming {
                Some(Incoming::Frame(frame)) => {
                    let event = self.manager.handle_frame(self.now, &frame, &mut self.transfers);
                    self.report(event);
                    let event = self.kept.as_mut().and_then(|kept| kept.network.handle_frame(self.now, &frame));
                    self.report_network(event);
                }
                // There may be no listener.
                Some(Incoming::State(state)) => drop(self.events.send(Event::Bus(state))),
                Some(Incoming::Gap(frames)) => drop(self.events.send(Event::Gap(frames))),
                None => {}
            }
            self.expire();
            let has_sent_all = self.transmit();
            if !may_have_more {
                self.has_more = !has_sent_all;
                break;
            }
        }
        Ok(())
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let kept = self.kept.as_ref().and_then(|kept| kept.network.poll_timeout());
        let [outgoing, transfers] = [self.outgoing.poll_timeout(), self.transfers.poll_timeout()];
        earliest([outgoing, self.next_alarm(), transfers, self.manager.poll_timeout(), kept])
    }

    fn next_alarm(&self) -> Option<Instant> {
        self.alarms.iter().map(|(at, _)| *at).min()
    }

    /// Replies to the calls whose time has come, and removes those that were dropped.
    fn ring(&mut self, now: Instant) {
        let due = |(at, reply): &mut (Instant, oneshot::Sender<Instant>)| *at <= now || reply.is_closed();
        for (_, reply) in self.alarms.extract_if(.., due) {
            // The call may have been dropped.
            let _ = reply.send(now);
        }
    }

    /// Handles the deadlines that have come, right after a look at the link.
    fn expire(&mut self) {
        while self.backlog.is_due(|| self.manager.poll_timeout()) {
            let event = self.manager.handle_timeout(self.now);
            self.report(event);
        }
        while self.backlog.is_due(|| self.kept.as_ref()?.network.poll_timeout()) {
            let event = self.kept.as_mut().and_then(|kept| kept.network.handle_timeout(self.now));
            self.report_network(event);
        }
        if self.backlog.is_due(|| self.transfers.poll_timeout()) {
            self.transfers.expire(&mut self.manager, self.now);
        }
        if self.backlog.is_due(|| self.next_alarm()) {
            self.ring(self.now);
        }
    }

    fn report_network(&mut self, event: Option<NetworkEvent>) {
        let (Some(event), Some(kept)) = (event, &mut self.kept) else { return };
        let end = kept.follow(event);
        trace::event(self.now, &manager::Event::Network(event));
        drop(self.events.send(Event::Manager(manager::Event::Network(event))));
        // After the event of the end, so that the caller that waits for the boot has received all events by then.
        if let Some(end) = end {
            self.booting.take().into_iter().for_each(|reply| drop(reply.send(end.clone())));
        }
        if let NetworkEvent::Booted(node) | NetworkEvent::Failed { node, .. } | NetworkEvent::Lost { node, .. } = event
        {
            self.transfers.hold(node, is_booting(self.kept.as_ref(), node));
            self.transfers.begin(node, &mut self.manager, self.now);
        }
    }

    fn report(&mut self, event: Option<manager::Event>) {
        if let Some(event) = &event {
            trace::event(self.now, event);
        }
        match event {
            Some(manager::Event::Sdo { node, event }) => {
                self.transfers.hold(node, is_booting(self.kept.as_ref(), node));
                self.transfers.end(node, event, &mut self.manager, self.now);
            }
            Some(event) => drop(self.events.send(Event::Manager(event))),
            None => {}
        }
    }
}

enum Handled {
    None,
    Some,
    /// All handles are dropped.
    Closed,
}
