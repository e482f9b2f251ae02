//! Booting a network: all nodes that belong to it, in parallel, and again when one comes back
//! (CiA 302-2, 6.3).

use super::{Assignment, OnLoss};
use crate::frame::Frame;
use crate::id::NodeId;
use crate::procedure::{BootError, BootEvent, BootNode, BootPlan};
use crate::service::heartbeat_consumer::{self, HeartbeatConsumer};
use crate::service::nmt_manager::Outbox;
use crate::time::{Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtCommand, NmtMessage, NmtState};

/// What happened in the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkEvent {
    /// A node has booted.
    Booted(NodeId),
    /// A node does not boot. It is tried again with its next boot-up message.
    Failed {
        /// Which node.
        node: NodeId,
        /// Whether the network can do without it.
        mandatory: bool,
        /// Why.
        error: BootError,
    },
    /// All mandatory nodes have booted, for the first time or again. Told by a call of `handle_timeout` that
    /// is due at once.
    Ready,
    /// Not all mandatory nodes have booted within the boot time (1F89h).
    BootTimeElapsed,
    /// A node that is not booted without asking has sent its boot-up message; [`Network::boot`] boots it.
    BootedUp(NodeId),
    /// A node is lost; it is booted again, or what [`OnLoss`] says happens.
    Lost {
        /// Which node.
        node: NodeId,
        /// Whether the network can do without it.
        mandatory: bool,
    },
}

/// Boots and keeps up a network of up to `NODES` nodes.
#[derive(Clone, Debug)]
pub struct Network<'a, const NODES: usize> {
    members: [Option<Member<'a>>; NODES],
    on_loss: OnLoss,
    outbox: Outbox,
    deadline: Option<Instant>,
    ready: bool,
    /// Nodes are not started one by one.
    start_all: bool,
    /// All nodes were stopped because of a loss, and stay so until the next start.
    stopped: bool,
}

/// How a node was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Loss {
    /// It sends no heartbeat any more.
    Silent,
    /// It has booted without being told to.
    Rebooted,
}

/// What a heartbeat or a boot-up message tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Heard {
    /// The node was up, and has booted without being told to.
    Rebooted(NodeId),
    /// The node has booted, and is not to be booted without asking.
    Waits(NodeId),
}

#[derive(Clone, Debug)]
struct Member<'a> {
    node: NodeId,
    assignment: Assignment<'a>,
    consumer: HeartbeatConsumer,
    /// From the start of the network on.
    boot: Option<BootNode<'a>>,
    booted: bool,
    /// It was started, but has not told yet that it is OPERATIONAL.
    starting: bool,
    /// It is not to be started when it has booted, but with all others.
    is_held: bool,
    retries: u8,
    /// What it is to be commanded.
    command: Option<NmtCommand>,
    /// Its heartbeat was lost, and it has not booted since.
    lost: bool,
}

impl<'a> Member<'a> {
    fn new(node: NodeId, assignment: Assignment<'a>) -> Self {
        let consumer = HeartbeatConsumer::new(node, assignment.heartbeat);
        Member {
            node,
            assignment,
            consumer,
            boot: None,
            booted: false,
            starting: false,
            is_held: false,
            retries: 0,
            command: None,
            lost: false,
        }
    }

    /// How often a node that does not answer in time is asked again, before that is a failure.
    const RETRIES: u8 = 3;

    /// Begins to boot, from the beginning. It was reset, or has just booted by itself.
    fn boot(&mut self) {
        self.retries = Self::RETRIES;
        self.boot_again(BootPlan { keep_alive: false, ..self.assignment.plan });
    }

    /// Begins to boot with the others, and may be running.
    fn boot_first(&mut self) {
        self.retries = Self::RETRIES;
        self.boot_again(self.assignment.plan);
    }

    /// From here on, the node may be silent for as long as a reset takes.
    const fn forget_heartbeat(&mut self) {
        self.consumer = HeartbeatConsumer::new(self.node, self.assignment.heartbeat);
    }

    fn stop(&mut self) {
        self.boot = None;
        self.starting = false;
        self.command = None;
    }

    fn boot_again(&mut self, plan: BootPlan<'a>) {
        self.booted = false;
        self.starting = false;
        let plan = BootPlan { start: plan.start && !self.is_held, ..plan };
        self.boot = Some(BootNode::new(self.node, self.assignment.client.clone(), plan));
    }

    /// All are started, or this one alone.
    fn release(&mut self, alone: bool) {
        let waits = core::mem::take(&mut self.is_held) && self.booted && self.assignment.plan.start;
        self.starting |= waits;
        if waits && alone {
            self.command = Some(NmtCommand::Start);
        }
    }

    fn handle_boot(&mut self, event: BootEvent) -> Option<NetworkEvent> {
        match event {
            BootEvent::Booted => {
                self.booted = true;
                self.starting = self.assignment.plan.start && !self.is_held;
                // The network got ready while it booted.
                let was_held = self.boot.as_ref().is_some_and(|boot| !boot.plan().start);
                self.command = (self.starting && was_held).then_some(NmtCommand::Start);
                Some(NetworkEvent::Booted(self.node))
            }
            BootEvent::Failed(error) if error.is_time_out() && self.retries > 0 => {
                self.retries -= 1;
                let plan = self.boot.as_ref().map_or(self.assignment.plan, |boot| *boot.plan());
                self.boot_again(plan);
                None
            }
            BootEvent::Failed(error) => {
                Some(NetworkEvent::Failed { node: self.node, mandatory: self.assignment.mandatory, error })
            }
        }
    }

    /// Looks in a heartbeat whether the command to start has reached the node.
    fn check_start(&mut self, frame: &Frame) {
        if self.starting && frame.id() == ErrorControl::cob_id(self.node) {
            match ErrorControl::parse(frame.data()).map(|message| message.state) {
                Some(NmtState::PreOperational) => self.command = Some(NmtCommand::Start),
                Some(NmtState::Operational) => self.starting = false,
                _ => {}
            }
        }
    }
}

impl<'a, const NODES: usize> Network<'a, NODES> {
    /// A network without nodes.
    #[must_use]
    pub const fn new(on_loss: OnLoss) -> Self {
        Network {
            members: [const { None }; NODES],
            on_loss,
            outbox: Outbox::new(),
            deadline: None,
            ready: false,
            start_all: false,
            stopped: false,
        }
    }

    /// Starts the nodes by one command to all of them, when the mandatory ones have booted. Those that boot later
    /// are started then.
    #[must_use]
    pub fn with_start_of_all(self, start_all: bool) -> Self {
        Network { start_all, ..self }
    }

    /// Adds a node.
    ///
    /// # Errors
    ///
    /// [`Full`](super::Full) when there is no room.
    pub fn assign(&mut self, node: NodeId, assignment: Assignment<'a>) -> Result<(), super::Full> {
        let known = self.members.iter().position(|place| place.as_ref().is_some_and(|known| known.node == node));
        let free = || self.members.iter().position(Option::is_none);
        let place = known.or_else(free).and_then(|at| self.members.get_mut(at));
        *place.ok_or(super::Full { node, nodes: NODES })? = Some(Member::new(node, assignment));
        Ok(())
    }

    /// Resets the communication of all nodes but those that [run on](BootPlan::keep_alive), and boots them. The mandatory ones must boot within `boot_time`;
    /// zero: whenever they do.
    pub fn start(&mut self, now: Instant, boot_time: Duration) {
        self.outbox = Outbox::new();
        // The outbox was just emptied.
        let spared = self.members.iter().flatten().any(|member| member.assignment.plan.keep_alive);
        if !spared {
            let _ = self.outbox.command(NmtCommand::ResetCommunication, None);
        }
        self.ready = false;
        self.stopped = false;
        self.deadline = if boot_time.is_zero() { None } else { Some(now + boot_time) };
        for member in self.members.iter_mut().flatten() {
            member.forget_heartbeat();
            member.lost = false;
            let reset = spared && !member.assignment.plan.keep_alive;
            member.command = reset.then_some(NmtCommand::ResetCommunication);
            member.is_held = self.start_all;
            member.boot_first();
        }
    }

    /// Boots a node again that is not booted without asking, or did not boot.
    pub fn boot(&mut self, node: NodeId) {
        if !self.stopped {
            self.members.iter_mut().flatten().filter(|member| member.node == node).for_each(Member::boot);
        }
    }

    /// Whether all mandatory nodes have booted.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.members.iter().flatten().all(|member| member.booted || !member.assignment.mandatory)
    }

    /// Whether a node has booted.
    #[must_use]
    pub fn has_booted(&self, node: NodeId) -> bool {
        self.members.iter().flatten().any(|member| member.node == node && member.booted)
    }

    /// Takes a frame.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<NetworkEvent> {
        match self.handle_error_control(now, frame) {
            Some(Heard::Rebooted(node)) => return self.handle_loss(now, node, Loss::Rebooted),
            Some(Heard::Waits(node)) => return Some(NetworkEvent::BootedUp(node)),
            None => {}
        }
        self.members.iter_mut().flatten().find_map(|member| {
            let event = member.boot.as_mut()?.handle_frame(now, frame);
            member.check_start(frame);
            member.handle_boot(event?)
        })
    }

    /// Takes a heartbeat or a boot-up message.
    fn handle_error_control(&mut self, now: Instant, frame: &Frame) -> Option<Heard> {
        let stopped = self.stopped;
        let mut members = self.members.iter_mut().flatten().filter(|member| member.boot.is_some() || stopped);
        let member = members.find(|member| frame.id() == ErrorControl::cob_id(member.node))?;
        match member.consumer.handle_frame(now, frame)? {
            heartbeat_consumer::Event::BootedUp => {
                member.lost = false;
                let boot = member.boot.as_ref();
                if member.booted {
                    return Some(Heard::Rebooted(member.node));
                }
                if stopped {
                    member.command = Some(NmtCommand::Stop);
                } else if boot.is_some_and(BootNode::is_over) && !member.assignment.boots_again {
                    return Some(Heard::Waits(member.node));
                } else if !boot.is_some_and(BootNode::resets) {
                    // Whatever it was before, it begins anew.
                    member.boot();
                }
            }
            // It was away, and did not notice: the command did not reach it.
            heartbeat_consumer::Event::Started(_) if member.lost && (stopped || member.assignment.boots_again) => {
                member.command = Some(if stopped { NmtCommand::Stop } else { NmtCommand::ResetNode });
            }
            _ => {}
        }
        None
    }

    /// Does what is due. Several deadlines may be due at once: call it while `poll_timeout() <= now`.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<NetworkEvent> {
        if self.is_ready() != self.ready {
            self.ready = !self.ready;
            if self.ready {
                self.deadline = None;
                self.release();
                return Some(NetworkEvent::Ready);
            }
        }
        if self.deadline.take_if(|deadline| *deadline <= now).is_some() {
            return Some(NetworkEvent::BootTimeElapsed);
        }
        let mut members = self.members.iter_mut().flatten();
        let lost = members.find_map(|member| member.consumer.handle_timeout(now).map(|_| member.node));
        if let Some(node) = lost {
            return self.handle_loss(now, node, Loss::Silent);
        }
        self.members.iter_mut().flatten().find_map(|member| {
            let event = member.boot.as_mut()?.handle_timeout(now)?;
            member.handle_boot(event)
        })
    }

    /// Starts those that have waited for the others: by one command when all have booted, or it would reach nodes in
    /// the midst of their configuration.
    fn release(&mut self) {
        let at_once = self.start_all
            && self.members.iter().flatten().all(|member| member.booted && member.assignment.plan.start)
            && self.outbox.command(NmtCommand::Start, None).is_ok();
        self.members.iter_mut().flatten().for_each(|member| member.release(!at_once));
    }

    fn handle_loss(&mut self, now: Instant, node: NodeId, loss: Loss) -> Option<NetworkEvent> {
        let stopped = self.stopped;
        let member = self.members.iter_mut().flatten().find(|member| member.node == node)?;
        let mandatory = member.assignment.mandatory;
        member.lost = loss == Loss::Silent;
        member.booted = false;
        match self.on_loss {
            OnLoss::ResetAll if mandatory => self.start(now, Duration::ZERO),
            OnLoss::StopAll if mandatory => self.stop_all(),
            _ if stopped => member.command = Some(NmtCommand::Stop),
            _ if !member.assignment.boots_again => member.starting = false,
            _ => {
                member.command = (loss == Loss::Silent).then_some(NmtCommand::ResetNode);
                member.boot();
            }
        }
        Some(NetworkEvent::Lost { node, mandatory })
    }

    fn stop_all(&mut self) {
        self.stopped = true;
        self.deadline = None;
        // Commands that were not sent yet are no longer wanted.
        self.members.iter_mut().flatten().for_each(Member::stop);
        self.outbox = Outbox::new();
        let _ = self.outbox.command(NmtCommand::Stop, None);
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if let Some(frame) = self.outbox.poll_transmit(now) {
            if frame == (NmtMessage { command: NmtCommand::ResetCommunication, node: None }.frame()) {
                // What came while the reset waited for being sent was from before it.
                self.members.iter_mut().flatten().for_each(Member::forget_heartbeat);
            }
            return Some(frame);
        }
        self.members.iter_mut().flatten().find_map(|member| {
            if let Some(command) = member.command.take() {
                if matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication) {
                    member.forget_heartbeat();
                }
                return Some(NmtMessage { command, node: Some(member.node) }.frame());
            }
            member.boot.as_mut()?.poll_transmit(now)
        })
    }

    /// When to call [`Network::handle_timeout`].
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        if self.is_ready() != self.ready {
            return Some(Instant::ZERO);
        }
        let members = self.members.iter().flatten();
        let timeouts = members
            .flat_map(|member| [member.consumer.poll_timeout(), member.boot.as_ref().and_then(BootNode::poll_timeout)]);
        timeouts.flatten().chain(self.deadline).min()
    }
}
