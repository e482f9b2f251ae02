//! Whom a network hears, so that links can leave out the others.

use std::collections::BTreeSet;
use std::vec::Vec;

use super::{Link, LinkError};
use crate::id::{CobId, NodeId};
use crate::manager::{Manager, Remote};
use crate::time::Instant;

/// Everybody, or only the nodes that the manager looks after. Those may become others at any time: what the
/// link listens to follows.
#[derive(Debug, Default)]
pub(super) struct Audience {
    /// `None` for everybody; else what is heard besides the nodes.
    others: Option<Vec<CobId>>,
    /// What the link was told last.
    told: BTreeSet<CobId>,
    /// The manager may look after other nodes than when the link was told.
    is_doubtful: bool,
}

impl Audience {
    /// Everybody, or the manager's nodes and `others`.
    pub(super) fn choose(&mut self, others: Option<Vec<CobId>>) {
        self.others = others;
        self.is_doubtful = true;
    }

    /// Looks after a node that nobody looks after yet: it is to be read or written, and heard.
    pub(super) fn include(&mut self, node: NodeId, manager: &mut Manager<127>, now: Instant) {
        if manager.remote(node).is_none() {
            manager.add(now, Remote::new(node)).expect("there is room for all 127 nodes");
            self.is_doubtful = true;
        }
    }

    /// To be called when the manager may have got to look after other nodes.
    pub(super) const fn doubt(&mut self) {
        self.is_doubtful = true;
    }

    /// Tells the link what to listen to, when that is no longer what it was told.
    pub(super) fn follow(&mut self, manager: &Manager<127>, link: &mut impl Link) -> Result<(), LinkError> {
        if !core::mem::take(&mut self.is_doubtful) {
            return Ok(());
        }
        let wanted: BTreeSet<CobId> = match &self.others {
            None => BTreeSet::new(),
            Some(others) => {
                let nodes = manager.remotes().flat_map(Remote::cob_ids);
                // Never empty, which would be everybody.
                nodes.chain([CobId::TIME]).chain(others.iter().copied()).collect()
            }
        };
        if wanted != self.told {
            link.listen_to(&wanted.iter().copied().collect::<Vec<_>>())?;
            self.told = wanted;
        }
        Ok(())
    }
}
