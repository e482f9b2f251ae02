//! Booting a network: all nodes that belong to it, in parallel, and again when one comes back
//! (CiA 302-2, 6.3).

use crate::frame::Frame;
use crate::id::NodeId;
use crate::object::ObjectDictionary;
use crate::procedure::{BootError, BootEvent, BootNode, BootPlan};
use crate::service::heartbeat_consumer::{self, HeartbeatConsumer};
use crate::service::nmt_manager::Outbox;
use crate::service::objects;
use crate::service::sdo_client::SdoClient;
use crate::time::{Duration, Instant};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::{NmtCommand, NmtMessage, NmtState};

/// A node that belongs to the network (1F81h).
#[derive(Clone, Debug)]
pub struct Assignment<'a> {
    /// SDO goes over this client.
    pub client: SdoClient,
    /// Without a mandatory node, the network does not start.
    pub mandatory: bool,
    /// The node is lost when no heartbeat comes within this time (1016h of the manager); zero: never.
    pub heartbeat: Duration,
    /// What the node is expected to be, and to be made.
    pub plan: BootPlan<'a>,
}

/// What happens when a mandatory node is lost (1F80h, bits 4 and 6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnLoss {
    /// That node alone is reset, and booted again.
    #[default]
    ResetNode,
    /// All nodes are reset, and booted again.
    ResetAll,
    /// All nodes are stopped, and stay so until [`Network::start`].
    StopAll,
}

impl<'a> Assignment<'a> {
    /// What the dictionary of the manager says of a node: 1F81h, with the node-ID as its sub-index, the node's
    /// entry in 1016h, and [`BootPlan::load`]. `None` when the node does not belong to the network.
    #[must_use]
    pub fn load(
        node: NodeId,
        client: SdoClient,
        configuration: &'a [u8],
        od: &mut dyn ObjectDictionary,
    ) -> Option<Self> {
        const MEMBER: u32 = 1 << 0;
        const MANDATORY: u32 = 1 << 3;
        let assignment = objects::read_u32(od, 0x1F81, node.get()).filter(|bits| bits & MEMBER != 0)?;
        let entries = objects::read_u8(od, 0x1016, 0).unwrap_or(0);
        let heartbeat_ms = (1..=entries).find_map(|sub| {
            let entry = objects::read_u32(od, 0x1016, sub)?;
            (entry >> 16 == u32::from(node.get())).then_some(entry & 0xFFFF)
        });
        let heartbeat = Duration::from_millis(heartbeat_ms.unwrap_or(0).into());
        // A node whose heartbeat is consumed must have one before it is started.
        let plan = BootPlan { error_control: heartbeat, ..BootPlan::load(node, configuration, od) };
        Some(Assignment { client, mandatory: assignment & MANDATORY != 0, heartbeat, plan })
    }
}

impl OnLoss {
    /// What 1F80h says: bit 4 resets all nodes, bit 6 stops all.
    #[must_use]
    pub const fn from_startup(nmt_startup: u32) -> Self {
        const RESET_ALL: u32 = 1 << 4;
        const STOP_ALL: u32 = 1 << 6;
        if nmt_startup & STOP_ALL != 0 {
            OnLoss::StopAll
        } else if nmt_startup & RESET_ALL != 0 {
            OnLoss::ResetAll
        } else {
            OnLoss::ResetNode
        }
    }
}

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
            retries: 0,
            command: None,
            lost: false,
        }
    }

    /// How often a node that does not answer in time is asked again, before that is a failure.
    const RETRIES: u8 = 3;

    /// Begins to boot, from the beginning.
    fn boot(&mut self) {
        self.retries = Self::RETRIES;
        self.boot_again();
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

    fn boot_again(&mut self) {
        self.booted = false;
        self.starting = false;
        self.boot = Some(BootNode::new(self.node, self.assignment.client.clone(), self.assignment.plan));
    }

    fn handle_boot(&mut self, event: BootEvent) -> Option<NetworkEvent> {
        match event {
            BootEvent::Booted => {
                self.booted = true;
                self.starting = self.assignment.plan.start;
                Some(NetworkEvent::Booted(self.node))
            }
            BootEvent::Failed(error) if error.is_time_out() && self.retries > 0 => {
                self.retries -= 1;
                self.boot_again();
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
            stopped: false,
        }
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

    /// Resets the communication of all nodes, and boots them. The mandatory ones must boot within `boot_time`;
    /// zero: whenever they do.
    pub fn start(&mut self, now: Instant, boot_time: Duration) {
        self.outbox = Outbox::new();
        // The outbox was just emptied.
        let _ = self.outbox.command(NmtCommand::ResetCommunication, None);
        self.ready = false;
        self.stopped = false;
        self.deadline = if boot_time.is_zero() { None } else { Some(now + boot_time) };
        for member in self.members.iter_mut().flatten() {
            member.forget_heartbeat();
            member.lost = false;
            member.command = None;
            member.boot();
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
        if let Some(node) = self.handle_error_control(now, frame) {
            return self.handle_loss(now, node, Loss::Rebooted);
        }
        self.members.iter_mut().flatten().find_map(|member| {
            let event = member.boot.as_mut()?.handle_frame(now, frame);
            member.check_start(frame);
            member.handle_boot(event?)
        })
    }

    /// Takes a heartbeat or a boot-up message; the node that was up and has booted without being told to.
    fn handle_error_control(&mut self, now: Instant, frame: &Frame) -> Option<NodeId> {
        let stopped = self.stopped;
        let mut members = self.members.iter_mut().flatten().filter(|member| member.boot.is_some() || stopped);
        let member = members.find(|member| frame.id() == ErrorControl::cob_id(member.node))?;
        match member.consumer.handle_frame(now, frame)? {
            heartbeat_consumer::Event::BootedUp => {
                member.lost = false;
                if member.booted {
                    return Some(member.node);
                }
                // Whatever it was before, it begins anew.
                if stopped { member.command = Some(NmtCommand::Stop) } else { member.boot() }
            }
            // It was away, and did not notice: the command did not reach it.
            heartbeat_consumer::Event::Started(_) if member.lost => {
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
            if !self.stopped {
                // What came while the reset waited for being sent was from before it.
                self.members.iter_mut().flatten().for_each(Member::forget_heartbeat);
            }
            return Some(frame);
        }
        self.members.iter_mut().flatten().find_map(|member| {
            if let Some(command) = member.command.take() {
                if command == NmtCommand::ResetNode {
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
