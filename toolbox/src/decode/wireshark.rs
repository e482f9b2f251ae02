//! Generates a Lua script that gives Wireshark the names of a bus's nodes and objects.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};

use lexican_eds::model::{Device, Entry, Meaning};
use lexican_eds::types::Class;
use lexican_runtime::{NodeId, cia301};

use super::pdo;
use crate::values::{DeviceValues, name};

/// A script with which Wireshark and tshark show the objects of these nodes by name and unit. Each node has a name, and
/// the PDOs that its data sheet or DCF configures.
#[must_use]
pub fn script<'a>(nodes: impl Iterator<Item = (String, NodeId, &'a Device)>) -> String {
    let mut lua = "local sheets, nodes, pdos = {}, {}, {}\n".to_owned();
    // Writing to a string cannot fail, so its results are ignored.
    let mut devices: Vec<&Device> = Vec::new();
    for (node, id, device) in nodes {
        let sheet = devices.iter().position(|known| std::ptr::eq(*known, device)).unwrap_or(devices.len());
        if sheet == devices.len() {
            let _ = write_sheet(&mut lua, sheet, device);
            devices.push(device);
        }
        let _ = writeln!(lua, "nodes[{id}] = {{ name = {}, sheet = sheets[{sheet}] }}", quoted(&node));
        let _ = write_pdos(&mut lua, id, device);
    }
    lua + "\n" + include_str!("wireshark.lua")
}

fn write_sheet(lua: &mut String, number: usize, device: &Device) -> fmt::Result {
    let values = DeviceValues::new(device);
    writeln!(lua, "sheets[{number}] = {{ objects = {{")?;
    for entry in device.objects.iter().flat_map(|object| &object.entries) {
        write_entry(lua, &values, entry)?;
    }
    let first_error = device.entry(cia301::PREDEFINED_ERROR_FIELD, 1);
    let emergencies = first_error.map(|entry| names(device, entry)).unwrap_or_default();
    writeln!(lua, "}}, emergencies = {} }}", Table(&emergencies))
}

fn write_pdos(lua: &mut String, id: NodeId, device: &Device) -> fmt::Result {
    let values = DeviceValues::new(device);
    for pdo in &device.pdos {
        let mapping = pdo::mapping(&values, pdo);
        let Some(cob_id) = pdo::cob_id(&values, id, pdo).filter(|_| !mapping.is_empty()) else { continue };
        write!(lua, "pdos[0x{:X}] = pdos[0x{0:X}] or {{ node = {id}", cob_id.raw())?;
        for mapped in mapping {
            write!(lua, ", {{ 0x{:06X}, {} }}", u32::from(mapped.index) << 8 | u32::from(mapped.sub), mapped.bits)?;
        }
        writeln!(lua, " }}")?;
    }
    Ok(())
}

fn write_entry(lua: &mut String, values: &DeviceValues<'_>, entry: &Entry) -> fmt::Result {
    let title = name(values.device, entry);
    write!(lua, "  [0x{:06X}] = {{ name = {}", u32::from(entry.index) << 8 | u32::from(entry.sub), quoted(&title))?;
    let class = entry.data_type.class();
    if let (Class::Boolean | Class::Signed | Class::Unsigned, Some(bits)) = (class, entry.data_type.bits()) {
        let field: String =
            title.chars().map(|it| if it.is_ascii_alphanumeric() { it.to_ascii_lowercase() } else { '_' }).collect();
        write!(lua, ", bits = {bits}, signed = {}, field = \"{field}\"", class == Class::Signed)?;
    }
    if let Some(unit) = values.unit(entry) {
        let factor = unit.num as f64 / unit.den as f64;
        write!(lua, ", unit = {}, factor = {factor:?}", quoted(&unit.symbol))?;
    }
    match &entry.meaning {
        Meaning::Enumeration(_) => write!(lua, ", values = {}", Table(&names(values.device, entry)))?,
        Meaning::BitField(field) => {
            let fields = values.device.bit_fields.get(field).map(|it| it.fields.as_slice()).unwrap_or_default();
            lua.push_str(", flags = {");
            for bits in fields {
                let width = bits.value.high - bits.value.low + 1;
                write!(lua, " {{ {}, {width}, {} }},", bits.value.low, quoted(&bits.name))?;
            }
            lua.push_str(" }");
        }
        Meaning::Plain | Meaning::Quantity(_) => {}
    }
    lua.push_str(" },\n");
    Ok(())
}

/// The names of an entry's values.
fn names<'a>(device: &'a Device, entry: &Entry) -> BTreeMap<i128, &'a str> {
    let Meaning::Enumeration(name) = &entry.meaning else { return BTreeMap::new() };
    let values = device.enumerations.get(name).map(|it| it.values.as_slice()).unwrap_or_default();
    values.iter().map(|it| (it.value, it.name.as_str())).collect()
}

struct Table<'a>(&'a BTreeMap<i128, &'a str>);

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{")?;
        self.0.iter().try_for_each(|(number, name)| write!(f, " [{number}] = {},", quoted(name)))?;
        f.write_str(" }")
    }
}

/// A text as a Lua literal.
fn quoted(text: &str) -> String {
    let plain: String = text.chars().map(|it| if it.is_control() { ' ' } else { it }).collect();
    format!("\"{}\"", plain.replace('\\', "\\\\").replace('"', "\\\""))
}
