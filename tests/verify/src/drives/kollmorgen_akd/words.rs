//! The words of the AKD's manual, and the parts of it that are not compared.

use kollmorgen_akd::driver::{AKD, Trigger};
use lexican_eds::model::{Entry, Meaning, Value};
use lexican_runtime::AbortCode;
use lexican_runtime::wire::pdo::PdoCobId;

use super::simulated::{SPEED, Simulated};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::Row;
use crate::notation::number;
use crate::rig::Rig;

pub(super) const COLUMNS: &[(&str, &[&str], &str)] = &[
    ("chapter", PLACES, "where the row stands in the manual"),
    ("category", &["descriptions.csv"], "what a standard asks for, not what the drive has"),
    ("name", &["descriptions.csv", "sections.csv"], "other words for what 7.1 names, which names.csv has"),
    ("s1", &["baud_rates.csv"], "a switch of the housing, which the simulated drive does not have"),
    ("s2", &["baud_rates.csv"], "a switch of the housing, which the simulated drive does not have"),
    ("chapter", &["sections.csv"], "which objects a chapter lists, only the manual says"),
    ("meaning", &["frames.csv"], "the example's own words"),
    ("use", &["frames.csv"], "ours; errata.csv has every frame that is not golden"),
];

/// The tables that have the chapter of each row: all of them.
const PLACES: &[&str] = &[
    "baud_rates.csv",
    "commands.csv",
    "descriptions.csv",
    "emergency.csv",
    "encodings.csv",
    "formats.csv",
    "frames.csv",
    "homing_methods.csv",
    "identifiers.csv",
    "mode_bits.csv",
    "names.csv",
    "nmt.csv",
    "objects.csv",
    "pdo_mappings.csv",
    "sdo_aborts.csv",
    "sdo_commands.csv",
    "states.csv",
    "terms.csv",
    "transitions.csv",
    "values.csv",
];

pub(super) const ROWS: &[(&str, &str, &str)] = &[
    ("formats.csv", "36E9:00:4:0", SETTING),
    ("formats.csv", "36E9:00:5", SETTING),
    ("formats.csv", "36E9:00:6:0", SETTING),
];

const SETTING: &str = "the other half of a setting that the simulated drive does not obey";

pub(super) const CLAUSES: &[(&str, &str)] =
    &[(SPEED, "how many units that is, is a setting of the drive; the simulated one has 1000")];

/// Codes for which the simulated drive has no cause.
pub(super) const NEVER_SENT: &[(&str, AbortCode)] = &[
    ("SDO timeout", AbortCode::TIMED_OUT),
    ("SDO segmented: invalid blocksize", AbortCode::INVALID_BLOCK_SIZE),
    ("SDO segmented: invalid block CRC", AbortCode::CRC_ERROR),
    ("SDO segmented: out of memory", AbortCode::OUT_OF_MEMORY),
    ("General parameter incompatibility", AbortCode::PARAMETER_INCOMPATIBLE),
    ("SDO hardware fault", AbortCode::HARDWARE_ERROR),
];

/// The meaning of bits: of numbers, and of latches by the driver's tables.
pub(super) fn part(case: &Case<'_>, row: &Row, entry: &Entry, (low, high): (u8, u8)) -> Option<(String, Against)> {
    let value = row.get("value");
    let is_number = !matches!(entry.meaning, Meaning::BitField(_));
    let said = match (entry.index, entry.sub) {
        (0x1000, _) => {
            let default = entry.default.as_ref().and_then(Value::as_integer).unwrap_or(0);
            let part = default >> low & ((1 << (high - low + 1)) - 1);
            let said = match (low, format!("{part:X}") == value, part) {
                (24, _, 0) if value.is_empty() => "mode bits",
                (16, true, 2) => "type: drive",
                (0, true, 0x192) => "profile 402",
                _ => "",
            };
            return Some((said.into(), Against::Sheet));
        }
        (0x20A4 | 0x20A5, _) => return latch(entry.index, low, value).map(|said| (said, Against::Code)),
        (0x1005, _) if is_number => match (low, high, value) {
            (30, 30, "0") => "does not generate SYNC",
            (30, 30, "1") => "generates SYNC",
            (28, 28, _) | (29, 29, "0") => "11-bit identifier",
            (29, 29, "1") => "29-bit identifier",
            (11, 28, "") => "0 with bit 29 = 0",
            (0, 10, "") => "identifier",
            _ => "",
        },
        (0x1010, _) if is_number || low < 2 || high == 31 => match (low, high, value) {
            (2, 31, "0") => "reserved",
            (1, 1, "0") => "not saved autonomously",
            (1, 1, "1") => "saved autonomously",
            // The drive has the second of these two values: reading gives 1, and saving works (E48).
            (0, 0, "0" | "1") => "not saved on command",
            _ => "",
        },
        (0x1400 | 0x1800, 1) if is_number => cob_id(entry.index < 0x1800, (low, high), value),
        _ => {
            let _ = case;
            return None;
        }
    };
    Some((said.into(), Against::Code))
}

/// A bit of the COB-ID of a PDO, as the runtime reads it.
fn cob_id(receives: bool, bits: (u8, u8), value: &str) -> &'static str {
    match (bits, value) {
        ((31, 31), "0") if PdoCobId(0).is_valid() => "PDO is valid",
        ((31, 31), "1") if !PdoCobId(1 << 31).is_valid() => "PDO is not valid",
        ((30, 30), "0") if receives => "RTR allowed; not to be used",
        ((30, 30), "1") if receives => "RTR not allowed",
        ((30, 30), "0") if PdoCobId(0).allows_remote() => "RTR allowed; not supported",
        ((30, 30), "1") if !PdoCobId(1 << 30).allows_remote() => "RTR not allowed; not supported",
        ((29, 29), "0") => "11-bit identifier",
        ((29, 29), "1") => "29-bit identifier; not supported",
        ((11, 28), "") => "not relevant",
        ((0, 10), "") => "identifier",
        _ => "",
    }
}

/// The meaning of a bit or value of a latch register, by the driver's rows.
fn latch(index: u16, low: u8, value: &str) -> Option<String> {
    let rows = AKD.latches.map_or(&[][..], |latches| latches.rows);
    let of_byte = low >= 8;
    if low >= 12 && index == 0x20A5 || (5..8).contains(&low) || low > 12 {
        return None;
    }
    let number = number(&format!("{value}h")).and_then(|number| u32::try_from(number).ok()).unwrap_or(0);
    let bit = if of_byte { 1 << number.checked_sub(1).unwrap_or(31) } else { 1_i64 << low };
    let row = rows.iter().find(|row| row.enable == bit && row.valid == bit)?;
    let (latch, edge) = match row.trigger {
        Trigger::Rising(latch) => (latch, "positive rise"),
        Trigger::Falling(latch) => (latch, "negative rise"),
        _ => (0, ""),
    };
    Some(match (index, of_byte, latch) {
        (0x20A4, false, 0) => "enable latch of encoder index pulse".into(),
        (0x20A4, true, 0) => "read latched position of encoder index pulse".into(),
        (_, false, 0) => "latched position of encoder index pulse valid".into(),
        (_, true, 0) => "acknowledge encoder index pulse".into(),
        (0x20A4, false, _) => format!("enable external latch {latch}, {edge}"),
        (0x20A4, true, _) => format!("read external latch {latch}, {edge}"),
        (_, false, _) => format!("external latch {latch} valid, {edge}"),
        (_, true, _) => format!("acknowledge latch {latch}, {edge}"),
    })
}

/// Compares `baud_rates.csv`.
pub(super) fn bit_rates(checker: &mut Checker<'_>, case: &Case<'_>) {
    let device = &case.sheet.device;
    let named = device.enumerations.get("CanBitRate").map_or(&[][..], |rates| &rates.values);
    for named in named {
        let Some(row) = checker.row("baud_rates.csv", &named.value.to_string()) else { continue };
        let kbit = if named.value == 0 { "auto".into() } else { named.value.to_string() };
        checker.cell(row, "kbit", Against::Sheet, &kbit);
        let listed = device.info.bit_rates_kbit.iter().any(|rate| rate.to_string() == kbit) || named.value == 0;
        checker.that(row, "kbit", Against::Sheet, listed, "no BaudRate key");
        let taken = Rig::<Simulated>::new().put(0x36E5, 0, named.value as i64);
        checker.that(row, "value", Against::Entry, taken.is_ok(), format!("{taken:08X?}"));
    }
    let rates = device.info.bit_rates_kbit.len();
    checker.require(rates + 1 == named.len(), || format!("{rates} bit rates in [DeviceInfo]"));
}
