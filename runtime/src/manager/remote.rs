//! A node as its manager sees it.

use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::service::emcy_consumer::EmcyConsumer;
use crate::service::heartbeat_consumer::{Heartbeat, HeartbeatConsumer};
use crate::service::node_guard::NodeGuard;
use crate::service::sdo_client::SdoClient;
use crate::time::{Duration, Instant};
use crate::wire::emcy::{CodeOrder, Emergency, ErrorRegister};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;

/// From how many bytes on SDO goes by block. On a bus alone, blocks take less time from 50 bytes on, and half the time
/// in the limit; a node that needs time for each answer gains more.
const BLOCKS_FROM: u32 = 64;

/// What a manager keeps of one node.
#[derive(Clone, Debug)]
pub struct Remote {
    pub(super) node: NodeId,
    pub(super) heartbeat: HeartbeatConsumer,
    pub(super) guard: Option<NodeGuard>,
    pub(super) emcy: EmcyConsumer,
    pub(super) sdo: SdoClient,
}

impl Remote {
    /// A node with the predefined connection set. Its heartbeat is followed, but it is never lost. From 64 bytes on,
    /// SDO goes by block if the node knows how.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Remote {
            node,
            heartbeat: HeartbeatConsumer::new(node, Duration::ZERO),
            guard: None,
            emcy: EmcyConsumer::new(Emergency::cob_id(node), CodeOrder::LowByteFirst),
            sdo: SdoClient::of_node(node).with_block_writes_from(BLOCKS_FROM).with_block_reads_from(BLOCKS_FROM),
        }
    }

    /// The node is lost when no heartbeat comes within `time`. The first one arms the watch.
    #[must_use]
    pub fn with_heartbeat(self, time: Duration) -> Self {
        Remote { heartbeat: HeartbeatConsumer::new(self.node, time), ..self }
    }

    /// The node is asked for its state every `guard_time`, and lost when it does not answer for
    /// `life_time_factor` times that.
    #[must_use]
    pub fn with_guarding(self, guard_time: Duration, life_time_factor: u8) -> Self {
        Remote { guard: Some(NodeGuard::new(self.node, guard_time, life_time_factor)), ..self }
    }

    /// The node sends emergencies as `id`, with the bytes of the error code in `order`.
    #[must_use]
    pub fn with_emergencies(self, id: CobId, order: CodeOrder) -> Self {
        Remote { emcy: EmcyConsumer::new(id, order), ..self }
    }

    /// SDO goes over this client, by block as it says.
    #[must_use]
    pub fn with_sdo(self, sdo: SdoClient) -> Self {
        Remote { sdo, ..self }
    }

    /// The node-ID.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The identifiers under which the node sends what its manager hears: error control, SDO responses, EMCY,
    /// and the four TPDOs of the predefined connection set (CiA 301, 7.3.5).
    pub fn cob_ids(&self) -> impl Iterator<Item = CobId> + use<> {
        let predefined = [0x180, 0x280, 0x380, 0x480].map(|base| CobId::of_node(base, self.node));
        let own = [ErrorControl::cob_id(self.node), self.sdo.response_id(), self.emcy.id()];
        own.into_iter().chain(predefined)
    }

    /// The NMT state, as heartbeat or guarding told it last; `None` when neither did, or the node is lost.
    #[must_use]
    pub fn state(&self) -> Option<NmtState> {
        match (&self.guard, self.heartbeat.heartbeat()) {
            (Some(guard), _) => guard.state(),
            (None, Heartbeat::Alive(state)) => Some(state),
            (None, _) => None,
        }
    }

    /// What is known of the heartbeat.
    #[must_use]
    pub const fn heartbeat(&self) -> Heartbeat {
        self.heartbeat.heartbeat()
    }

    /// The error register, as the last emergency since the node's boot-up told it.
    #[must_use]
    pub const fn error_register(&self) -> ErrorRegister {
        self.emcy.register()
    }

    pub(super) fn start(&mut self, now: Instant) {
        if let Some(guard) = &mut self.guard {
            guard.start(now);
        }
    }

    pub(super) fn poll_guard(&mut self, now: Instant) -> Option<Frame> {
        self.guard.as_mut()?.poll_transmit(now)
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let guard = self.guard.as_ref().and_then(NodeGuard::poll_timeout);
        [guard, self.heartbeat.poll_timeout(), self.sdo.poll_timeout()].into_iter().flatten().min()
    }
}
