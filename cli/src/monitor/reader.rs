//! What the nodes are, and how they are configured: from SDO transfers, or by reading.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use lexican_eds::model::Device;
use lexican_runtime::cia301::{self, is_pdo_mapping};
use lexican_runtime::object::Address;
use lexican_runtime::wire::sdo::ClientRequest;
use lexican_runtime::{AbortCode, Duration, Frame, Instant, NodeId};

use lexican_toolbox::bus::sdo_channel::request_frame;
use lexican_toolbox::decode::{Decoded, Detail, Side};
use lexican_toolbox::node::identity::{PRODUCT, Shipped, VENDOR, recognise};
use lexican_toolbox::values::address;

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
    /// Whether the device of the node is given, recognised, or not needed.
    pub(super) fn is_settled(&self, node: NodeId) -> bool {
        self.settled.contains(&node)
    }

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

/// Reads entries of nodes, one at a time: their identity, or how their PDOs are configured.
#[derive(Default)]
pub(super) struct Reader {
    /// What is still to be read, in the order in which the nodes were heard.
    requests: VecDeque<(NodeId, Address)>,
    /// Whose identity is known, or read.
    heard: BTreeSet<NodeId>,
    /// The last use of the node's SDO channel by others.
    used: BTreeMap<NodeId, Instant>,
    /// The request without a response, and its deadline.
    open: Option<(NodeId, Instant)>,
}

impl Reader {
    pub(super) fn observe(&mut self, at: Instant, decoded: &Decoded) {
        let Some(node) = decoded.node else { return };
        if let Detail::Sdo(sdo) = &decoded.detail {
            match self.open {
                // Our own request, and the response to it.
                Some((asked, _)) if asked == node => {
                    if sdo.side == Side::Server {
                        self.open = None;
                    }
                }
                _ => drop(self.used.insert(node, at)),
            }
        }
    }

    /// The identity of a node that is heard for the first time is to be read.
    pub(super) fn read_identity(&mut self, node: NodeId) {
        if self.heard.insert(node) {
            self.requests.extend([(node, VENDOR), (node, PRODUCT)]);
        }
    }

    /// The PDO parameters of a node are to be read: identifiers and mappings, which the decoder hears.
    pub(super) fn read_mapping(&mut self, node: NodeId, device: &Device) {
        let parameters = device.entries().filter(|entry| match entry.index {
            cia301::RPDO_1..=cia301::RPDO_512 | cia301::TPDO_1..=cia301::TPDO_512 => entry.sub == 1,
            index => is_pdo_mapping(index),
        });
        self.requests.extend(parameters.map(|entry| (node, address(entry))));
    }

    /// The next request, when it is due.
    pub(super) fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        if self.poll_timeout().is_none_or(|at| at > now) {
            return None;
        }
        self.open = None;
        let (node, address) = self.requests.pop_front()?;
        self.open = Some((node, now + PATIENCE));
        Some(request_frame(node, ClientRequest::InitiateUpload { address }))
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        let (node, _) = self.requests.front()?;
        if let Some((_, deadline)) = self.open {
            return Some(deadline);
        }
        Some(self.used.get(node).map_or(Instant::ZERO, |used| *used + QUIET))
    }
}
