//! Identifies nodes and learns their PDO configuration, from SDO transfers of others or by reading.

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

/// How long an SDO channel must be quiet before we use it, so that no transfer of another client is disturbed.
const QUIET: Duration = Duration::from_millis(200);

/// How long a node may take to respond.
const PATIENCE: Duration = Duration::from_millis(500);

/// Recognises nodes by identities that any client reads.
#[derive(Default)]
pub(super) struct IdentityListener {
    /// The vendor-ID and product code of each node, as far as heard. The inner `None` of the second means that the node
    /// has none.
    heard: BTreeMap<NodeId, (Option<u32>, Option<Option<u32>>)>,
    settled: BTreeSet<NodeId>,
}

impl IdentityListener {
    /// Whether the device of the node is given or recognised, or not needed.
    pub(super) fn is_settled(&self, node: NodeId) -> bool {
        self.settled.contains(&node)
    }

    /// Notes that the device of the node is given or not needed.
    pub(super) fn settle(&mut self, node: NodeId) {
        self.settled.insert(node);
    }

    /// Handles a frame; once both vendor-ID and product code are known, returns the node and its device.
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

/// The entry and the number in the response to an upload; `None` for the number if the node lacks the entry.
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

/// Reads entries of nodes one at a time: identities and PDO configurations.
#[derive(Default)]
pub(super) struct Reader {
    /// The entries still to be read, in the order in which nodes were heard.
    requests: VecDeque<(NodeId, Address)>,
    /// Nodes whose identity is known or is being read.
    heard: BTreeSet<NodeId>,
    /// When others last used the node's SDO channel.
    used: BTreeMap<NodeId, Instant>,
    /// The open request: its node and its deadline.
    open: Option<(NodeId, Instant)>,
}

impl Reader {
    pub(super) fn observe(&mut self, at: Instant, decoded: &Decoded) {
        let Some(node) = decoded.node else { return };
        if let Detail::Sdo(sdo) = &decoded.detail {
            match self.open {
                // This is our own request or its response.
                Some((asked, _)) if asked == node => {
                    if sdo.side == Side::Server {
                        self.open = None;
                    }
                }
                _ => drop(self.used.insert(node, at)),
            }
        }
    }

    /// Plans to read the identity of a node that is heard for the first time.
    pub(super) fn read_identity(&mut self, node: NodeId) {
        if self.heard.insert(node) {
            self.requests.extend([(node, VENDOR), (node, PRODUCT)]);
        }
    }

    /// Plans to read the PDO parameters of a node: COB-IDs and mappings. The decoder picks up the responses.
    pub(super) fn read_mapping(&mut self, node: NodeId, device: &Device) {
        let parameters = device.entries().filter(|entry| match entry.index {
            cia301::RPDO_1..=cia301::RPDO_512 | cia301::TPDO_1..=cia301::TPDO_512 => entry.sub == 1,
            index => is_pdo_mapping(index),
        });
        self.requests.extend(parameters.map(|entry| (node, address(entry))));
    }

    /// The next request, if it is due.
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
