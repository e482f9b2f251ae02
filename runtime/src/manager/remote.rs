//! A node as its manager sees it.

use super::table::{Entry, IDS, MARKS};
use super::watch::Watch;
use crate::cia301::connection;
use crate::id::{CobId, NodeId};
use crate::service::emcy_consumer::EmcyConsumer;
use crate::service::heartbeat_consumer::Heartbeat;
use crate::service::sdo_client::SdoClient;
use crate::time::{Duration, Instant, earliest};
use crate::wire::emcy::{CodeOrder, Emergency, ErrorRegister};
use crate::wire::heartbeat::ErrorControl;
use crate::wire::nmt::NmtState;

/// From this many bytes on, SDO uses block transfers. On a bus without other traffic, they take less time from 50 bytes
/// on, and half the time for long data; a node that answers slowly gains more.
const BLOCKS_FROM: u32 = 64;

/// What a manager knows of one node.
#[derive(Clone, Debug)]
pub struct Remote {
    pub(super) node: NodeId,
    pub(super) watch: Watch,
    pub(super) emcy: EmcyConsumer,
    pub(super) sdo: SdoClient,
}

impl Remote {
    /// A node with the predefined connection set. Its heartbeat is followed, but the node never counts as lost. From 64
    /// bytes on, SDO uses block transfers if the node supports them.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Remote {
            node,
            watch: Watch::heartbeat(node, Duration::ZERO),
            emcy: EmcyConsumer::new(Emergency::cob_id(node), CodeOrder::LowByteFirst),
            sdo: SdoClient::of_node(node).with_block_writes_from(BLOCKS_FROM).with_block_reads_from(BLOCKS_FROM),
        }
    }

    /// The node counts as lost if no heartbeat comes within `time`, from the first one on. Excludes guarding.
    #[must_use]
    pub fn with_heartbeat(self, time: Duration) -> Self {
        Remote { watch: Watch::heartbeat(self.node, time), ..self }
    }

    /// The node is asked for its state every `guard_time`, and counts as lost if it has not answered for
    /// `life_time_factor` times that.
    #[must_use]
    pub fn with_guarding(self, guard_time: Duration, life_time_factor: u8) -> Self {
        Remote { watch: Watch::guarding(self.node, guard_time, life_time_factor), ..self }
    }

    /// The COB-ID of the node's emergencies, and the byte order of their error codes.
    #[must_use]
    pub fn with_emergencies(self, id: CobId, order: CodeOrder) -> Self {
        Remote { emcy: EmcyConsumer::new(id, order), ..self }
    }

    /// Uses this SDO client, and its thresholds for block transfers.
    #[must_use]
    pub fn with_sdo(self, sdo: SdoClient) -> Self {
        Remote { sdo, ..self }
    }

    /// The node-ID.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The COB-IDs of frames from the node to its manager: error control, SDO responses, EMCY, and the four TPDOs of
    /// the predefined connection set (CiA 301, 7.3.5).
    pub fn cob_ids(&self) -> impl Iterator<Item = CobId> + use<> {
        let predefined = connection::TPDOS.map(|base| CobId::of_node(base, self.node));
        let own = [ErrorControl::cob_id(self.node), self.sdo.response_id(), self.emcy.id()];
        own.into_iter().chain(predefined)
    }

    /// The NMT state last reported by heartbeat or guarding; `None` before the first report, and while the node is
    /// lost.
    #[must_use]
    pub const fn state(&self) -> Option<NmtState> {
        match &self.watch {
            Watch::Guarding(guard) => guard.state(),
            Watch::Heartbeat(consumer) => match consumer.heartbeat() {
                Heartbeat::Alive(state) => Some(state),
                Heartbeat::Unknown | Heartbeat::Lost => None,
            },
        }
    }

    /// The state of the heartbeat; [`Heartbeat::Unknown`] if the node is guarded.
    #[must_use]
    pub const fn heartbeat(&self) -> Heartbeat {
        match &self.watch {
            Watch::Heartbeat(consumer) => consumer.heartbeat(),
            Watch::Guarding(_) => Heartbeat::Unknown,
        }
    }

    /// The error register in the last emergency since the node's boot-up.
    #[must_use]
    pub const fn error_register(&self) -> ErrorRegister {
        self.emcy.register()
    }
}

/// The position of the SDO response in [`Entry::cob_ids`]; the other one is that of emergencies.
pub(super) const SDO_RESPONSE: usize = 0;

/// The questions for the marks of the manager's table: which nodes have a guarding request, which an SDO frame to send?
pub(super) const GUARDING: usize = 0;
pub(super) const SDO: usize = 1;

impl Entry for Remote {
    fn node(&self) -> NodeId {
        self.node
    }

    fn cob_ids(&self) -> [Option<CobId>; IDS] {
        [Some(self.sdo.response_id()), Some(self.emcy.id())]
    }

    fn poll_timeout(&self) -> Option<Instant> {
        earliest([self.watch.poll_timeout(), self.sdo.poll_timeout()])
    }

    fn marks(&self) -> [bool; MARKS] {
        [self.watch.has_outgoing(), self.sdo.has_outgoing(), false]
    }
}
