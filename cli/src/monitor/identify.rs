//! Which devices there are: by what anybody reads of their identity, or by asking them.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use lexican_runtime::object::Address;
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use crate::decode::{Decoded, Detail, Side};
use crate::identity::{PRODUCT, Shipped, VENDOR, recognise};

/// Somebody else may be in the middle of a transfer: so long a channel must have been quiet.
const QUIET: Duration = Duration::from_millis(200);

/// How long a node may take to answer.
const PATIENCE: Duration = Duration::from_millis(500);

/// What was heard of the identities of nodes.
#[derive(Default)]
pub(super) struct Overheard {
    heard: BTreeMap<NodeId, (Option<u32>, Option<u32>)>,
    settled: BTreeSet<NodeId>,
}

impl Overheard {
    /// What the node is has been said, and is not to be found out.
    pub(super) fn settle(&mut self, node: NodeId) {
        self.settled.insert(node);
    }

    /// A node and what it is, as soon as its vendor and its product have been heard.
    pub(super) fn notice(&mut self, decoded: &Decoded) -> Option<(NodeId, &'static Shipped)> {
        let node = decoded.node.filter(|node| !self.settled.contains(node))?;
        let (address, number) = answered(decoded)?;
        let heard = self.heard.entry(node).or_default();
        match address {
            VENDOR => heard.0 = Some(number),
            PRODUCT => heard.1 = Some(number),
            _ => return None,
        }
        let (vendor, product) = (heard.0?, heard.1?);
        self.settle(node);
        Some((node, recognise(vendor, product)?))
    }
}

/// The number that a server told of an entry.
fn answered(decoded: &Decoded) -> Option<(Address, u32)> {
    let Detail::Sdo(sdo) = &decoded.detail else { return None };
    let told = sdo.told.as_ref().filter(|_| sdo.side == Side::Server && sdo.complete && sdo.writes == Some(false))?;
    let bytes = <[u8; 4]>::try_from(told.raw.as_deref()?).ok()?;
    Some((told.address, u32::from_le_bytes(bytes)))
}

/// Asks nodes for their identity, one question at a time.
#[derive(Default)]
pub(super) struct Asker {
    /// Nodes that were heard, in this order, and what they are to be asked.
    questions: VecDeque<(NodeId, Address)>,
    heard: BTreeSet<NodeId>,
    /// When the SDO channel of a node was last used.
    used: BTreeMap<NodeId, Instant>,
    /// The question that is not answered, and when it is given up.
    open: Option<(NodeId, Instant)>,
}

impl Asker {
    pub(super) fn notice(&mut self, at: Instant, decoded: &Decoded, overheard: &Overheard) {
        let Some(node) = decoded.node else { return };
        if let Detail::Sdo(sdo) = &decoded.detail {
            self.used.insert(node, at);
            if sdo.side == Side::Server && self.open.is_some_and(|(asked, _)| asked == node) {
                self.open = None;
            }
        }
        if decoded.is_from_node() && self.heard.insert(node) && !overheard.settled.contains(&node) {
            self.questions.extend([(node, VENDOR), (node, PRODUCT)]);
        }
    }

    /// The next question, when it is time for it.
    pub(super) fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if self.poll_timeout().is_none_or(|at| at > now) {
            return None;
        }
        self.open = None;
        let (node, address) = self.questions.pop_front()?;
        self.open = Some((node, now + PATIENCE));
        let request = ClientRequest::InitiateUpload { address };
        Some(Frame::from_array(CobId::of_node(0x600, node), request.to_bytes()))
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let (node, address) = self.questions.front()?;
        if let Some((_, patience)) = self.open {
            return Some(patience);
        }
        let used = self.used.get(node).filter(|_| *address == VENDOR);
        Some(used.map_or(Instant::ZERO, |used| *used + QUIET))
    }
}
