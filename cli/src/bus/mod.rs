//! The bus of a command: opening it, and the nodes on it.

pub(crate) mod failure;
mod node_id;
pub(crate) mod object;
mod profibus;
#[cfg(unix)]
pub(crate) mod pty;
pub(crate) mod sdo;
pub(crate) mod serial;
pub(crate) mod serial_terminal;
pub(crate) mod simulation;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod virtual_device;

use lexican_eds::model::Device;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, BusUrl, Link, Pace, Pump};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{Duration, NodeId};

use crate::device::Loaded;
use crate::identity::{PRODUCT, VENDOR, recognise};
use crate::output::{Failure, note};
pub(crate) use node_id::{NodeOrNone, node_id};

use failure::open_failure;

#[derive(clap::Args, Debug)]
pub(crate) struct BusArgs {
    /// The bus: can0, slcan:/dev/ttyACM0?bitrate=500000, sim:siko/ag03-1?node=5, serial:PORT?device=siko/ag02,
    /// profibus:PORT?device=siko/ag03-1&address=5 or log:FILE
    ///
    /// A drive at its own serial interface is a node, too, alone on its bus: node 1 unless node=5 is among the
    /// parameters; baud=19200 sets the speed, which is 9600 otherwise. So is a drive on PROFIBUS, whose node-ID is its address;
    /// bitrate=187500 sets the rate, which is 500000 otherwise. A simulation lasts as long as the command, and runs as fast as possible unless pace=real is among its
    /// parameters. A log is a file from `candump -L`.
    #[arg(long, value_name = "URL")]
    bus: BusUrl,
}

/// The arguments that name a node and its device.
#[derive(clap::Args, Debug)]
pub(crate) struct NodeArgs {
    #[command(flatten)]
    bus: BusArgs,

    /// The node-ID, 1 to 127; may be left out for a simulation, and where the URL names the drive
    #[arg(long, value_name = "ID", value_parser = node_id)]
    node: Option<NodeId>,

    /// The device: an EDS or DCF file, or a device that lexican knows; none for an unknown device
    ///
    /// By default the device that is named in the URL of the bus, else the device that lexican knows by the node's identity (1018h).
    #[arg(long, value_name = "FILE|DEVICE")]
    device: Option<String>,
}

/// The `--device` of a node that is treated as unknown.
pub(crate) const NO_DEVICE: &str = "none";

pub(crate) struct Bus {
    pub(crate) link: Box<dyn Link + Send>,
    /// The only node, where the URL names it.
    pub(crate) only: Option<(NodeId, Loaded)>,
}

impl BusArgs {
    pub(crate) const fn named(bus: BusUrl) -> Self {
        BusArgs { bus }
    }

    /// Whether the bus is a log, which takes no frames.
    pub(crate) fn is_log(&self) -> bool {
        matches!(self.bus, BusUrl::Log { .. })
    }

    /// Opens the bus; simulated time passes at `pace` unless the URL says otherwise.
    pub(crate) fn open(&self, pace: Pace) -> Result<Bus, Failure> {
        if let BusUrl::Simulation { device, parameters } = &self.bus {
            let (link, node, loaded) = simulation::open(device, parameters, pace)?;
            return Ok(Bus { link, only: Some((node, loaded)) });
        }
        if let BusUrl::Serial { port, parameters } = &self.bus {
            let (link, node, loaded) = serial::open(port, parameters)?;
            return Ok(Bus { link, only: Some((node, loaded)) });
        }
        if let BusUrl::Profibus { port, parameters } = &self.bus {
            let (link, node, loaded) = profibus::open(port, parameters)?;
            return Ok(Bus { link, only: Some((node, loaded)) });
        }
        if self.bus == (BusUrl::SocketCan { interface: "pty".to_owned() }) {
            return Err(Failure::new("pty is a bus that `lexican simulate` makes")
                .help("name one of the terminals that it prints, such as --bus slcan:/dev/pts/3"));
        }
        let link = self.bus.open().map_err(|error| open_failure(&error))?;
        Ok(Bus { link, only: None })
    }
}

impl Bus {
    /// Waits until the only node has booted.
    pub(crate) fn settled(mut self) -> Result<Self, Failure> {
        const BOOTING: Duration = Duration::from_millis(100);
        if self.only.is_some() {
            listen(&mut self.link, BOOTING)?;
        }
        Ok(self)
    }
}

pub(crate) struct Node {
    pub(crate) link: Box<dyn Link + Send>,
    pub(crate) id: NodeId,
    /// The device, if it is given or recognised.
    pub(crate) device: Option<Device>,
}

impl NodeArgs {
    pub(crate) fn open(&self) -> Result<Node, Failure> {
        let named = self.device.as_deref().filter(|name| *name != NO_DEVICE).map(Loaded::named).transpose()?;
        let Bus { link, only } = self.bus.open(Pace::Virtual)?.settled()?;
        let id = self.node.or(only.as_ref().map(|(id, _)| *id));
        let id = id.ok_or_else(|| {
            Failure::new("which node?").help("name it with --node ID; `lexican scan` shows the nodes of the bus")
        })?;
        if self.device.is_some() {
            return Ok(Node { link, id, device: named.map(|loaded| loaded.device) });
        }
        if let Some((_, loaded)) = only.filter(|(only, _)| *only == id) {
            return Ok(Node { link, id, device: Some(loaded.device) });
        }
        let mut network = network(link)?;
        let device = identify(&mut network, id)?;
        Ok(Node { link: network.into_link(), id, device })
    }
}

/// A network that receives only the responses to its requests, so that other frames cost nothing.
pub(crate) fn network<L: Link>(link: L) -> Result<Network<L>, Failure> {
    let mut network = Network::new(link);
    network.listen_to_own(&[])?;
    Ok(network)
}

/// Waits until a frame without response has left the buffers.
pub(crate) fn let_leave(link: &mut impl Link) -> Result<(), Failure> {
    const LEAVING: Duration = Duration::from_millis(20);
    listen(link, LEAVING)
}

/// Lets `span` pass, and drops the frames.
fn listen(link: &mut impl Link, span: Duration) -> Result<(), Failure> {
    let (mut pump, until) = (Pump::new(), link.now() + span);
    while pump.receive_frame(link, until)?.is_some() {}
    Ok(())
}

/// Recognises a node by its identity, and says so.
fn identify(network: &mut Network<Box<dyn Link + Send>>, node: NodeId) -> Result<Option<Device>, Failure> {
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
    Ok(Some(shipped.device.clone()))
}
