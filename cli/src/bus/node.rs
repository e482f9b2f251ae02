//! The nodes of a command, and their data sheets.

use std::path::{Path, PathBuf};

use clap_complete::engine::ArgValueCompleter;
use lexican_eds::library;
use lexican_eds::model::Device;
use lexican_machine::Machine;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link, Pace};
use lexican_runtime::manager::Remote;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::node::identity::{PRODUCT, Shipped, VENDOR, recognise};
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::restore::check_identity;

use super::{Bus, BusArgs, NodeIds, SheetName, network};
use crate::completions::devices;
use crate::device::{load, load_input};
use crate::machine::machine_of_sheet;
use crate::output::{Failure, Outcome, note, warn};
use lexican_toolbox::text::duration::milliseconds;

/// The help of an argument that is a node.
pub(crate) const NODE: &str =
    "The node-ID: 1 to 127, or 0x1 to 0x7F; may be left out for a simulation, and where the URL names the drive";

/// The help of an argument that is several nodes.
pub(crate) const NODES: &str =
    "The node-IDs: 5, 0x10, 3,5-9; may be left out for a simulation, and where the URL names the drive";

/// The arguments of a command that talks with nodes by their data sheets.
#[derive(clap::Args, Debug)]
pub(crate) struct NetworkArgs {
    #[command(flatten)]
    bus: BusArgs,

    #[command(flatten)]
    pub(crate) sheet: SheetArgs,
}

/// The arguments that say what a node is, and how long it may take.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct SheetArgs {
    /// The device: an EDS, DCF or XDD file, or a device that lexican knows; none for an unknown device; for several nodes 5=FILE, for each
    ///
    /// By default the device that is named in the URL of the bus, else the device that lexican knows by the node's identity (1018h).
    /// A node whose vendor is not that of the data sheet is refused; another product is warned of.
    #[arg(long, value_name = "FILE|DEVICE", add = ArgValueCompleter::new(devices))]
    device: Vec<SheetName>,

    /// Corrections and meanings in addition to the data sheet (TOML); may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,

    /// How long each answer of a node may take
    #[arg(long, value_name = "TIME", default_value = "1s", value_parser = milliseconds)]
    timeout: Duration,
}

/// When a named data sheet is refused because the node's identity (1018h) is another one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Identity {
    /// If the vendor is another; of another product it is warned: makers have data sheets for several.
    #[default]
    Vendor,
    /// If vendor or product is another.
    Product,
    /// Never.
    Any,
}

/// The `--device` for a node to be treated as unknown.
pub(super) const NO_DEVICE: &str = "none";

pub(crate) type BoxedLink = Box<dyn Link + Send>;

/// A network with one node; requests time out after `--timeout`.
pub(crate) struct Connected {
    pub(crate) network: Network<BoxedLink>,
    pub(crate) id: NodeId,
    /// The device, if it is given or was recognised.
    pub(crate) device: Option<Device>,
}

/// A network with several nodes.
pub(crate) struct Nodes {
    pub(crate) network: Network<BoxedLink>,
    pub(crate) ids: Vec<NodeId>,
    /// The data sheets of `--device`, for one node or for all; `None` for `none`.
    named: Vec<(SheetName, Option<Device>)>,
    /// The nodes that the URL of the bus describes.
    known: Vec<(NodeId, Device)>,
    overlays: Vec<PathBuf>,
    is_log: bool,
    /// How well a node must match the data sheet that is named for it.
    pub(crate) identity: Identity,
}

impl NetworkArgs {
    /// Whether the bus is a log, to which nothing can be sent.
    pub(crate) fn is_log(&self) -> bool {
        self.bus.is_log()
    }

    /// The files that the command reads.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        let sheets = self.sheet.device.iter().map(|named| Machine::file_and_bus(Path::new(&named.sheet)).0);
        sheets.chain(self.sheet.overlay.iter().map(PathBuf::as_path)).chain(self.bus.log_file())
    }

    /// Opens the bus and identifies the node; with `None`, the only node that the URL names.
    pub(crate) fn connect(&self, node: Option<NodeId>) -> Result<Connected, Failure> {
        self.connect_at(Pace::Virtual, node)
    }

    /// The same, with simulated time passing at `pace` unless the URL says otherwise.
    pub(crate) fn connect_at(&self, pace: Pace, node: Option<NodeId>) -> Result<Connected, Failure> {
        self.connect_as(pace, node, Identity::default())
    }

    /// The same, with this requirement on the node's identity.
    pub(crate) fn connect_as(
        &self,
        pace: Pace,
        node: Option<NodeId>,
        identity: Identity,
    ) -> Result<Connected, Failure> {
        let mut nodes = self.sheet.connect(&self.bus, node.map(|node| vec![node]), pace)?;
        nodes.identity = identity;
        let id = nodes.ids[0];
        let device = nodes.device(id)?;
        Ok(Connected { network: nodes.network, id, device })
    }

    /// See [`SheetArgs::connect_known`].
    pub(crate) fn connect_known(&self, ids: impl IntoIterator<Item = NodeId>) -> Result<Network<BoxedLink>, Failure> {
        self.sheet.connect_known(&self.bus, ids)
    }

    /// Opens the bus; with `None`, for the only node that the URL names.
    pub(crate) fn connect_several(&self, nodes: Option<&NodeIds>) -> Result<Nodes, Failure> {
        self.sheet.connect(&self.bus, nodes.map(|nodes| nodes.0.clone()), Pace::Virtual)
    }
}

impl SheetArgs {
    /// Loads a data sheet from a file or the library, with the overlays.
    pub(crate) fn load(&self, name: &str) -> Result<Device, Failure> {
        Ok(load(name, &self.overlay)?.device)
    }

    /// Opens a bus with nodes whose data sheets come from a machine.
    pub(crate) fn connect_known(
        &self,
        bus: &BusArgs,
        ids: impl IntoIterator<Item = NodeId>,
    ) -> Result<Network<BoxedLink>, Failure> {
        let mut network = network(bus.open(Pace::Virtual)?.settled()?.link)?;
        ids.into_iter().for_each(|id| limit(&mut network, id, self.timeout));
        Ok(network)
    }

    /// Opens a bus with at least one node.
    pub(crate) fn connect(&self, bus: &BusArgs, ids: Option<Vec<NodeId>>, pace: Pace) -> Result<Nodes, Failure> {
        let mut named: Vec<(SheetName, Option<Device>)> = Vec::new();
        for name in &self.device {
            if named.iter().any(|(other, _)| other.node == name.node) {
                return Err(match name.node {
                    Some(node) => Failure::new(format_args!("node {node} has two data sheets")),
                    None => Failure::new("all nodes have two data sheets")
                        .help("say which node has which: --device 5=FILE --device 7=FILE"),
                });
            }
            let device = match name.sheet.as_str() {
                NO_DEVICE if !self.overlay.is_empty() => {
                    return Err(
                        Failure::new("an overlay adds to a data sheet").help("name the data sheet with --device FILE")
                    );
                }
                NO_DEVICE => None,
                sheet => Some(self.load(sheet)?),
            };
            named.push((name.clone(), device));
        }
        let Bus { link, nodes: known, .. } = bus.open(pace)?.settled()?;
        let only = if let [(id, _)] = known.as_slice() { Some(vec![*id]) } else { None };
        let ids = ids.or(only).ok_or_else(which_node)?;
        // A machine has data sheets for all its nodes; keep those of nodes that are meant.
        named.retain(|(name, _)| {
            name.node.is_none_or(|node| ids.contains(&node)) || machine_of_sheet(&name.sheet).is_none()
        });
        let other = named.iter().filter_map(|(name, _)| name.node).find(|node| !ids.contains(node));
        if let Some(other) = other {
            return Err(Failure::new(format_args!("node {other} has a data sheet, but is none of the nodes")));
        }
        let known =
            known.into_iter().filter(|(id, _)| ids.contains(id)).map(|(id, sheet)| match self.overlay.as_slice() {
                [] => Ok((id, sheet.device)),
                overlays => Ok((id, load_input(sheet.input, overlays)?.device)),
            });
        let known = known.collect::<Result<_, Failure>>()?;
        let mut nodes = Nodes {
            network: network(link)?,
            ids,
            named,
            known,
            overlays: self.overlay.clone(),
            is_log: bus.is_log(),
            identity: Identity::default(),
        };
        for id in nodes.ids.clone() {
            limit(&mut nodes.network, id, self.timeout);
        }
        Ok(nodes)
    }
}

/// The failure of a command that requires a node-ID.
pub(crate) fn which_node() -> Failure {
    Failure::new("which node?").help("name its node-ID; `lexican scan` shows the nodes of the bus")
}

impl Nodes {
    /// The device of a node, if it is given or recognised.
    pub(crate) fn device(&mut self, id: NodeId) -> Result<Option<Device>, Failure> {
        let of = |node| self.named.iter().find(|(name, _)| name.node == node);
        if let Some((name, device)) = of(Some(id)).or_else(|| of(None)) {
            let (name, device) = (name.sheet.clone(), device.clone());
            if let Some(device) = &device {
                self.check_identity(id, device, &name)?;
            }
            return Ok(device);
        }
        if let Some((_, device)) = self.known.iter().find(|(known, _)| *known == id) {
            return Ok(Some(device.clone()));
        }
        // A log cannot be asked.
        let shipped = if self.is_log { None } else { identify(&mut self.network, id)? };
        let Some(shipped) = shipped else { return Ok(None) };
        match self.overlays.as_slice() {
            [] => Ok(Some(shipped.device.clone())),
            overlays => {
                let shipped = library::find(shipped.id).expect("it is in the library");
                Ok(Some(load_input(shipped.input(), overlays)?.device))
            }
        }
    }

    /// Refuses the data sheet of another device, as strictly as [`Identity`] requires.
    pub(crate) fn check_identity(&mut self, id: NodeId, device: &Device, name: &str) -> Result<(), Failure> {
        if self.is_log || self.identity == Identity::Any {
            return Ok(());
        }
        let checked = check_identity(&mut RemoteNode::new(&mut self.network, id), device);
        match checked.map_err(Failure::from)? {
            Ok(()) => Ok(()),
            Err(other) if other.what == "vendor" || self.identity == Identity::Product => {
                Err(Failure::new(format_args!("node {id} is not the device of {name}: {other}")).help(format_args!(
                    "name its own data sheet with --device {id}=FILE; --device {id}=none treats it as unknown"
                )))
            }
            Err(other) => {
                warn(format_args!("node {id} may not be the device of {name}: {other}"));
                Ok(())
            }
        }
    }

    /// Runs an action for each node with its device. With several nodes, a failure of one is reported and the others
    /// follow.
    pub(crate) fn for_each(
        mut self,
        mut action: impl FnMut(&mut Network<BoxedLink>, NodeId, Option<&Device>) -> Result<Outcome, Failure>,
    ) -> Result<Outcome, Failure> {
        let mut worst = Outcome::Clean;
        for id in self.ids.clone() {
            let device = self.device(id);
            let result = device.and_then(|device| action(&mut self.network, id, device.as_ref()));
            worst = worst.max(match result {
                Err(failure) if self.are_several() => {
                    failure.report();
                    Outcome::Unreadable
                }
                result => result?,
            });
        }
        Ok(worst)
    }

    /// Whether results must name the node.
    pub(crate) fn are_several(&self) -> bool {
        self.ids.len() > 1
    }
}

/// Sets the timeout for each response of a node.
pub(crate) fn limit<L: Link>(network: &mut Network<L>, id: NodeId, timeout: Duration) {
    let (now, timeout) = (network.now(), timeout + network.latency());
    let manager = network.manager();
    manager.add(now, Remote::new(id)).expect("there is room for all nodes");
    let client = manager.sdo(id).expect("it was added");
    *client = client.clone().with_timeout(timeout);
}

/// Recognises a node by its identity, and tells the user.
pub(crate) fn identify(network: &mut Network<BoxedLink>, node: NodeId) -> Result<Option<&'static Shipped>, Failure> {
    let mut number = |address| -> Result<Option<u32>, Failure> {
        match network.read_bytes(node, address) {
            Ok(data) => Ok(<[u8; 4]>::try_from(data).ok().map(u32::from_le_bytes)),
            Err(AccessError::Sdo { error, .. }) if !matches!(error, SdoError::TimedOut { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    };
    let Some(vendor) = number(VENDOR)? else { return Ok(None) };
    let product = number(PRODUCT)?;
    let Some(shipped) = recognise(vendor, product) else { return Ok(None) };
    note(format_args!("node {node} is a {} by its identity (1018h); --device none treats it as unknown", shipped.id));
    Ok(Some(shipped))
}
