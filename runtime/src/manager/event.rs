//! What a manager and a network report.

use crate::frame::Frame;
use crate::id::NodeId;
use crate::object::TimeOfDay;
use crate::procedure::BootError;
use crate::service::{node_guard, sdo_client};
use crate::wire::emcy::Emergency;
use crate::wire::nmt::NmtState;

/// What a manager has noticed. One frame or deadline leads to at most one event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Event {
    /// A node sent its boot-up message; it may be a node that the manager does not have.
    BootedUp { node: NodeId },
    /// A node's state was heard for the first time, or for the first time after it was lost.
    Appeared { node: NodeId, state: NmtState },
    /// A node has changed its state.
    StateChanged { node: NodeId, state: NmtState },
    /// A node's heartbeat or guarding answer is overdue.
    Lost { node: NodeId },
    /// A node's guarding answers do not alternate.
    ToggleError { node: NodeId },
    /// A node that the manager does not have sends heartbeats or guarding answers.
    Stranger { node: NodeId, state: NmtState },
    /// A node reports an error, or the end of one.
    Emergency { node: NodeId, emergency: Emergency },
    /// An SDO transfer ended.
    Sdo { node: NodeId, event: sdo_client::Event },
    /// A data frame that is no other message: a PDO, to be [decoded](crate::object::Pdo::from_data) with the known
    /// mapping.
    Pdo {
        /// The manager's node whose TPDO has this COB-ID in the predefined connection set. The PDOs of a network may be
        /// configured differently.
        node: Option<NodeId>,
        frame: Frame,
    },
    /// Another node sends SYNC, with the COB-ID of [`Manager::produce_sync`](super::Manager::produce_sync), by default
    /// 080h.
    Sync(Frame),
    /// Another node sends the time of day.
    Time(TimeOfDay),
    /// An event of the network that a shell boots and keeps up. A [`Manager`](super::Manager) alone reports none.
    Network(NetworkEvent),
}

impl Event {
    /// The event for what the monitoring of a node has noticed.
    pub(super) const fn of_watch(node: NodeId, event: node_guard::Event) -> Self {
        match event {
            node_guard::Event::BootedUp => Event::BootedUp { node },
            node_guard::Event::Started(state) => Event::Appeared { node, state },
            node_guard::Event::StateChanged(state) => Event::StateChanged { node, state },
            node_guard::Event::ToggleError => Event::ToggleError { node },
            node_guard::Event::Lost => Event::Lost { node },
        }
    }
}

/// An event of the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum NetworkEvent {
    /// A node has booted: it is as planned, and reports OPERATIONAL if it was to be started.
    Booted(NodeId),
    /// A node does not boot. It is tried again at its next boot-up message.
    Failed {
        node: NodeId,
        /// Whether the network needs the node to be ready.
        mandatory: bool,
        error: BootError,
    },
    /// All mandatory nodes have booted, for the first time or again. Returned by `handle_timeout`, which is then due at
    /// once.
    Ready,
    /// Not all mandatory nodes have booted within the boot time (1F89h).
    BootTimeElapsed,
    /// A node that is not booted by itself has sent its boot-up message; [`Network::boot`](super::Network::boot) boots
    /// it.
    BootedUp(NodeId),
    /// A booted node reports another state than before: another manager has commanded it, or it has an error.
    StateChanged { node: NodeId, state: NmtState },
    /// A node is lost; it is booted again, or [`OnLoss`](super::OnLoss) says what happens.
    Lost {
        node: NodeId,
        /// Whether the network needs the node to be ready.
        mandatory: bool,
    },
    /// A node boots, or is lost, again and again. From now on there is a pause between two attempts to recover it, which
    /// grows from 1 s to 32 s. Reported again only after 64 s without such an occasion.
    BootLoop(NodeId),
}
