//! A machine, as its file describes it.

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

/// A machine; of one that has several buses, what is on one of them.
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
    /// What the bench shows from the beginning.
    pub bench: Vec<Shown>,
    /// The files of sequences that it plays.
    pub sequences: Vec<PathBuf>,
    /// Messages that it sends, by name: lines of sequences.
    pub messages: BTreeMap<String, String>,
    /// Filters of its trace, by name; nodes are node-IDs.
    pub filters: BTreeMap<String, Filter>,
    /// What is wrong with the file.
    pub findings: Diagnostics,
    /// The same machine on its other buses; their findings are here.
    pub others: Vec<Machine>,
}

/// What the bench shows of a node from the beginning.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The node.
    pub node: NodeId,
    /// The object, or the PDO.
    pub signal: Signal,
    /// Whether it has a curve; else its value is watched.
    pub as_curve: bool,
    /// How often an object is read.
    pub every: Duration,
}

/// A machine has several buses, or not the one that is meant.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}: {}", match wanted { Some(bus) => format!("the machine has no bus {bus:?}"), None => "the machine has several buses".to_owned() }, if names.is_empty() { "its only one has no name" } else { names })]
pub struct WhichBus {
    /// The bus that is meant.
    pub wanted: Option<String>,
    /// The names of all.
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
    /// `None` for a device that gets its node-ID by LSS.
    pub id: Option<NodeId>,
    /// The name of its data sheet: a path, or a device of the library.
    pub sheet_name: Option<String>,
    pub sheet: Option<Arc<DataSheet>>,
    pub overlays: Vec<PathBuf>,
    pub identity: Identity,
    /// The device with this identity gets the node-ID by LSS.
    pub lss: Option<lss::Identity>,
    pub software: Option<String>,
    pub optional: bool,
    pub heartbeat: Option<Duration>,
    pub guarding: Option<Duration>,
    pub retry: u8,
    /// The time within which it notices that its manager is gone; zero for one that need not.
    pub protection: Option<Duration>,
    pub start: bool,
    pub keep_alive: bool,
    pub boots_again: bool,
    pub dcf: Option<Vec<(Address, Vec<u8>)>>,
    /// Its parameters, in wire form.
    pub settings: Vec<Setting>,
    /// The PDOs about which the file says something.
    pub pdos: Vec<PlannedPdo>,
    pub simulated: Simulated,
}

/// What a node must say of itself (1018h).
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Identity {
    /// The vendor-ID.
    pub vendor: Option<u32>,
    /// The product code.
    pub product: Option<u32>,
    /// The revision number, or the least one: ">= 0x10002".
    pub revision: Option<Revision>,
    /// The serial number.
    pub serial: Option<u32>,
}

impl Identity {
    /// Its numbers, in the order of 1018h.
    #[must_use]
    pub fn parts(&self) -> [Option<u32>; 4] {
        [self.vendor, self.product, self.revision.map(|revision| revision.number), self.serial]
    }

    /// Those that must be so and not otherwise.
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

    /// The machine on each of its buses.
    pub fn buses(&self) -> impl Iterator<Item = &Machine> {
        std::iter::once(self).chain(&self.others)
    }

    /// The place among its [buses](Machine::buses) of the one of this name, or of the only one.
    pub fn place_of_bus(&self, bus: Option<&str>) -> Result<usize, WhichBus> {
        let names: Vec<_> =
            self.buses().filter_map(|machine| Some(machine.bus.name.as_ref()?.value.as_str())).collect();
        let found = match bus {
            Some(bus) => names.iter().position(|name| *name == bus),
            None => self.others.is_empty().then_some(0),
        };
        found.ok_or_else(|| WhichBus { wanted: bus.map(str::to_owned), names: names.join(", ") })
    }

    /// The machine on the bus of this name, or on the only one.
    pub fn on(&self, bus: Option<&str>) -> Result<&Machine, WhichBus> {
        Ok(self.buses().nth(self.place_of_bus(bus)?).expect("it is one of its buses"))
    }

    /// The same, by itself.
    pub fn into_bus(mut self, bus: Option<&str>) -> Result<Machine, WhichBus> {
        let place = self.place_of_bus(bus)?;
        let mut others = std::mem::take(&mut self.others);
        if place == 0 {
            return Ok(self);
        }
        let findings = self.findings;
        Ok(Machine { findings, ..others.swap_remove(place - 1) })
    }

    /// The errors of its file, with the lines that they are about; empty if there are none.
    #[must_use]
    pub fn errors(&self) -> String {
        let errors = self.findings.iter().filter(|finding| finding.severity == Severity::Error);
        errors.map(|finding| finding.render(&self.input) + "\n\n").collect()
    }

    /// The file of a machine, and the name of the bus that is meant: `machine.toml#left`.
    #[must_use]
    pub fn file_and_bus(name: &Path) -> (&Path, Option<&str>) {
        match name.to_str().and_then(|name| name.rsplit_once('#')) {
            Some((path, bus)) => (Path::new(path), Some(bus)),
            None => (name, None),
        }
    }
}

impl Node {
    /// The object dictionary by its data sheet.
    #[must_use]
    pub fn device(&self) -> Option<&lexican_eds::model::Device> {
        self.sheet.as_ref().map(|sheet| &sheet.device)
    }
}
