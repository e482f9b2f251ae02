//! Backup and restore of a running machine and its nodes, for blocking programs; by the functions of the toolbox.

use std::fmt;

use lexican_eds::model::Device;
use lexican_runtime::NodeId;
use lexican_runtime::host::LinkError;
use lexican_runtime::host::tokio::{Event as NetworkEvent, Network, Runner};
use lexican_runtime::manager;
use lexican_runtime::object::{Address, TimeOfDay};
use lexican_runtime::service::sdo_client::Payload;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_toolbox::node::remote::{Answer, Entries, Silence};
use lexican_toolbox::parameters::archive::Archive;
use lexican_toolbox::parameters::backup::{Backup, backup};
use lexican_toolbox::parameters::restore::{Options, OtherDevice, Outcome, Settings, check_identity, restore};
use lexican_toolbox::parameters::{Ended, OnProgress};
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::TryRecvError;

use super::MachineError;
use super::tokio::{Machine, Node};

/// Why parameters were not saved, or not all written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "`Display` says what it is")]
pub enum ParametersError {
    #[error(transparent)]
    Machine(#[from] MachineError),
    #[error("no node can be read: {0}")]
    Nothing(String),
    #[error(transparent)]
    Ended(#[from] Ended),
    #[error("{node}: {other}; nothing was written")]
    Other { node: String, other: OtherDevice },
    /// The device has refused some of them.
    #[error("{0}")]
    Refused(Box<Restored>),
    #[error("{ended}; {restored}; the same call goes on from there")]
    Interrupted { ended: Ended, restored: Box<Restored> },
}

/// The result of writing parameters into a node, complete or not. `Display` is a sentence with everything that was
/// refused.
#[derive(Clone, Debug)]
pub struct Restored {
    /// The name of the node.
    pub node: String,
    /// What was done.
    pub outcome: Outcome,
}

impl fmt::Display for Restored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Outcome { written, equal, refused, switched_off, .. } = &self.outcome;
        let ending = if written.len() == 1 { "" } else { "s" };
        write!(f, "{}: {} parameter{ending} written, {equal} had their value", self.node, written.len())?;
        refused.iter().try_for_each(|(address, why)| write!(f, "; {address}: {why}"))?;
        switched_off.iter().try_for_each(|address| write!(f, "; the PDO of {address} is switched off"))
    }
}

/// Reads the parameters of a node; see [`backup`].
pub fn backup_node(
    node: &Node,
    runner: &Runner,
    domains: bool,
    progress: OnProgress<'_>,
) -> Result<Backup, ParametersError> {
    Ok(backup(&mut NodeEntries::new(node, runner), node.device()?, domains, progress)?)
}

/// Reads the parameters of all nodes. Nodes that are gone, or lack a node-ID or a data sheet, are listed as unread.
pub fn backup_machine(
    machine: &Machine,
    runner: &Runner,
    made: TimeOfDay,
    progress: OnProgress<'_>,
) -> Result<Archive, ParametersError> {
    let mut archive = Archive { machine: machine.file().name.clone(), made, ..Archive::default() };
    for name in machine.file().buses().flat_map(|bus| &bus.nodes).map(|node| &node.name.value) {
        match machine.node(name).and_then(|node| Ok((node.device()?.clone(), NodeEntries::new(&node, runner)))) {
            Ok((sheet, mut entries)) => archive.take(&mut entries, name, &sheet, progress)?,
            Err(error) => drop(archive.unread.insert(name.clone(), error.to_string())),
        }
    }
    match archive.nodes.is_empty() {
        true => Err(ParametersError::Nothing(archive.missing().collect::<Vec<_>>().join("; "))),
        false => Ok(archive),
    }
}

/// Writes the settings of the device `of` into a node; see [`restore`]. Vendor and product must be the same unless
/// `force` is set.
pub fn restore_node(
    node: &Node,
    runner: &Runner,
    (of, settings): (&Device, &Settings),
    options: Options,
    force: bool,
    progress: OnProgress<'_>,
) -> Result<Restored, ParametersError> {
    let mut entries = NodeEntries::new(node, runner);
    check(node, &mut entries, of, force)?;
    let mut restored = Restored { node: node.stated().name.value.clone(), outcome: Outcome::default() };
    match restore(&mut entries, node.device()?, settings, options, progress, &mut restored.outcome) {
        Err(ended) => Err(ParametersError::Interrupted { ended, restored: restored.into() }),
        Ok(()) if !restored.outcome.refused.is_empty() => Err(ParametersError::Refused(restored.into())),
        Ok(()) => Ok(restored),
    }
}

/// Writes the backup of each node, one after the other. All nodes are checked before anything is written.
pub fn restore_machine(
    machine: &Machine,
    runner: &Runner,
    archive: &Archive,
    options: Options,
    force: bool,
    progress: OnProgress<'_>,
) -> Result<Vec<Restored>, ParametersError> {
    let nodes = archive.nodes.iter().map(|it| Ok((machine.node(&it.name)?, it.device(&[]), it.settings())));
    let nodes = nodes.collect::<Result<Vec<_>, MachineError>>()?;
    nodes.iter().try_for_each(|(node, of, _)| check(node, &mut NodeEntries::new(node, runner), of, force))?;
    let restored =
        nodes.iter().map(|(node, of, settings)| restore_node(node, runner, (of, settings), options, force, progress));
    restored.collect()
}

fn check(node: &Node, entries: &mut NodeEntries, of: &Device, force: bool) -> Result<(), ParametersError> {
    match check_identity(entries, of)? {
        Err(other) if !force => Err(ParametersError::Other { node: node.stated().name.value.clone(), other }),
        _ => Ok(()),
    }
}

/// The entries of a machine's node. Other calls to the node wait meanwhile.
#[derive(Debug)]
struct NodeEntries {
    network: Network,
    runner: Runner,
    id: NodeId,
    events: Receiver<NetworkEvent>,
    silence: Silence,
}

impl NodeEntries {
    /// The entries of a node; calls block on `runner`.
    fn new(node: &Node, runner: &Runner) -> Self {
        let (network, events) = (node.network().clone(), node.network().events());
        NodeEntries { network, runner: runner.clone(), id: node.id(), events, silence: Silence::default() }
    }
}

impl Entries for NodeEntries {
    fn id(&self) -> NodeId {
        self.id
    }

    fn read_into(&mut self, address: Address, payload: &mut impl Payload) -> Answer<u32> {
        let read = self.read(address)?;
        Ok(read.map(|data| payload.store(0, &data) as u32))
    }

    fn write_from(&mut self, address: Address, len: u32, payload: &mut impl Payload) -> Answer<()> {
        let mut data = vec![0; len as usize];
        let loaded = payload.load(0, &mut data);
        self.write(address, &data[..loaded])
    }

    fn read(&mut self, address: Address) -> Answer<Vec<u8>> {
        self.silence.answer(self.runner.block_on(self.network.read_bytes(self.id, address)))
    }

    fn write(&mut self, address: Address, data: &[u8]) -> Answer<()> {
        self.silence.answer(self.runner.block_on(self.network.write_bytes(self.id, address, data)))
    }

    fn command(&mut self, command: NmtCommand) -> Result<(), LinkError> {
        self.runner.block_on(self.network.command(command, Some(self.id)))
    }

    fn has_restarted(&mut self) -> Result<bool, LinkError> {
        // After this call, everything that has happened is among the events.
        self.runner.block_on(self.network.now())?;
        let mut has_restarted = false;
        loop {
            match self.events.try_recv() {
                Ok(event) => {
                    has_restarted |= event == NetworkEvent::Manager(manager::Event::BootedUp { node: self.id });
                }
                // The boot-up may be among the lost events.
                Err(TryRecvError::Lagged(_)) => has_restarted = true,
                Err(_) => return Ok(has_restarted),
            }
        }
    }
}
