//! The task that owns the link and the manager.

use std::boxed::Box;
use std::sync::{Arc, OnceLock};
use std::vec::Vec;

use tokio::sync::{broadcast, mpsc, oneshot};

use super::command::{Command, Event};
use super::outgoing::{Outgoing, tell};
use super::readiness::Readiness;
use super::transfers::Transfers;
use crate::frame::Frame;
use crate::host::audience::Audience;
use crate::host::boot::{Kept, NotReady, is_booting};
use crate::host::pump::{Backlog, MOST_SENT};
use crate::host::{Incoming, Link, LinkError};
use crate::manager::{self, Manager, NetworkEvent};
use crate::time::Instant;

/// How many frames are taken before commands are looked at again, and other tasks have their turn.
const MOST_TAKEN: usize = 256;

/// How many commands are obeyed before the link is looked at again: as many as wait at most.
const MOST_OBEYED: usize = 64;

/// What the task runs.
pub(super) struct Owner<L: Link> {
    link: L,
    readiness: Readiness,
    manager: Box<Manager<127>>,
    kept: Option<Kept>,
    /// Who waits for the network to be ready.
    booting: Option<oneshot::Sender<Result<(), NotReady>>>,
    transfers: Transfers,
    outgoing: Outgoing,
    backlog: Backlog,
    audience: Audience,
    events: broadcast::Sender<Event>,
    inbox: mpsc::Receiver<Command>,
    posted: mpsc::Receiver<Frame>,
    /// Calls that wait for a time.
    alarms: Vec<(Instant, oneshot::Sender<Instant>)>,
    /// There may be more to receive or to send than was done at once.
    more: bool,
}

/// What was taken is sent, however the task ends: it may be what stops a machine. For room, all of it together waits
/// as long as one frame does.
impl<L: Link> Drop for Owner<L> {
    fn drop(&mut self) {
        let mut is_full = false;
        let mut send = |link: &mut L, frame: Frame, reply| {
            let outcome = if is_full { link.try_send(&frame) } else { link.send(&frame) };
            is_full |= matches!(outcome, Err(LinkError::Full));
            tell(reply, outcome);
        };
        while let Ok(frame) = self.posted.try_recv() {
            send(&mut self.link, frame, None);
        }
        for (frame, reply) in self.outgoing.take() {
            send(&mut self.link, frame, reply);
        }
        while let Ok(command) = self.inbox.try_recv() {
            if let Command::Send(frame, reply) = command {
                send(&mut self.link, frame, Some(reply));
            }
        }
    }
}

impl<L: Link> Owner<L> {
    pub(super) fn new(
        link: L,
        inbox: mpsc::Receiver<Command>,
        posted: mpsc::Receiver<Frame>,
        events: broadcast::Sender<Event>,
    ) -> std::io::Result<Self> {
        Ok(Owner {
            readiness: Readiness::of(&link)?,
            link,
            manager: Box::default(),
            kept: None,
            booting: None,
            transfers: Transfers::default(),
            outgoing: Outgoing::default(),
            backlog: Backlog::default(),
            audience: Audience::default(),
            events,
            inbox,
            posted,
            alarms: Vec::new(),
            // The link may have read something already.
            more: true,
        })
    }

    /// Runs until the last handle is dropped, or until the link is gone for good: that is what is written to `failure`.
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

    /// Waits for what is next, and does it; `false` when nobody has a handle any more.
    async fn turn(&mut self) -> Result<bool, LinkError> {
        let now = self.link.now();
        self.transmit(now);
        let deadline = self.poll_timeout();
        tokio::select! {
            Some(frame) = self.posted.recv() => self.outgoing.post(&mut self.link, frame),
            command = self.inbox.recv(), if self.outgoing.is_free() => match command {
                Some(command) => self.obey_all(command),
                None => return Ok(false),
            },
            () = self.readiness.wait(now, deadline), if !self.more => {}
            () = tokio::task::yield_now(), if self.more => {}
        }
        // Before a request is sent whose answer must be heard.
        self.audience.follow(&self.manager, &mut self.link)?;
        self.listen()?;
        self.readiness.follow(&self.link)?;
        Ok(true)
    }

    /// Does what was asked for by now: on the virtual bus each turn takes time.
    fn obey_all(&mut self, first: Command) {
        self.obey(first);
        for _ in 1..MOST_OBEYED {
            if !self.outgoing.is_free() {
                return;
            }
            let Ok(command) = self.inbox.try_recv() else { return };
            self.obey(command);
        }
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Tell(what) => {
                what(&mut self.manager, self.link.now());
                self.audience.doubt();
                self.transfers.restart_lost(&mut self.manager, &mut self.audience, self.link.now());
            }
            Command::Send(frame, reply) => self.outgoing.send(&mut self.link, frame, Some(reply)),
            Command::Transfer(node, transfer) => {
                let now = self.link.now();
                self.audience.include(node, &mut self.manager, now);
                self.transfers.hold(node, is_booting(self.kept.as_ref(), node));
                self.transfers.add(node, transfer, &mut self.manager, now);
            }
            Command::Boot(plan, boot_time, reply) => {
                let now = self.link.now();
                let kept = self.kept.insert(Kept::new(*plan));
                for node in kept.network.nodes() {
                    self.audience.include(node, &mut self.manager, now);
                }
                kept.network.start(now, boot_time);
                self.booting = Some(reply);
            }
            Command::Listen(others) => self.audience.choose(others),
            Command::Alarm(at, reply) => {
                let now = self.link.now();
                self.alarms.push((at, reply));
                self.ring(now);
            }
        }
    }

    fn transmit(&mut self, now: Instant) {
        while let Ok(frame) = self.posted.try_recv() {
            self.outgoing.post(&mut self.link, frame);
        }
        self.outgoing.retry(&mut self.link);
        for _ in 0..MOST_SENT {
            if !self.outgoing.is_free() {
                return;
            }
            let frame = self.manager.poll_transmit(now, &mut self.transfers);
            let kept = || self.kept.as_mut()?.network.poll_transmit(now);
            let Some(frame) = frame.or_else(kept) else { return };
            self.outgoing.send(&mut self.link, frame, None);
        }
        self.more = true;
    }

    /// Takes what has come by now, but not so much that a flood holds up the rest.
    fn listen(&mut self) -> Result<(), LinkError> {
        let mut until = self.link.now();
        // Time does not pass while there is something to do.
        if !self.more {
            let latest = self.readiness.until(until);
            until = self.poll_timeout().map_or(latest, |deadline| deadline.min(latest));
        }
        self.more = true;
        for _ in 0..MOST_TAKEN {
            let incoming = self.link.receive(until)?;
            let now = self.link.now();
            self.backlog.note(now, incoming.is_some());
            match incoming {
                Some(Incoming::Frame(frame)) => {
                    let event = self.manager.handle_frame(now, &frame, &mut self.transfers);
                    self.tell(now, event);
                    let event = self.kept.as_mut().and_then(|kept| kept.network.handle_frame(now, &frame));
                    self.tell_network(now, event);
                    self.transmit(now);
                }
                // Nobody may be listening.
                Some(Incoming::State(state)) => drop(self.events.send(Event::Bus(state))),
                Some(Incoming::Gap(frames)) => drop(self.events.send(Event::Gap(frames))),
                None => self.more = false,
            }
            self.expire();
            if !self.more {
                break;
            }
        }
        Ok(())
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let kept = self.kept.as_ref().and_then(|kept| kept.network.poll_timeout());
        let shell = [self.outgoing.poll_timeout(), self.next_alarm(), self.transfers.poll_timeout()];
        shell.into_iter().chain([self.manager.poll_timeout(), kept]).flatten().min()
    }

    fn next_alarm(&self) -> Option<Instant> {
        self.alarms.iter().map(|(at, _)| *at).min()
    }

    /// Replies to the calls whose time has come, and forgets those that were dropped.
    fn ring(&mut self, now: Instant) {
        let due = |(at, reply): &mut (Instant, oneshot::Sender<Instant>)| *at <= now || reply.is_closed();
        for (_, reply) in self.alarms.extract_if(.., due) {
            // The call may have been dropped.
            let _ = reply.send(now);
        }
    }

    /// Does what is due.
    fn expire(&mut self) {
        while let Some(now) = self.backlog.due(|| self.manager.poll_timeout()) {
            let event = self.manager.handle_timeout(now);
            self.tell(now, event);
        }
        while let Some(now) = self.backlog.due(|| self.kept.as_ref()?.network.poll_timeout()) {
            let event = self.kept.as_mut().and_then(|kept| kept.network.handle_timeout(now));
            self.tell_network(now, event);
        }
        if let Some(now) = self.backlog.due(|| self.transfers.poll_timeout()) {
            self.transfers.expire(&mut self.manager, now);
        }
        if let Some(now) = self.backlog.due(|| self.next_alarm()) {
            self.ring(now);
        }
    }

    fn tell_network(&mut self, now: Instant, event: Option<NetworkEvent>) {
        let (Some(event), Some(kept)) = (event, &mut self.kept) else { return };
        let end = kept.follow(event);
        drop(self.events.send(Event::Manager(manager::Event::Network(event))));
        // Behind its event, so that who waits for it has heard all.
        if let Some(end) = end {
            self.booting.take().into_iter().for_each(|reply| drop(reply.send(end.clone())));
        }
        if let NetworkEvent::Booted(node) | NetworkEvent::Failed { node, .. } | NetworkEvent::Lost { node, .. } = event
        {
            self.transfers.hold(node, is_booting(self.kept.as_ref(), node));
            self.transfers.begin(node, &mut self.manager, now);
        }
    }

    fn tell(&mut self, now: Instant, event: Option<manager::Event>) {
        match event {
            Some(manager::Event::Sdo { node, event }) => {
                self.transfers.hold(node, is_booting(self.kept.as_ref(), node));
                self.transfers.end(node, event, &mut self.manager, now);
            }
            Some(event) => drop(self.events.send(Event::Manager(event))),
            None => {}
        }
    }
}
