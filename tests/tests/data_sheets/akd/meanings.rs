//! The names of values and bits in the overlay against the tables that print them.

use lexican_eds::model::{Bits, Device, Entry, Meaning, Named, Value};

use super::tables::rows;
use crate::manual::{Judge, Row};
use crate::protocol::number;

/// Words whose bits the overlay does not name: they stay numbers.
const NUMBERS: [&str; 4] = ["1005:00", "1010:01", "1400:01", "1800:01"];

pub fn judge(device: &Device, judge: &mut Judge) {
    emergency(device, judge);
    formats(device, judge);
    values(device, judge);
    terms(device, judge);
    homing_methods(device, judge);
    mode_bits(device, judge);
    baud_rates(device, judge);
}

/// Every code is named by its fault or warning number and its text.
fn emergency(device: &Device, judge: &mut Judge) {
    let named = &device.enumerations["EmergencyCode"].values;
    let table = rows("emergency");
    for row in &table {
        let code = i128::from_str_radix(row.get("code"), 16).unwrap();
        let name = &named.iter().find(|named| named.value == code).expect("every code has a name").name;
        let (number, text) = name.split_once(' ').unwrap_or((name, ""));
        let (expected, printed) = (row.get("number"), row.get("description"));
        let is_without_number = matches!(expected, "0" | "-");
        judge.that(
            row,
            "number",
            expected == number || (is_without_number && ["no", "reserved"].contains(&number)),
            name,
        );
        let printed = printed.trim_start_matches("Warning:").trim().trim_end_matches('.');
        judge.that(row, "description", printed == text || is_without_number, name);
    }
    assert_eq!((table.len(), named.len()), (168, 168));
}

/// Bits that have a meaning have a name, and no others.
fn formats(device: &Device, judge: &mut Judge) {
    for row in rows("formats") {
        let (low, high) = bits(&row);
        if row.get("address") == "1000:00" {
            let default = entry(device, &row).default.as_ref().and_then(Value::as_integer).unwrap();
            let found = default >> low & ((1 << (high - low + 1)) - 1);
            let expected = i128::from_str_radix(row.get("value"), 16).unwrap_or(0);
            judge.that(&row, "value", found == expected, format!("{found:X}"));
            continue;
        }
        if NUMBERS.contains(&row.get("address")) {
            judge.that(
                &row,
                "meaning",
                !matches!(entry(device, &row).meaning, Meaning::BitField(_)),
                "bits with names",
            );
            continue;
        }
        let fields = fields(device, entry(device, &row));
        let meaning = row.get("meaning");
        let is_reserved = ["reserve", "Manufacturer-specific", "not used"].iter().any(|word| meaning.starts_with(word));
        let over: Vec<_> =
            fields.iter().filter(|field| field.value.low <= high && low <= field.value.high).map(|f| &f.name).collect();
        let is_covered = fields.iter().any(|field| field.value.low <= low && high <= field.value.high);
        judge.that(&row, "meaning", if is_reserved { over.is_empty() } else { is_covered }, format!("{over:?}"));
    }
}

/// Values that have a meaning have a name.
fn values(device: &Device, judge: &mut Judge) {
    for row in rows("values") {
        let Meaning::Enumeration(name) = &entry(device, &row).meaning else { panic!("{} has no enumeration", row.key) };
        let value = number(row.get("value"));
        let named = &device.enumerations[name].values;
        judge.that(&row, "value", named.iter().any(|named| Some(named.value) == value), name);
    }
}

/// What the manual calls a bit or value, and what the overlay does; all of the overlay is there.
fn terms(device: &Device, judge: &mut Judge) {
    let table = rows("terms");
    let printed: Vec<String> =
        ["formats", "values"].iter().flat_map(|file| rows(file)).map(|row| row.get("meaning").to_owned()).collect();
    let mut of_overlay: Vec<(String, String)> = Vec::new();
    for (name, field) in device.bit_fields.iter().flat_map(|(name, of)| of.fields.iter().map(move |f| (name, f))) {
        let Bits { low, high } = field.value;
        let bits = if low == high { low.to_string() } else { format!("{low}..{high}") };
        of_overlay.push((format!("{name}:{bits}"), field.name.clone()));
    }
    let elsewhere = ["EmergencyCode", "HomingMethod"];
    for (name, of) in device.enumerations.iter().filter(|(name, _)| !elsewhere.contains(&name.as_str())) {
        of_overlay.extend(of.values.iter().map(|named| (format!("{name}:{}", named.value), named.name.clone())));
    }
    for row in &table {
        let found = of_overlay.iter().find(|(key, _)| *key == row.key).map(|(_, name)| name.as_str());
        judge.that(row, "overlay", found == Some(row.get("overlay")), format!("{found:?}"));
        let is_code = ["read", "acknowledge"].contains(&row.get("printed"));
        judge.that(row, "printed", is_code || printed.iter().any(|cell| cell == row.get("printed")), "no such row");
    }
    let missing: Vec<_> = of_overlay.iter().filter(|(key, _)| table.iter().all(|row| row.key != *key)).collect();
    assert!(missing.is_empty(), "names of the overlay that no term has: {missing:?}");
}

fn homing_methods(device: &Device, judge: &mut Judge) {
    let methods = &device.enumerations["HomingMethod"].values;
    for row in rows("homing_methods") {
        let method = row.get("method");
        let (low, high) = method.split_once("..").unwrap_or((method, method));
        let (low, high) = (number(low).unwrap(), number(high).unwrap());
        let found: Vec<&Named<i128>> = methods.iter().filter(|named| (low..=high).contains(&named.value)).collect();
        judge.that(&row, "supported", (row.get("supported") == "yes") == (found.len() == 1), found.len());
        let [named] = found[..] else { continue };
        let switch = row.get("switch").replace("a single", "one");
        judge.that(&row, "switch", named.name.starts_with(&switch), &named.name);
        judge.that(&row, "zeroing", (row.get("zeroing") == "with") == named.name.contains("with zeroing"), &named.name);
        let command = format!("HOME.MODE {}, HOME.DIR {}.", row.get("home_mode"), row.get("home_dir"));
        let description = named.description.as_deref().unwrap_or_default();
        judge.that(&row, "home_mode", description.ends_with(&command), description);
        let direction = row.get("count_direction");
        let found = description.to_lowercase().starts_with(&format!("{direction} count direction"));
        judge.that(&row, "count_direction", found || direction.is_empty(), description);
    }
}

/// The description of a bit names the modes in which it has a meaning, and no others.
fn mode_bits(device: &Device, judge: &mut Judge) {
    for row in rows("mode_bits") {
        let bit: u8 = row.get("bit").parse().unwrap();
        let word = device.entry(u16::from_str_radix(row.get("object"), 16).unwrap(), 0).unwrap();
        let field = fields(device, word).iter().find(|field| field.value == Bits { low: bit, high: bit }).unwrap();
        let number: i128 = row.get("number").parse().unwrap();
        let modes = &device.enumerations["OperatingMode"].values;
        let mode = modes.iter().find(|mode| mode.value == number).expect("a mode of the drive");
        let description = field.description.as_deref().unwrap_or_default().to_lowercase();
        let is_named = description.contains(&format!("{}:", mode.name));
        judge.that(&row, "meaning", (row.get("meaning") != "reserved") == is_named, description);
    }
}

fn baud_rates(device: &Device, judge: &mut Judge) {
    let table = rows("baud_rates");
    for row in &table {
        let value = number(row.get("value"));
        let is_named = device.enumerations["CanBitRate"].values.iter().any(|named| Some(named.value) == value);
        judge.that(row, "value", is_named, "no such value");
        let rates = &device.info.bit_rates_kbit;
        let is_rate = row.get("kbit").parse().map_or(row.get("kbit") == "auto", |rate| rates.contains(&rate));
        judge.that(row, "kbit", is_rate, format!("{rates:?}"));
    }
    assert_eq!(device.info.bit_rates_kbit.len() + 1, table.len());
}

fn entry<'d>(device: &'d Device, row: &Row) -> &'d Entry {
    let (index, sub) = row.get("address").split_once(':').expect("index and sub-index");
    let (index, sub) = (u16::from_str_radix(index, 16).unwrap(), u8::from_str_radix(sub, 16).unwrap());
    device.entry(index, sub).unwrap_or_else(|| panic!("no {}", row.get("address")))
}

fn fields<'d>(device: &'d Device, entry: &Entry) -> &'d [Named<Bits>] {
    match &entry.meaning {
        Meaning::BitField(name) => &device.bit_fields[name].fields,
        _ => panic!("{:04X}:{:02X} has no bit field", entry.index, entry.sub),
    }
}

/// The lowest and the highest bit of a row; the manual prints either first.
fn bits(row: &Row) -> (u8, u8) {
    let text = row.get("bits");
    let (a, b) = text.split_once("..").unwrap_or((text, text));
    let (a, b) = (a.parse().unwrap(), b.parse().unwrap());
    (std::cmp::min(a, b), std::cmp::max(a, b))
}
