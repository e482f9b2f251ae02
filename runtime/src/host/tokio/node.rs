//! A node and its dictionary.

use std::vec::Vec;

use super::Network;
use crate::host::named::{self, Reading, UnknownName};
use crate::host::settings::Found;
use crate::host::{AccessError, LinkError, MappedPdo, PdoOptions, Settings};
use crate::id::NodeId;
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

    /// Writes settings in the order in which devices take them: see [`Settings`]. Most devices take some of them in
    /// PRE-OPERATIONAL only.
    ///
    /// Errors: [`AccessError`]: [`OutOfRange`](AccessError::OutOfRange) before anything is sent; else what was written
    /// before stays, and a PDO that was being changed stays switched off. So it is if the call is dropped.
    pub async fn configure<D>(&self, node: NodeId, settings: &Settings<D>) -> Result<(), AccessError> {
        let mut found = Found::default();
        for address in settings.questions()? {
            found.answer(address, &self.read_bytes(node, address).await?);
        }
        for write in settings.in_order(&found) {
            self.write_bytes(node, write.address, &write.data).await?;
        }
        Ok(())
    }

    /// Maps PDO `number` of a node, 1 to 512, by the procedure of CiA 301, 7.5.2.36 and 7.5.2.38: the PDO is switched
    /// off, changed and switched on. Most devices take that in PRE-OPERATIONAL only.
    ///
    /// Errors: [`AccessError::NoSuchPdo`], [`AccessError::NoCobId`].
    pub async fn map<D: PdoDirection, V: Values, N>(
        &self,
        node: NodeId,
        number: u16,
        mapping: Mapping<D, V, N>,
        options: PdoOptions,
    ) -> Result<MappedPdo<D, V, N>, AccessError> {
        let pdo = options.pdo(node, D::DIRECTION, number)?;
        let id = pdo.choose(self.read(node, pdo.cob_id()).await?)?;
        self.configure(node, &pdo.settings(id, mapping.entries())).await?;
        Ok(MappedPdo::new(id.id(), mapping))
    }
}

impl<D: DeviceModel> RemoteNode<D> {
    /// The node-ID.
    #[must_use]
    pub const fn id(&self) -> NodeId {
        self.node
    }

    /// Reads an object.
    pub async fn read<T, A, M, E>(&self, object: Object<T, A, M, E>) -> Result<T, AccessError>
    where
        T: Value,
        A: Readable,
        E: Fits<D>,
    {
        self.network.read(self.node, object).await
    }

    /// Writes an object, when the data sheet allows the value.
    pub async fn write<T, A, M, E>(&self, object: Object<T, A, M, E>, value: T) -> Result<(), AccessError>
    where
        T: Value,
        A: Writable,
        E: Fits<D>,
    {
        self.network.write(self.node, object, value).await
    }

    /// Reads all elements that the data sheet describes.
    pub async fn read_all<T, A, M, S, E>(&self, array: Array<T, A, M, S, E>) -> Result<Vec<T>, AccessError>
    where
        T: Value,
        A: Readable,
        E: Fits<D>,
    {
        let mut values = Vec::new();
        for element in array.iter() {
            values.push(self.read(element).await?);
        }
        Ok(values)
    }

    /// Reads the bytes of an entry of any type, up to 64 MiB.
    pub async fn read_bytes(&self, address: Address) -> Result<Vec<u8>, AccessError> {
        self.network.read_bytes(self.node, address).await
    }

    /// Writes bytes into an entry of any type.
    ///
    /// # Panics
    ///
    /// As [`Network::write_bytes`].
    pub async fn write_bytes(&self, address: Address, data: &[u8]) -> Result<(), AccessError> {
        self.network.write_bytes(self.node, address, data).await
    }

    /// An object by the name that it has in the data sheet, for tools. Letters and digits count, their case does not.
    ///
    /// Errors: every name is unknown if the dictionary was generated without names.
    pub fn by_name(&self, name: &str) -> Result<Named<'_>, UnknownName> {
        let name = named::find(self.device.names(), name)?;
        Ok(Named { network: &self.network, node: self.node, name })
    }

    /// Commands the node.
    pub async fn command(&self, command: NmtCommand) -> Result<(), LinkError> {
        self.network.command(command, Some(self.node)).await
    }

    /// Writes settings in the order in which devices take them: see [`Network::configure`].
    pub async fn configure<E: Fits<D>>(&self, settings: &Settings<E>) -> Result<(), AccessError> {
        self.network.configure(self.node, settings).await
    }

    /// Maps PDO `number`: see [`Network::map`].
    pub async fn map<P: PdoDirection, V: Values, E: Fits<D>>(
        &self,
        number: u16,
        mapping: Mapping<P, V, E>,
        options: PdoOptions,
    ) -> Result<MappedPdo<P, V, E>, AccessError> {
        self.network.map(self.node, number, mapping, options).await
    }
}

/// An object of a node, found by name. Made by [`RemoteNode::by_name`].
#[derive(Debug)]
pub struct Named<'a> {
    network: &'a Network,
    node: NodeId,
    name: &'static Name,
}

impl Named<'_> {
    /// What the dictionary says of it.
    #[must_use]
    pub const fn name(&self) -> &'static Name {
        self.name
    }

    /// Reads it.
    pub async fn read(&self) -> Result<Reading, AccessError> {
        Ok(Reading::new(self.name, self.network.read_bytes(self.node, self.name.address).await?))
    }

    /// Writes a value that is written as text, with its unit or as the name of a value: see [`Name::parse`].
    ///
    /// Errors: [`AccessError`]: [`NoValue`](AccessError::NoValue) before anything is sent.
    pub async fn write(&self, text: &str) -> Result<(), AccessError> {
        self.network.write_bytes(self.node, self.name.address, &named::encode(self.name, text)?).await
    }
}
