//! What the nodes are: from SDO transfers of their identity, or by reading it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use lexican_runtime::cia301::connection;
use lexican_runtime::object::Address;
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{AbortCode, CobId, Duration, Frame, Instant, NodeId};

use crate::decode::{Decoded, Detail, Side};
use crate::identity::{PRODUCT, Shipped, VENDOR, recognise};

/// How long an SDO channel must be quiet, so that no transfer of another client is disturbed.
const QUIET: Duration = Duration::from_millis(200);

/// How long a node may take to respond.
const PATIENCE: Duration = Duration::from_millis(500);

/// Recognises nodes by the identity that they report to any client.
#[derive(Default)]
pub(super) struct IdentityListener {
    /// The vendor and the product of each node; it may say that it has no product.
    heard: BTreeMap<NodeId, (Option<u32>, Option<Option<u32>>)>,
    settled: BTreeSet<NodeId>,
}

impl IdentityListener {
    /// The device of the node is given, or known not to be needed.
    pub(super) fn settle(&mut self, node: NodeId) {
        self.settled.insert(node);
    }

    /// Handles a frame; returns the node and its device when both vendor and product have been heard.
    pub(super) fn observe(&mut self, decoded: &Decoded) -> Option<(NodeId, &'static Shipped)> {
        let node = decoded.node.filter(|node| !self.settled.contains(node))?;
        let (address, number) = response(decoded)?;
        let heard = self.heard.entry(node).or_default();
        match address {
            VENDOR => heard.0 = number,
            PRODUCT => heard.1 = Some(number),
            _ => return None,
        }
        let (vendor, product) = (heard.0?, heard.1?);
        self.settle(node);
        Some((node, recognise(vendor, product)?))
    }
}

/// The entry and the number of an upload's response; no number if the node does not have the entry.
fn response(decoded: &Decoded) -> Option<(Address, Option<u32>)> {
    let Detail::Sdo(sdo) = &decoded.detail else { return None };
    let report = sdo.report.as_ref().filter(|_| sdo.side == Side::Server)?;
    if let Some(AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX) = sdo.abort {
        return Some((report.address, None));
    }
    if !sdo.complete || sdo.writes != Some(false) {
        return None;
    }
    let bytes = <[u8; 4]>::try_from(report.raw.as_deref()?).ok()?;
    Some((report.address, Some(u32::from_le_bytes(bytes))))
}

/// Reads the identities of nodes, one entry at a time.
#[derive(Default)]
pub(super) struct IdentityReader {
    /// What is still to be read, in the order in which the nodes were heard.
    requests: VecDeque<(NodeId, Address)>,
    heard: BTreeSet<NodeId>,
    /// The last use of the node's SDO channel.
    used: BTreeMap<NodeId, Instant>,
    /// The request without a response, and its deadline.
    open: Option<(NodeId, Instant)>,
}

impl IdentityReader {
    pub(super) fn observe(&mut self, at: Instant, decoded: &Decoded, listener: &IdentityListener) {
        let Some(node) = decoded.node else { return };
        if let Detail::Sdo(sdo) = &decoded.detail {
            self.used.insert(node, at);
            if sdo.side == Side::Server && self.open.is_some_and(|(asked, _)| asked == node) {
                self.open = None;
            }
        }
        if decoded.is_from_node() && self.heard.insert(node) && !listener.settled.contains(&node) {
            self.requests.extend([(node, VENDOR), (node, PRODUCT)]);
        }
    }

    /// The next request, when it is due.
    pub(super) fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if self.poll_timeout().is_none_or(|at| at > now) {
            return None;
        }
        self.open = None;
        let (node, address) = self.requests.pop_front()?;
        self.open = Some((node, now + PATIENCE));
        let request = ClientRequest::InitiateUpload { address };
        Some(Frame::from_array(CobId::of_node(connection::SDO_REQUEST, node), request.to_bytes()))
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let (node, address) = self.requests.front()?;
        if let Some((_, deadline)) = self.open {
            return Some(deadline);
        }
        let used = self.used.get(node).filter(|_| *address == VENDOR);
        Some(used.map_or(Instant::ZERO, |used| *used + QUIET))
    }
}
