//! The SDO transfers that handles have asked for.

use std::collections::{BTreeMap, VecDeque};
use std::vec::Vec;

use tokio::sync::oneshot;

use crate::host::{AccessError, Bytes};
use crate::id::NodeId;
use crate::manager::{Manager, Payloads, Remote};
use crate::object::Address;
use crate::service::sdo_client::{self, Payload};
use crate::time::Instant;

/// One transfer, and who waits for it.
pub(super) struct Transfer {
    node: NodeId,
    address: Address,
    /// The number of bytes to write; `None` to read.
    write: Option<u32>,
    payload: Bytes,
    begun: bool,
    reply: oneshot::Sender<Result<Vec<u8>, AccessError>>,
}

impl Transfer {
    pub(super) const fn new(
        node: NodeId,
        address: Address,
        write: Option<u32>,
        payload: Bytes,
        reply: oneshot::Sender<Result<Vec<u8>, AccessError>>,
    ) -> Self {
        Transfer { node, address, write, payload, begun: false, reply }
    }

    pub(super) const fn node(&self) -> NodeId {
        self.node
    }
}

/// The transfers of each node: the first is under way, the others wait.
#[derive(Default)]
pub(super) struct Transfers {
    of: BTreeMap<NodeId, VecDeque<Transfer>>,
    /// What a node without a transfer gets.
    nothing: [u8; 0],
}

impl Payloads for Transfers {
    fn of_node(&mut self, node: NodeId) -> &mut dyn Payload {
        match self.of.get_mut(&node).and_then(VecDeque::front_mut) {
            Some(transfer) => &mut transfer.payload,
            None => &mut self.nothing,
        }
    }
}

impl Transfers {
    /// Takes a transfer, and begins it when no other with its node is under way.
    pub(super) fn add(&mut self, transfer: Transfer, manager: &mut Manager<127>, now: Instant) {
        let node = transfer.node;
        let waiting = self.of.entry(node).or_default();
        waiting.push_back(transfer);
        if waiting.len() == 1 {
            self.begin(node, manager, now);
        }
    }

    /// A transfer ended: whoever asked for it is told, and the next one begins.
    pub(super) fn end(&mut self, node: NodeId, event: sdo_client::Event, manager: &mut Manager<127>, now: Instant) {
        let ended = self.of.get_mut(&node).and_then(|all| if all.front()?.begun { all.pop_front() } else { None });
        if let Some(transfer) = ended {
            let result = match event {
                sdo_client::Event::Done { len, .. } => Ok(transfer.payload.into_vec(len)),
                sdo_client::Event::Failed(error) => Err(AccessError::Sdo { node, error }),
            };
            // Nobody may be waiting any more.
            drop(transfer.reply.send(result));
        }
        self.begin(node, manager, now);
    }

    /// Begins transfers anew whose SDO client the application has replaced under them.
    pub(super) fn restart_lost(&mut self, manager: &mut Manager<127>, now: Instant) {
        let nodes: Vec<NodeId> = self.of.keys().copied().collect();
        for node in nodes {
            let begun = self.of.get(&node).and_then(VecDeque::front).is_some_and(|transfer| transfer.begun);
            if !(begun && manager.sdo(node).is_ok_and(|sdo| sdo.is_busy())) {
                self.begin(node, manager, now);
            }
        }
    }

    /// Begins the first transfer with a node that somebody still wants.
    fn begin(&mut self, node: NodeId, manager: &mut Manager<127>, now: Instant) {
        let Some(waiting) = self.of.get_mut(&node) else { return };
        while waiting.front().is_some_and(|transfer| transfer.reply.is_closed()) {
            waiting.pop_front();
        }
        let Some(transfer) = waiting.front_mut() else { return };
        if manager.remote(node).is_none() {
            manager.add(now, Remote::new(node)).expect("there is room for all 127 nodes");
        }
        let begun = match transfer.write {
            Some(len) => manager.write(now, node, transfer.address, len),
            None => manager.read(now, node, transfer.address),
        };
        // When the application has a transfer of its own under way, its end brings the next attempt.
        transfer.begun = begun.is_ok();
    }
}
