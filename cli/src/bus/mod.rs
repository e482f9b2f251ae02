//! The bus of a command: opening it, and the nodes on it.

pub(crate) mod failure;
mod node;
mod node_id;
pub(crate) mod profibus;
#[cfg(unix)]
pub(crate) mod pty;
pub(crate) mod sdo;
pub(crate) mod serial;
pub(crate) mod serial_terminal;
mod simulation;
#[cfg(test)]
pub(crate) mod testing;

use std::io;
use std::path::Path;

use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{BusUrl, Link, Pace, Pump, Replay};
use lexican_runtime::{Duration, Frame, Instant, NodeId};

use crate::output::{Failure, reason};
use lexican_simulation::Plant;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::log::{INTERFACE, Reader};
pub(crate) use lexican_toolbox::text::node_id::node_id;
pub(crate) use node::{
    BoxedLink, Connected, Identity, NO_DEVICE, NODE, NODES, NetworkArgs, Nodes, SheetArgs, identify, which_node,
};
pub(crate) use node_id::{NodeIds, NodeOrNone, SheetName, of_node};
pub(crate) use simulation::Simulation;

pub(crate) use simulation::read_plant;

use failure::open_failure;

/// The environment variable that stands for `--bus`.
pub(crate) const BUS: &str = "LEXICAN_BUS";

#[derive(clap::Args, Debug)]
pub(crate) struct BusArgs {
    /// The bus: can0, slcan:/dev/ttyACM0?bitrate=500000, sim:siko/ag03-1?node=5, sim:plant.toml, serial:PORT?device=siko/ag02,
    /// profibus:PORT?device=siko/ag03-1&address=5 or log:FILE
    ///
    /// A drive at its own serial interface is a node, too, alone on its bus: node 1 unless node=5 is among the
    /// parameters; baud=19200 sets the speed, which is 9600 otherwise. So is a drive on PROFIBUS, whose node-ID is its address;
    /// bitrate=187500 sets the rate, which is 500000 otherwise. A simulation, of one device or of a plant of several
    /// (`lexican simulate --help` shows one), lasts as long as the command, and runs as fast as possible unless pace=real is among its
    /// parameters. A log is a file of candump, pcap, pcapng, ASC, TRC or BLF.
    #[arg(long, value_name = "URL", env = BUS)]
    bus: BusUrl,
}

pub(crate) struct Bus {
    pub(crate) link: Box<dyn Link + Send>,
    /// The nodes, where the URL says what they are.
    pub(crate) nodes: Vec<(NodeId, DataSheet)>,
    /// The devices, where they are simulated in this process.
    pub(crate) simulation: Option<Simulation>,
}

impl BusArgs {
    pub(crate) const fn named(bus: BusUrl) -> Self {
        BusArgs { bus }
    }

    /// Whether the bus is a log, which takes no frames.
    pub(crate) fn is_log(&self) -> bool {
        matches!(self.bus, BusUrl::Log { .. })
    }

    /// The file of the log, if the bus is one.
    pub(crate) fn log_file(&self) -> Option<&Path> {
        match &self.bus {
            BusUrl::Log { file, .. } => Some(file),
            _ => None,
        }
    }

    /// All frames of the log, if the bus is one.
    pub(crate) fn recorded(&self) -> Option<Result<Vec<(Instant, Frame)>, Failure>> {
        let BusUrl::Log { file, interface, .. } = &self.bus else { return None };
        let broken = |error: io::Error| Failure::new(format_args!("{}: {}", file.display(), reason(&error)));
        Some(
            Reader::open(file, None)
                .map_err(Failure::from)
                .and_then(|reader| reader.into_frames(interface.clone()).collect::<io::Result<_>>().map_err(broken)),
        )
    }

    /// The bit rate in bits per second, if the URL names it.
    pub(crate) fn bit_rate(&self) -> Option<u32> {
        match self.bus {
            BusUrl::Slcan { bit_rate, .. } => bit_rate,
            _ => None,
        }
    }

    /// How the bus is called.
    pub(crate) const fn url(&self) -> &BusUrl {
        &self.bus
    }

    /// The name of its interface in logs.
    pub(crate) fn interface(&self) -> &str {
        match &self.bus {
            BusUrl::SocketCan { interface } => interface,
            _ => INTERFACE,
        }
    }

    /// Opens the bus; simulated time passes at `pace` unless the URL says otherwise.
    pub(crate) fn open(&self, pace: Pace) -> Result<Bus, Failure> {
        if let BusUrl::Simulation { device, parameters } = &self.bus {
            return simulation::open(device, parameters, pace).map(Bus::simulated);
        }
        if let BusUrl::Serial { port, parameters } = &self.bus {
            let (link, node, sheet) = serial::open(port, parameters)?;
            return Ok(Bus::of(link, vec![(node, sheet)]));
        }
        if let BusUrl::Profibus { port, parameters } = &self.bus {
            let (link, node, sheet) = profibus::open(port, parameters)?;
            return Ok(Bus::of(link, vec![(node, sheet)]));
        }
        if let BusUrl::Log { file, interface, pace } = &self.bus {
            let frames = Reader::open(file, None)?.into_frames(interface.clone());
            let link = Replay::of(frames, *pace).map_err(Failure::new)?;
            return Ok(Bus::of(Box::new(link), Vec::new()));
        }
        if self.bus == (BusUrl::SocketCan { interface: "pty".to_owned() }) {
            return Err(Failure::new("pty is a bus that `lexican simulate` makes")
                .help("name one of the terminals that it prints, such as --bus slcan:/dev/pts/3"));
        }
        let link = self.bus.open().map_err(|error| open_failure(&error))?;
        Ok(Bus::of(link, Vec::new()))
    }
}

impl Bus {
    /// One of this plant, which is switched on.
    pub(crate) fn of_plant(plant: Plant, pace: Pace) -> Result<Self, Failure> {
        simulation::simulate(plant, pace).map(Bus::simulated)
    }

    fn simulated((link, nodes, simulation): (Box<dyn Link + Send>, Vec<(NodeId, DataSheet)>, Simulation)) -> Self {
        Bus { link, nodes, simulation: Some(simulation) }
    }

    /// One that is not simulated here.
    fn of(link: Box<dyn Link + Send>, nodes: Vec<(NodeId, DataSheet)>) -> Self {
        Bus { link, nodes, simulation: None }
    }

    /// Waits until the nodes of a URL have booted.
    pub(crate) fn settled(mut self) -> Result<Self, Failure> {
        const BOOTING: Duration = Duration::from_millis(100);
        if !self.nodes.is_empty() {
            listen(&mut self.link, BOOTING)?;
        }
        Ok(self)
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
