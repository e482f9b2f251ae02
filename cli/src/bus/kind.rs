//! What a kind of bus is, and what opening one gives.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::url::Scheme;
use lexican_runtime::host::{BusUrl, Link, Pace, Pump, VirtualBus};
use lexican_runtime::{Duration, Instant, NodeId};
use lexican_simulation::{Plant, Segment, SimulatedDevice};
use lexican_toolbox::data_sheet::DataSheet;

use crate::output::Failure;

/// A kind of bus, as this command has it.
pub(crate) struct Kind {
    pub(crate) scheme: &'static Scheme,
    /// Opens it; simulated time passes at the pace unless the URL says otherwise.
    pub(super) open: fn(&BusUrl, Pace) -> Result<Bus, Failure>,
    pub(crate) simulated: Simulated,
}

/// How simulated devices get onto a kind of bus.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Simulated {
    /// As any program does: by opening it.
    Shared,
    /// As any program, and no other one can open it meanwhile.
    Alone,
    /// One drive, by the protocol of its other interface, at a terminal that it makes itself.
    AtTerminal(Terminal),
    /// Not at all: why, and what to do.
    Never(&'static str, Option<&'static str>),
}

/// What is at a terminal that a simulated drive makes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terminal {
    /// The word of `simulate --bus`.
    pub(crate) name: &'static str,
    /// The parameters of the URL by which others open it.
    pub(crate) parameters: fn(&Plant) -> Result<String, Failure>,
    /// Connects the interface of the drive, whose data sheet has this name.
    pub(crate) connect: fn(SimulatedDevice, &str, Instant) -> Result<SimulatedDevice, Failure>,
}

/// A bus that is open.
pub(crate) struct Bus {
    pub(crate) link: Box<dyn Link + Send>,
    /// The nodes, where the URL says what they are.
    pub(crate) nodes: Vec<(NodeId, DataSheet)>,
    /// The devices, where they are simulated in this process.
    pub(crate) simulation: Option<Simulation>,
}

/// Simulated devices, and their bus.
#[derive(Clone)]
pub(crate) struct Simulation {
    pub(crate) bus: VirtualBus,
    /// In bits per second.
    pub(crate) bit_rate: u32,
    /// Not to be held while the bus is asked for something.
    pub(crate) devices: Arc<Mutex<Segment<SimulatedDevice>>>,
}

impl Bus {
    /// One that is not simulated here.
    pub(crate) fn of(link: Box<dyn Link + Send>, nodes: Vec<(NodeId, DataSheet)>) -> Self {
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

/// Lets `span` pass, and drops the frames.
pub(super) fn listen(link: &mut impl Link, span: Duration) -> Result<(), Failure> {
    let (mut pump, until) = (Pump::new(), link.now() + span);
    while pump.receive_frame(link, until)?.is_some() {}
    Ok(())
}
