//! A node whose entries are accessed one after the other.

use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link, LinkError};
use lexican_runtime::manager::Event;
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::{Payload, SdoError};
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{AbortCode, NodeId};

use crate::values::DeviceValues;
use crate::values::wire::parse_padded;

/// After this many timeouts in a row, a node counts as gone.
const SILENCE: usize = 3;

/// A node of a network, for many accesses in a row. Refusals are answers; after three timeouts in a row the node is
/// gone.
pub struct RemoteNode<'a, L> {
    network: &'a mut Network<L>,
    node: NodeId,
    silence: Silence,
}

/// Counts timeouts in a row.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silence(usize);

/// The value, or the node's refusal. Errors: the link has failed, or the node is gone.
pub type Answer<T> = Result<Result<T, Refusal>, AccessError>;

/// Access to the entries of a node in any shell, for backup and restore.
pub trait Entries {
    /// The node-ID.
    fn id(&self) -> NodeId;
    /// Reads an entry into `payload`, and returns the number of bytes.
    fn read_into(&mut self, address: Address, payload: &mut impl Payload) -> Answer<u32>;
    /// Writes `len` bytes, taken from `payload`.
    fn write_from(&mut self, address: Address, len: u32, payload: &mut impl Payload) -> Answer<()>;
    /// Reads an entry.
    fn read(&mut self, address: Address) -> Answer<Vec<u8>>;
    /// Writes an entry.
    fn write(&mut self, address: Address, data: &[u8]) -> Answer<()>;
    /// Sends an NMT command to the node.
    fn command(&mut self, command: NmtCommand) -> Result<(), LinkError>;
    /// Whether the node has booted since the last call.
    fn has_restarted(&mut self) -> Result<bool, LinkError>;
}

/// Why an entry was not accessed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The device has aborted the transfer.
    #[error("the device aborts: {0}")]
    Aborted(AbortCode),
    /// Why there was no valid response.
    #[error("{0}")]
    Failed(String),
}

impl<'a, L: Link> RemoteNode<'a, L> {
    /// A node that is not known to be gone.
    pub fn new(network: &'a mut Network<L>, node: NodeId) -> Self {
        RemoteNode { network, node, silence: Silence::default() }
    }

    /// The node-ID.
    #[must_use]
    pub fn id(&self) -> NodeId {
        self.node
    }

    /// The network.
    pub fn network(&mut self) -> &mut Network<L> {
        self.network
    }

    /// Reads the bytes of an entry.
    pub fn read(&mut self, address: Address) -> Answer<Vec<u8>> {
        let result = self.network.read_bytes(self.node, address);
        self.silence.answer(result)
    }

    /// See [`Entries::read_into`].
    pub fn read_into(&mut self, address: Address, payload: &mut impl Payload) -> Answer<u32> {
        let result = self.network.read_into(self.node, address, payload);
        self.silence.answer(result)
    }

    /// Writes an entry.
    pub fn write(&mut self, address: Address, data: &[u8]) -> Answer<()> {
        let result = self.network.write_bytes(self.node, address, data);
        self.silence.answer(result)
    }

    /// See [`Entries::write_from`].
    pub fn write_from(&mut self, address: Address, len: u32, payload: &mut impl Payload) -> Answer<()> {
        let result = self.network.write_from(self.node, address, len, payload);
        self.silence.answer(result)
    }

    /// Reads entries on which meanings and limits of others depend. If the node does not answer, the default of the
    /// data sheet counts.
    pub fn read_conditions(
        &mut self,
        conditions: impl IntoIterator<Item = Address>,
        values: &mut DeviceValues<'_>,
    ) -> Result<(), AccessError> {
        for condition in conditions {
            let Some(entry) = values.entry(condition).filter(|_| values.seen(condition).is_none()) else { continue };
            let value = self.read(condition)?.ok().and_then(|data| parse_padded(entry.data_type, &data));
            if let Some(value) = value {
                values.set(condition, &value);
            }
        }
        Ok(())
    }
}

impl Silence {
    /// Turns the third timeout in a row into an error, and other failures into refusals.
    pub fn answer<T>(&mut self, result: Result<T, AccessError>) -> Answer<T> {
        let error = match result {
            Ok(value) => {
                self.0 = 0;
                return Ok(Ok(value));
            }
            Err(error) => error,
        };
        let AccessError::Sdo { error: sdo, .. } = &error else { return Err(error) };
        self.0 = if matches!(sdo, SdoError::TimedOut { .. }) { self.0 + 1 } else { 0 };
        match *sdo {
            SdoError::Aborted { code, .. } => Ok(Err(Refusal::Aborted(code))),
            _ if self.0 >= SILENCE => Err(error),
            SdoError::TimedOut { .. } => Ok(Err(Refusal::Failed("no answer".to_owned()))),
            other => Ok(Err(Refusal::Failed(other.to_string()))),
        }
    }
}

impl<L: Link> Entries for RemoteNode<'_, L> {
    fn id(&self) -> NodeId {
        self.node
    }
    fn read_into(&mut self, address: Address, payload: &mut impl Payload) -> Answer<u32> {
        self.read_into(address, payload)
    }
    fn write_from(&mut self, address: Address, len: u32, payload: &mut impl Payload) -> Answer<()> {
        self.write_from(address, len, payload)
    }
    fn read(&mut self, address: Address) -> Answer<Vec<u8>> {
        self.read(address)
    }
    fn write(&mut self, address: Address, data: &[u8]) -> Answer<()> {
        self.write(address, data)
    }
    fn command(&mut self, command: NmtCommand) -> Result<(), LinkError> {
        self.network.command(command, Some(self.node))
    }
    fn has_restarted(&mut self) -> Result<bool, LinkError> {
        let (now, mut has_restarted) = (self.network.now(), false);
        while let Some(event) = self.network.next_event(now)? {
            has_restarted |= event == Event::BootedUp { node: self.node };
        }
        Ok(has_restarted)
    }
}
