//! Why a session has not led to what was wanted.

use lexican_runtime::host::LinkError;
use lexican_runtime::service::lss_manager::{Event, LssError};
use lexican_runtime::{Duration, NodeId};

/// Why a session has not led to what was wanted.
#[derive(Debug, thiserror::Error)]
pub enum Trouble {
    /// Nobody has LSS, or answers.
    #[error("no device answers to LSS")]
    NoDevice,
    /// Nobody has the identity.
    #[error("no device with this identity answers")]
    NoSuchDevice,
    /// All have a node-ID.
    #[error("no device without node-ID answers")]
    NoUnconfigured,
    /// One has no node-ID, and does not know the search.
    #[error("there is a device without node-ID, but it cannot be searched for: it has no LSS fastscan")]
    NoFastscan,
    /// It was selected, and does not answer any more.
    #[error("the device does not report its node-ID")]
    NoNodeId,
    /// It keeps its own, or does not store the new one.
    #[error("a device does not take node-ID {0} by LSS")]
    Refused(NodeId),
    /// Only one may be selected.
    #[error("more than one device answers")]
    Several,
    /// A response was lost, or later than these times allow.
    #[error("{error}")]
    LostAnswer {
        /// What came of it.
        error: LssError,
        /// The times of the session.
        times: Times,
    },
    /// No device does this.
    #[error("an LSS operation ended unexpectedly: {0:?}")]
    Unexpected(Event),
    /// The bus is gone.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// How long to wait for responses.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    /// After a request.
    pub response: Duration,
    /// In each step of a fastscan.
    pub step: Duration,
}

/// Half a second, and 25 ms.
impl Default for Times {
    fn default() -> Self {
        Times { response: Duration::from_millis(500), step: Duration::from_millis(25) }
    }
}
