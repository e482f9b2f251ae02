//! What a manager and a network report.

use crate::frame::Frame;
use crate::id::NodeId;
use crate::object::TimeOfDay;
use crate::procedure::BootError;
use crate::service::{node_guard, sdo_client};
use crate::wire::emcy::Emergency;
use crate::wire::nmt::NmtState;

/// What a manager learned. One frame or deadline is at most one event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Event {
    /// A node sent its boot-up message; also one that the manager does not look after.
    BootedUp { node: NodeId },
    /// A node's state was heard for the first time, or for the first time after it was lost.
    Appeared { node: NodeId, state: NmtState },
    /// A node is in another state.
    StateChanged { node: NodeId, state: NmtState },
    /// A node's heartbeat or guarding answer is overdue.
    Lost { node: NodeId },
    /// A node's guarding answers do not alternate.
    ToggleError { node: NodeId },
    /// A node that the manager does not look after sends heartbeats or guarding answers.
    Stranger { node: NodeId, state: NmtState },
    /// A node reports an error, or the end of one.
    Emergency { node: NodeId, emergency: Emergency },
    /// An SDO transfer ended.
    Sdo { node: NodeId, event: sdo_client::Event },
    /// A data frame that is no other message: a PDO, to be [read](crate::object::Pdo::from_data) by who knows the mapping.
    Pdo {
        /// The node that the manager looks after whose TPDO has this COB-ID in the predefined connection
        /// set. The PDOs of a network may be arranged otherwise.
        node: Option<NodeId>,
        frame: Frame,
    },
    /// Another node sends SYNC, with the COB-ID of [`Manager::produce_sync`](super::Manager::produce_sync), 080h unless set.
    Sync(Frame),
    /// Another node sends the time of day.
    Time(TimeOfDay),
    /// Something happened in the network that a shell boots and keeps. A [`Manager`](super::Manager) alone reports none.
    Network(NetworkEvent),
}

impl Event {
    /// What the watch over a node has noticed.
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

/// What happened in the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum NetworkEvent {
    /// A node has booted: it is what it shall be, and reports OPERATIONAL if it was to be started.
    Booted(NodeId),
    /// A node does not boot. It is tried again with its next boot-up message.
    Failed {
        node: NodeId,
        /// Whether the network can do without it.
        mandatory: bool,
        error: BootError,
    },
    /// All mandatory nodes have booted, for the first time or again. Returned by a call of `handle_timeout` that
    /// is due at once.
    Ready,
    /// Not all mandatory nodes have booted within the boot time (1F89h).
    BootTimeElapsed,
    /// A node that is not booted without asking has sent its boot-up message; [`Network::boot`](super::Network::boot) boots it.
    BootedUp(NodeId),
    /// A node that has booted reports another state than before: it was commanded by another manager, or has an error.
    StateChanged { node: NodeId, state: NmtState },
    /// A node is lost; it is booted again, or what [`OnLoss`](super::OnLoss) says happens.
    Lost {
        node: NodeId,
        /// Whether the network can do without it.
        mandatory: bool,
    },
    /// A node boots again and again, or is lost again and again: from now on there is a pause between two attempts to
    /// recover it, which grows from 1 s to 32 s. Reported once, until there was no such occasion for 64 s.
    BootLoop(NodeId),
}
