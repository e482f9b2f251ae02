//! Kinds of buses, and open buses.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::url::Scheme;
use lexican_runtime::host::{BusUrl, Link, Pace, Pump, VirtualBus};
use lexican_runtime::{Duration, Instant, NodeId};
use lexican_simulation::{Plant, Segment, SimulatedDevice};
use lexican_toolbox::data_sheet::DataSheet;

use crate::output::Failure;

/// A kind of bus in this command.
pub(crate) struct Kind {
    pub(crate) scheme: &'static Scheme,
    /// Opens the bus. Simulated time passes at this pace unless the URL says otherwise.
    pub(super) open: fn(&BusUrl, Pace) -> Result<Bus, Failure>,
    pub(crate) simulated: Simulated,
}

/// How simulated devices use a kind of bus.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Simulated {
    /// They open it, as other programs do.
    Shared,
    /// They open it, and no other program can do so meanwhile.
    Alone,
    /// A single drive uses the protocol of its other interface, at a pseudo-terminal that the command creates.
    AtTerminal(Terminal),
    /// They cannot: the reason, and what to do instead.
    Never(&'static str, Option<&'static str>),
}

/// The interface of a simulated drive at a pseudo-terminal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terminal {
    /// The value of `simulate --bus`.
    pub(crate) name: &'static str,
    /// The parameters of the URL by which other programs open it.
    pub(crate) parameters: fn(&Plant) -> Result<String, Failure>,
    /// Connects the interface to the drive, whose data sheet has this name.
    pub(crate) connect: fn(SimulatedDevice, &str, Instant) -> Result<SimulatedDevice, Failure>,
}

/// An open bus.
pub(crate) struct Bus {
    pub(crate) link: Box<dyn Link + Send>,
    /// The nodes that the URL describes.
    pub(crate) nodes: Vec<(NodeId, DataSheet)>,
    /// The devices simulated in this process, if any.
    pub(crate) simulation: Option<Simulation>,
}

/// Simulated devices with their bus.
#[derive(Clone)]
pub(crate) struct Simulation {
    pub(crate) bus: VirtualBus,
    /// In bits per second.
    pub(crate) bit_rate: u32,
    /// Must not be locked while the bus is used.
    pub(crate) devices: Arc<Mutex<Segment<SimulatedDevice>>>,
}

impl Bus {
    /// An open bus without simulation.
    pub(crate) fn of(link: Box<dyn Link + Send>, nodes: Vec<(NodeId, DataSheet)>) -> Self {
        Bus { link, nodes, simulation: None }
    }

    /// Waits until the nodes in the URL have booted.
    pub(crate) fn settled(mut self) -> Result<Self, Failure> {
        const BOOTING: Duration = Duration::from_millis(100);
        if !self.nodes.is_empty() {
            listen(&mut self.link, BOOTING)?;
        }
        Ok(self)
    }
}

/// Lets `span` pass, ignoring all frames.
pub(super) fn listen(link: &mut impl Link, span: Duration) -> Result<(), Failure> {
    let (mut pump, until) = (Pump::new(), link.now() + span);
    while pump.receive_frame(link, until)?.is_some() {}
    Ok(())
}
