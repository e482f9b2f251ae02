//! A node and its dictionary.

use std::vec::Vec;

use super::Network;
use crate::host::named::{self, Reading, UnknownName};
use crate::host::remote_node::remote_nodes;
use crate::host::settings::Found;
use crate::host::{AccessError, LinkError, MappedPdo, PdoOptions, Settings};
use crate::id::NodeId;
use crate::manager::Shell;
use crate::object::{
    Address, Array, DeviceModel, Fits, Mapping, Name, Object, PdoDirection, Readable, Value, Values, Writable,
};
use crate::wire::nmt::NmtCommand;

/// A node that is bound to a dictionary: handles of another device do not compile. Made by [`Network::node`].
#[derive(Clone, Debug)]
pub struct RemoteNode<D> {
    network: Network,
    node: NodeId,
    device: D,
}

impl Network {
    /// Binds a node and its dictionary: as [the blocking shell](crate::host::blocking::Network::node) does. Nothing is
    /// sent.
    #[must_use]
    pub fn node<D: DeviceModel>(&self, node: NodeId, device: D) -> RemoteNode<D> {
        RemoteNode { network: self.clone(), node, device }
    }
}

impl Shell for Network {
    type Node<'s, D: DeviceModel> = RemoteNode<D>;

    fn bind<D: DeviceModel>(&mut self, node: NodeId, device: D) -> RemoteNode<D> {
        self.node(node, device)
    }
}

/// An object of a node, found by name. Made by [`RemoteNode::by_name`].
#[derive(Debug)]
pub struct Named<'a> {
    network: &'a Network,
    node: NodeId,
    name: &'static Name,
}

remote_nodes! { {async} {.await} {} [] Network = Network, RemoteNode<D> = RemoteNode<D>, Named = Named<'_> }
