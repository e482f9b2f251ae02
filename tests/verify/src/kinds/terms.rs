//! The values and bits that the overlay names.

use lexican_eds::model::Meaning;

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::{Manual, Row};
use crate::notation::{bits, number};
use crate::sheet::Sheet;

/// Where a manual names the values or bits of a type, other than in its tables of objects.
pub(crate) enum Place {
    /// In rows with this `bit`, by their `name`.
    Bits(&'static str),
    /// In the row with the value, in this column: file and column.
    Row(&'static str, &'static str),
    /// In a cell: file, key and column.
    Cell(&'static str, &'static str, &'static str),
    /// In another table, which another comparison covers.
    Elsewhere,
}

/// Compares `terms.csv`. `places` has the types that are named elsewhere than in `values.csv` and `formats.csv`. Types
/// that other comparisons cover have none.
pub(crate) fn check(checker: &mut Checker<'_>, case: &Case<'_>, places: &[(&str, Place)]) {
    let device = &case.sheet.device;
    let enumerations = device.enumerations.iter().flat_map(|(name, enumeration)| {
        let wide = enumeration.values.iter().map(|value| value.value).max().unwrap_or(0);
        enumeration.values.iter().map(move |value| {
            let key = match wide {
                0..=0xFF => value.value.to_string(),
                0x100..=0xFFFF => format!("0x{:04X}", value.value),
                _ => format!("0x{:08X}", value.value),
            };
            (name, "enumeration", key, &value.name)
        })
    });
    let bit_fields = device.bit_fields.iter().flat_map(|(name, field)| {
        field.fields.iter().map(move |bit| (name, "bit_field", bit.value.low.to_string(), &bit.name))
    });
    for (name, kind, key, term) in enumerations.chain(bit_fields) {
        let place = places.iter().find(|(of, _)| of == name).map(|(_, place)| place);
        // A type that no object has is that of a parameter of another interface, which is compared with that
        // interface's tables.
        if matches!(place, Some(Place::Elsewhere)) || users(case.sheet, name).is_empty() {
            continue;
        }
        let Some(row) = checker.row("terms.csv", &format!("{name}:{key}")) else { continue };
        checker.cell(row, "kind", Against::Sheet, kind);
        checker.cell(row, "overlay", Against::Sheet, term);
        let printed = printed(case.manual, case.sheet, name, &key, place);
        let agrees = printed.iter().any(|printed| row.get("printed") == printed);
        checker.that(row, "printed", Against::Manual, agrees, printed.join(" or "));
    }
}

/// The entries whose values have this meaning, as `2102:00`.
fn users(sheet: &Sheet, name: &str) -> Vec<String> {
    let of = |meaning: &Meaning| matches!(meaning, Meaning::Enumeration(of) | Meaning::BitField(of) if of == name);
    let entries = sheet.device.entries().filter(|entry| of(&entry.meaning));
    entries.map(|entry| format!("{:04X}:{:02X}", entry.index, entry.sub)).collect()
}

/// The manual's name of a value or bit, in the table where it is.
fn printed(manual: &Manual, sheet: &Sheet, name: &str, key: &str, place: Option<&Place>) -> Vec<String> {
    let cell = |file: &str, key: &str, column: &str| manual.row(file, key).map(|row| row.get(column).to_owned());
    match place {
        Some(Place::Bits(file)) => {
            let rows = manual.rows(file).iter().filter(|row| row.get("bit") == key && !row.get("name").is_empty());
            let mut names: Vec<&str> = rows.map(|row| row.get("name")).collect();
            names.dedup();
            vec![names.join(" / ")]
        }
        Some(Place::Row(file, column)) => cell(file, key.trim_start_matches("0x"), column).into_iter().collect(),
        Some(Place::Cell(file, key, column)) => cell(file, key, column).into_iter().collect(),
        Some(Place::Elsewhere) => Vec::new(),
        None => {
            let addresses = users(sheet, name);
            let of = |row: &&Row| addresses.iter().any(|address| row.get("address") == address);
            // A value is decimal or hexadecimal; for a range of bits, the lowest counts.
            let same = |cell: &str| cell == key || number(cell).is_some() && number(cell) == number(key);
            let values = manual.rows("values.csv").iter().filter(of).filter(|row| same(row.get("value")));
            let bits = manual.rows("formats.csv").iter().filter(of).filter(|row| {
                let low = bits(row.get("bits")).map(|(low, _)| low.to_string());
                low.as_deref() == Some(key) && row.get("value") != "0"
            });
            values.chain(bits).map(|row| row.get("meaning").to_owned()).collect()
        }
    }
}
