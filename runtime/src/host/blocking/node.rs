//! A node and its dictionary.

use std::vec::Vec;

use super::Network;
use crate::host::named::{self, Reading, UnknownName};
use crate::host::settings::Found;
use crate::host::{AccessError, Link, LinkError, MappedPdo, PdoOptions, Settings};
use crate::id::NodeId;
use crate::object::{
    Address, Array, DeviceModel, Fits, Mapping, Name, Object, PdoDirection, Readable, Value, Values, Writable,
};
use crate::wire::nmt::NmtCommand;

/// A node that is bound to a dictionary: handles of another device do not compile. Made by [`Network::node`].
pub struct RemoteNode<'a, L, D> {
    network: &'a mut Network<L>,
    node: NodeId,
    device: D,
}

impl<L: Link> Network<L> {
    /// Binds a node and its dictionary. Nothing is sent.
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

    /// Writes settings in the order in which devices take them: see [`Settings`]. Most devices take some of them in
    /// PRE-OPERATIONAL only.
    ///
    /// Errors: [`AccessError`]: [`OutOfRange`](AccessError::OutOfRange) before anything is sent; else what was written
    /// before stays, and a PDO that was being changed stays switched off.
    pub fn configure<D>(&mut self, node: NodeId, settings: &Settings<D>) -> Result<(), AccessError> {
        let mut found = Found::default();
        for address in settings.questions()? {
            found.answer(address, &self.read_bytes(node, address)?);
        }
        settings.in_order(&found).into_iter().try_for_each(|write| self.write_bytes(node, write.address, &write.data))
    }

    /// Maps PDO `number` of a node, 1 to 512, by the procedure of CiA 301, 7.5.2.36 and 7.5.2.38: the PDO is switched
    /// off, changed and switched on. Most devices take that in PRE-OPERATIONAL only.
    ///
    /// Errors: [`AccessError::NoSuchPdo`], [`AccessError::NoCobId`].
    pub fn map<D: PdoDirection, V: Values, N>(
        &mut self,
        node: NodeId,
        number: u16,
        mapping: Mapping<D, V, N>,
        options: PdoOptions,
    ) -> Result<MappedPdo<D, V, N>, AccessError> {
        let pdo = options.pdo(node, D::DIRECTION, number)?;
        let id = pdo.choose(self.read(node, pdo.cob_id())?)?;
        self.configure(node, &pdo.settings(id, mapping.entries()))?;
        Ok(MappedPdo::new(id.id(), mapping))
    }
}

impl<L: Link, D: DeviceModel> RemoteNode<'_, L, D> {
    /// The node-ID.
    #[must_use]
    pub const fn id(&self) -> NodeId {
        self.node
    }

    /// The network.
    pub const fn network(&mut self) -> &mut Network<L> {
        self.network
    }

    /// Reads an object.
    pub fn read<T: Value, A: Readable, M, E: Fits<D>>(&mut self, object: Object<T, A, M, E>) -> Result<T, AccessError> {
        self.network.read(self.node, object)
    }

    /// Writes an object, when the data sheet allows the value.
    pub fn write<T: Value, A: Writable, M, E: Fits<D>>(
        &mut self,
        object: Object<T, A, M, E>,
        value: T,
    ) -> Result<(), AccessError> {
        self.network.write(self.node, object, value)
    }

    /// Reads all elements that the data sheet describes.
    pub fn read_all<T: Value, A: Readable, M, S, E: Fits<D>>(
        &mut self,
        array: Array<T, A, M, S, E>,
    ) -> Result<Vec<T>, AccessError> {
        array.iter().map(|element| self.read(element)).collect()
    }

    /// Reads the bytes of an entry of any type, up to 64 MiB.
    pub fn read_bytes(&mut self, address: Address) -> Result<Vec<u8>, AccessError> {
        self.network.read_bytes(self.node, address)
    }

    /// Writes bytes into an entry of any type.
    ///
    /// # Panics
    ///
    /// As [`Network::write_bytes`].
    pub fn write_bytes(&mut self, address: Address, data: &[u8]) -> Result<(), AccessError> {
        self.network.write_bytes(self.node, address, data)
    }

    /// An object by the name that it has in the data sheet, for tools. Letters and digits count, their case does not.
    ///
    /// Errors: every name is unknown if the dictionary was generated without names.
    pub fn by_name(&mut self, name: &str) -> Result<Named<'_, L>, UnknownName> {
        let name = named::find(self.device.names(), name)?;
        Ok(Named { network: self.network, node: self.node, name })
    }

    /// Commands the node.
    pub fn command(&mut self, command: NmtCommand) -> Result<(), LinkError> {
        self.network.command(command, Some(self.node))
    }

    /// Writes settings in the order in which devices take them: see [`Network::configure`].
    pub fn configure<E: Fits<D>>(&mut self, settings: &Settings<E>) -> Result<(), AccessError> {
        self.network.configure(self.node, settings)
    }

    /// Maps PDO `number`: see [`Network::map`].
    pub fn map<P: PdoDirection, V: Values, E: Fits<D>>(
        &mut self,
        number: u16,
        mapping: Mapping<P, V, E>,
        options: PdoOptions,
    ) -> Result<MappedPdo<P, V, E>, AccessError> {
        self.network.map(self.node, number, mapping, options)
    }
}

/// An object of a node, found by name. Made by [`RemoteNode::by_name`].
pub struct Named<'a, L> {
    network: &'a mut Network<L>,
    node: NodeId,
    name: &'static Name,
}

impl<L: Link> Named<'_, L> {
    /// What the dictionary says of it.
    #[must_use]
    pub const fn name(&self) -> &'static Name {
        self.name
    }

    /// Reads it.
    pub fn read(&mut self) -> Result<Reading, AccessError> {
        Ok(Reading::new(self.name, self.network.read_bytes(self.node, self.name.address)?))
    }

    /// Writes a value that is written as text, with its unit or as the name of a value: see [`Name::parse`].
    ///
    /// Errors: [`AccessError`]: [`NoValue`](AccessError::NoValue) before anything is sent.
    pub fn write(&mut self, text: &str) -> Result<(), AccessError> {
        self.network.write_bytes(self.node, self.name.address, &named::encode(self.name, text)?)
    }
}
