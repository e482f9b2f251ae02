//! The parameters of the overlay against chapter 8 and the simulated drive.

use std::collections::BTreeSet;

use lexican_driver::ParameterSet;

use super::Cells;
use super::tables::{Raw, Row, manual, parameters};

#[test]
fn a_drive_takes_what_the_table_allows_and_nothing_else() {
    for row in parameters() {
        let [low, high] = ["low", "high"].map(|column| row[column].parse::<i64>().unwrap());
        let write = |value: i64| match row["write"].as_bytes()[0] {
            b'F' => format!("{}{value:+08}", row["write"]),
            b'H' => format!("{}{value:05}", row["write"]),
            _ => format!("{}{value}", row["write"]),
        };
        // Limits are free of each other only in one direction, and calibrations and setpoints lie within them.
        let prepared = match &*row["parameter"] {
            "14" => "F1+9999999;F2-9999999",
            "15" => "F2-9999999",
            "16" => "F1+9999999",
            "24" if row["object"] == "60FF:00" => "X1",
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
            // A word or number for each value; T3 and T4 are the two of parameter 25.
            None if key == "25" => "3..4".to_owned(),
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
            cells.check(key, "default", shown == default || key == "23" && (shown, default) == (10, 500));
        }
    }
}
