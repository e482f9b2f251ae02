//! Which frames a network receives.

use std::collections::BTreeSet;
use std::vec::Vec;

use super::{Link, LinkError};
use crate::id::{CobId, NodeId};
use crate::manager::{Manager, Remote};
use crate::time::{Duration, Instant};

/// All frames, or only those of the manager's nodes. The link's filter follows when those change.
#[derive(Debug, Default)]
pub(super) struct FrameFilter {
    /// `None` for all frames; else the COB-IDs to receive besides those of the nodes.
    others: Option<Vec<CobId>>,
    /// The COB-IDs that the link was last given.
    current: BTreeSet<CobId>,
    /// `current` may be out of date.
    is_stale: bool,
    latency: Duration,
}

impl FrameFilter {
    /// All frames of this link.
    pub(super) fn new(link: &impl Link) -> Self {
        FrameFilter { latency: link.latency(), ..FrameFilter::default() }
    }

    /// All frames, or those of the manager's nodes and `others`.
    pub(super) fn choose(&mut self, others: Option<Vec<CobId>>) {
        self.others = others;
        self.is_stale = true;
    }

    /// Adds a node to the manager, unless it has the node.
    pub(super) fn include(&mut self, node: NodeId, manager: &mut Manager<127>, now: Instant) {
        if manager.remote(node).is_none() {
            manager.add(now, Remote::new(node)).expect("there is room for all 127 nodes");
            let client = manager.sdo(node).expect("it was added");
            *client = client.clone().with_timeout(client.timeout() + self.latency);
            self.is_stale = true;
        }
    }

    /// To be called when the manager's nodes may have changed.
    pub(super) const fn invalidate(&mut self) {
        self.is_stale = true;
    }

    /// Gives the link new COB-IDs, if they have changed.
    pub(super) fn apply(&mut self, manager: &Manager<127>, link: &mut impl Link) -> Result<(), LinkError> {
        if !core::mem::take(&mut self.is_stale) {
            return Ok(());
        }
        let wanted: BTreeSet<CobId> = match &self.others {
            None => BTreeSet::new(),
            Some(others) => {
                let nodes = manager.remotes().flat_map(Remote::cob_ids);
                // Never empty, since that would mean all frames.
                nodes.chain([CobId::TIME]).chain(others.iter().copied()).collect()
            }
        };
        if wanted != self.current {
            link.listen_to(&wanted.iter().copied().collect::<Vec<_>>())?;
            self.current = wanted;
        }
        Ok(())
    }
}
