//! Errors of a manager.

use crate::id::NodeId;
use crate::service::sdo_client::Busy;

/// There is no room for another node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("node {node} does not fit: the manager has room for {nodes} nodes")]
pub struct Full {
    /// The node that does not fit.
    pub node: NodeId,
    /// How many nodes the manager has room for.
    pub nodes: usize,
}

/// Why an SDO transfer cannot begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BeginError {
    /// The manager does not have the node.
    #[error("node {0} was not added to the manager")]
    UnknownNode(NodeId),
    /// Another transfer with the node is under way.
    #[error(transparent)]
    Busy(#[from] Busy),
}
