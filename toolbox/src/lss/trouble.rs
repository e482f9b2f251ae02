//! The errors of a session.

use lexican_runtime::host::LinkError;
use lexican_runtime::service::lss_manager::{Event, LssError};
use lexican_runtime::{Duration, NodeId};

/// Why a session has failed.
#[derive(Debug, thiserror::Error)]
pub enum Trouble {
    /// No device with LSS responds.
    #[error("no device answers to LSS")]
    NoDevice,
    /// No device has the identity.
    #[error("no device with this identity answers")]
    NoSuchDevice,
    /// All devices have a node-ID.
    #[error("no device without node-ID answers")]
    NoUnconfigured,
    /// A device has no node-ID, but does not support fastscan.
    #[error("there is a device without node-ID, but it cannot be searched for: it has no LSS fastscan")]
    NoFastscan,
    /// The device was selected, but then does not tell its node-ID.
    #[error("the device does not report its node-ID")]
    NoNodeId,
    /// The device keeps its old node-ID, or does not store the new one.
    #[error("a device does not take node-ID {0} by LSS")]
    Refused(NodeId),
    /// Several devices are there where only one may be selected.
    #[error("more than one device answers")]
    Several,
    /// A response was lost, or came later than these times allow.
    #[error("{error}")]
    LostAnswer {
        /// What was received instead, if anything.
        error: LssError,
        /// The times of the session.
        times: Times,
    },
    /// A response that no device sends by CiA 305.
    #[error("an LSS operation ended unexpectedly: {0:?}")]
    Unexpected(Event),
    /// The link has failed.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// How long to wait for responses.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    /// For the response to a request.
    pub response: Duration,
    /// For each step of a fastscan.
    pub step: Duration,
}

/// Half a second, and 25 ms.
impl Default for Times {
    fn default() -> Self {
        Times { response: Duration::from_millis(500), step: Duration::from_millis(25) }
    }
}
