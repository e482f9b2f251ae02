//! The error of reading or writing an object, in both shells.

use std::string::String;

use super::LinkError;
use crate::id::NodeId;
use crate::object::{Address, LengthMismatch, OutOfRange};
use crate::service::sdo_client::SdoError;

/// Why an object of a node could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum AccessError {
    /// The value is outside the limits of the data sheet. Nothing was sent.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The node has aborted the transfer, or has not answered.
    #[error("node {node}: {error}")]
    Sdo { node: NodeId, error: SdoError },
    /// The value has another length than in the data sheet.
    #[error("node {node}, {address}: the device and its data sheet differ: {error}")]
    DataSheet { node: NodeId, address: Address, error: LengthMismatch },
    /// There is no such PDO. Nothing was sent.
    #[error("there is no PDO {number}: PDOs have the numbers 1 to 512")]
    NoSuchPdo { number: u16 },
    /// A PDO has no COB-ID, and the predefined connection set has none for it. The PDO was left unchanged.
    #[error("PDO {number} has no COB-ID: choose one")]
    NoCobId { number: u16 },
    /// A text is not a value of an object. Nothing was sent.
    #[error("{address} {name:?}: {why}")]
    NoValue {
        address: Address,
        name: &'static str,
        /// What is wrong with the text, and what to write.
        why: String,
    },
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// The longest object that the shells read into memory.
pub(super) const LONGEST: usize = 64 << 20;
