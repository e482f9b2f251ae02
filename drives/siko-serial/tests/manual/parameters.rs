//! The table of parameters beside the data sheet, against chapter 8, the generated dictionary, and the simulated drive.

use std::collections::BTreeSet;

use lexican_driver::ParameterSet;
use lexican_runtime::NodeId;
use lexican_runtime::object::{Address, DataType};
use siko_ag02::od;
use siko_ag02::sim::Storage;
use siko_serial::command::{Command, Mode, PosType, Turning};
use siko_serial::parameter;

use super::tables::{Raw, Row, manual, parameters};
use super::{Cells, whole};

fn address(text: &str) -> Option<Address> {
    let (index, sub) = text.split_once(':')?;
    Some(Address::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?))
}

/// What a raw number means.
fn number(data_type: DataType, raw: u64) -> i64 {
    let unused_bits = 64 - u32::from(data_type.bits().unwrap());
    let high = raw << unused_bits;
    if data_type.is_signed() { high as i64 >> unused_bits } else { (high >> unused_bits) as i64 }
}

/// The object that the code has for a telegram of the table.
fn object_of(row: &Row, telegram: &str) -> Option<Address> {
    let mode = if row["object"] == "60FF:00" { Mode::Velocity } else { Mode::Positioning };
    match Command::parse(whole(telegram).as_bytes()).unwrap() {
        Command::ReadLong(which) | Command::WriteLong(which, _) => Some(which.object(mode)),
        Command::ReadShort(which) | Command::WriteShort(which, _) => Some(which.object()),
        Command::SetPosType(_) => Some(parameter::POS_TYPE),
        Command::SetMode(_) => Some(parameter::MODE),
        Command::SetTurning(_) if row["parameter"] == "18" => Some(parameter::SENSE_OF_ROTATION),
        Command::SetTurning(_) => None,
        other => panic!("{other:?} is about no parameter"),
    }
}

/// In what a parameter and its object differ, in the words of the column `differs`.
fn differences(row: &Row) -> BTreeSet<&'static str> {
    let mut found = BTreeSet::new();
    let Some(object) = address(&row["object"]) else { return BTreeSet::from(["none"]) };
    let entry = od::TABLE.entry(object).unwrap();
    let values = !row["values"].is_empty();
    let limit = usize::from(entry.limit).checked_sub(1).map(|row| od::TABLE.limits[row]);
    let limits = limit.map(|limit| [limit.low, limit.high].map(|raw| number(entry.data_type, raw)));
    let [low, high] = ["low", "high"].map(|column| row[column].parse::<i64>().unwrap());
    if !values && limits.is_some_and(|limits| limits != [low, high]) {
        found.insert("range");
    }
    let codes: Vec<u8> = match &*row["parameter"] {
        "18" => Turning::ALL.iter().filter_map(|it| it.in_object()).collect(),
        "19" => PosType::ALL.iter().map(|it| it.in_object()).collect(),
        "20" => Mode::ALL.iter().map(|it| it.in_object()).collect(),
        _ => Vec::new(),
    };
    let shift = codes.first().map_or(0, |first| i64::from(*first));
    assert!(codes.iter().zip(low..=high).all(|(code, here)| i64::from(*code) == here + shift));
    if shift != 0 {
        found.insert("values");
    }
    let defaults = od::storage(NodeId::literal(127));
    let default = number(entry.data_type, defaults.raw(object).unwrap()) - shift;
    if default != row["default"].parse::<i64>().unwrap() {
        found.insert("default");
    }
    // Neighbours of the port are neighbours of the object, in the same order.
    let place = |text: &str| text[1..].parse::<i64>().ok();
    let same_record = |other: &&Row| {
        let neighbour = address(&other["object"]).filter(|other| other.index() == object.index() && *other != object);
        neighbour.is_some() && place(&other["read"]).is_some()
    };
    let rows = parameters();
    let swapped = rows.iter().filter(same_record).any(|other| {
        let there = address(&other["object"]).unwrap().sub() < object.sub();
        (place(&other["read"]) < place(&row["read"])) != there
    });
    if swapped {
        found.insert("place");
    }
    found
}

#[test]
fn the_table_is_that_of_the_dictionary_but_where_it_says_so() {
    let rows = parameters();
    assert_eq!(rows.len(), 24);
    for row in &rows {
        let stated: BTreeSet<&str> = row["differs"].split(';').filter(|word| !word.is_empty()).collect();
        assert_eq!(differences(row), stated, "{row:?}");
        for telegram in ["read", "write"].map(|column| &*row[column]).into_iter().filter(|it| !matches!(*it, "" | "Q"))
        {
            assert_eq!(object_of(row, telegram), address(&row["object"]), "{telegram}");
        }
        if let Some(object) = address(&row["object"]) {
            assert_eq!(od::PERSISTENT.contains(&object), row["stored"] == "yes", "{row:?}");
        }
    }
}

#[test]
fn a_drive_takes_what_the_table_allows_and_nothing_else() {
    for row in parameters() {
        let [low, high] = ["low", "high"].map(|column| row[column].parse::<i64>().unwrap());
        let write = |value: i64| match row["write"].as_bytes()[0] {
            b'F' => format!("{}{value:+08}", row["write"]),
            b'H' => format!("{}{value:05}", row["write"]),
            _ if row["parameter"] == "25" => format!("T{}", value + 3),
            _ => format!("{}{value}", row["write"]),
        };
        // Limits are free of each other only in one direction, and calibrations and setpoints lie within them.
        let prepared = match &*row["parameter"] {
            "14" => "F1+9999999;F2-9999999",
            "15" => "F2-9999999",
            "16" => "F1+9999999",
            "24" if row["unit"] == "rev/min" => "X1",
            "24" => "F1+9999999;F2-9999999",
            _ => "",
        };
        for value in [low, high] {
            let mut drive = Raw::default();
            drive.send(prepared);
            assert_eq!(drive.text(&write(value)), ">", "{row:?}");
            if !matches!(&*row["read"], "" | "Q") {
                let text = drive.text(&row["read"]);
                assert_eq!(text.trim_end_matches('>').parse::<i64>().unwrap(), value, "{row:?}");
            }
        }
        // A number that the telegram has no room for is a matter of the codec.
        for value in [low - 1, high + 1] {
            if !(-9_999_999..=9_999_999).contains(&value) || value < 0 && !row["write"].starts_with('F') {
                continue;
            }
            let mut drive = Raw::default();
            drive.send(prepared);
            assert_eq!(drive.text(&write(value)), "?02", "{row:?}");
        }
    }
}

#[test]
fn chapter_8() {
    let cells = Cells::of("parameters");
    let table = parameters();
    for row in manual("parameters") {
        let key = &row["number"];
        let listed: Vec<&Row> = table.iter().filter(|listed| listed["parameter"] == *key).collect();
        let Some(first) = listed.first() else {
            assert_eq!(row["name"].to_lowercase(), "reserviert");
            continue;
        };
        let letters = |cell: &str| cell.split('/').map(|part| part[..1].to_owned()).collect::<BTreeSet<_>>();
        let both: Vec<&str> =
            ["read", "write"].map(|column| &*first[column]).into_iter().filter(|it| !it.is_empty()).collect();
        cells.check(key, "serial", letters(&row["serial"]) == letters(&both.join("/")));
        cells.check(key, "object", listed.len() > 1 || row["object"] == first["object"]);
        cells.check(key, "eeprom", row["eeprom"] == first["stored"]);
        let first_range = row["range"].split('|').next().unwrap();
        let range = match first_range.split_once("..") {
            Some(_) => first_range.to_owned(),
            // A word or number for each value.
            None => format!("0..{}", row["range"].split('|').count() - 1),
        };
        let by_limits = row["range"] == "by the limits";
        cells.check(key, "range", by_limits || range == format!("{}..{}", first["low"], first["high"]));
        let set = siko_ag02::driver::AG02.parameters.iter().find(|parameter| parameter.number.to_string() == *key);
        let kind =
            set.map(|parameter| if parameter.set == ParameterSet::Controller { "controller" } else { "standard" });
        cells.check(key, "kind", kind.is_none_or(|kind| kind == row["kind"]));
        if let Ok(default) = row["default"].parse::<i64>() {
            let read = Raw::default().text(&first["read"]);
            let shown: i64 = read.trim_end_matches('>').parse().unwrap();
            // The bit rate is printed, and read as its code.
            cells.check(key, "default", shown == default || key == "23" && shown.to_string() == first["default"]);
        }
    }
}
