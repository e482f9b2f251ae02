//! Which nodes belong to a network, and how it starts: what the dictionary of its manager says (CiA 302-2, 1F80h
//! and 1F81h).

use crate::id::NodeId;
use crate::object::ObjectDictionary;
use crate::procedure::BootPlan;
use crate::service::objects;
use crate::service::sdo_client::SdoClient;
use crate::time::Duration;

/// A node that belongs to the network (1F81h).
#[derive(Clone, Debug)]
pub struct Assignment<'a> {
    /// SDO goes over this client.
    pub client: SdoClient,
    /// Without a mandatory node, the network does not start.
    pub mandatory: bool,
    /// A node that was lost, or boots later than the others, is booted without asking; otherwise that is left to
    /// the application ([`Network::boot`](super::Network::boot)).
    pub boots_again: bool,
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
    /// All nodes are stopped, and stay so until [`Network::start`](super::Network::start).
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
        const BOOTS_AGAIN: u32 = 1 << 2;
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
        let (mandatory, boots_again) = (assignment & MANDATORY != 0, assignment & BOOTS_AGAIN != 0);
        Some(Assignment { client, mandatory, boots_again, heartbeat, plan })
    }
}

/// What the dictionary asks of the device that starts the network, or starts itself (1F80h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Startup {
    /// The device is the manager (bit 0).
    pub is_manager: bool,
    /// The nodes are started by one command to all of them, when the mandatory ones have booted (bit 1).
    pub start_all: bool,
    /// The device enters OPERATIONAL by itself: a manager when the network is [ready](super::NetworkEvent::Ready), another
    /// device after its boot-up (bit 2 clear).
    pub enters_operational: bool,
    /// What happens when a mandatory node is lost (bits 4 and 6).
    pub on_loss: OnLoss,
}

impl Startup {
    /// What a value of 1F80h means. Bit 3, whether nodes are started at all, is in [`BootPlan::load`]; bit 5, several
    /// managers of which one is active, is not served.
    #[must_use]
    pub const fn from_parameter(nmt_startup: u32) -> Self {
        Startup {
            is_manager: nmt_startup & 1 << 0 != 0,
            start_all: nmt_startup & 1 << 1 != 0,
            enters_operational: nmt_startup & 1 << 2 == 0,
            on_loss: OnLoss::from_startup(nmt_startup),
        }
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
