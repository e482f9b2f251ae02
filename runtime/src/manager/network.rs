//! Booting a network: all nodes that belong to it, in parallel, and again when one comes back
//! (CiA 302-2, 6.3).

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

/// Boots and keeps up a network of up to `NODES` nodes, each with its configuration as a `C`: `&[u8]`, `Vec<u8>`.
#[derive(Clone, Debug)]
pub struct Network<C, const NODES: usize> {
    members: Table<Member<C>, NODES>,
    on_loss: OnLoss,
    outbox: Outbox,
    deadline: Option<Instant>,
    ready: bool,
    /// Nodes are not started one by one.
    start_all: bool,
    /// No node is started yet: some mandatory one cannot be.
    held: bool,
    /// All nodes were stopped because of a loss, and stay so until the next start.
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

    /// Starts the nodes by one command to all of them, when the mandatory ones can be started. Those that boot later
    /// are started then.
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

    /// Resets the communication of all nodes but those that [run on](crate::procedure::BootPlan::keep_alive), and boots
    /// them. The mandatory ones must boot within `boot_time`; zero: whenever they do.
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

    /// Boots a node again that is not booted without asking, or did not boot.
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

    /// Whether a node is being booted, over the same SDO channel that others use to reach it.
    #[must_use]
    pub fn is_booting(&self, node: NodeId) -> bool {
        self.members.get(node).is_some_and(Member::is_booting)
    }

    /// The mandatory nodes that have not booted.
    pub fn missing(&self) -> impl Iterator<Item = NodeId> + '_ {
        self.members.iter().filter(|member| member.is_missing()).map(Member::node)
    }

    /// Whether a mandatory node has failed or is lost, and no other one is being booted: the network does not get ready
    /// before a node boots up by itself, or is [booted](Network::boot) again.
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

    /// Does what is due. Several deadlines may be due at once: call it while `poll_timeout() <= now`.
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

    /// Whether the nodes have waited for each other, and need to no longer.
    fn is_releasable(&self) -> bool {
        self.held && self.members.marked(member::AWAITED).is_empty()
    }

    /// Starts the nodes that have waited for the others: by one command to all nodes only if all can be started, since it
    /// would also reach nodes that are being configured.
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
                    // The others have been reset already when it was lost before it has booted.
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
        // Commands that were not sent yet are no longer wanted.
        self.members.change_all(Member::stop);
        self.outbox = Outbox::new();
        let _ = self.outbox.command(NmtCommand::Stop, None);
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if let Some(frame) = self.outbox.poll_transmit(now) {
            if frame == (NmtMessage { command: NmtCommand::ResetCommunication, node: None }.frame()) {
                // What came while the reset waited for being sent was from before it.
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
