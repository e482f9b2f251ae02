//! The SDO transfers that handles have asked for.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::vec::Vec;

use tokio::sync::oneshot;

use crate::host::audience::Audience;
use crate::host::{AccessError, Bytes};
use crate::id::NodeId;
use crate::manager::{Manager, Payloads};
use crate::object::Address;
use crate::service::sdo_client::{self, Payload};
use crate::time::Instant;

/// One transfer, and who waits for it.
pub(super) struct Transfer {
    pub(super) address: Address,
    /// The number of bytes to write; `None` to read.
    pub(super) write: Option<u32>,
    pub(super) payload: Bytes,
    pub(super) begun: bool,
    pub(super) reply: oneshot::Sender<Result<Vec<u8>, AccessError>>,
}

impl Transfer {
    /// Whether it is under way, or somebody still waits for it.
    fn counts(&self) -> bool {
        self.begun || !self.reply.is_closed()
    }
}

/// The transfers of each node: the first is under way, the others wait.
#[derive(Default)]
pub(super) struct Transfers {
    of: BTreeMap<NodeId, VecDeque<Transfer>>,
    /// The nodes that are being booted over the same channel.
    held: BTreeSet<NodeId>,
    /// What a node gets that has no transfer, or one of the application's own.
    nothing: [u8; 0],
}

impl Payloads for Transfers {
    fn of_node(&mut self, node: NodeId) -> &mut dyn Payload {
        match self.of.get_mut(&node).and_then(VecDeque::front_mut) {
            Some(transfer) if transfer.begun => &mut transfer.payload,
            _ => &mut self.nothing,
        }
    }
}

impl Transfers {
    /// Begins no transfer with a node, or does so again.
    pub(super) fn hold(&mut self, node: NodeId, held: bool) {
        let _ = if held { self.held.insert(node) } else { self.held.remove(&node) };
    }

    /// Begins the transfer that waits, if one does.
    pub(super) fn resume(&mut self, node: NodeId, manager: &mut Manager<127>, now: Instant) {
        if self.of.get(&node).and_then(VecDeque::front).is_some_and(|transfer| !transfer.begun) {
            self.begin(node, manager, now);
        }
    }

    /// Takes a transfer with a node that the manager looks after, and begins it when no other with it is under way.
    pub(super) fn add(&mut self, node: NodeId, transfer: Transfer, manager: &mut Manager<127>, now: Instant) {
        let all = self.of.entry(node).or_default();
        // Whoever has lost patience once does so again: what they have left behind must not pile up.
        all.retain(Transfer::counts);
        all.push_back(transfer);
        if all.len() == 1 {
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
    pub(super) fn restart_lost(&mut self, manager: &mut Manager<127>, audience: &mut Audience, now: Instant) {
        let nodes: Vec<NodeId> = self.of.iter().filter(|(_, all)| !all.is_empty()).map(|(node, _)| *node).collect();
        for node in nodes {
            audience.include(node, manager, now);
            let begun = self.of.get(&node).and_then(VecDeque::front).is_some_and(|transfer| transfer.begun);
            if !(begun && manager.sdo(node).is_ok_and(|sdo| sdo.is_busy())) {
                self.begin(node, manager, now);
            }
        }
    }

    /// Begins the first transfer with a node that somebody still wants.
    fn begin(&mut self, node: NodeId, manager: &mut Manager<127>, now: Instant) {
        let Some(all) = self.of.get_mut(&node).filter(|_| !self.held.contains(&node)) else { return };
        while all.front().is_some_and(|transfer| transfer.reply.is_closed()) {
            all.pop_front();
        }
        let Some(transfer) = all.front_mut() else { return };
        let begun = match transfer.write {
            Some(len) => manager.write(now, node, transfer.address, len),
            None => manager.read(now, node, transfer.address),
        };
        // When the application has a transfer of its own under way, its end brings the next attempt.
        transfer.begun = begun.is_ok();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manager::Remote;

    #[test]
    fn calls_that_were_dropped_leave_nothing_behind_while_another_is_under_way() {
        let (node, mut manager, mut transfers) = (NodeId::literal(1), Manager::new(), Transfers::default());
        manager.add(Instant::ZERO, Remote::new(node)).unwrap();
        let mut add = || {
            let (reply, answer) = oneshot::channel();
            let (address, payload) = (Address::new(0x1000, 0), Bytes::default());
            let transfer = Transfer { address, write: None, payload, begun: false, reply };
            transfers.add(node, transfer, &mut manager, Instant::ZERO);
            answer
        };
        // One under way, one that is wanted, and between them those of somebody who has lost patience.
        let _under_way = add();
        drop(add());
        let _wanted = add();
        (0..1000).for_each(|_| drop(add()));
        assert!(transfers.of[&node].len() <= 3, "{}", transfers.of[&node].len());
    }
}
