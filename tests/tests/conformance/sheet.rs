//! The data sheet of the device under test, as `lexican-eds` reads it: what the device is compared with.

use lexican_eds::model::{Device, Value};
use lexican_eds::{Diagnostics, Input, Source, load};
use lexican_runtime::object::Address;

use crate::dut::NODE;

pub fn device() -> Device {
    read().1
}

/// What the linter says, at any severity.
pub fn findings() -> String {
    let (input, _, findings) = read();
    findings.render(&input)
}

/// The default of a number, with the node-ID in it.
pub fn default(device: &Device, address: Address) -> u64 {
    let entry = device.entry(address.index(), address.sub()).expect("the dictionary was generated from the data sheet");
    let bits = device.bits(entry.data_type).expect("a number has a size");
    let value = match entry.default {
        Some(Value::Integer(value)) => value,
        Some(Value::NodeIdPlus(base)) => i128::from(base) + i128::from(NODE.get()),
        ref other => panic!("{address}: {other:?} is no number"),
    };
    value as u64 & (u64::MAX >> (64 - u32::from(bits)))
}

fn read() -> (Input, Device, Diagnostics) {
    let input = Input::new(Source::new("device.eds", include_str!("../../conformance/device.eds")));
    let (device, findings) = load(&input);
    (input, device, findings)
}
