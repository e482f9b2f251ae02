//! The bits of objects.

use std::collections::BTreeSet;

use lexican_eds::model::{Entry, Meaning};

use super::objects::address_in;
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::{Manual, Row};
use crate::notation::bits;

/// The meaning, by the drive's code, of bits that the overlay does not name, and of their values.
pub(crate) type Part = fn(&Case<'_>, &Row, &Entry, (u8, u8)) -> Option<(String, Against)>;

/// Whether the drive shows a bit exactly while its meaning is true; `None` if the drive has no such state.
pub(crate) type Shown = fn(u16, u8) -> Option<bool>;

/// Compares `formats.csv`. The rows of the addresses in `gaps` leave out bits between others.
pub(crate) fn check(checker: &mut Checker<'_>, case: &Case<'_>, part: Part, shown: Shown, gaps: &[&str]) {
    for row in case.manual.rows("formats.csv") {
        let Some(((index, sub), (low, high))) = address_in(row).zip(bits(row.get("bits"))) else { continue };
        let Some(entry) = case.sheet.device.entry(index, sub) else { continue };
        if case.drive.exempt.row(row.file, &row.key) {
            continue;
        }
        checker.key(row);
        let width = entry.data_type.bits().unwrap_or(0);
        checker.that(row, "bits", Against::Sheet, u32::from(high) < u32::from(width), format!("{width} bits"));
        let whole = are_whole(case.manual, row.get("address"), gaps.contains(&row.get("address")));
        checker.that(row, "bits", Against::Manual, whole, "a gap or an overlap");
        let has_place = if matches!(entry.meaning, Meaning::BitField(_)) {
            has_place(case.manual, row)
        } else {
            row.get("value").is_empty() || u32::from_str_radix(row.get("value"), 16).is_ok()
        };
        checker.that(row, "value", Against::Manual, has_place, "another place");
        if let Some((found, against)) = part(case, row, entry, (low, high)) {
            checker.cell(row, "meaning", against, found);
            continue;
        }
        let Meaning::BitField(name) = &entry.meaning else { continue };
        let fields = case.sheet.device.bit_fields.get(name).map_or(&[][..], |field| &field.fields);
        let over = fields.iter().filter(|field| field.value.low <= high && low <= field.value.high);
        let over: Vec<_> = over.map(|field| (field.value.low, field.value.high)).collect();
        let coded = case.sheet.code.bit_fields.get(name.as_str()).map_or(&[][..], |bits| bits);
        if is_reserved(row.get("meaning")) {
            checker.that(row, "meaning", Against::Sheet, over.is_empty(), format!("{over:?}"));
            continue;
        }
        checker.that(row, "bits", Against::Sheet, over == [(low, high)], format!("{over:?}"));
        let generated = coded.iter().any(|bit| (bit.low, bit.width) == (low, high - low + 1));
        checker.that(row, "bits", Against::Code, generated, "no such bits");
        let term = case.manual.cell("terms.csv", &format!("{name}:{low}"), "printed");
        checker.cell(row, "meaning", Against::Manual, term);
        if let Some(agrees) = shown(index, low) {
            checker.that(row, "meaning", Against::Drive, agrees, "shown otherwise");
        }
    }
}

fn is_reserved(meaning: &str) -> bool {
    matches!(
        meaning,
        "reserved" | "reserve" | "not used" | "Manufacturer-specific" | "Manufacturer-specific (reserved)"
    )
}

/// Whether the rows of an address cover its bits without overlap, up to a single bit or the highest of a byte.
fn are_whole(manual: &Manual, address: &str, has_gaps: bool) -> bool {
    let rows = manual.rows("formats.csv").iter().filter(|row| row.get("address") == address);
    let parts: Vec<(u8, u8)> =
        rows.filter_map(|row| bits(row.get("bits"))).collect::<BTreeSet<_>>().into_iter().collect();
    let follow = parts.windows(2).all(|pair| pair[1].0 == pair[0].1 + 1 || has_gaps && pair[1].0 > pair[0].1);
    follow && parts.last().is_some_and(|(low, high)| low == high || high % 8 == 7)
}

/// Whether the bits can have a value: none, 0, all ones of a single bit (as 1, or at its place in the byte), or one of
/// several that are counted.
fn has_place(manual: &Manual, row: &Row) -> bool {
    let (Some((low, high)), Ok(value)) = (bits(row.get("bits")), u32::from_str_radix(row.get("value"), 16)) else {
        return row.get("value").is_empty();
    };
    let same = |other: &&Row| other.get("address") == row.get("address") && other.get("value") != "0";
    let counted = manual.rows("formats.csv").iter().filter(same).filter_map(|other| {
        let of_bits = bits(other.get("bits"))?;
        (low != high && of_bits == (low, high) || low == high && of_bits.0 >= 8).then_some(other.key.as_str())
    });
    let number = counted.enumerate().find(|(_, key)| *key == row.key).map(|(at, _)| at as u32 + 1);
    let is_byte = row.get("value").len() == 2;
    match value {
        0 => true,
        _ if low == high && !is_byte => value == 1,
        _ if low == high && low < 8 => value == 1 << low,
        _ => number == Some(value),
    }
}
