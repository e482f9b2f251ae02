//! Describes a machine as it was found, by the differences of its nodes from their data sheets.

use std::collections::{BTreeMap, BTreeSet};

use lexican_eds::model::{Device, Meaning, Value};
use lexican_eds::start::initial;
use lexican_eds::types::DataType;
use lexican_runtime::object::{Address, Mapped};
use lexican_runtime::{CobId, NodeId, cia301};
use lexican_toolbox::parameters::restore::configured;
use lexican_toolbox::parameters::settings::encode;
use lexican_toolbox::pdo::{Change, PdoName, PdoState, Plan};
use lexican_toolbox::values::wire::parse;
use lexican_toolbox::values::{DeviceValues, given, resolved};

use super::{Draft, Section, identity, object_name, quoted, time, transmission, usual_name};
use crate::nodes::PATIENCE;

const GUARD_TIME: Address = Address::new(cia301::GUARD_TIME, 0);
const LIFE_TIME_FACTOR: Address = Address::new(cia301::LIFE_TIME_FACTOR, 0);
const HEARTBEAT: Address = Address::new(cia301::PRODUCER_HEARTBEAT_TIME, 0);
const WATCHED: Address = Address::new(cia301::CONSUMER_HEARTBEAT_TIME, 1);

/// A node as it was found, on a bus or in a file.
#[derive(Clone, Debug)]
pub struct Found {
    /// What it is called, if it is.
    pub name: Option<String>,
    /// The reference designator in drawings.
    pub designator: Option<String>,
    /// Its node-ID.
    pub id: NodeId,
    /// Its identity (1018h).
    pub identity: [Option<u32>; 4],
    /// The name of its data sheet, the data sheet, and the data sheet with the node's values: a backup.
    pub sheet: Option<(String, Device, Device)>,
    /// The heartbeat period in ms; only used without data sheet.
    pub heartbeat_ms: u16,
    /// Further lines of its table: keys with their TOML values.
    pub(crate) lines: Vec<(&'static str, String)>,
    /// Entries to write even if the data sheet has their value; for a PDO, sub-index 0 of its mapping.
    pub(crate) written: BTreeSet<Address>,
}

impl Found {
    /// A node without name.
    #[must_use]
    pub fn new(
        id: NodeId,
        identity: [Option<u32>; 4],
        sheet: Option<(String, Device, Device)>,
        heartbeat_ms: u16,
    ) -> Self {
        let (lines, written) = (Vec::new(), BTreeSet::new());
        Found { name: None, designator: None, id, identity, sheet, heartbeat_ms, lines, written }
    }

    /// A node by its DCF and its data sheet, which may be the same file.
    #[must_use]
    pub fn of_dcf(id: NodeId, dcf: Device, sheet_name: String, sheet: Device) -> Self {
        let commissioning = dcf.commissioning.clone().unwrap_or_default();
        let info = &dcf.info;
        let identity = [info.vendor_number, info.product_number, info.revision_number, commissioning.serial_number];
        let found = Found::new(id, identity, Some((sheet_name, sheet, dcf)), 0);
        Found { name: commissioning.node_name, designator: commissioning.node_designator, ..found }
    }

    /// The value of an entry in the node, as a number.
    pub(crate) fn held(&self, address: Address) -> Option<i128> {
        let (.., device) = self.sheet.as_ref()?;
        resolved(given(device.entry(address.index(), address.sub())?)?, self.id).as_integer()
    }
}

/// The manager that all nodes watch, if they agree: node-ID and heartbeat in ms.
fn watched(nodes: &[Found]) -> Option<(NodeId, u64)> {
    let watched: BTreeSet<_> = nodes.iter().filter_map(|node| node.held(WATCHED)).collect();
    let value = Some(&watched).filter(|all| all.len() == 1)?.first()?;
    let (manager, ms) = (NodeId::new((value >> 16 & 0x7F) as u8)?, (value & 0xFFFF) as u64);
    let is_ours = ms > 0 && ms.is_multiple_of(PATIENCE.into()) && nodes.iter().all(|node| node.id != manager);
    is_ours.then_some((manager, ms / u64::from(PATIENCE)))
}

impl Draft {
    /// Adds nodes as they were found, so that booting the machine gives them the values that they have.
    #[must_use]
    pub fn with(mut self, nodes: &[Found]) -> Self {
        self.add_all(nodes);
        self
    }

    /// The same; returns the name of each node, and its parameters that the data sheet does not allow.
    pub(crate) fn add_all(&mut self, nodes: &[Found]) -> Vec<(String, Vec<String>)> {
        let watched = watched(nodes);
        if let Some((manager, ms)) = watched {
            self.bus.put("manager", manager.to_string());
            self.bus.put_time("heartbeat", ms);
        }
        let add = |node| {
            let refused = self.add(node, watched.is_some());
            (self.nodes.last().map(|(name, _)| name.clone()).unwrap_or_default(), refused)
        };
        nodes.iter().map(add).collect()
    }

    /// Adds a node, which `watches` the manager; returns its parameters that the data sheet does not allow.
    pub(crate) fn add(&mut self, node: &Found, watches: bool) -> Vec<String> {
        let usual = usual_name(node.sheet.as_ref().map(|(_, sheet, _)| sheet), node.id);
        let name = self.free_name(node.name.as_deref().unwrap_or_default(), &usual);
        let (section, refused) = section(node, watches);
        self.nodes.push((name, section));
        refused
    }
}

fn section(node: &Found, watches: bool) -> (Section, Vec<String>) {
    let mut section = Section::default();
    section.put("id", node.id.to_string());
    let known = |address: Address| {
        let (_, sheet, _) = node.sheet.as_ref()?;
        given(sheet.entry(address.index(), address.sub())?)?.as_integer()
    };
    let numbers = [1, 2, 3, 4].map(|sub| {
        let number = node.identity[usize::from(sub) - 1].filter(|number| *number != 0)?;
        (known(Address::new(cia301::IDENTITY, sub)) != Some(number.into())).then_some(number)
    });
    if let Some((name, ..)) = &node.sheet {
        section.put("sheet", quoted(name));
    }
    if let Some(identity) = identity(numbers) {
        section.put("identity", identity);
    }
    if let Some(designator) = &node.designator {
        section.put("designator", quoted(designator));
    }
    for (key, value) in &node.lines {
        section.put(key, value);
    }
    let Some((_, sheet, device)) = &node.sheet else {
        if node.heartbeat_ms > 0 {
            section.put_time("heartbeat", node.heartbeat_ms.into());
        }
        return (section, Vec::new());
    };
    let mut said = BTreeSet::from_iter(watches.then_some(WATCHED));
    let [heartbeat, guarding, factor] =
        [HEARTBEAT, GUARD_TIME, LIFE_TIME_FACTOR].map(|address| node.held(address).unwrap_or_default());
    if heartbeat > 0 {
        section.put_time("heartbeat", heartbeat as u64);
        said.insert(HEARTBEAT);
    } else if guarding > 0 && factor > 0 {
        section.put_time("guarding", guarding as u64);
        if factor != i128::from(PATIENCE) {
            section.put("retry", factor.to_string());
        }
        said.extend([GUARD_TIME, LIFE_TIME_FACTOR]);
    }
    let mut pdos = BTreeSet::new();
    for name in PdoName::of_sheet(sheet) {
        let Some(wanted) = PdoState::of_sheet(device, node.id, name) else { continue };
        if let Some(text) = pdo(sheet, node.id, &wanted, node.written.contains(&name.mapping(0))) {
            pdos.extend([name.parameter(0).index(), name.mapping(0).index()]);
            if !text.is_empty() {
                section.put(&name.to_string().to_lowercase().replace("pdo", "pdo."), text);
            }
        }
    }
    let mut values = configured(device, node.id);
    values.retain(|address, data| {
        let entry = sheet.entry(address.index(), address.sub());
        let differs = entry.is_some_and(|entry| initial(sheet, entry).of_node(node.id.get()) != *data);
        (differs || node.written.contains(address)) && !said.contains(address) && !pdos.contains(&address.index())
    });
    let refused = put_settings(&mut section, sheet, node.id, &values);
    (section, refused)
}

/// A PDO in TOML: empty if it is as in the data sheet, `None` if the file cannot express it exactly.
fn pdo(sheet: &Device, id: NodeId, wanted: &PdoState, maps: bool) -> Option<String> {
    let before = PdoState::of_sheet(sheet, id, wanted.name)?;
    if before == *wanted && !maps {
        return Some(String::new());
    }
    let becomes =
        |change: &Change| Plan::new(Some(sheet), id, before.clone(), change).is_ok_and(|plan| plan.after == *wanted);
    if !wanted.cob_id.is_valid() {
        return becomes(&Change { on: Some(false), ..Change::default() }).then(|| quoted("off"));
    }
    let moves = wanted.cob_id.id() != before.cob_id.id() || !before.cob_id.is_valid();
    let cob_id = u16::try_from(wanted.cob_id.id().raw()).ok().and_then(CobId::standard).filter(|_| moves);
    let change = Change {
        on: Some(true),
        cob_id,
        transmission: wanted.transmission.filter(|_| wanted.transmission != before.transmission),
        inhibit_100us: wanted.inhibit_100us.filter(|_| wanted.inhibit_100us != before.inhibit_100us),
        event_timer_ms: wanted.event_timer_ms.filter(|_| wanted.event_timer_ms != before.event_timer_ms),
        mapping: (maps || wanted.mapping != before.mapping).then(|| wanted.mapping.clone()),
    };
    pdo_text(sheet, wanted.name, &change).filter(|_| becomes(&change))
}

/// A change of a PDO in TOML, as a short list if it is only about the objects; `None` if the file cannot express it.
fn pdo_text(sheet: &Device, pdo: PdoName, change: &Change) -> Option<String> {
    let mut keys = Vec::new();
    if let Some(mapping) = &change.mapping {
        let name = |mapped: &Mapped| match sheet.entry(mapped.address.index(), mapped.address.sub()) {
            Some(_) => object_name(sheet, mapped.address),
            None => DataType::from_code(mapped.address.index()).to_string(),
        };
        let names: Vec<_> = mapping.iter().map(name).collect();
        if pdo.map(Some(sheet), &names).ok()? != *mapping {
            return None;
        }
        let objects: Vec<_> = names.iter().map(|name| quoted(name)).collect();
        keys.push(("map", format!("[{}]", objects.join(", "))));
    }
    keys.extend(change.cob_id.map(|id| ("cob-id", format!("{:#X}", id.raw()))));
    keys.extend(change.transmission.map(|it| ("transmission", transmission(it))));
    if let Some(inhibit) = change.inhibit_100us {
        // The file allows whole milliseconds only.
        keys.push(("inhibit", time(inhibit.is_multiple_of(10).then_some(u64::from(inhibit) / 10)?)));
    }
    keys.extend(change.event_timer_ms.map(|ms| ("every", time(ms.into()))));
    Some(match &keys[..] {
        [] => "{}".to_owned(),
        [("map", objects)] => objects.clone(),
        keys => {
            let keys: Vec<_> = keys.iter().map(|(key, value)| format!("{key} = {value}")).collect();
            format!("{{ {} }}", keys.join(", "))
        }
    })
}

/// Puts parameters with names and units into a section. Those that the data sheet does not allow become remarks, and
/// are returned.
fn put_settings(
    section: &mut Section,
    sheet: &Device,
    id: NodeId,
    settings: &BTreeMap<Address, Vec<u8>>,
) -> Vec<String> {
    let mut values = DeviceValues::new(sheet);
    let known = |(address, data): (&Address, &Vec<u8>)| {
        let entry = sheet.entry(address.index(), address.sub())?;
        Some((entry, parse(entry.data_type, data)?))
    };
    for (entry, value) in settings.iter().filter_map(known) {
        values.set(Address::new(entry.index, entry.sub), &value);
    }
    let texts = settings.iter().filter_map(known).map(|(entry, value)| {
        let text = values.describe(entry, &value);
        let text = match &value {
            Value::Integer(number) if matches!(entry.meaning, Meaning::Plain) => number.to_string(),
            Value::Integer(number) if values.parse(entry, &text).as_ref() != Ok(&value) => format!("raw:{number}"),
            _ => text,
        };
        (object_name(sheet, Address::new(entry.index, entry.sub)), text)
    });
    let texts: Vec<(String, String)> = texts.collect();
    let pairs: Vec<_> = texts.iter().map(|(object, value)| (object.as_str(), value.as_str())).collect();
    let (_, wrong) = encode(&pairs, &mut DeviceValues::new(sheet), Some(id));
    let mut refused = Vec::new();
    for (at, (object, value)) in texts.iter().enumerate() {
        match wrong.iter().find(|wrong| wrong.at == at) {
            Some(wrong) => refused.push(format!("{object} = {value}: {}", wrong.text)),
            None if value.parse::<i64>().is_ok() => section.set(object, value),
            None => section.set(object, &quoted(value)),
        }
    }
    refused.iter().for_each(|refused| section.remark(refused));
    refused
}
