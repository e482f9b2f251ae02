//! Booting a network: all its nodes in parallel, and again those that come back (CiA 302-2, 6.3).

use super::assignment::{Assignment, OnLoss};
use super::error::Full;
use super::event::NetworkEvent;
use super::member::{self, Loss, Member, Report};
use super::places::Place;
use super::table::{Entry as _, Table};
use crate::frame::Frame;
use crate::id::NodeId;
use crate::service::nmt_manager::Outbox;
use crate::time::{Duration, Instant, earliest};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtCommand, NmtMessage};

/// Boots and keeps up a network of up to `NODES` nodes, each with a configuration of type `C`: `&[u8]`, `Vec<u8>`.
#[derive(Clone, Debug)]
pub struct Network<C, const NODES: usize> {
    members: Table<Member<C>, NODES>,
    on_loss: OnLoss,
    outbox: Outbox,
    deadline: Option<Instant>,
    ready: bool,
    /// Whether the nodes are started together, and not one by one.
    start_all: bool,
    /// Whether no node is started yet, because some mandatory one cannot be.
    held: bool,
    /// Whether all nodes were stopped because of a loss, until the next start.
    stopped: bool,
}

impl<C: AsRef<[u8]> + Clone, const NODES: usize> Network<C, NODES> {
    /// A network without nodes.
    #[must_use]
    pub const fn new(on_loss: OnLoss) -> Self {
        Network {
            members: Table::new(),
            on_loss,
            outbox: Outbox::new(),
            deadline: None,
            ready: false,
            start_all: false,
            held: false,
            stopped: false,
        }
    }

    /// Starts the nodes by one command to all of them, once the mandatory ones can be started. Nodes that boot later
    /// are started one by one.
    #[must_use]
    pub fn with_start_of_all(self, start_all: bool) -> Self {
        Network { start_all, ..self }
    }

    /// Adds a node.
    pub fn assign(&mut self, node: NodeId, assignment: Assignment<C>) -> Result<(), Full> {
        self.members.insert(Member::new(node, assignment))
    }

    /// The nodes that belong to the network.
    pub fn nodes(&self) -> impl Iterator<Item = NodeId> + '_ {
        self.members.iter().map(Member::node)
    }

    /// Resets the communication of all nodes, except those that [keep running](crate::procedure::BootPlan::keep_alive),
    /// and boots them. The mandatory ones must boot within `boot_time`; zero means no limit.
    pub fn start(&mut self, now: Instant, boot_time: Duration) {
        self.members.change_all(Member::forgive);
        self.restart(now, boot_time);
    }

    fn restart(&mut self, now: Instant, boot_time: Duration) {
        self.outbox = Outbox::new();
        // The outbox was just emptied.
        let spared = self.members.iter().any(Member::is_kept_alive);
        if !spared {
            let _ = self.outbox.command(NmtCommand::ResetCommunication, None);
        }
        self.ready = false;
        self.stopped = false;
        self.held = self.start_all;
        self.deadline = if boot_time.is_zero() { None } else { Some(now + boot_time) };
        let held = self.held;
        self.members.change_all(|member| member.start(held, spared));
    }

    /// Boots a node that is not booted by itself, or has failed to boot.
    pub fn boot(&mut self, node: NodeId) {
        if let Some(place) = self.members.place(node).filter(|_| !self.stopped) {
            self.members.change(place, |member| member.boot(self.held));
        }
    }

    /// Whether all mandatory nodes have booted.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.members.marked(member::MISSING).is_empty()
    }

    /// Whether a node has booted.
    #[must_use]
    pub fn has_booted(&self, node: NodeId) -> bool {
        self.members.get(node).is_some_and(Member::has_booted)
    }

    /// Whether a node is being booted, which occupies its SDO channel.
    #[must_use]
    pub fn is_booting(&self, node: NodeId) -> bool {
        self.members.get(node).is_some_and(Member::is_booting)
    }

    /// The mandatory nodes that have not booted.
    pub fn missing(&self) -> impl Iterator<Item = NodeId> + '_ {
        self.members.iter().filter(|member| member.is_missing()).map(Member::node)
    }

    /// Whether a mandatory node has failed or is lost, and none is being booted: the network does not become ready
    /// until a node boots up by itself, or is [booted](Network::boot) again.
    #[must_use]
    pub fn is_stuck(&self) -> bool {
        let mut missing = self.members.iter().filter(|member| member.is_mandatory() && !member.is_startable());
        missing.next().is_some_and(|first| !first.is_booting()) && missing.all(|other| !other.is_booting())
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<NetworkEvent> {
        let (stopped, held) = (self.stopped, self.held);
        let place = match ErrorControl::node(frame.id()) {
            Some(node) => self.members.place(node)?,
            None => self.members.find(frame.id())?.0,
        };
        let report = self.members.change(place, |member| member.handle_frame(now, frame, stopped, held))??;
        self.handle_report(now, report)
    }

    /// Handles a deadline that has come. Several may be due at once: call it while `poll_timeout() <= now`.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<NetworkEvent> {
        if self.is_releasable() {
            self.release(now);
        }
        if self.is_ready() != self.ready {
            self.ready = !self.ready;
            if self.ready {
                self.deadline = None;
                return Some(NetworkEvent::Ready);
            }
        }
        if self.deadline.take_if(|deadline| *deadline <= now).is_some() {
            return Some(NetworkEvent::BootTimeElapsed);
        }
        let (stopped, held) = (self.stopped, self.held);
        let report = self.members.handle_timeout(now, |member| member.handle_timeout(now, stopped, held))?;
        self.handle_report(now, report)
    }

    /// Whether the nodes have waited for each other, and all may now start.
    fn is_releasable(&self) -> bool {
        self.held && self.members.marked(member::AWAITED).is_empty()
    }

    /// Starts the nodes that have waited for each other. One command to all is sent only if all can be started, since
    /// it would also reach nodes that are being configured.
    fn release(&mut self, now: Instant) {
        self.held = false;
        let at_once = self.members.iter().all(|member| member.is_startable() && member.is_to_be_started())
            && self.outbox.command(NmtCommand::Start, None).is_ok();
        self.members.change_all(|member| member.release(now, at_once));
    }

    fn handle_report(&mut self, now: Instant, report: Report) -> Option<NetworkEvent> {
        let (node, loss) = match report {
            Report::Event(event) => return Some(event),
            Report::Lost(node, loss) => (node, loss),
        };
        let place = self.members.place(node)?;
        let member = self.members.at(place)?;
        let (mandatory, had_booted) = (member.is_mandatory(), member.has_booted());
        self.members.change(place, |member| member.lose(now, loss == Loss::Silent));
        match self.on_loss {
            OnLoss::ResetAll if mandatory => match self.members.change(place, |member| member.attempt(now))? {
                Ok(()) => self.restart(now, Duration::ZERO),
                Err(until) => {
                    // If it was lost before it had booted, the others have been reset already.
                    if had_booted {
                        self.restart(now, Duration::ZERO);
                    }
                    self.members.change(place, |member| member.pause(until));
                }
            },
            OnLoss::StopAll if mandatory && !self.stopped => self.stop_all(),
            _ => {
                let (stopped, held) = (self.stopped, self.held);
                self.members.change(place, |member| member.recover(now, stopped, held));
            }
        }
        Some(NetworkEvent::Lost { node, mandatory })
    }

    fn stop_all(&mut self) {
        self.stopped = true;
        self.held = false;
        self.deadline = None;
        // Commands that were not sent yet are obsolete.
        self.members.change_all(Member::stop);
        self.outbox = Outbox::new();
        let _ = self.outbox.command(NmtCommand::Stop, None);
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if let Some(frame) = self.outbox.poll_transmit(now) {
            if frame == (NmtMessage { command: NmtCommand::ResetCommunication, node: None }.frame()) {
                // Frames that came before the reset was sent are from before it.
                self.members.change_all(Member::note_reset);
            }
            return Some(frame);
        }
        let mut sending = self.members.marked(member::SENDING).from(Place::FIRST);
        sending.find_map(|place| self.members.change(place, |member| member.poll_transmit(now))?)
    }

    /// When to call [`Network::handle_timeout`].
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.is_ready() != self.ready || self.is_releasable() {
            return Some(Instant::ZERO);
        }
        earliest([self.members.poll_timeout(), self.deadline])
    }
}
