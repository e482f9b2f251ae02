//! A machine, as its file describes it.

use std::path::PathBuf;
use std::sync::Arc;

use lexican_eds::text::Span;
use lexican_eds::{Diagnostics, Input};
use lexican_runtime::manager::OnLoss;
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::pdo::PdoState;

use crate::at::{At, BitRate};
pub use crate::faults::{Fault, Simulated};
use crate::file;

/// A machine.
#[derive(Debug)]
pub struct Machine {
    /// The text of its file, for the findings.
    pub input: Input,
    /// What it is called.
    pub name: Option<String>,
    /// What it is, in a sentence.
    pub note: Option<String>,
    /// Its bus.
    pub bus: Bus,
    /// Its nodes, in the order of the file.
    pub nodes: Vec<Node>,
    /// What goes wrong between simulated nodes.
    pub faults: Vec<Fault>,
    /// What is wrong with the file.
    pub findings: Diagnostics,
}

/// The bus of a machine, and how its manager boots it.
#[derive(Debug)]
pub struct Bus {
    /// Where it is, as `--bus` has it.
    pub url: Option<At<String>>,
    /// In bit/s.
    pub bit_rate: Option<u32>,
    /// The node-ID of the manager.
    pub manager: Option<NodeId>,
    /// The period of SYNC.
    pub sync: Option<Duration>,
    /// The heartbeat of the manager, and where the file has it.
    pub heartbeat: Option<At<Duration>>,
    /// The time within which the mandatory nodes must boot.
    pub boot_time: Option<Duration>,
    /// What happens when a mandatory node is lost.
    pub on_loss: OnLoss,
    /// Whether all nodes are started by one command.
    pub start_all: bool,
}

impl From<file::Bus> for Bus {
    fn from(bus: file::Bus) -> Bus {
        Bus {
            url: bus.url,
            bit_rate: bus.bit_rate.map(|At { value: BitRate(rate), .. }| rate),
            manager: bus.manager.and_then(|id| id.value.0),
            sync: bus.sync.map(|time| time.0),
            heartbeat: bus.heartbeat.map(|time| At { value: time.0, span: time.span }),
            boot_time: bus.boot_time.map(|time| time.0),
            on_loss: bus.on_loss.into(),
            start_all: bus.start_all,
        }
    }
}

/// A node of a machine.
#[derive(Debug)]
pub struct Node {
    /// What it is called.
    pub name: At<String>,
    /// `None` for a device that gets its node-ID by LSS.
    pub id: Option<NodeId>,
    /// The name of its data sheet: a path, or a device of the library.
    pub sheet_name: Option<String>,
    /// Its data sheet, with overlays.
    pub sheet: Option<Arc<DataSheet>>,
    /// The overlays of its data sheet.
    pub overlays: Vec<PathBuf>,
    /// What it must say of itself: vendor-ID, product code, revision number, serial number (1018h).
    pub identity: [Option<u32>; 4],
    /// The machine runs without it.
    pub optional: bool,
    /// Its heartbeat.
    pub heartbeat: Option<Duration>,
    /// The guard time.
    pub guarding: Option<Duration>,
    /// How many answers to guarding may be missing.
    pub retry: u8,
    /// Whether it is started.
    pub start: bool,
    /// It is not reset while it is OPERATIONAL.
    pub keep_alive: bool,
    /// Whether it is booted again after it was lost.
    pub boots_again: bool,
    /// A concise DCF, written before all else.
    pub dcf: Option<Vec<(Address, Vec<u8>)>>,
    /// Its parameters, in wire form.
    pub settings: Vec<Setting>,
    /// The PDOs about which the file says something.
    pub pdos: Vec<PlannedPdo>,
    /// How it is simulated.
    pub simulated: Simulated,
}

/// A parameter of a node.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The entry.
    pub address: Address,
    /// Its value in wire form.
    pub data: Vec<u8>,
}

/// A PDO of a node.
#[derive(Clone, Debug)]
pub struct PlannedPdo {
    /// How the data sheet configures it.
    pub before: PdoState,
    /// How it is configured.
    pub after: PdoState,
    /// Whether its mapping is written, even if it is that of the data sheet.
    pub maps: bool,
    /// Where the file says so.
    pub place: Span,
}

impl Machine {
    /// The node of this name.
    #[must_use]
    pub fn node(&self, name: &str) -> Option<&Node> {
        self.nodes.iter().find(|node| node.name.value == name)
    }
}

impl Node {
    /// The object dictionary by its data sheet.
    #[must_use]
    pub fn device(&self) -> Option<&lexican_eds::model::Device> {
        self.sheet.as_ref().map(|sheet| &sheet.device)
    }
}
