//! Descriptions of formats: the meaning of the bits of an object.

use std::collections::BTreeSet;

use lexican_eds::model::Meaning;
use lexican_runtime::CobId;
use lexican_runtime::object::Mapped;
use lexican_runtime::wire::pdo::PdoCobId;

use super::rig::{LOAD, Rig, Siko};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::objects::address_in;
use crate::manual::{Manual, Row};
use crate::notation::{bits, hex};
use crate::sheet::Sheet;

/// Compares `formats.csv`.
pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let mut rig = Rig::<D>::new();
    for row in case.manual.rows("formats.csv") {
        format(checker, case, row, &mut rig);
    }
}

fn format<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row, rig: &mut Rig<D>) {
    let (manual, sheet) = (case.manual, case.sheet);
    let Some(((index, sub), (low, high))) = address_in(row).zip(bits(row.get("bits"))) else { return };
    let last = row.get("address").split("..").nth(1).and_then(|sub| u8::from_str_radix(sub, 16).ok());
    let subs = sheet.device.object(index).and_then(|object| object.entries.last()).map_or(0, |entry| entry.sub);
    checker.that(row, "address", Against::Sheet, last.is_none_or(|last| last == subs), format!("..{subs:02X}"));
    let bits = sheet.device.entry(index, sub).and_then(|entry| entry.data_type.bits());
    checker.that(row, "address", Against::Sheet, bits.is_some(), "no such entry");
    // The manual prints 32 bits even where the drive has 16 (E05, E06).
    let fits = bits.is_some_and(|bits| high < bits || bits == 16 && high == 31);
    checker.that(row, "bits", Against::Sheet, fits, format!("{bits:?} bits"));
    // The rows of an object describe each of its bits exactly once.
    checker.that(row, "bits", Against::Manual, are_whole(manual, row.get("address")), "a gap or an overlap");
    let taken = |raw: u32| u32::try_from(u64::from(raw) >> low & ((1 << (high - low + 1)) - 1)).unwrap_or(0);
    let mut drive = || rig.read(index, sub).ok().map(taken);
    let value = row.get("value");
    let (found, against) = match index {
        0x1000 if low == 0 => (if drive() == Some(402) { "device profile number" } else { "" }.into(), Against::Drive),
        0x1000 => {
            let part = match (low, drive()) {
                (24, Some(0)) => "manufacturer-specific; not used",
                (16, Some(0)) => "drive type; not used",
                _ => "",
            };
            (part.into(), Against::Drive)
        }
        0x1001 | 0x2420 | 0x2422 => (named_bits(manual, sheet, row, index, sub, (low, high)), Against::Sheet),
        0x1002 | 0x1003 => (halves(sheet, index, sub, (low, high)).into(), Against::Sheet),
        0x1008 => (drive().and_then(char::from_u32).map_or(String::new(), String::from), Against::Drive),
        0x100A => (version(drive(), value).unwrap_or_default(), Against::Drive),
        0x1011 => (character(LOAD as u32, low).to_string(), Against::Code),
        0x1600..=0x16FF | 0x1A00..=0x1AFF => (mapping_part((low, high)).into(), Against::Code),
        0x2500 => {
            let part = match (low, drive().map(|part| format!("{part:02X}")) == Some(value.to_owned())) {
                (24, true) => "day",
                (16, true) => "month",
                (0, true) => "year",
                _ => "",
            };
            (part.into(), Against::Drive)
        }
        _ => (cob_id_part::<D>(row, index, (low, high)).into(), Against::Code),
    };
    // Bytes of a text or of a date have values, single bits have two values, and all other rows have none.
    let said = match index {
        0x1008 | 0x100A | 0x1011 => {
            hex(value).and_then(char::from_u32).map(String::from) == Some(row.get("meaning").into())
        }
        0x2500 => hex(value).is_some(),
        0x1000 | 0x1002 | 0x1003 | 0x1600..=0x16FF | 0x1A00..=0x1AFF => value.is_empty(),
        _ => matches!(value, "" | "0" | "1"),
    };
    checker.cell(row, "meaning", against, found);
    checker.that(row, "value", Against::Manual, said, "another character, or no value");
    if index == 0x1008 {
        let byte = drive().map(|byte| format!("{byte:02X}"));
        checker.cell(row, "value", Against::Drive, byte.unwrap_or_default());
    }
}

/// Whether the rows of an address cover its bits without gap or overlap, from bit 0 to the highest of a byte.
fn are_whole(manual: &Manual, address: &str) -> bool {
    let rows = manual.rows("formats.csv").iter().filter(|row| row.get("address") == address);
    let parts: BTreeSet<(u8, u8)> = rows.filter_map(|row| bits(row.get("bits"))).collect();
    let next = parts.iter().try_fold(0, |next, (low, high)| (*low == next).then_some(high + 1));
    next.is_some_and(|next| next % 8 == 0)
}

/// The character that begins at a bit of a word.
fn character(word: u32, low: u8) -> char {
    char::from(word.to_le_bytes().get(usize::from(low / 8)).copied().unwrap_or(0))
}

/// The printed version is an example; the drive must have one of the same kind.
fn version(drive: Option<u32>, value: &str) -> Option<String> {
    let (drive, printed) = (char::from_u32(drive?)?, char::from_u32(hex(value)?)?);
    (drive == printed || drive.is_ascii_digit() && printed.is_ascii_digit()).then(|| printed.to_string())
}

fn halves(sheet: &Sheet, index: u16, sub: u8, (low, high): (u8, u8)) -> &'static str {
    let bits = sheet.device.entry(index, sub).and_then(|entry| entry.data_type.bits());
    match (index, low, high, bits) {
        (_, 16, 31, Some(16)) => "not used",
        (0x1002, 0, 15, Some(16)) => "system status word",
        (0x1003, 8, 15, Some(16)) => "error code high byte",
        (0x1003, 0, 7, Some(16)) => "error code low byte",
        _ => "",
    }
}

fn mapping_part((low, high): (u8, u8)) -> &'static str {
    let mapped = Mapped::from_parameter(0x6040_0110);
    match (low, high) {
        (16, 31) if mapped.address.index() == 0x6040 => "index",
        (8, 15) if mapped.address.sub() == 1 => "sub-index",
        (0, 7) if mapped.bits == 0x10 => "length in bits",
        _ => "",
    }
}

fn named_bits(manual: &Manual, sheet: &Sheet, row: &Row, index: u16, sub: u8, (low, high): (u8, u8)) -> String {
    let Some(Meaning::BitField(name)) = sheet.device.entry(index, sub).map(|entry| &entry.meaning) else {
        return String::new();
    };
    let Some(field) = sheet.device.bit_fields.get(name) else { return String::new() };
    if field.fields.iter().all(|bit| bit.value.high < low || bit.value.low > high) {
        return if row.get("value") == "0" { "reserved" } else { "not used" }.into();
    }
    let term = manual.cell("terms.csv", &format!("{name}:{low}"), "printed");
    match row.get("value") {
        "" | "1" => term.to_owned(),
        "0" if term.ends_with(" active") => format!("{} inactive", term.trim_end_matches(" active")),
        "0" if term.ends_with(" applied") => format!("{} not applied", term.trim_end_matches(" applied")),
        _ => String::new(),
    }
}

/// What the runtime reads in a bit of a COB-ID parameter.
fn cob_id_part<D: Siko>(row: &Row, index: u16, (low, high): (u8, u8)) -> &'static str {
    let (sync, emcy, sdo, rpdo) = (index == 0x1005, index == 0x1014, index == 0x1200, index < 0x1800);
    let own_switch = D::MODEL.emergencies.filter(|_| emcy).map(|switch| (switch.bit, switch.on_when_set));
    let bit_31 = if emcy { own_switch.is_none() } else { sdo || D::MODEL.behaviour.pdo_bit_31 };
    match (low, high, row.get("value")) {
        (31, 31, "") if !bit_31 => "not used",
        (30, 30, "0") if own_switch == Some((1 << 30, true)) => "no EMCY is sent",
        (30, 30, "1") if own_switch == Some((1 << 30, true)) => "EMCY is sent",
        (30, 31, "") if sync => "not used",
        (31, 31, "0") if bit_31 && !sync && PdoCobId(0).is_valid() => "valid",
        (31, 31, "1") if bit_31 && !sync && !PdoCobId(1 << 31).is_valid() => "not valid",
        (30, 30, "0") if emcy || sdo => "reserved",
        (30, 30, "") if rpdo && !emcy && !sdo => "not used",
        (30, 30, "0") if !rpdo && PdoCobId(0).allows_remote() => "RTR enabled",
        (30, 30, "1") if !rpdo && !PdoCobId(1 << 30).allows_remote() => "RTR disabled",
        (29, 29, "0") if !CobId::from_parameter(0).is_extended() => "11-bit identifier",
        (29, 29, "1") if CobId::from_parameter(1 << 29).is_extended() => "29-bit identifier",
        (11, 28, "") if CobId::from_parameter(1 << 29 | 0x1FFF_F800).raw() == 0x1FFF_F800 => "identifier when 29-bit",
        (0, 10, "") if sync || emcy => "identifier",
        (7, 10, "") => "function code",
        (0, 6, "") => "node-ID",
        _ => "",
    }
}
