//! Keeps apart what the bench itself sends: its heartbeats and SDO requests are no trouble of the bus.

use std::collections::{BTreeMap, BTreeSet};

use lexican_runtime::NodeId;
use lexican_toolbox::bus::statistics::Report;
use lexican_toolbox::decode::{Decoded, Detail};

#[derive(Default)]
pub(crate) struct Own {
    /// The node-IDs with which it sends heartbeats for drives to watch.
    nodes: BTreeSet<NodeId>,
    /// The nodes whose last SDO request came from the bench.
    asked: BTreeSet<NodeId>,
    /// How many of the bench's transfers each node has aborted.
    aborts: BTreeMap<NodeId, u32>,
}

impl Own {
    /// Handles a frame.
    pub(crate) fn observe(&mut self, is_own: bool, decoded: &Decoded) {
        let Some(node) = decoded.node else { return };
        let is_from_node = decoded.is_from_node();
        match decoded.detail {
            Detail::ErrorControl { .. } if is_own => drop(self.nodes.insert(node)),
            // Somebody else uses this node-ID.
            Detail::ErrorControl { .. } => drop(self.nodes.remove(&node)),
            Detail::Sdo(_) if is_own && !is_from_node => drop(self.asked.insert(node)),
            Detail::Sdo(_) if !is_own && !is_from_node => drop(self.asked.remove(&node)),
            _ => {}
        }
    }

    /// Handles an aborted transfer.
    pub(crate) fn aborted(&mut self, node: NodeId) {
        if self.asked.contains(&node) {
            *self.aborts.entry(node).or_default() += 1;
        }
    }

    /// The report without what the bench itself has caused.
    pub(crate) fn removed_from(&self, mut report: Report) -> Report {
        report.nodes.retain(|of_node| self.nodes.iter().all(|own| own.get() != of_node.node));
        for of_node in &mut report.nodes {
            let own = NodeId::new(of_node.node).and_then(|node| self.aborts.get(&node)).copied().unwrap_or_default();
            of_node.sdo_aborts = of_node.sdo_aborts.saturating_sub(own);
        }
        report
    }
}
