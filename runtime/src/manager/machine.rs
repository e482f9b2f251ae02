//! A machine as data: `lexican-machine` makes it of the machine's file where the program is built. Where it runs, nothing is
//! read and nothing allocated.

use super::assignment::{Assignment, OnLoss};
use super::error::Full;
use super::{Manager, Network, Remote};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{DeviceModel, Pdo};
use crate::time::{Duration, Instant};

/// What the manager of a machine does, generated of the machine's file.
#[derive(Clone, Debug)]
pub struct MachinePlan<const NODES: usize> {
    /// The nodes, with what is written into them.
    pub nodes: [(NodeId, Assignment<&'static [u8]>); NODES],
    /// What happens when a mandatory node is lost.
    pub on_loss: OnLoss,
    /// Whether all nodes are started by one command.
    pub start_all: bool,
    /// The time within which the mandatory nodes must boot; zero: whenever they do.
    pub boot_time: Duration,
    /// The period of SYNC; zero: there is none.
    pub sync: Duration,
    /// The manager's node-ID and the period of its heartbeat.
    pub heartbeat: Option<(NodeId, Duration)>,
}

impl<const NODES: usize> MachinePlan<NODES> {
    /// The network to boot: with `&[u8]` as `C` the configurations stay where the program is.
    ///
    /// Errors: [`Full`] when there are more nodes than the network has room for.
    pub fn network<C, const N: usize>(&self) -> Result<Network<C, N>, Full>
    where
        C: From<&'static [u8]> + AsRef<[u8]> + Clone,
    {
        let mut network = Network::new(self.on_loss).with_start_of_all(self.start_all);
        for (node, assignment) in &self.nodes {
            let configuration = C::from(assignment.plan.configuration);
            network.assign(*node, assignment.clone().with_configuration(configuration))?;
        }
        Ok(network)
    }

    /// Lets a manager send SYNC and heartbeats as the machine has them, and look after its nodes.
    ///
    /// Errors: [`Full`] when there are more nodes than the manager has room for.
    pub fn prepare<const N: usize>(&self, now: Instant, manager: &mut Manager<N>) -> Result<(), Full> {
        self.nodes.iter().try_for_each(|(node, _)| manager.add(now, Remote::new(*node)))?;
        manager.produce_sync(now, CobId::SYNC, self.sync, 0);
        if let Some((node, period)) = self.heartbeat {
            manager.produce_heartbeat(now, node, period);
        }
        Ok(())
    }
}

/// A PDO of a machine, which has one COB-ID.
pub trait MachinePdo: Pdo {
    /// The COB-ID that it has in the machine.
    const COB_ID: CobId;

    /// The values of a frame, if it is this PDO and as long as its mapping.
    #[must_use]
    fn received(frame: &Frame) -> Option<Self> {
        let is_this = frame.id() == Self::COB_ID && !frame.is_remote();
        is_this.then(|| Self::from_data(frame.data()).ok())?
    }

    /// The frame that carries the values.
    #[must_use]
    fn to_frame(self) -> Frame {
        self.frame(Self::COB_ID)
    }
}

/// What binds a node to its dictionary: a shell. A machine's nodes are methods of it.
pub trait Shell {
    /// A node with its dictionary.
    type Node<'s, D: DeviceModel>
    where
        Self: 's;

    /// Binds a node and its dictionary. Nothing is sent.
    fn bind<D: DeviceModel>(&mut self, node: NodeId, device: D) -> Self::Node<'_, D>;
}
