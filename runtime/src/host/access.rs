//! The error of reading or writing an object, in both shells.

use super::LinkError;
use crate::id::NodeId;
use crate::object::{Address, LengthMismatch, OutOfRange};
use crate::service::sdo_client::SdoError;

/// Why an object of a node could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AccessError {
    /// The value is outside the limits of the data sheet. Nothing was sent.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The node has aborted the transfer, or does not answer.
    #[error("node {node}: {error}")]
    Sdo {
        /// Which node.
        node: NodeId,
        /// What happened.
        error: SdoError,
    },
    /// The node's value has another length than in the data sheet.
    #[error("node {node}, {address}: the device and its data sheet differ: {error}")]
    DataSheet {
        /// Which node.
        node: NodeId,
        /// Which entry.
        address: Address,
        /// The lengths.
        error: LengthMismatch,
    },
    /// The link has failed.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// The longest object that the shells read into memory.
pub(super) const LONGEST: usize = 64 << 20;
