//! Makes the file of an existing machine, from what was [`Found`] on a bus or in DCFs, or from another format.

mod found;

use std::fmt::Write as _;

use lexican_eds::model::{Device, Entry};
use lexican_runtime::object::Address;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::values::lookup::resolve;
use lexican_toolbox::values::name;
use toml_edit::{Key, Value};

pub use found::Found;

use crate::nodes::is_name;

/// The file of a machine, still being written.
#[derive(Clone, Debug, Default)]
pub struct Draft {
    machine: Section,
    pub(crate) bus: Section,
    /// The buses with their names, if there are several.
    buses: Vec<(String, Section)>,
    nodes: Vec<(String, Section)>,
}

/// A table of the file, as lines.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Section {
    lines: Vec<String>,
    settings: Vec<String>,
}

impl Section {
    /// Adds a key; the value is TOML.
    pub(crate) fn put(&mut self, key: &str, value: impl AsRef<str>) {
        self.lines.push(format!("{key} = {}", value.as_ref()));
    }

    pub(crate) fn put_time(&mut self, key: &str, ms: u64) {
        self.put(key, time(ms));
    }

    pub(crate) fn put_bit_rate(&mut self, kbit: u32) {
        self.put("bit-rate", quoted(&format!("{kbit} kbit/s")));
    }

    /// Adds a parameter; the value is TOML.
    pub(crate) fn set(&mut self, object: &str, value: &str) {
        self.settings.push(format!("{} = {value}", Key::new(object).display_repr()));
    }

    /// Adds a comment about what the file cannot express.
    fn remark(&mut self, text: &str) {
        self.settings.push(format!("# {}", text.replace(char::is_control, " ")));
    }
}

impl Draft {
    /// A machine without nodes on this bus, with bit rate in bit/s and SYNC period, if known.
    #[must_use]
    pub fn on(url: &str, bit_rate: Option<u32>, sync: Option<Duration>) -> Self {
        let mut draft = Draft::default();
        draft.bus.put("url", quoted(url));
        if let Some(rate) = bit_rate {
            draft.bus.put_bit_rate(rate / 1000);
        }
        if let Some(period) = sync {
            draft.bus.put("sync", quoted(&period.to_string()));
        }
        draft
    }

    /// A free name for a node.
    fn free_name(&self, wanted: &str, otherwise: &str) -> String {
        free_name(&self.nodes, wanted, otherwise)
    }

    /// A free name for a bus.
    pub(crate) fn free_bus_name(&self, wanted: &str) -> String {
        free_name(&self.buses, wanted, "bus")
    }

    /// Completes the bus described so far: the only one, which has the machine's name, or one of several, which has its
    /// own.
    pub(crate) fn end_bus(&mut self, bus: Option<String>, name: Option<&str>, designator: Option<&str>) {
        self.bus.lines.extend(designator.map(|it| format!("designator = {}", quoted(it))));
        match (bus, name) {
            (Some(bus), _) => self.buses.push((bus, std::mem::take(&mut self.bus))),
            (None, Some(name)) => self.machine.put("name", quoted(name)),
            (None, None) => {}
        }
    }

    /// The text of the file.
    #[must_use]
    pub fn text(&self) -> String {
        // Writing to a string cannot fail, so its results are ignored.
        let mut text = String::new();
        let mut table = |name: &str, lines: &[String]| {
            let gap = if text.is_empty() { "" } else { "\n" };
            let _ = writeln!(text, "{gap}[{name}]");
            for line in lines {
                let _ = writeln!(text, "{line}");
            }
        };
        for (name, section) in [("machine", &self.machine), ("bus", &self.bus)] {
            if !section.lines.is_empty() {
                table(name, &section.lines);
            }
        }
        for (name, bus) in &self.buses {
            table(&format!("bus.{}", Key::new(name).display_repr()), &bus.lines);
        }
        for (name, node) in &self.nodes {
            let name = format!("node.{}", Key::new(name).display_repr());
            table(&name, &node.lines);
            if !node.settings.is_empty() {
                table(&format!("{name}.settings"), &node.settings);
            }
        }
        text
    }
}

/// `wanted` as a valid name, if that is possible and free; else `otherwise`.
fn free_name(taken: &[(String, Section)], wanted: &str, otherwise: &str) -> String {
    let word = |name: &str| name.trim().replace(|letter: char| ".:= ".contains(letter) || letter.is_control(), "-");
    let is_free = |name: &String| is_name(name) && !taken.iter().any(|(other, _)| other == name);
    let numbered = (2..).map(|number| format!("{otherwise}-{number}"));
    let mut names = [word(wanted), otherwise.to_owned()].into_iter().chain(numbered);
    names.find(is_free).expect("one of the numbers is free")
}

/// A text in TOML.
pub(crate) fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}

/// A time in TOML.
pub(crate) fn time(ms: u64) -> String {
    quoted(&Duration::from_millis(ms).to_string())
}

/// The given numbers of an identity, in TOML; `None` without any.
pub(crate) fn identity(numbers: [Option<u32>; 4]) -> Option<String> {
    let names = ["vendor", "product", "revision", "serial"].into_iter().zip(numbers);
    let given: Vec<_> = names.filter_map(|(name, number)| Some(format!("{name} = {:#X}", number?))).collect();
    (!given.is_empty()).then(|| format!("{{ {} }}", given.join(", ")))
}

fn transmission(transmission: TransmissionType) -> String {
    match transmission {
        TransmissionType::EventProfile => quoted("event"),
        TransmissionType::SynchronousCyclic(1) => quoted("sync"),
        TransmissionType::SynchronousCyclic(each) => quoted(&format!("sync {each}")),
        other => other.code().to_string(),
    }
}

/// The name of an object, or its address if several objects have that name.
pub(crate) fn object_name(device: &Device, address: Address) -> String {
    let name = device.entry(address.index(), address.sub()).map(|entry| name(device, entry));
    let name = name.filter(|name| resolve(Some(device), name).as_ref() == Ok(&address));
    name.unwrap_or_else(|| match address.sub() {
        0 => format!("{:04X}", address.index()),
        _ => address.to_string(),
    })
}

/// An entry of a device.
pub(crate) fn entry_mut(device: &mut Device, address: Address) -> Option<&mut Entry> {
    let object = device.objects.iter_mut().find(|object| object.index == address.index())?;
    object.entries.iter_mut().find(|entry| entry.sub == address.sub())
}

/// The name for a node that was given none.
fn usual_name(device: Option<&Device>, id: NodeId) -> String {
    let kind = match device.and_then(|device| device.profile) {
        Some(401) => "io",
        Some(402) => "drive",
        Some(406) => "encoder",
        _ => "node",
    };
    format!("{kind}{id}")
}
