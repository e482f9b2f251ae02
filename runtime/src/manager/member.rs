//! A node of a network that is booted.

use super::{Assignment, NetworkEvent};
use crate::frame::Frame;
use crate::id::NodeId;
use crate::procedure::{BootEvent, BootNode, BootPlan};
use crate::service::heartbeat_consumer::{self, HeartbeatConsumer};
use crate::service::node_guard::{self, NodeGuard};
use crate::time::Instant;
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtCommand, NmtMessage, NmtState};

#[derive(Clone, Debug)]
pub(super) struct Member<C> {
    node: NodeId,
    assignment: Assignment<C>,
    watch: Watch,
    phase: Phase<C>,
    /// How often it may still be silent before that is a failure.
    retries: u8,
    /// What it is to be commanded.
    command: Option<NmtCommand>,
    /// It is silent, and has not booted since.
    lost: bool,
}

/// What the network does with a node.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "nothing is allocated, and every node boots")]
enum Phase<C> {
    /// Nothing: the network has not started, or is stopped.
    Idle,
    /// Boots it, or has failed to: what may be left to send is an abort.
    Booting(BootNode<C>),
    /// Watches it.
    Booted,
    /// Waits for its boot-up message: it was lost, and is not booted without asking.
    Down,
}

#[derive(Clone, Copy, Debug)]
enum Watch {
    Heartbeat(HeartbeatConsumer),
    Guarding(NodeGuard),
}

/// What a heartbeat, a guarding answer or a boot-up message says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heard {
    /// The node was up, and has booted without being told to.
    Rebooted,
    /// The node has booted, and is not to be booted without asking.
    Waits,
    /// The node is up, and in another state than before.
    State(NmtState),
}

/// How often a node that does not answer in time is asked again, before that is a failure.
const RETRIES: u8 = 3;

impl Watch {
    fn new<C>(node: NodeId, assignment: &Assignment<C>) -> Self {
        match assignment.guarding {
            Some(guarding) => Watch::Guarding(NodeGuard::new(node, guarding.guard_time, guarding.retry_factor)),
            None => Watch::Heartbeat(HeartbeatConsumer::new(node, assignment.heartbeat)),
        }
    }

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<heartbeat_consumer::Event> {
        let guard = match self {
            Watch::Heartbeat(consumer) => return consumer.handle_frame(now, frame),
            Watch::Guarding(guard) => guard,
        };
        match guard.handle_frame(now, frame)? {
            node_guard::Event::BootedUp => Some(heartbeat_consumer::Event::BootedUp),
            node_guard::Event::Started(state) => Some(heartbeat_consumer::Event::Started(state)),
            node_guard::Event::StateChanged(state) => Some(heartbeat_consumer::Event::StateChanged(state)),
            // A node that never alternates is lost when its life time is over.
            node_guard::Event::ToggleError | node_guard::Event::Lost => None,
        }
    }

    /// Whether the node is lost.
    fn handle_timeout(&mut self, now: Instant) -> bool {
        match self {
            Watch::Heartbeat(consumer) => consumer.handle_timeout(now).is_some(),
            Watch::Guarding(guard) => guard.handle_timeout(now).is_some(),
        }
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        match self {
            Watch::Heartbeat(_) => None,
            Watch::Guarding(guard) => guard.poll_transmit(now),
        }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        match self {
            Watch::Heartbeat(consumer) => consumer.poll_timeout(),
            Watch::Guarding(guard) => guard.poll_timeout(),
        }
    }

    /// Begins to guard.
    fn start(&mut self, now: Instant) {
        match self {
            Watch::Guarding(guard) if guard.poll_timeout().is_none() => guard.start(now),
            _ => {}
        }
    }
}

impl<C: AsRef<[u8]> + Clone> Member<C> {
    pub(super) fn new(node: NodeId, assignment: Assignment<C>) -> Self {
        let watch = Watch::new(node, &assignment);
        Member { node, assignment, watch, phase: Phase::Idle, retries: 0, command: None, lost: false }
    }

    pub(super) const fn node(&self) -> NodeId {
        self.node
    }

    pub(super) const fn is_mandatory(&self) -> bool {
        self.assignment.mandatory
    }

    pub(super) const fn is_kept_alive(&self) -> bool {
        self.assignment.plan.keep_alive
    }

    pub(super) const fn is_to_be_started(&self) -> bool {
        self.assignment.plan.start
    }

    pub(super) const fn has_booted(&self) -> bool {
        matches!(self.phase, Phase::Booted)
    }

    pub(super) fn is_booting(&self) -> bool {
        matches!(&self.phase, Phase::Booting(boot) if !boot.is_over())
    }

    /// Whether it has booted, or waits to be started with the others.
    pub(super) fn is_startable(&self) -> bool {
        self.has_booted() || matches!(&self.phase, Phase::Booting(boot) if boot.is_held())
    }

    /// Boots it with all others; `spared` when not all of them are reset by one command.
    pub(super) fn start(&mut self, held: bool, spared: bool) {
        self.lost = false;
        let reset = spared && !self.is_kept_alive();
        self.command = reset.then_some(NmtCommand::ResetCommunication);
        self.retries = RETRIES;
        self.forget();
        self.begin(self.is_kept_alive(), held);
    }

    /// Boots it, from the beginning: it was reset, or has just booted by itself.
    pub(super) fn boot(&mut self, held: bool) {
        self.retries = RETRIES;
        self.forget();
        self.begin(false, held);
    }

    fn begin(&mut self, keep_alive: bool, held: bool) {
        let plan = BootPlan { keep_alive, ..self.assignment.plan.clone() };
        let boot = BootNode::new(self.node, self.assignment.client.clone(), plan);
        self.phase = Phase::Booting(if held { boot.held() } else { boot });
    }

    /// From here on, the node may be silent for as long as a reset takes.
    pub(super) fn forget(&mut self) {
        self.watch = Watch::new(self.node, &self.assignment);
    }

    pub(super) fn stop(&mut self) {
        self.phase = Phase::Idle;
        self.command = None;
    }

    pub(super) const fn command(&mut self, command: NmtCommand) {
        self.command = Some(command);
    }

    pub(super) const fn lose(&mut self, silent: bool) {
        self.lost = silent;
    }

    /// What follows when it is lost.
    pub(super) fn recover(&mut self, silent: bool, held: bool) {
        if self.assignment.boots_again {
            self.command = silent.then_some(NmtCommand::ResetNode);
            self.boot(held);
        } else {
            self.phase = Phase::Down;
        }
    }

    /// All are started, or each alone.
    pub(super) fn release(&mut self, now: Instant, at_once: bool) {
        if let Phase::Booting(boot) = &mut self.phase {
            boot.release(now, at_once);
        }
    }

    /// Takes a heartbeat, a guarding answer or a boot-up message.
    pub(super) fn hear(&mut self, now: Instant, frame: &Frame, stopped: bool, held: bool) -> Option<Heard> {
        if matches!(self.phase, Phase::Idle) && !stopped {
            return None;
        }
        let is_answer = matches!(&self.phase, Phase::Booting(boot) if boot.asks());
        if is_answer && *frame != ErrorControl::heartbeat(NmtState::Initialising).frame(self.node) {
            return None;
        }
        match self.watch.handle_frame(now, frame)? {
            heartbeat_consumer::Event::BootedUp => {
                self.lost = false;
                match &self.phase {
                    Phase::Booted => return Some(Heard::Rebooted),
                    Phase::Idle => self.command = Some(NmtCommand::Stop),
                    Phase::Down => return Some(Heard::Waits),
                    Phase::Booting(boot) if boot.is_over() && !self.assignment.boots_again => {
                        return Some(Heard::Waits);
                    }
                    Phase::Booting(boot) if boot.resets() => {}
                    // Whatever it was before, it begins anew.
                    Phase::Booting(_) => self.boot(held),
                }
            }
            // It was away, and did not notice: the command did not reach it.
            heartbeat_consumer::Event::Started(_) if self.lost && (stopped || self.assignment.boots_again) => {
                self.command = Some(if stopped { NmtCommand::Stop } else { NmtCommand::ResetNode });
            }
            heartbeat_consumer::Event::StateChanged(state) if self.has_booted() => return Some(Heard::State(state)),
            _ => {}
        }
        None
    }

    pub(super) fn handle_frame(&mut self, now: Instant, frame: &Frame, held: bool) -> Option<NetworkEvent> {
        let Phase::Booting(boot) = &mut self.phase else { return None };
        let event = boot.handle_frame(now, frame);
        self.handle_boot(now, event, held)
    }

    /// The node, when it is lost now.
    pub(super) fn find_loss(&mut self, now: Instant) -> Option<NodeId> {
        self.watch.handle_timeout(now).then_some(self.node)
    }

    pub(super) fn handle_timeout(&mut self, now: Instant, held: bool) -> Option<NetworkEvent> {
        let Phase::Booting(boot) = &mut self.phase else { return None };
        let event = boot.handle_timeout(now);
        self.handle_boot(now, event, held)
    }

    fn handle_boot(&mut self, now: Instant, event: Option<BootEvent>, held: bool) -> Option<NetworkEvent> {
        let Phase::Booting(boot) = &self.phase else { return None };
        if boot.is_configured() || event == Some(BootEvent::Booted) {
            self.watch.start(now);
        }
        match event? {
            BootEvent::Booted => {
                self.phase = Phase::Booted;
                Some(NetworkEvent::Booted(self.node))
            }
            BootEvent::Failed(error) if error.is_time_out() && self.retries > 0 => {
                self.retries -= 1;
                self.begin(boot.plan().keep_alive, held);
                None
            }
            BootEvent::Failed(error) => {
                Some(NetworkEvent::Failed { node: self.node, mandatory: self.is_mandatory(), error })
            }
        }
    }

    pub(super) fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if let Some(command) = self.command.take() {
            if matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication) {
                self.forget();
            }
            return Some(NmtMessage { command, node: Some(self.node) }.frame());
        }
        if let Some(frame) = self.watch.poll_transmit(now) {
            return Some(frame);
        }
        match &mut self.phase {
            Phase::Booting(boot) => boot.poll_transmit(now),
            _ => None,
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let boot = match &self.phase {
            Phase::Booting(boot) => boot.poll_timeout(),
            _ => None,
        };
        [self.watch.poll_timeout(), boot].into_iter().flatten().min()
    }
}
