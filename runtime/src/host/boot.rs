//! Booting a network from a shell: when the boot ends, and with which result.

use core::fmt;
use std::boxed::Box;
use std::collections::BTreeMap;
use std::vec::Vec;

use super::LinkError;
use crate::id::NodeId;
use crate::manager::{self, NetworkEvent};
use crate::procedure::BootError;

/// The nodes of a network and their configurations, for a shell to boot and keep up.
pub type Plan = manager::Network<Vec<u8>, 127>;

/// Why a network is not ready.
#[derive(Debug, thiserror::Error)]
pub enum BootNetworkError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Some mandatory nodes have not booted.
    #[error(transparent)]
    NotReady(#[from] NotReady),
}

/// Mandatory nodes that have not booted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotReady {
    /// Each with the reason; `None` if it was still being booted at the end of the boot time.
    pub nodes: Vec<(NodeId, Option<BootError>)>,
}

impl core::error::Error for NotReady {}

impl fmt::Display for NotReady {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, (node, error)) in self.nodes.iter().enumerate() {
            f.write_str(if number > 0 { "; " } else { "" })?;
            match error {
                Some(error) => write!(f, "node {node} has not booted: {error}")?,
                None => write!(f, "node {node} has not booted in time")?,
            }
        }
        Ok(())
    }
}

/// A network that a shell keeps up, and the errors since it was started.
#[derive(Debug)]
pub(super) struct Kept {
    pub(super) network: Box<Plan>,
    failed: BTreeMap<NodeId, BootError>,
}

impl Kept {
    pub(super) fn new(network: Plan) -> Self {
        Kept { network: Box::new(network), failed: BTreeMap::new() }
    }

    /// Handles an event. `Some` when it ends the boot: all mandatory nodes have booted, or some cannot.
    pub(super) fn follow(&mut self, event: NetworkEvent) -> Option<Result<(), NotReady>> {
        match event {
            NetworkEvent::Ready => return Some(Ok(())),
            NetworkEvent::BootTimeElapsed => return Some(Err(self.not_ready())),
            NetworkEvent::Failed { node, error, .. } => drop(self.failed.insert(node, error)),
            NetworkEvent::Booted(node) | NetworkEvent::Lost { node, .. } => drop(self.failed.remove(&node)),
            NetworkEvent::BootedUp(_) | NetworkEvent::StateChanged { .. } | NetworkEvent::BootLoop(_) => {}
        }
        self.network.is_stuck().then(|| Err(self.not_ready()))
    }

    fn not_ready(&self) -> NotReady {
        let nodes = self.network.missing().map(|node| (node, self.failed.get(&node).copied()));
        NotReady { nodes: nodes.collect() }
    }
}

/// Whether a node is being booted, so that other transfers with it must wait.
pub(super) fn is_booting(kept: Option<&Kept>, node: NodeId) -> bool {
    kept.is_some_and(|kept| kept.network.is_booting(node))
}
