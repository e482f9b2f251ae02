//! A value that is shown can be typed in again and means the same: for every object of the library's data sheets with
//! their overlays, and of the golden ones.

use lexican_eds::library;
use lexican_eds::model::{Device, Entry, Meaning, Value};
use lexican_eds::types::Class;
use lexican_toolbox::values::DeviceValues;

use crate::cases;

/// Values of an entry: named ones, bits, limits, and numbers.
fn values(device: &Device, entry: &Entry) -> Vec<Value> {
    let mut numbers: Vec<i128> =
        vec![0, 1, 5, 100, -5, 5000, 12_345, -1_234_567, 0x8000_0180, 0xC000_0180, 0x6040_0010];
    numbers.extend((0..64).map(|bit| 1 << bit));
    numbers.extend([0x06, 0x07, 0x0F, 0x1F, 0x2F, 0x8F, 0x10F, 0xFFFF]);
    if let Meaning::Enumeration(name) = &entry.meaning {
        numbers.extend(device.enumerations[name].values.iter().map(|named| named.value));
    }
    match entry.data_type.class() {
        Class::Boolean | Class::Signed | Class::Unsigned | Class::Time => {
            let (low, high) = entry.data_type.range().unwrap();
            numbers.extend([low, low + 1, high - 1, high]);
            numbers.into_iter().filter(|number| (low..=high).contains(number)).map(Value::Integer).collect()
        }
        Class::Real => {
            [0.0, -0.1_f32, 5.1, 1e-20, 3.4e38, 16_777_217.0].map(|number| Value::Real(number.into())).to_vec()
        }
        Class::Text => ["AG03", "", "two words", "\"", "a\\b"].map(|text| Value::Text(text.to_owned())).to_vec(),
        Class::Bytes | Class::Other => vec![Value::Bytes(vec![0x01, 0xA0, 0xFF]), Value::Bytes(vec![7; 100])],
    }
}

/// The number of values that were parsed again, and of those that were refused.
fn check(source: &str, device: &Device) -> (usize, usize) {
    let (mut same, mut refused) = (0, 0);
    let known = DeviceValues::new(device);
    for entry in device.entries() {
        for value in values(device, entry) {
            let shown = known.describe(entry, &value);
            match known.parse(entry, &shown) {
                Ok(taken) => {
                    assert_eq!(taken, value, "{source} {:04X}:{:02X} {} {shown:?}", entry.index, entry.sub, entry.name);
                    same += 1;
                }
                // A text that is cut short or incomplete is refused, rather than taken for another value.
                Err(why) => {
                    let is_status = (entry.index, entry.sub) == (0x6041, 0);
                    let is_cut = matches!(value, Value::Bytes(_) | Value::Text(_));
                    assert!(is_status || is_cut, "{source} {:04X}:{:02X} {shown:?}: {why}", entry.index, entry.sub);
                    refused += 1;
                }
            }
        }
    }
    (same, refused)
}

#[test]
fn what_is_shown_goes_in_again_and_means_the_same() {
    let (mut same, mut refused) = (0, 0);
    let mut add = |(taken, not): (usize, usize)| (same, refused) = (same + taken, refused + not);
    for shipped in library::all() {
        add(check(shipped.id, &lexican_eds::load(&shipped.input()).0));
    }
    for case in cases::cases() {
        add(check(&case.code, &lexican_eds::load(&case.input).0));
    }
    assert!(same > 20_000 && refused * 20 < same, "{same} {refused}");
}

#[test]
fn a_value_beyond_its_type_is_refused_by_the_limits_of_the_data_sheet() {
    let shipped = library::all().iter().find(|shipped| shipped.id.ends_with("ag03-1")).unwrap();
    let (mut device, _) = lexican_eds::load(&shipped.input());
    let at = device.objects.iter_mut().find(|object| object.index == 0x6060).unwrap();
    (at.entries[0].low, at.entries[0].high) = (Some(Value::Integer(1)), Some(Value::Integer(3)));
    let entry = device.entry(0x6060, 0).unwrap();
    let error = DeviceValues::new(&device).parse(entry, "300").unwrap_err();
    assert!(
        error.contains("300 is no UNSIGNED8: the data sheet allows profile position (1) to 3")
            && !error.contains("255"),
        "{error}"
    );
}
