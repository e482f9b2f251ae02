//! Decodes PDOs: by the configuration if there is a data sheet, else by the predefined connection set.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};

use lexican_eds::model::{self, Direction, Entry, Mapped, Value};
use lexican_eds::types::DataType;
use lexican_runtime::cia301::{self, connection};
use lexican_runtime::object::Address;
use lexican_runtime::wire::pdo::PdoCobId;
use lexican_runtime::{CobId, Frame, NodeId};

use super::{Decoded, Detail, Pdo, Service};
use crate::values::report::ValueReport;
use crate::values::wire::of_bits;
use crate::values::{DeviceValues, resolved};

/// A PDO with its current configuration.
pub(super) struct Configured<'a> {
    node: NodeId,
    received: bool,
    number: u16,
    pub(super) mapping: Vec<Mapped>,
    slots: Vec<Slot<'a>>,
}

/// A mapped object.
struct Slot<'a> {
    bits: u8,
    entry: Option<&'a Entry>,
    /// The report without value; `None` for a dummy entry.
    blank: Option<ValueReport>,
}

impl<'a> Slot<'a> {
    fn new(device: &DeviceValues<'a>, mapped: &Mapped) -> Self {
        let address = Address::new(mapped.index, mapped.sub);
        let entry = device.entry(address);
        let is_dummy = entry.is_none() && DataType::from_code(mapped.index).bits().is_some();
        let blank = (!is_dummy).then(|| ValueReport::without_value(Some(device), address));
        Slot { bits: mapped.bits, entry, blank }
    }
}

/// The PDOs of nodes with data sheets, by COB-ID: finding the configuration takes longer than decoding. If two have the
/// same COB-ID, that of the lower node-ID is used.
pub(super) fn table<'a>(nodes: &BTreeMap<NodeId, DeviceValues<'a>>) -> HashMap<CobId, Configured<'a>> {
    let mut table = HashMap::new();
    for (node, device) in nodes {
        for pdo in &device.device.pdos {
            let Some(cob_id) = cob_id(device, *node, pdo) else { continue };
            let received = pdo.direction == Direction::Receive;
            table.entry(cob_id).or_insert_with(|| {
                let mapping = mapping(device, pdo);
                let slots = mapping.iter().map(|mapped| Slot::new(device, mapped)).collect();
                Configured { node: *node, received, number: pdo.number, mapping, slots }
            });
        }
    }
    table
}

impl Configured<'_> {
    /// Decodes a frame with the COB-ID of this PDO.
    pub(super) fn decode(&self, nodes: &mut BTreeMap<NodeId, DeviceValues<'_>>, frame: &Frame) -> Option<Decoded> {
        let Configured { node, received, number, ref mapping, ref slots } = *self;
        let device = nodes.get_mut(&node)?;
        let mut decoded = new(received, number, node);
        if frame.is_remote() {
            "asked for".clone_into(&mut decoded.text);
            return Some(decoded);
        }
        let bits: u32 = mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
        let (expected, len) = (bits.div_ceil(8), u32::from(frame.dlc()));
        if len < expected {
            let text = format!("{len} bytes instead of {expected}");
            return Some(Decoded { text, alarming: true, ..decoded });
        }
        let fields = read(device, slots, frame.data());
        let mut text = String::with_capacity(40 * fields.len());
        for field in &fields {
            text.push_str(separator(&text));
            field.add_brief(&mut text);
        }
        if len > expected {
            // An RPDO that is too long is used by the device, which may send EMCY 8220h for it (CiA 301, 7.2.2.4). A
            // TPDO must be as long as its mapping.
            text += &format!("{}{len} bytes instead of {expected}", separator(&text));
            decoded.alarming = !received;
        }
        Some(decoded.with(text, Detail::Pdo(Pdo { number, received, fields })))
    }
}

/// A PDO without data sheet, by the predefined connection set (CiA 301, 7.3.3).
pub(super) fn predefined(base: u16, node: NodeId, frame: &Frame) -> Decoded {
    let number = (base - connection::TPDO_1) / 0x100 + 1;
    let text = if frame.is_remote() { "asked for".to_owned() } else { String::new() };
    Decoded { text, ..new(base & 0x80 == 0, number, node) }
}

fn new(received: bool, number: u16, node: NodeId) -> Decoded {
    let (service, word, first) = match received {
        true => (Service::Rpdo, "RPDO", ["RPDO1", "RPDO2", "RPDO3", "RPDO4"]),
        false => (Service::Tpdo, "TPDO", ["TPDO1", "TPDO2", "TPDO3", "TPDO4"]),
    };
    // Nearly all PDOs are among the first four; their names need no allocation.
    let known = first.get(usize::from(number).wrapping_sub(1)).copied();
    let name = known.map_or_else(|| Cow::Owned(format!("{word}{number}")), Cow::Borrowed);
    let detail = Detail::Pdo(Pdo { number, received, fields: Vec::new() });
    Decoded::new(service, name, Some(node)).with("", detail)
}

/// The separator before the next part of a text.
fn separator(text: &str) -> &'static str {
    if text.is_empty() { "" } else { ", " }
}

/// The COB-ID of a PDO: as seen on the bus, else from the data sheet.
pub(crate) fn cob_id(device: &DeviceValues<'_>, node: NodeId, pdo: &model::Pdo) -> Option<CobId> {
    let seen = device.seen(Address::new(parameter(pdo)?, 1));
    let given = || resolved(pdo.cob_id.as_ref()?, node).as_integer();
    let raw = seen.and_then(|seen| u32::try_from(seen).ok()).or_else(|| u32::try_from(given()?).ok())?;
    PdoCobId(raw).is_valid().then(|| PdoCobId(raw).id())
}

/// The mapping of a PDO: as seen on the bus, else from the data sheet.
pub(crate) fn mapping(device: &DeviceValues<'_>, pdo: &model::Pdo) -> Vec<Mapped> {
    let seen = parameter(pdo).and_then(|parameter| {
        let entry = |sub| device.seen(Address::new(parameter + cia301::TO_MAPPING, sub));
        let count = u8::try_from(entry(0)?).ok()?;
        (1..=count.min(64)).map(|sub| entry(sub).map(mapped)).collect::<Option<Vec<_>>>()
    });
    seen.unwrap_or_else(|| pdo.mapping.clone())
}

fn mapped(entry: i128) -> Mapped {
    Mapped { index: (entry >> 16) as u16, sub: (entry >> 8) as u8, bits: entry as u8 }
}

/// The index of the communication parameter.
fn parameter(pdo: &model::Pdo) -> Option<u16> {
    let number = (1..=512).contains(&pdo.number).then_some(pdo.number)?;
    Some(match pdo.direction {
        Direction::Receive => cia301::rpdo(number),
        Direction::Transmit => cia301::tpdo(number),
    })
}

/// The mapped values in a PDO's data, without dummy entries.
pub fn content(device: &mut DeviceValues<'_>, mapping: &[Mapped], data: &[u8]) -> Vec<ValueReport> {
    let slots: Vec<Slot<'_>> = mapping.iter().map(|mapped| Slot::new(device, mapped)).collect();
    read(device, &slots, data)
}

fn read(device: &mut DeviceValues<'_>, slots: &[Slot<'_>], data: &[u8]) -> Vec<ValueReport> {
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    let mut rest = u64::from_le_bytes(bytes);
    let mut fields = Vec::with_capacity(slots.len());
    for Slot { bits: all_bits, entry, blank } in slots {
        let bits = u32::from(*all_bits).min(64);
        let raw = if bits == 64 { rest } else { rest & ((1 << bits) - 1) };
        rest = rest.checked_shr(bits).unwrap_or(0);
        let Some(mut report) = blank.clone() else { continue };
        match entry {
            Some(entry) => {
                let value = of_bits(entry.data_type, *all_bits, raw);
                report.set_value(device, entry, value.clone());
                device.set(report.address, &value);
            }
            None => (report.value, report.text) = (Some(Value::Integer(raw.into())), Some(format!("{raw:X}h"))),
        }
        fields.push(report);
    }
    fields
}
