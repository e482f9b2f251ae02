//! The planned state of a node, and why a node does not reach it.

use crate::cia301;
use crate::id::NodeId;
use crate::object::ObjectDictionary;
use crate::procedure::ConciseDcfError;
use crate::service::objects;
use crate::service::sdo_client::SdoError;
use crate::time::Duration;
use crate::wire::lss::Part;
use crate::wire::nmt::NmtState;

/// The expected identity of a node, and its configuration. `None` and empty mean any.
///
/// The configuration is borrowed (`&[u8]`) or owned (`Vec<u8>`).
#[derive(Clone, Copy, Debug, Default)]
pub struct BootPlan<C> {
    /// Device type, 1000h (1F84h of the manager).
    pub device_type: Option<u32>,
    /// Vendor-ID, 1018h:01 (1F85h).
    pub vendor: Option<u32>,
    /// Product code, 1018h:02 (1F86h).
    pub product: Option<u32>,
    /// Revision number, 1018h:03 (1F87h).
    pub revision: Option<u32>,
    /// Whether a later revision is accepted, too.
    pub or_later: bool,
    /// Serial number, 1018h:04 (1F88h).
    pub serial: Option<u32>,
    /// Date and time of the configuration, 1020h:01 and :02 (1F26h, 1F27h). A node that has both is not configured
    /// again.
    pub configured: Option<(u32, u32)>,
    /// The configuration as a [concise DCF](super::ConciseDcf) (1F22h).
    pub configuration: C,
    /// The time within which a heartbeat, or an answer to guarding, must be heard; zero means not to wait for it.
    pub error_control: Duration,
    /// Whether the node is started at the end. It has booted once it reports OPERATIONAL: in its heartbeat, or, if it
    /// has none (1017h is 0), in the answer to a guarding request. Such a request arms life guarding in a node with a
    /// life time (100Ch, 100Dh), which then has to be guarded.
    pub start: bool,
    /// Whether a node that is already OPERATIONAL is left as it is, and any other one reset first (1F81h bit 4). The
    /// node reports its state within `error_control`; if that is zero, it is asked.
    pub keep_alive: bool,
}

impl<C> BootPlan<C> {
    /// The same with another configuration.
    pub fn with_configuration<D>(self, configuration: D) -> BootPlan<D> {
        let BootPlan { device_type, vendor, product, revision, serial, configured, .. } = self;
        let BootPlan { or_later, error_control, start, keep_alive, .. } = self;
        BootPlan {
            device_type,
            vendor,
            product,
            revision,
            or_later,
            serial,
            configured,
            configuration,
            error_control,
            start,
            keep_alive,
        }
    }

    /// Reads the plan for a node from the dictionary of the manager: 1F84h to 1F88h, 1F26h and 1F27h, each with the
    /// node-ID as sub-index, where 0 means any; 1F80h bit 3, which leaves starting the nodes to the application; and
    /// 1F81h bit 4. `configuration` is the content of 1F22h for the node.
    #[must_use]
    pub fn load(node: NodeId, configuration: C, od: &mut (impl ObjectDictionary + ?Sized)) -> Self {
        let mut expected = |index| objects::read_u32(od, index, node.get()).filter(|&value| value != 0);
        let date = expected(cia301::EXPECTED_CONFIGURATION_DATE);
        let configured = date.zip(expected(cia301::EXPECTED_CONFIGURATION_TIME));
        BootPlan {
            device_type: expected(cia301::EXPECTED_DEVICE_TYPE),
            vendor: expected(cia301::EXPECTED_VENDOR),
            product: expected(cia301::EXPECTED_PRODUCT),
            revision: expected(cia301::EXPECTED_REVISION),
            or_later: false,
            serial: expected(cia301::EXPECTED_SERIAL),
            configured,
            configuration,
            error_control: Duration::ZERO,
            start: objects::read_u32(od, cia301::NMT_STARTUP, 0).unwrap_or(0) & START_BY_APPLICATION == 0,
            keep_alive: objects::read_u32(od, cia301::NMT_SLAVE_ASSIGNMENT, node.get()).unwrap_or(0) & KEEP_ALIVE != 0,
        }
    }
}

/// 1F80h: the application starts the nodes.
const START_BY_APPLICATION: u32 = 1 << 3;
/// 1F81h: the node is not reset while it is OPERATIONAL.
const KEEP_ALIVE: u32 = 1 << 4;

/// Why a node does not boot. The letters are those of CiA 302-2, table 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum BootError {
    /// B: the device type cannot be read.
    #[error("the node does not report its device type: {0}")]
    NoDeviceType(SdoError),
    /// C: another device type.
    #[error("the device type (1000h) is {got:08X}h, and not {expected:08X}h")]
    DeviceType { expected: u32, got: u32 },
    /// D, M, N, O: another identity.
    #[error("the {} (1018h:{:02X}) is {got:08X}h, and not {expected:08X}h", part.name(), 1 + part.number())]
    Identity { part: Part, expected: u32, got: u32 },
    /// D, M, N, O: the identity cannot be read.
    #[error("the node does not report its identity: {0}")]
    NoIdentity(SdoError),
    /// J: the configuration failed.
    #[error("entry {entry} of the configuration failed: {error}")]
    Configuration {
        /// Counted from 1.
        entry: usize,
        error: SdoError,
    },
    /// J: the concise DCF is truncated.
    #[error(transparent)]
    BadConfiguration(#[from] ConciseDcfError),
    /// K: error control did not start.
    #[error("no heartbeat or guarding answer within {0}")]
    NoErrorControl(Duration),
    /// The node was reset, since it was not OPERATIONAL, and does not boot.
    #[error("no boot-up message within {0} after a reset")]
    NoBootUp(Duration),
    /// The node was started, and reports another state than OPERATIONAL.
    #[error("the node is {state} after {starts} commands to start")]
    NotStarted {
        /// The last reported state.
        state: NmtState,
        /// How often the command was sent.
        starts: u8,
    },
    /// The node was started, and does not report its state.
    #[error("the node was started, but reports its state by neither heartbeat (1017h) nor guarding")]
    NoState,
}

impl BootError {
    /// Whether the node did not answer in time: asking again may help.
    #[must_use]
    pub const fn is_time_out(&self) -> bool {
        matches!(
            self,
            BootError::NoDeviceType(SdoError::TimedOut { .. })
                | BootError::NoIdentity(SdoError::TimedOut { .. })
                | BootError::Configuration { error: SdoError::TimedOut { .. }, .. }
        )
    }
}
