//! Opens the bus of a command, and finds the nodes on it.

pub(crate) mod failure;
pub(crate) mod kind;
pub(crate) mod kinds;
mod known;
mod node;
mod node_id;
mod profibus;
#[cfg(unix)]
pub(crate) mod pty;
mod serial;
pub(crate) mod serial_terminal;
mod shared;
mod simulation;
#[cfg(test)]
pub(crate) mod testing;

use std::io;
use std::path::Path;

use clap_complete::engine::ArgValueCompleter;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::schemes::{LOG, SOCKETCAN};
use lexican_runtime::host::{BusUrl, Link, Pace};
use lexican_runtime::{Duration, Frame, Instant};

use crate::output::{Failure, reason};
pub(crate) use kind::{Bus, Simulation};
use lexican_toolbox::log::{INTERFACE, Reader};
pub(crate) use lexican_toolbox::text::node_id::node_id;
pub(crate) use node::{
    BoxedLink, Connected, Identity, NODE, NODES, NetworkArgs, Nodes, SheetArgs, identify, which_node,
};
pub(crate) use node_id::{NodeIds, NodeOrNone, SheetName, of_node};

pub(crate) use kinds::url;
pub(crate) use known::KnownArgs;
pub(crate) use shared::{lend, share};
pub(crate) use simulation::{read_plant, simulate};

use kind::{Kind, listen};

/// The environment variable that stands for `--bus`.
pub(crate) const BUS: &str = "LEXICAN_BUS";

#[derive(clap::Args, Debug)]
pub(crate) struct BusArgs {
    #[arg(long, value_name = "URL", env = BUS, value_parser = url, help = kinds::examples(), long_help = kinds::help(),
        add = ArgValueCompleter::new(kinds::complete))]
    bus: BusUrl,
}

impl BusArgs {
    pub(crate) const fn named(bus: BusUrl) -> Self {
        BusArgs { bus }
    }

    /// Whether the bus is a log, to which nothing can be sent.
    pub(crate) fn is_log(&self) -> bool {
        self.log_file().is_some()
    }

    /// The file, if the bus is a log.
    pub(crate) fn log_file(&self) -> Option<&Path> {
        (self.bus.scheme().name == LOG.name).then(|| Path::new(self.bus.place()))
    }

    /// All frames, if the bus is a log.
    pub(crate) fn recorded(&self) -> Option<Result<Vec<(Instant, Frame)>, Failure>> {
        let (file, interface) = (self.log_file()?, self.bus.get("interface").map(str::to_owned));
        let broken = |error: io::Error| Failure::new(format_args!("{}: {}", file.display(), reason(&error)));
        let reader = Reader::open(file, None).map_err(Failure::from);
        Some(reader.and_then(|reader| reader.into_frames(interface).collect::<io::Result<_>>().map_err(broken)))
    }

    pub(crate) const fn url(&self) -> &BusUrl {
        &self.bus
    }

    /// The name of the bus's interface in logs.
    pub(crate) fn interface(&self) -> &str {
        if self.bus.scheme().name == SOCKETCAN.name { self.bus.place() } else { INTERFACE }
    }

    /// Opens the bus. Simulated time passes at `pace` unless the URL says otherwise.
    pub(crate) fn open(&self, pace: Pace) -> Result<Bus, Failure> {
        shared::open(&self.bus, || (Kind::of(&self.bus).open)(&self.bus, pace))
    }
}

/// A network whose link passes on only responses to its requests, so that other frames cost nothing.
pub(crate) fn network<L: Link>(link: L) -> Result<Network<L>, Failure> {
    let mut network = Network::new(link);
    network.listen_to_own(&[])?;
    Ok(network)
}

/// Waits until a frame that gets no response has left the transmit buffers.
pub(crate) fn let_leave(link: &mut impl Link) -> Result<(), Failure> {
    const LEAVING: Duration = Duration::from_millis(20);
    listen(link, LEAVING)
}
