//! Process data: by the configuration of a known device, else by the predefined connection set.

use std::collections::BTreeMap;

use lexican_eds::model::{self, Direction, Mapped, Value};
use lexican_eds::types::DataType;
use lexican_runtime::object::Address;
use lexican_runtime::wire::pdo::PdoCobId;
use lexican_runtime::{CobId, Frame, NodeId};

use super::{Decoded, Detail, Pdo, Service};
use crate::values::told::Told;
use crate::values::{self, Known};

/// A PDO of a known device, wherever it was configured to.
pub(super) fn configured(nodes: &mut BTreeMap<NodeId, Known<'_>>, frame: &Frame) -> Option<Decoded> {
    let (node, known, direction, number, mapping) = nodes.iter_mut().find_map(|(node, known)| {
        let pdo = known.device.pdos.iter().find(|pdo| cob_id(known, *node, pdo) == Some(frame.id()))?;
        let mapping = mapping(known, pdo);
        Some((*node, known, pdo.direction, pdo.number, mapping))
    })?;
    let received = direction == Direction::Receive;
    let mut decoded = new(received, number, node);
    if frame.is_remote() {
        "asked for".clone_into(&mut decoded.text);
        return Some(decoded);
    }
    let bits: u32 = mapping.iter().map(|mapped| u32::from(mapped.bits)).sum();
    let (expected, len) = (bits.div_ceil(8), u32::from(frame.dlc()));
    if len < expected {
        decoded.text = format!("{len} bytes instead of {expected}");
        decoded.alarming = true;
        return Some(decoded);
    }
    let fields = content(known, &mapping, frame.data());
    let mut parts: Vec<_> = fields.iter().map(|field| text(known, field)).collect();
    if len > expected {
        // A device takes the bytes that are mapped, and may complain of the others (CiA 301, 7.2.2.4, EMCY 8220h); what
        // it sends itself is as long as its mapping.
        parts.push(format!("{len} bytes instead of {expected}"));
        decoded.alarming = !received;
    }
    decoded.text = parts.join(", ");
    decoded.detail = Detail::Pdo(Pdo { number, received, fields });
    Some(decoded)
}

/// A PDO of a device that nobody introduced, by the predefined connection set (CiA 301, 7.3.5).
pub(super) fn predefined(base: u16, node: NodeId, frame: &Frame) -> Decoded {
    let number = (base - 0x180) / 0x100 + 1;
    let text = if frame.is_remote() { "asked for".to_owned() } else { String::new() };
    Decoded { text, ..new(base & 0x80 == 0, number, node) }
}

fn new(received: bool, number: u16, node: NodeId) -> Decoded {
    let (service, letter) = if received { (Service::Rpdo, 'R') } else { (Service::Tpdo, 'T') };
    let detail = Detail::Pdo(Pdo { number, received, fields: Vec::new() });
    Decoded { detail, ..Decoded::new(service, format!("{letter}PDO{number}"), Some(node)) }
}

/// The COB-ID of a PDO: as seen on the bus, else by default.
fn cob_id(known: &Known<'_>, node: NodeId, pdo: &model::Pdo) -> Option<CobId> {
    let index = parameter(pdo, 0x1400, 0x1800)?;
    let parameter = known.seen(index, 1).and_then(|seen| u32::try_from(seen).ok()).or_else(|| {
        let described = values::resolved(pdo.cob_id.as_ref()?, node).as_integer()?;
        u32::try_from(described).ok()
    })?;
    let parameter = PdoCobId(parameter);
    parameter.is_valid().then(|| parameter.id())
}

/// The mapping of a PDO: as seen on the bus, else by default.
fn mapping(known: &Known<'_>, pdo: &model::Pdo) -> Vec<Mapped> {
    let seen = parameter(pdo, 0x1600, 0x1A00).and_then(|index| {
        let count = u8::try_from(known.seen(index, 0)?).ok()?;
        (1..=count.min(64)).map(|sub| known.seen(index, sub).map(mapped)).collect::<Option<Vec<_>>>()
    });
    seen.unwrap_or_else(|| pdo.mapping.clone())
}

fn mapped(entry: i128) -> Mapped {
    Mapped { index: (entry >> 16) as u16, sub: (entry >> 8) as u8, bits: entry as u8 }
}

fn parameter(pdo: &model::Pdo, receive: u16, transmit: u16) -> Option<u16> {
    let base = match pdo.direction {
        Direction::Receive => receive,
        Direction::Transmit => transmit,
    };
    base.checked_add(pdo.number.checked_sub(1)?)
}

/// The mapped values; placeholders are left out.
fn content(known: &mut Known<'_>, mapping: &[Mapped], data: &[u8]) -> Vec<Told> {
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    let mut rest = u64::from_le_bytes(bytes);
    let mut fields = Vec::new();
    for mapped in mapping {
        let bits = u32::from(mapped.bits.min(64));
        let raw = if bits == 64 { rest } else { rest & ((1 << bits) - 1) };
        rest = rest.checked_shr(bits).unwrap_or(0);
        let address = Address::new(mapped.index, mapped.sub);
        let Some(entry) = known.entry(address) else {
            if DataType::from_code(mapped.index).bits().is_none() {
                let told = Told::entry(None, address);
                fields.push(Told { value: Some(Value::Integer(raw.into())), text: Some(format!("{raw:X}h")), ..told });
            }
            continue;
        };
        let value = values::wire::of_bits(entry.data_type, mapped.bits, raw);
        fields.push(Told::value(known, entry, value.clone()));
        known.learn(mapped.index, mapped.sub, &value);
    }
    fields
}

/// `Statusword = OPERATION ENABLED`: without the name of the object, which a line has no room for.
fn text(known: &Known<'_>, field: &Told) -> String {
    let name = known.entry(field.address).map_or_else(|| field.address.to_string(), |entry| entry.name.clone());
    format!("{name} = {}", field.words())
}
