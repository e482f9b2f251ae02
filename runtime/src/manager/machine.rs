//! A machine as data, which `lexican-machine` generates from the machine's file when the program is built. At run time
//! nothing is parsed and nothing allocated.

use super::assignment::{Assignment, OnLoss};
use super::error::Full;
use super::{Manager, Network, Remote};
use crate::frame::Frame;
use crate::id::{CobId, NodeId};
use crate::object::{DeviceModel, Pdo};
use crate::time::{Duration, Instant};

/// What the manager of a machine does, generated from the machine's file.
#[derive(Clone, Debug)]
pub struct MachinePlan<const NODES: usize> {
    /// The nodes with their configurations.
    pub nodes: [(NodeId, Assignment<&'static [u8]>); NODES],
    /// What happens when a mandatory node is lost.
    pub on_loss: OnLoss,
    /// Whether all nodes are started by one command.
    pub start_all: bool,
    /// The time within which the mandatory nodes must boot; zero means no limit.
    pub boot_time: Duration,
    /// The period of SYNC; zero means none.
    pub sync: Duration,
    /// The manager's node-ID and the period of its heartbeat.
    pub heartbeat: Option<(NodeId, Duration)>,
}

impl<const NODES: usize> MachinePlan<NODES> {
    /// The network to boot. With `&[u8]` as `C`, the configurations are not copied.
    ///
    /// Errors: [`Full`] if there are more nodes than the network has room for.
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

    /// Makes a manager send SYNC and heartbeats as the machine defines them, and adds the machine's nodes.
    ///
    /// Errors: [`Full`] if there are more nodes than the manager has room for.
    pub fn prepare<const N: usize>(&self, now: Instant, manager: &mut Manager<N>) -> Result<(), Full> {
        self.nodes.iter().try_for_each(|(node, _)| manager.add(now, Remote::new(*node)))?;
        manager.produce_sync(now, CobId::SYNC, self.sync, 0);
        if let Some((node, period)) = self.heartbeat {
            manager.produce_heartbeat(now, node, period);
        }
        Ok(())
    }
}

/// A PDO of a machine, which has a fixed COB-ID.
pub trait MachinePdo: Pdo {
    /// The COB-ID in the machine.
    const COB_ID: CobId;

    /// The values of a frame; `None` if it is another PDO, or shorter than the mapping.
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

/// A shell, which binds a node to its dictionary. The nodes of a machine are methods of it.
pub trait Shell {
    /// A node with its dictionary.
    type Node<'s, D: DeviceModel>
    where
        Self: 's;

    /// Binds a node to its dictionary. Nothing is sent.
    fn bind<D: DeviceModel>(&mut self, node: NodeId, device: D) -> Self::Node<'_, D>;
}
