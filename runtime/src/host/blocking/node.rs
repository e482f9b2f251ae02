//! A node with its dictionary.

use std::vec::Vec;

use super::Network;
use crate::host::named::{self, Reading, UnknownName};
use crate::host::remote_node::remote_nodes;
use crate::host::settings::Found;
use crate::host::{AccessError, Link, LinkError, MappedPdo, PdoOptions, Settings};
use crate::id::NodeId;
use crate::manager::Shell;
use crate::object::{
    Address, Array, DeviceModel, Fits, Mapping, Name, Object, PdoDirection, Readable, Value, Values, Writable,
};
use crate::wire::nmt::NmtCommand;

/// A node bound to a dictionary: handles of another device do not compile. Made by [`Network::node`].
pub struct RemoteNode<'a, L, D> {
    network: &'a mut Network<L>,
    node: NodeId,
    device: D,
}

impl<L: Link> Network<L> {
    /// Binds a node to its dictionary. Nothing is sent.
    ///
    /// ```
    /// use lexican_runtime::NodeId;
    /// use lexican_runtime::host::{VirtualBus, blocking::Network};
    /// # mod servo {
    /// #     lexican_runtime::device_model!();
    /// #     pub const TARGET_POSITION: Object<i32, Rw> = Object::new(0x607A, 0);
    /// # }
    /// # mod encoder {
    /// #     lexican_runtime::device_model!();
    /// #     pub const POSITION: Object<u32, Ro> = Object::new(0x6004, 0);
    /// # }
    ///
    /// // `servo` and `encoder` are generated from data sheets.
    /// let mut network = Network::new(VirtualBus::new().link());
    /// let mut servo = network.node(NodeId::literal(3), servo::DEVICE);
    /// let written = servo.write(servo::TARGET_POSITION, 36_000);
    /// assert_eq!(written.unwrap_err().to_string(), "node 3: 607A:00: no answer of the device in time");
    /// ```
    ///
    /// ```compile_fail,E0277
    /// # use lexican_runtime::NodeId;
    /// # use lexican_runtime::host::{VirtualBus, blocking::Network};
    /// # mod servo {
    /// #     lexican_runtime::device_model!();
    /// # }
    /// # mod encoder {
    /// #     lexican_runtime::device_model!();
    /// #     pub const POSITION: Object<u32, Ro> = Object::new(0x6004, 0);
    /// # }
    /// # let mut network = Network::new(VirtualBus::new().link());
    /// # let mut servo = network.node(NodeId::literal(3), servo::DEVICE);
    /// // This object is not one of the node's device.
    /// servo.read(encoder::POSITION);
    /// ```
    pub const fn node<D: DeviceModel>(&mut self, node: NodeId, device: D) -> RemoteNode<'_, L, D> {
        RemoteNode { network: self, node, device }
    }
}

impl<L: Link> Shell for Network<L> {
    type Node<'s, D: DeviceModel>
        = RemoteNode<'s, L, D>
    where
        L: 's;

    fn bind<D: DeviceModel>(&mut self, node: NodeId, device: D) -> RemoteNode<'_, L, D> {
        self.node(node, device)
    }
}

impl<L: Link, D: DeviceModel> RemoteNode<'_, L, D> {
    /// The network.
    pub const fn network(&mut self) -> &mut Network<L> {
        self.network
    }
}

/// An object of a node, found by name. Made by [`RemoteNode::by_name`].
pub struct Named<'a, L> {
    network: &'a mut Network<L>,
    node: NodeId,
    name: &'static Name,
}

remote_nodes! { {} {} {mut} [L: Link,] Network = Network<L>, RemoteNode<D> = RemoteNode<'_, L, D>, Named = Named<'_, L> }
