//! The list of a data sheet's entries.

use lexican_eds::model::{Device, Entry, Value};
use lexican_runtime::NodeId;
use lexican_toolbox::values::{DeviceValues, address, choices, given, resolved};

use super::node::Node;
use crate::view;

/// The entries in a node's data sheet, with the values known.
pub(crate) fn list(id: NodeId, node: &Node, values: &DeviceValues<'_>) -> Vec<view::Object> {
    let device = values.device;
    device.objects.iter().flat_map(|object| &object.entries).map(|entry| of_entry(id, node, values, entry)).collect()
}

fn of_entry(id: NodeId, node: &Node, values: &DeviceValues<'_>, entry: &Entry) -> view::Object {
    let device = values.device;
    let words = |value: &Value| values.describe(entry, &resolved(value, id));
    let (address, object) = (address(entry), device.object(entry.index));
    let (low, high) = limits(values, entry);
    view::Object {
        address: address.to_string(),
        object: object.map_or_else(String::new, |object| object.name.clone()),
        name: entry.name.clone(),
        group: group(device, entry.index).to_owned(),
        data_type: entry.data_type.name().to_owned(),
        bits: device.bits(entry.data_type),
        access: entry.access.name().to_owned(),
        mappable: entry.pdo_mapping.then(|| mappable(entry).to_owned()),
        default: given(entry).map(words),
        low: low.as_ref().map(words),
        high: high.as_ref().map(words),
        choices: choices(device, entry),
        unit: values.unit(entry).map(|unit| unit.symbol.clone()),
        help: entry.description.clone().or_else(|| object?.description.clone()),
        value: node.values.get(&address).map(|seen| seen.value.clone()),
    }
}

/// The limits that hold now: conditional ones, or else those of the entry.
fn limits(values: &DeviceValues<'_>, entry: &Entry) -> (Option<Value>, Option<Value>) {
    match entry.ranges.iter().find(|range| values.holds(&range.when)) {
        Some(range) => (Some(Value::Integer(range.low)), Some(Value::Integer(range.high))),
        None => (entry.low.clone(), entry.high.clone()),
    }
}

/// The area of an object (CiA 301, 7.4.1, table 37).
fn group(device: &Device, index: u16) -> &'static str {
    match index {
        0x1000..=0x1FFF => "Communication",
        0x2000..=0x5FFF => "Manufacturer",
        0x6000..=0x9FFF if device.profile == Some(402) => "Drive",
        0x6000..=0x9FFF => "Device profile",
        _ => "Other",
    }
}

fn mappable(entry: &Entry) -> &'static str {
    match (entry.access.readable(), entry.access.writable()) {
        (true, true) => "both",
        (false, true) => "rpdo",
        _ => "tpdo",
    }
}
