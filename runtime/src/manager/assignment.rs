//! Which nodes belong to a network, and how it starts, from the dictionary of its manager (CiA 302-2, 1F80h and 1F81h).

use crate::cia301;
use crate::id::NodeId;
use crate::object::ObjectDictionary;
use crate::procedure::BootPlan;
use crate::service::objects;
use crate::service::sdo_client::SdoClient;
use crate::time::Duration;

/// A node that belongs to the network (1F81h).
///
/// ```
/// use lexican_runtime::manager::Assignment;
/// use lexican_runtime::object::Address;
/// use lexican_runtime::procedure::{ConciseDcf, Step};
/// use lexican_runtime::{Duration, NodeId};
///
/// let node = NodeId::literal(5);
/// let mut buffer = [0; 64];
/// let settings = ConciseDcf::encode([Step::value(Address::new(0x1017, 0), 100_u16)], &mut buffer)?;
/// let mut drive = Assignment::new(node, settings).with_heartbeat(Duration::from_millis(250));
/// drive.plan.vendor = Some(0x195);
/// # Ok::<(), lexican_runtime::procedure::EncodeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Assignment<C> {
    /// The client for SDO with the node.
    pub client: SdoClient,
    /// Whether the network needs the node to start.
    pub mandatory: bool,
    /// Whether the node is booted by itself when it was lost, or boots later than the others; otherwise the application
    /// boots it ([`Network::boot`](super::Network::boot)).
    pub boots_again: bool,
    /// The node counts as lost if no heartbeat comes within this time (1016h of the manager); zero disables that.
    pub heartbeat: Duration,
    /// How the node is guarded (1F81h, bits 8 to 31), if it is. Heartbeat and guarding exclude each other.
    pub guarding: Option<Guarding>,
    /// The expected identity of the node, and its configuration.
    pub plan: BootPlan<C>,
}

/// How a node is guarded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Guarding {
    /// The time between two requests.
    pub guard_time: Duration,
    /// The node counts as lost if it has not answered for this many guard times; 0 disables that.
    pub retry_factor: u8,
}

impl Guarding {
    /// The time within which a live node answers.
    #[must_use]
    pub fn life_time(self) -> Duration {
        self.guard_time.times(self.retry_factor.max(1).into())
    }
}

/// What happens when a mandatory node is lost (1F80h, bits 4 and 6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OnLoss {
    /// This node alone is reset, and booted again.
    #[default]
    ResetNode,
    /// All nodes are reset, and booted again.
    ResetAll,
    /// All nodes are stopped, until [`Network::start`](super::Network::start).
    StopAll,
}

impl<C> Assignment<C> {
    /// A mandatory node of any kind with the predefined connection set. It is configured and started, and booted again
    /// after it was lost. It is not guarded, and its heartbeat is not monitored.
    #[must_use]
    pub fn new(node: NodeId, configuration: C) -> Self {
        let plan = BootPlan {
            device_type: None,
            vendor: None,
            product: None,
            revision: None,
            or_later: false,
            serial: None,
            configured: None,
            configuration,
            error_control: Duration::ZERO,
            start: true,
            keep_alive: false,
        };
        Assignment {
            client: SdoClient::of_node(node),
            mandatory: true,
            boots_again: true,
            heartbeat: Duration::ZERO,
            guarding: None,
            plan,
        }
    }

    /// The network also starts without the node.
    #[must_use]
    pub fn optional(self) -> Self {
        Assignment { mandatory: false, ..self }
    }

    /// The node counts as lost if no heartbeat comes within `time`, and is started only once one has come. Its
    /// configuration must give it a shorter heartbeat time (1017h).
    #[must_use]
    pub fn with_heartbeat(self, time: Duration) -> Self {
        let plan = BootPlan { error_control: time, ..self.plan };
        Assignment { heartbeat: time, guarding: None, plan, ..self }
    }

    /// The node is guarded, and started only once it answers.
    #[must_use]
    pub fn with_guarding(self, guarding: Guarding) -> Self {
        let plan = BootPlan { error_control: guarding.life_time(), ..self.plan };
        Assignment { heartbeat: Duration::ZERO, guarding: Some(guarding), plan, ..self }
    }

    /// The same with another configuration.
    pub fn with_configuration<D>(self, configuration: D) -> Assignment<D> {
        let Assignment { client, mandatory, boots_again, heartbeat, guarding, plan } = self;
        let plan = plan.with_configuration(configuration);
        Assignment { client, mandatory, boots_again, heartbeat, guarding, plan }
    }

    /// Reads the assignment of a node from the dictionary of the manager: 1F81h, with the node-ID as sub-index; the
    /// node's entry in 1016h; and [`BootPlan::load`]. A node whose heartbeat is consumed is not guarded. `None` if the
    /// node does not belong to the network.
    #[must_use]
    pub fn load(
        node: NodeId,
        client: SdoClient,
        configuration: C,
        od: &mut (impl ObjectDictionary + ?Sized),
    ) -> Option<Self> {
        const MEMBER: u32 = 1 << 0;
        const BOOTS_AGAIN: u32 = 1 << 2;
        const MANDATORY: u32 = 1 << 3;
        let assignment =
            objects::read_u32(od, cia301::NMT_SLAVE_ASSIGNMENT, node.get()).filter(|bits| bits & MEMBER != 0)?;
        let entries = objects::read_u8(od, cia301::CONSUMER_HEARTBEAT_TIME, 0).unwrap_or(0);
        let heartbeat_ms = (1..=entries).find_map(|sub| {
            let entry = objects::read_u32(od, cia301::CONSUMER_HEARTBEAT_TIME, sub)?;
            (entry >> 16 == u32::from(node.get())).then_some(entry & 0xFFFF)
        });
        let heartbeat = Duration::from_millis(heartbeat_ms.unwrap_or(0).into());
        let [.., retry_factor, low, high] = assignment.to_le_bytes();
        let guard_time = Duration::from_millis(u16::from_le_bytes([low, high]).into());
        let guarding = Guarding { guard_time, retry_factor };
        let guarding = (heartbeat.is_zero() && !guard_time.is_zero()).then_some(guarding);
        // A monitored node must be heard before it is started.
        let error_control = guarding.map_or(heartbeat, Guarding::life_time);
        let plan = BootPlan { error_control, ..BootPlan::load(node, configuration, od) };
        let (mandatory, boots_again) = (assignment & MANDATORY != 0, assignment & BOOTS_AGAIN != 0);
        Some(Assignment { client, mandatory, boots_again, heartbeat, guarding, plan })
    }
}

/// How a device starts the network, or itself, by its dictionary (1F80h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Startup {
    /// The device is the manager (bit 0).
    pub is_manager: bool,
    /// The nodes are started by one command to all of them, once the mandatory ones have booted (bit 1).
    pub start_all: bool,
    /// The device enters OPERATIONAL by itself (bit 2 clear): a manager when the network is
    /// [ready](super::NetworkEvent::Ready), another device after its boot-up.
    pub enters_operational: bool,
    /// What happens when a mandatory node is lost (bits 4 and 6).
    pub on_loss: OnLoss,
}

impl Startup {
    /// Decodes 1F80h. Bit 3, whether nodes are started at all, is in [`BootPlan::load`]; bit 5, several managers of
    /// which one is active, is not supported.
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
    /// Decodes 1F80h: bit 4 resets all nodes, bit 6 stops all.
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
