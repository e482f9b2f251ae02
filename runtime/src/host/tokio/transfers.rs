//! The SDO transfers that handles have asked for.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::vec::Vec;

use tokio::sync::oneshot;

use crate::abort::AbortCode;
use crate::host::filter::FrameFilter;
use crate::host::{AccessError, Bytes};
use crate::id::NodeId;
use crate::manager::{Manager, Payloads};
use crate::object::Address;
use crate::service::sdo_client::{self, Payload, SdoError};
use crate::time::{Duration, Instant};

/// A transfer, and the call that waits for it.
pub(super) struct Transfer {
    pub(super) address: Address,
    /// The number of bytes to write; `None` to read.
    pub(super) write: Option<u32>,
    pub(super) payload: Bytes,
    /// How long the call may take.
    pub(super) patience: Duration,
    pub(super) reply: oneshot::Sender<Result<Vec<u8>, AccessError>>,
}

/// A transfer that waits or is under way.
struct Pending {
    transfer: Transfer,
    asked: Instant,
    /// When it began, if it is under way.
    began: Option<Instant>,
}

impl Pending {
    /// When the call times out.
    fn deadline(&self) -> Instant {
        self.asked + self.transfer.patience
    }

    /// Whether it is under way, or its call still waits.
    fn is_wanted(&self) -> bool {
        self.began.is_some() || !self.transfer.reply.is_closed()
    }

    fn fail(self, node: NodeId, error: SdoError) {
        // The call may have been dropped.
        drop(self.transfer.reply.send(Err(AccessError::Sdo { node, error })));
    }

    fn time_out(self, node: NodeId) {
        let address = self.transfer.address;
        self.fail(node, SdoError::TimedOut { address });
    }
}

/// The transfers of each node: the first is under way, the others wait.
#[derive(Default)]
pub(super) struct Transfers {
    of: BTreeMap<NodeId, VecDeque<Pending>>,
    /// The earliest deadline of all calls.
    deadline: Option<Instant>,
    /// The nodes that are being booted over the same channel.
    held: BTreeSet<NodeId>,
    /// The payload of a node without a transfer, or with one that the application has begun through the manager.
    nothing: [u8; 0],
}

impl Payloads for Transfers {
    fn of_node(&mut self, node: NodeId) -> &mut dyn Payload {
        match self.of.get_mut(&node).and_then(VecDeque::front_mut) {
            Some(first) if first.began.is_some() => &mut first.transfer.payload,
            _ => &mut self.nothing,
        }
    }
}

impl Transfers {
    /// Holds back the transfers with a node, or no longer does.
    pub(super) fn hold(&mut self, node: NodeId, held: bool) {
        let _ = if held { self.held.insert(node) } else { self.held.remove(&node) };
    }

    /// Adds a transfer with a node of the manager, and begins it when no other one with the node is under way.
    pub(super) fn add(&mut self, node: NodeId, transfer: Transfer, manager: &mut Manager<127>, now: Instant) {
        let all = self.of.entry(node).or_default();
        // Calls that were dropped must not pile up.
        all.retain(Pending::is_wanted);
        let pending = Pending { transfer, asked: now, began: None };
        if pending.deadline() < Instant::MAX {
            self.deadline = self.deadline.into_iter().chain([pending.deadline()]).min();
        }
        all.push_back(pending);
        if all.len() == 1 {
            self.begin(node, manager, now);
        }
    }

    /// Ends a transfer: the call returns, and the next transfer begins.
    ///
    /// If the node does not answer, all calls return that were made before that transfer began: each of them would wait
    /// as long again.
    pub(super) fn end(&mut self, node: NodeId, event: sdo_client::Event, manager: &mut Manager<127>, now: Instant) {
        let Some(all) = self.of.get_mut(&node) else { return };
        if let Some(began) = all.front().and_then(|first| first.began)
            && let Some(Pending { transfer, .. }) = all.pop_front()
        {
            let result = match event {
                sdo_client::Event::Done { len, .. } => Ok(transfer.payload.into_vec(len)),
                sdo_client::Event::Failed(error) => Err(AccessError::Sdo { node, error }),
            };
            // The call may have been dropped.
            drop(transfer.reply.send(result));
            if let sdo_client::Event::Failed(SdoError::TimedOut { .. } | SdoError::Stalled { .. }) = event {
                let hopeless = all.partition_point(|pending| pending.asked <= began);
                all.drain(..hopeless).for_each(|pending| pending.time_out(node));
            }
        }
        self.begin(node, manager, now);
    }

    /// When the next call times out.
    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }

    /// Times out calls.
    pub(super) fn expire(&mut self, manager: &mut Manager<127>, now: Instant) {
        let has_timed_out = |pending: &Pending| pending.deadline() <= now;
        let nodes: Vec<NodeId> =
            self.of.iter().filter(|(_, all)| all.iter().any(has_timed_out)).map(|(node, _)| *node).collect();
        for node in nodes {
            let Some(all) = self.of.get_mut(&node) else { continue };
            let (over, left): (VecDeque<_>, VecDeque<_>) = core::mem::take(all).into_iter().partition(has_timed_out);
            *all = left;
            for pending in over {
                if pending.began.is_some()
                    && let Ok(sdo) = manager.sdo(node)
                {
                    sdo.abort(AbortCode::TIMED_OUT);
                }
                pending.time_out(node);
            }
            self.begin(node, manager, now);
        }
        let deadlines = self.of.values().flatten().map(Pending::deadline);
        self.deadline = deadlines.filter(|deadline| *deadline < Instant::MAX).min();
    }

    /// Restarts transfers whose SDO client the application has replaced.
    pub(super) fn restart_lost(&mut self, manager: &mut Manager<127>, filter: &mut FrameFilter, now: Instant) {
        let nodes: Vec<NodeId> = self.of.iter().filter(|(_, all)| !all.is_empty()).map(|(node, _)| *node).collect();
        for node in nodes {
            filter.include(node, manager, now);
            let Some(first) = self.of.get_mut(&node).and_then(VecDeque::front_mut) else { continue };
            if !manager.sdo(node).is_ok_and(|sdo| sdo.is_busy()) {
                first.began = None;
            }
            self.begin(node, manager, now);
        }
    }

    /// Begins the first transfer with a node whose call still waits, unless it is under way.
    pub(super) fn begin(&mut self, node: NodeId, manager: &mut Manager<127>, now: Instant) {
        let Some(all) = self.of.get_mut(&node).filter(|_| !self.held.contains(&node)) else { return };
        while all.front().is_some_and(|first| !first.is_wanted()) {
            all.pop_front();
        }
        let Some(Pending { transfer, began: began @ None, .. }) = all.front_mut() else { return };
        let begun = match transfer.write {
            Some(len) => manager.write(now, node, transfer.address, len),
            None => manager.read(now, node, transfer.address),
        };
        // If the application has a transfer under way, this one begins at its end.
        *began = begun.is_ok().then_some(now);
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
            let patience = Duration::from_secs(9);
            let transfer = Transfer { address, write: None, payload, patience, reply };
            transfers.add(node, transfer, &mut manager, Instant::ZERO);
            answer
        };
        // One under way, one whose call waits, and calls that were dropped.
        let _under_way = add();
        drop(add());
        let _wanted = add();
        (0..1000).for_each(|_| drop(add()));
        assert!(transfers.of[&node].len() <= 3, "{}", transfers.of[&node].len());
    }
}
