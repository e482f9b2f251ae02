//! The node methods of both shells, written once: of `Network`, `RemoteNode` and `Named`.

/// Makes the methods. A shell passes `async`, `.await` and `mut`, or nothing instead, and its types.
macro_rules! remote_nodes {
    (
        {$($async:tt)?} {$($await:tt)*} {$($mut:tt)?}
        [$($link:tt)*] Network = $network:ty, RemoteNode<D> = $remote:ty, Named = $named:ty
    ) => {
        impl<$($link)*> $network {
            /// Writes settings in the order in which devices accept them: see [`Settings`]. Most devices accept some of
            /// them in PRE-OPERATIONAL only.
            ///
            /// Errors: [`OutOfRange`](AccessError::OutOfRange) before anything is sent. After another error, or if the
            /// call is dropped, what was written stays, and a PDO that was being changed stays disabled.
            pub $($async)? fn configure<D>(
                &$($mut)? self,
                node: NodeId,
                settings: &Settings<D>,
            ) -> Result<(), AccessError> {
                let mut found = Found::default();
                for address in settings.questions()? {
                    found.answer(address, &self.read_bytes(node, address)$($await)*?);
                }
                for write in settings.in_order(&found) {
                    self.write_bytes(node, write.address, &write.data)$($await)*?;
                }
                Ok(())
            }

            /// Maps PDO `number` of a node, 1 to 512, by the procedure of CiA 301, 7.5.2.36 and 7.5.2.38: the PDO is
            /// disabled, changed and enabled. Most devices accept that in PRE-OPERATIONAL only.
            ///
            /// Errors: [`AccessError::NoSuchPdo`], [`AccessError::NoCobId`].
            pub $($async)? fn map<D: PdoDirection, V: Values, N>(
                &$($mut)? self,
                node: NodeId,
                number: u16,
                mapping: Mapping<D, V, N>,
                options: PdoOptions,
            ) -> Result<MappedPdo<D, V, N>, AccessError> {
                let pdo = options.pdo(node, D::DIRECTION, number)?;
                let id = pdo.choose(self.read(node, pdo.cob_id())$($await)*?)?;
                self.configure(node, &pdo.settings(id, mapping.entries()))$($await)*?;
                Ok(MappedPdo::new(id.id(), mapping))
            }
        }

        impl<$($link)* D: DeviceModel> $remote {
            /// The node-ID.
            #[must_use]
            pub const fn id(&self) -> NodeId {
                self.node
            }

            /// Reads an object.
            pub $($async)? fn read<T: Value, A: Readable, M, E: Fits<D>>(
                &$($mut)? self,
                object: Object<T, A, M, E>,
            ) -> Result<T, AccessError> {
                self.network.read(self.node, object)$($await)*
            }

            /// Writes an object, if the data sheet allows the value.
            pub $($async)? fn write<T: Value, A: Writable, M, E: Fits<D>>(
                &$($mut)? self,
                object: Object<T, A, M, E>,
                value: T,
            ) -> Result<(), AccessError> {
                self.network.write(self.node, object, value)$($await)*
            }

            /// Reads all elements that the data sheet describes.
            pub $($async)? fn read_all<T: Value, A: Readable, M, S, E: Fits<D>>(
                &$($mut)? self,
                array: Array<T, A, M, S, E>,
            ) -> Result<Vec<T>, AccessError> {
                let mut values = Vec::new();
                for element in array.iter() {
                    values.push(self.read(element)$($await)*?);
                }
                Ok(values)
            }

            /// Reads the bytes of an entry of any type, up to 64 MiB.
            pub $($async)? fn read_bytes(&$($mut)? self, address: Address) -> Result<Vec<u8>, AccessError> {
                self.network.read_bytes(self.node, address)$($await)*
            }

            /// Writes bytes into an entry of any type.
            ///
            /// # Panics
            ///
            /// As [`Network::write_bytes`].
            pub $($async)? fn write_bytes(&$($mut)? self, address: Address, data: &[u8]) -> Result<(), AccessError> {
                self.network.write_bytes(self.node, address, data)$($await)*
            }

            /// An object by its name in the data sheet, for tools. Letters and digits count, but not their case.
            ///
            /// Errors: every name is unknown if the dictionary was generated without names.
            pub fn by_name(&$($mut)? self, name: &str) -> Result<$named, UnknownName> {
                let name = named::find(self.device.names(), name)?;
                Ok(Named { network: &$($mut)? self.network, node: self.node, name })
            }

            /// Sends an NMT command to the node.
            pub $($async)? fn command(&$($mut)? self, command: NmtCommand) -> Result<(), LinkError> {
                self.network.command(command, Some(self.node))$($await)*
            }

            /// As [`Network::configure`].
            pub $($async)? fn configure<E: Fits<D>>(
                &$($mut)? self,
                settings: &Settings<E>,
            ) -> Result<(), AccessError> {
                self.network.configure(self.node, settings)$($await)*
            }

            /// As [`Network::map`].
            pub $($async)? fn map<P: PdoDirection, V: Values, E: Fits<D>>(
                &$($mut)? self,
                number: u16,
                mapping: Mapping<P, V, E>,
                options: PdoOptions,
            ) -> Result<MappedPdo<P, V, E>, AccessError> {
                self.network.map(self.node, number, mapping, options)$($await)*
            }
        }

        impl<$($link)*> $named {
            /// Its name and meaning in the dictionary.
            #[must_use]
            pub const fn name(&self) -> &'static Name {
                self.name
            }

            /// Reads the object.
            pub $($async)? fn read(&$($mut)? self) -> Result<Reading, AccessError> {
                Ok(Reading::new(self.name, self.network.read_bytes(self.node, self.name.address)$($await)*?))
            }

            /// Writes a value given as text, with its unit or as the name of a value: see [`Name::parse`].
            ///
            /// Errors: [`NoValue`](AccessError::NoValue) before anything is sent.
            pub $($async)? fn write(&$($mut)? self, text: &str) -> Result<(), AccessError> {
                self.network.write_bytes(self.node, self.name.address, &named::encode(self.name, text)?)$($await)*
            }
        }
    };
}

pub(super) use remote_nodes;
