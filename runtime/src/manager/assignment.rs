//! Which nodes belong to a network, and how it starts: what the dictionary of its manager says (CiA 302-2, 1F80h
//! and 1F81h).

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
    /// SDO goes over this client.
    pub client: SdoClient,
    /// Without a mandatory node, the network does not start.
    pub mandatory: bool,
    /// A node that was lost, or boots later than the others, is booted without asking; otherwise that is left to
    /// the application ([`Network::boot`](super::Network::boot)).
    pub boots_again: bool,
    /// The node is lost when no heartbeat comes within this time (1016h of the manager); zero: never.
    pub heartbeat: Duration,
    /// The node is guarded (1F81h, bits 8 to 31). Either this or a heartbeat; `None`: it is not.
    pub guarding: Option<Guarding>,
    /// What the node is expected to be, and to be made.
    pub plan: BootPlan<C>,
}

/// How a node is guarded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Guarding {
    /// The time from one request to the next.
    pub guard_time: Duration,
    /// The node is lost when it has not answered for this many guard times; 0: never.
    pub retry_factor: u8,
}

impl Guarding {
    /// Within this time a node that lives answers.
    #[must_use]
    pub fn life_time(self) -> Duration {
        self.guard_time.times(self.retry_factor.max(1).into())
    }
}

/// What happens when a mandatory node is lost (1F80h, bits 4 and 6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OnLoss {
    /// That node alone is reset, and booted again.
    #[default]
    ResetNode,
    /// All nodes are reset, and booted again.
    ResetAll,
    /// All nodes are stopped, and stay so until [`Network::start`](super::Network::start).
    StopAll,
}

impl<C> Assignment<C> {
    /// A mandatory node with the predefined connection set, of any kind, which is given a configuration and started,
    /// and booted again when it was lost. It is neither guarded, nor is its heartbeat watched.
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

    /// The network starts without the node, too.
    #[must_use]
    pub fn optional(self) -> Self {
        Assignment { mandatory: false, ..self }
    }

    /// The node is lost when no heartbeat comes within `time`, and is started only when there is one. Its configuration
    /// gives it a heartbeat (1017h) that is quicker.
    #[must_use]
    pub fn with_heartbeat(self, time: Duration) -> Self {
        let plan = BootPlan { error_control: time, ..self.plan };
        Assignment { heartbeat: time, guarding: None, plan, ..self }
    }

    /// The node is guarded, and started only when it answers.
    #[must_use]
    pub fn with_guarding(self, guarding: Guarding) -> Self {
        let plan = BootPlan { error_control: guarding.life_time(), ..self.plan };
        Assignment { heartbeat: Duration::ZERO, guarding: Some(guarding), plan, ..self }
    }

    /// The same with a configuration that lies elsewhere.
    pub fn with_configuration<D>(self, configuration: D) -> Assignment<D> {
        let Assignment { client, mandatory, boots_again, heartbeat, guarding, plan } = self;
        let plan = plan.with_configuration(configuration);
        Assignment { client, mandatory, boots_again, heartbeat, guarding, plan }
    }

    /// What the dictionary of the manager says of a node: 1F81h, with the node-ID as its sub-index, the node's
    /// entry in 1016h, and [`BootPlan::load`]. A node whose heartbeat is consumed is not guarded. `None` when the node does not belong to the network.
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
        // A node that is watched must be heard before it is started.
        let error_control = guarding.map_or(heartbeat, Guarding::life_time);
        let plan = BootPlan { error_control, ..BootPlan::load(node, configuration, od) };
        let (mandatory, boots_again) = (assignment & MANDATORY != 0, assignment & BOOTS_AGAIN != 0);
        Some(Assignment { client, mandatory, boots_again, heartbeat, guarding, plan })
    }
}

/// What the dictionary asks of the device that starts the network, or starts itself (1F80h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
