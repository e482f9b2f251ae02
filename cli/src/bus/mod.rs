//! The bus that a command works on, whatever carries it.

pub(crate) mod object;
pub(crate) mod simulation;
pub(crate) mod virtual_device;

use lexican_runtime::host::{AccessError, BusUrl, Link, Pace};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{Duration, NodeId};

use crate::device::Loaded;
use crate::output::Failure;

/// The arguments that name a bus.
#[derive(clap::Args, Debug)]
pub(crate) struct BusArgs {
    /// The bus: can0, slcan:/dev/ttyACM0?bitrate=500000, sim:siko/ag03-1?node=5 or log:FILE
    ///
    /// A simulation lives as long as the command; what happens in it takes no time, unless pace=real stands
    /// behind the question mark. A log is what `candump -L` writes.
    #[arg(long, value_name = "URL")]
    bus: BusUrl,
}

/// The arguments that name a node, and the device that it is.
#[derive(clap::Args, Debug)]
pub(crate) struct NodeArgs {
    #[command(flatten)]
    bus: BusArgs,

    /// The node-ID, 1 to 127; of a simulation, the simulated one when not given
    #[arg(long, value_name = "ID", value_parser = node_id)]
    node: Option<NodeId>,

    /// What the node is: an EDS or DCF file, or a device that lexican knows; of a simulation, the simulated one
    #[arg(long, value_name = "FILE|DEVICE")]
    device: Option<String>,
}

/// An open bus.
pub(crate) struct Bus {
    pub(crate) link: Box<dyn Link + Send>,
    /// Who is on it for certain: the node that is simulated.
    pub(crate) simulated: Option<(NodeId, Loaded)>,
}

impl BusArgs {
    /// Whether the bus can only be listened to.
    pub(crate) fn is_log(&self) -> bool {
        matches!(self.bus, BusUrl::Log { .. })
    }

    /// Opens the bus; simulated time passes at `pace` unless the URL says otherwise.
    pub(crate) fn open(&self, pace: Pace) -> Result<Bus, Failure> {
        if let BusUrl::Simulation { device, parameters } = &self.bus {
            return simulation::open(device, parameters, pace);
        }
        let link = self.bus.open().map_err(Failure::new)?;
        Ok(Bus { link, simulated: None })
    }
}

impl Bus {
    /// The bus when a device that was switched on with it has booted.
    pub(crate) fn settled(mut self) -> Result<Self, Failure> {
        const BOOTING: Duration = Duration::from_millis(100);
        if self.simulated.is_some() {
            let until = self.link.now() + BOOTING;
            while self.link.receive(until).map_err(Failure::new)?.is_some() {}
        }
        Ok(self)
    }
}

/// A node on an open bus.
pub(crate) struct Node {
    pub(crate) link: Box<dyn Link + Send>,
    pub(crate) id: NodeId,
    /// What it is, if anybody said.
    pub(crate) device: Option<Loaded>,
}

impl NodeArgs {
    /// Opens the bus and finds out which node is meant, and what it is.
    pub(crate) fn open(&self) -> Result<Node, Failure> {
        let device = self.device.as_deref().map(Loaded::named).transpose()?;
        let Bus { link, simulated } = self.bus.open(Pace::Virtual)?.settled()?;
        let id = self.node.or(simulated.as_ref().map(|(id, _)| *id));
        let id = id.ok_or_else(|| Failure::new("which node? Name it with --node ID"))?;
        let simulated = simulated.filter(|(simulated, _)| *simulated == id).map(|(_, device)| device);
        Ok(Node { link, id, device: device.or(simulated) })
    }
}

/// Why an object could not be read or written, with advice where there is any.
pub(crate) fn access_failure(error: AccessError) -> Failure {
    let failure = Failure::new(&error);
    match error {
        AccessError::Sdo { error: SdoError::TimedOut { .. }, .. } => {
            failure.help("is the node on this bus, with power and at this bit rate? `lexican scan` finds out")
        }
        _ => failure,
    }
}

/// A node-ID on the command line.
pub(crate) fn node_id(text: &str) -> Result<NodeId, String> {
    let number: u32 = text.parse().map_err(|_| format!("{text:?} is not a number"))?;
    let id = u8::try_from(number).ok().and_then(NodeId::new);
    id.ok_or_else(|| format!("{number} is not a node-ID: node-IDs are 1 to 127"))
}
