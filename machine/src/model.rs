//! The model of a machine, as read from its file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lexican_eds::text::Span;
use lexican_eds::{Diagnostics, Input, Severity};
use lexican_runtime::manager::OnLoss;
use lexican_runtime::object::Address;
use lexican_runtime::wire::lss;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::pdo::PdoState;
use lexican_toolbox::trace::sampler::Signal;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::at::{At, BitRate, Revision};
pub use crate::faults::{Fault, Simulated};
use crate::file;
pub use crate::file::Filter;

/// A machine. If it has several buses, this is the part on one of them.
#[derive(Debug)]
pub struct Machine {
    /// The text of the file, to render the findings.
    pub input: Input,
    /// What it is called.
    pub name: Option<String>,
    /// A description in one sentence.
    pub note: Option<String>,
    /// Its bus.
    pub bus: Bus,
    /// In the order of the file.
    pub nodes: Vec<Node>,
    /// Faults between simulated nodes.
    pub faults: Vec<Fault>,
    /// What the bench shows from the beginning.
    pub bench: Vec<Shown>,
    /// Files of sequences for the bench.
    pub sequences: Vec<PathBuf>,
    /// Messages that the bench can send, by name: each a line of a sequence.
    pub messages: BTreeMap<String, String>,
    /// Filters of the bench's trace, by name, with node-IDs for nodes.
    pub filters: BTreeMap<String, Filter>,
    /// The findings about the file.
    pub findings: Diagnostics,
    /// The parts of the machine on its other buses. Their findings are in this one.
    pub others: Vec<Machine>,
}

/// A signal that the bench shows from the beginning.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The node.
    pub node: NodeId,
    /// An object or a PDO.
    pub signal: Signal,
    /// Whether it is plotted; otherwise it is watched as a number.
    pub as_curve: bool,
    /// The interval of reading an object.
    pub every: Duration,
}

/// The bus is not named although there are several, or the name is unknown.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}: {}", match wanted { Some(bus) => format!("the machine has no bus {bus:?}"), None => "the machine has several buses".to_owned() }, if names.is_empty() { "its only one has no name" } else { names })]
pub struct WhichBus {
    /// The bus that was named.
    pub wanted: Option<String>,
    /// The names of all buses.
    pub names: String,
}

/// The bus of a machine, and how its manager boots it.
#[derive(Debug)]
#[allow(missing_docs, reason = "they are as in the section of the file")]
pub struct Bus {
    pub name: Option<At<String>>,
    pub url: Option<At<String>>,
    pub designator: Option<String>,
    /// In bit/s.
    pub bit_rate: Option<u32>,
    pub manager: Option<NodeId>,
    pub sync: Option<Duration>,
    pub time: Option<Duration>,
    pub heartbeat: Option<At<Duration>>,
    pub boot_time: Option<Duration>,
    pub on_loss: OnLoss,
    pub start_all: bool,
}

impl Bus {
    pub(crate) fn new(name: Option<At<String>>, bus: file::Bus) -> Bus {
        Bus {
            name,
            url: bus.url,
            designator: bus.designator,
            bit_rate: bus.bit_rate.map(|At { value: BitRate(rate), .. }| rate),
            manager: bus.manager.and_then(|id| id.value.0),
            sync: bus.sync.map(|time| time.0),
            time: bus.time.map(|time| time.0),
            heartbeat: bus.heartbeat.map(|time| At { value: time.0, span: time.span }),
            boot_time: bus.boot_time.map(|time| time.0),
            on_loss: bus.on_loss,
            start_all: bus.start_all,
        }
    }
}

/// A node of a machine.
#[derive(Debug)]
#[allow(missing_docs, reason = "they are as in the section of the file")]
pub struct Node {
    pub name: At<String>,
    pub designator: Option<String>,
    /// `None` until the device gets its node-ID by LSS.
    pub id: Option<NodeId>,
    /// A path, or a device of the library.
    pub sheet_name: Option<String>,
    pub sheet: Option<Arc<DataSheet>>,
    pub overlays: Vec<PathBuf>,
    pub identity: Identity,
    /// The identity of the device that gets this node-ID by LSS.
    pub lss: Option<lss::Identity>,
    pub software: Option<String>,
    pub optional: bool,
    pub heartbeat: Option<Duration>,
    pub guarding: Option<Duration>,
    pub retry: u8,
    /// The time within which it has to notice that its manager is gone; zero if it need not.
    pub protection: Option<Duration>,
    pub start: bool,
    pub keep_alive: bool,
    pub boots_again: bool,
    pub dcf: Option<Vec<(Address, Vec<u8>)>>,
    /// The parameters, in wire form.
    pub settings: Vec<Setting>,
    /// The PDOs that the file mentions.
    pub pdos: Vec<PlannedPdo>,
    pub simulated: Simulated,
}

/// The identity (1018h) that a node must have.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Identity {
    /// The vendor-ID.
    pub vendor: Option<u32>,
    /// The product code.
    pub product: Option<u32>,
    /// An exact number or a minimum.
    pub revision: Option<Revision>,
    /// The serial number.
    pub serial: Option<u32>,
}

impl Identity {
    /// All numbers, in the order of 1018h.
    #[must_use]
    pub fn parts(&self) -> [Option<u32>; 4] {
        [self.vendor, self.product, self.revision.map(|revision| revision.number), self.serial]
    }

    /// The numbers that must be equal, without a minimum revision.
    #[must_use]
    pub fn exact(&self) -> [Option<u32>; 4] {
        let revision = self.revision.filter(|revision| !revision.or_later);
        Identity { revision, ..*self }.parts()
    }
}

/// A parameter of a node.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The entry.
    pub address: Address,
    /// In wire form.
    pub data: Vec<u8>,
}

/// A PDO that the file mentions.
#[derive(Clone, Debug)]
pub struct PlannedPdo {
    /// The configuration in the data sheet.
    pub before: PdoState,
    /// The configuration in the machine.
    pub after: PdoState,
    /// Whether to write the mapping even if it is that of the data sheet.
    pub maps: bool,
    /// The place in the file.
    pub place: Span,
}

impl Machine {
    /// The node of this name.
    #[must_use]
    pub fn node(&self, name: &str) -> Option<&Node> {
        self.nodes.iter().find(|node| node.name.value == name)
    }

    /// The parts of the machine on each bus, this one first.
    pub fn buses(&self) -> impl Iterator<Item = &Machine> {
        std::iter::once(self).chain(&self.others)
    }

    /// The position in [buses](Machine::buses) of the bus with this name; without a name, of the only bus.
    pub fn place_of_bus(&self, bus: Option<&str>) -> Result<usize, WhichBus> {
        let names: Vec<_> =
            self.buses().filter_map(|machine| Some(machine.bus.name.as_ref()?.value.as_str())).collect();
        let found = match bus {
            Some(bus) => names.iter().position(|name| *name == bus),
            None => self.others.is_empty().then_some(0),
        };
        found.ok_or_else(|| WhichBus { wanted: bus.map(str::to_owned), names: names.join(", ") })
    }

    /// The part on the bus with this name; without a name, on the only bus.
    pub fn on(&self, bus: Option<&str>) -> Result<&Machine, WhichBus> {
        Ok(self.buses().nth(self.place_of_bus(bus)?).expect("it is one of its buses"))
    }

    /// The same, taking the part out of the machine.
    pub fn into_bus(mut self, bus: Option<&str>) -> Result<Machine, WhichBus> {
        let place = self.place_of_bus(bus)?;
        let mut others = std::mem::take(&mut self.others);
        if place == 0 {
            return Ok(self);
        }
        let findings = self.findings;
        Ok(Machine { findings, ..others.swap_remove(place - 1) })
    }

    /// The errors in the file, rendered with their lines; empty if there are none.
    #[must_use]
    pub fn errors(&self) -> String {
        let errors = self.findings.iter().filter(|finding| finding.severity == Severity::Error);
        errors.map(|finding| finding.render(&self.input) + "\n\n").collect()
    }

    /// Splits `machine.toml#left` into the file and the name of a bus.
    #[must_use]
    pub fn file_and_bus(name: &Path) -> (&Path, Option<&str>) {
        match name.to_str().and_then(|name| name.rsplit_once('#')) {
            Some((path, bus)) => (Path::new(path), Some(bus)),
            None => (name, None),
        }
    }
}

impl Node {
    /// The device in its data sheet.
    #[must_use]
    pub fn device(&self) -> Option<&lexican_eds::model::Device> {
        self.sheet.as_ref().map(|sheet| &sheet.device)
    }
}
