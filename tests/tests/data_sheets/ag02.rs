//! The SIKO AG02: its data sheet against the tables of its manual, and the frames that the manual prints.

use lexican_eds::model::{Device, Entry, Meaning, NmtState, Value};
use lexican_runtime::wire::nmt::NmtMessage;
use lexican_runtime::wire::sdo::{ClientRequest, ServerResponse};

use crate::manual::{Judge, Manual, Row};
use crate::protocol::{self, number};

const MANUAL: Manual = Manual {
    folder: "ag02",
    keys: &[
        ("baud_rates", &["value"]),
        ("commands", &["command"]),
        ("controlword", &["bit", "mode"]),
        ("emergency", &["code"]),
        ("errata", &["id"]),
        ("error_register", &["bit"]),
        ("faults", &["letter"]),
        ("frames", &["frame"]),
        ("gears", &["value"]),
        ("names", &["index", "subindex"]),
        ("objects", &["index", "subindex"]),
        ("sdo_aborts", &["code"]),
        ("sdo_commands", &["hex"]),
        ("states", &["state"]),
        ("statusword", &["bit", "mode"]),
        ("system_status", &["bit", "value", "mode"]),
        ("values", &["address", "value"]),
    ],
};

/// Every cell that can be compared agrees with the data sheet, its overlay or the runtime, or is one of the errata.
#[test]
fn the_data_sheet_is_what_the_manual_prints() {
    let device = crate::device("siko/ag02");
    let mut judge = Judge::default();
    objects(&device, &mut judge);
    meanings(&device, &mut judge);
    protocol::states(&mut judge, &MANUAL.rows("states"), "bits_7_0");
    protocol::commands(&mut judge, &MANUAL.rows("commands"));
    protocol::sdo(&mut judge, &MANUAL.rows("sdo_aborts"), &MANUAL.rows("sdo_commands"));
    for row in MANUAL.rows("frames") {
        judge.that(&row, "data", is_made_anew(&row), "other bytes");
    }
    judge.finish(&MANUAL, &["errata"]);
    MANUAL.check_folder();
}

/// The objects of 10.12.2.
fn objects(device: &Device, judge: &mut Judge) {
    let table = MANUAL.rows("objects");
    for row in &table {
        let (index, sub) = row.address();
        let entry = device.entry(index, sub.unwrap()).unwrap_or_else(|| panic!("no {}", row.key));
        let data_type = entry.data_type.name();
        judge.that(row, "data_type", row.get("data_type").to_uppercase() == data_type, data_type);
        let access: &[&str] = match row.get("access") {
            // What a receive PDO maps is process output in the terms of CiA 306.
            "read-write" if entry.pdo_mapping => &["rww"],
            "read-write" => &["rw"],
            "write-only" => &["wo"],
            _ => &["ro"],
        };
        judge.that(row, "access", access.contains(&entry.access.name()), entry.access.name());
        let mapping = if entry.pdo_mapping { "yes" } else { "no" };
        judge.that(row, "pdo_mapping", row.get("pdo_mapping") == mapping, mapping);
        let eeprom = if entry.persistent { "yes" } else { "no" };
        judge.that(row, "eeprom", row.get("eeprom") == eeprom, eeprom);
        let expected = match row.get("default") {
            "no" => None,
            text => match text.strip_suffix("h + Node-ID") {
                Some(base) => Some(Value::NodeIdPlus(i64::from_str_radix(base, 16).unwrap())),
                None => number(text).map(Value::Integer),
            },
        };
        judge.that(row, "default", entry.default == expected, format!("{:?}", entry.default));
        let ranges = ranges(entry);
        judge.that(row, "range", row.get("range") == ranges, ranges);
        let is_in_ms = matches!(&entry.meaning, Meaning::Quantity(name) if name == "Interval");
        judge.that(row, "unit", (row.get("unit") == "ms") == is_in_ms, is_in_ms);
        let is_bound = entry.writable_in.as_deref() == Some(&[NmtState::PreOperational]);
        judge.that(row, "notice", (row.get("notice") == "write PRE-OPERATIONAL") == is_bound, is_bound);
    }
    assert_eq!((device.objects.len(), device.entries().count(), table.len()), (44, 98, 98));
    for row in MANUAL.rows("names") {
        let (index, sub) = row.address();
        let object = device.object(index).unwrap();
        let name = sub.map_or(&object.name, |sub| &object.entry(sub).unwrap().name);
        judge.that(&row, "data_sheet", row.get("data_sheet") == name, name);
    }
}

/// The limits of an entry in the manual's notation, by gear if they depend on it.
fn ranges(entry: &Entry) -> String {
    if !entry.ranges.is_empty() {
        let gears = ["55:1", "62:1", "135:1"];
        let of = |(range, gear): (&lexican_eds::model::ConditionalRange, &str)| {
            format!("{gear} {}..{}", range.low, range.high)
        };
        return entry.ranges.iter().zip(gears).map(of).collect::<Vec<_>>().join("; ");
    }
    let limit = |value: &Option<Value>| value.as_ref().and_then(Value::as_integer);
    let limits = limit(&entry.low).zip(limit(&entry.high));
    limits.map_or(String::new(), |(low, high)| format!("{low}..{high}"))
}

/// The names of values and bits.
fn meanings(device: &Device, judge: &mut Judge) {
    let value = |row: &Row| number(row.get("value")).unwrap();
    let codes = &device.enumerations["EmergencyCode"].values;
    let table = MANUAL.rows("emergency");
    for row in &table {
        let code = i128::from_str_radix(row.get("code"), 16).unwrap();
        let named = codes.iter().find(|named| named.value == code).expect("every code has a name");
        let description = named.description.as_deref().unwrap_or_default();
        let letter = row.get("letter");
        judge.that(row, "letter", letter.is_empty() || description.contains(&format!("Fault {letter}")), description);
        judge.that(
            row,
            "stored",
            row.get("stored") != "no"
                || description.contains("not in the fault")
                || description.contains("Not in the fault"),
            description,
        );
        let bytes = [row.get("byte_0"), row.get("byte_1")].concat();
        judge.that(row, "byte_0", bytes == row.get("code"), bytes);
    }
    assert_eq!(codes.len(), table.len());
    for row in MANUAL.rows("faults") {
        let letter = row.get("letter");
        let is_named = |text: &str| text.to_lowercase().contains(&format!("fault {}", letter.to_lowercase()));
        let found = codes.iter().any(|named| named.description.as_deref().is_some_and(is_named));
        judge.that(&row, "letter", found, "no code");
        let hex = format!("{:02X}", letter.as_bytes()[0]);
        judge.that(&row, "hex", row.get("hex") == hex, hex);
    }
    for (table, name, column) in [
        ("statusword", "Statusword", "name"),
        ("controlword", "Controlword", "name"),
        ("system_status", "SystemStatus", "name"),
        ("error_register", "ErrorRegister", "meaning"),
    ] {
        let fields = &device.bit_fields[name].fields;
        for row in MANUAL.rows(table) {
            let bit: u8 = row.get("bit").parse().unwrap();
            let field = fields.iter().find(|field| (field.value.low..=field.value.high).contains(&bit));
            let is_reserved = row.get(column) == "reserviert";
            judge.that(&row, column, is_reserved == field.is_none(), format!("{:?}", field.map(|field| &field.name)));
        }
    }
    let rates = &device.enumerations["CanBitRate"].values;
    for row in MANUAL.rows("baud_rates") {
        let name = rates.iter().find(|rate| rate.value == value(&row)).map_or("", |rate| &rate.name);
        judge.that(&row, "kbit", name == format!("rate {} kbit/s", row.get("kbit")), name);
    }
    let speed = device.entry(0x2410, 5).unwrap();
    for (row, range) in MANUAL.rows("gears").iter().zip(&speed.ranges) {
        let gears = &device.enumerations["GearReduction"].values;
        let name = gears.iter().find(|gear| gear.value == value(row)).map_or("", |gear| &gear.name);
        judge.that(row, "gear", name == format!("gear {}", row.get("gear")), name);
        judge.that(row, "value", range.when.value == value(row), range.when.value);
        judge.that(row, "max_rev_per_min", range.high.to_string() == row.get("max_rev_per_min"), range.high);
    }
    for row in MANUAL.rows("values") {
        let (index, _) = row.get("address").split_once(':').unwrap();
        let entry = device.entry(u16::from_str_radix(index, 16).unwrap(), 0).unwrap();
        let Meaning::Enumeration(name) = &entry.meaning else { panic!("{} has no enumeration", row.key) };
        let found = device.enumerations[name].values.iter().any(|named| named.value == value(&row));
        judge.that(&row, "value", found, name);
    }
}

/// Whether the runtime reads a frame and makes the same bytes of it.
fn is_made_anew(row: &Row) -> bool {
    let bytes = row.get("data").split_whitespace();
    let data: Vec<u8> = bytes.map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
    let anew = match row.get("kind") {
        "NMT" => NmtMessage::parse(&data).map(|message| message.emit().to_vec()),
        "upload request" | "download request" => ClientRequest::parse(&data).map(|request| request.to_bytes().to_vec()),
        "upload response" | "download response" => {
            ServerResponse::parse(&data).map(|response| response.to_bytes().to_vec())
        }
        // The controlword, and a position or velocity.
        "RPDO1" => (data.len() == 2).then(|| data.clone()),
        _ => (data.len() == 6).then(|| data.clone()),
    };
    anew.as_deref() == Some(&data[..])
}
