//! The modes of operation and homing methods of a drive.

use super::data::Homing;
use super::objects::{Need, Reader};
use crate::model::pdo::held;
use crate::model::{Device, Entry, Meaning, Value};
use lexican_cia::cia402::Modes;

/// The homing methods up to the last one that CiA 402-2 reserves, and 0, no homing.
const RESERVED: &[i8] = &[0, 15, 16, 31, 32, 36];

/// The modes of the drive, ascending, as 6502h states them, or else the overlay's enumeration of 6060h, or else the
/// limits of 6060h. A mode whose objects are missing is left out. `targets` lists the target objects, and whether a
/// driver can use them. A drive with neither profile position nor profile velocity mode is an error.
pub(super) fn modes(reader: &mut Reader<'_>, targets: &[(u16, bool)]) -> Option<Vec<i8>> {
    let device = reader.device;
    let stated = stated(device);
    let has = |index: u16| device.object(index).is_some();
    let modes: Vec<i8> = Modes::CIA_402
        .0
        .iter()
        .filter(|(_, mode)| has(mode.object()) && !targets.contains(&(mode.object(), false)))
        .map(|(number, _)| *number)
        .filter(|number| stated.as_ref().is_none_or(|stated| stated.modes.contains(number)))
        .collect();
    if let Some(stated) = stated.as_ref().filter(|stated| stated.one_by_one) {
        for (number, mode) in Modes::CIA_402.0 {
            let (name, index) = (mode.name(), mode.object());
            if stated.modes.contains(number) && !has(index) {
                let message = format!("the drive has {name} mode by {:04X}h, but no {index:04X}h", stated.entry.index);
                let help = "if the drive has the object, add it to the data sheet; the driver does without the mode";
                reader.report("drive::left-out", message, stated.entry.span, help);
            }
        }
    }
    if modes.contains(&1) || modes.contains(&3) {
        return Some(modes);
    }
    let span = stated.map_or_else(|| reader.nearest(0x607A), |stated| stated.entry.span);
    let mut message =
        "the drive has neither profile position mode (607Ah, 6064h) nor profile velocity mode (60FFh)".to_owned();
    let belongs = |found: &str| ["607A ", "6064 ", "60FF "].iter().any(|object| found.starts_with(object));
    for found in reader.findings.iter().filter(|found| belongs(&found.message)) {
        message += &format!("; {}", found.message);
    }
    let help = "if it has, correct 6502h by an overlay (bit 0, bit 2), or add the objects to the data sheet";
    reader.report("drive::no-mode", message, span, help);
    None
}

/// The modes that a data sheet states.
struct Stated<'a> {
    modes: Vec<i8>,
    entry: &'a Entry,
    /// Whether each mode is named, not merely between limits.
    one_by_one: bool,
}

fn stated(device: &Device) -> Option<Stated<'_>> {
    let supported = device.entry(0x6502, 0).and_then(|entry| {
        // Bit 0 is mode 1.
        let word = held(entry)?.as_integer()?;
        let known = Modes::CIA_402.0.iter().map(|(mode, _)| *mode);
        let modes: Vec<i8> = known.filter(|mode| word >> (mode - 1) & 1 != 0).collect();
        (!modes.is_empty()).then_some(Stated { modes, entry, one_by_one: true })
    });
    let chosen = device.entry(0x6060, 0)?;
    let named = || Some(Stated { modes: enumerated(device, chosen)?, entry: chosen, one_by_one: true });
    let limited = || Some(Stated { modes: between_limits(chosen)?, entry: chosen, one_by_one: false });
    supported.or_else(named).or_else(limited)
}

/// The objects of homing mode, if the drive has the mode.
pub(super) fn homing(reader: &mut Reader<'_>, modes: &[i8]) -> Option<Homing> {
    if !modes.contains(&6) {
        return None;
    }
    let method = reader.optional((0x6098, 0), "homing method", Need::Written)?;
    let offset = reader.optional((0x607C, 0), "home offset", Need::Target)?;
    let device = reader.device;
    let listed = || {
        let entries = device.object(0x60E3)?.entries.iter().filter(|entry| entry.sub > 0);
        let methods = entries.filter_map(|entry| i8::try_from(held(entry)?.as_integer()?).ok());
        Some(methods.filter(|&method| method != 0).collect::<Vec<_>>()).filter(|methods| !methods.is_empty())
    };
    let entry = device.entry(0x6098, 0)?;
    let methods = listed().or_else(|| enumerated(device, entry)).or_else(|| {
        // Limits include reserved methods.
        Some(between_limits(entry)?.into_iter().filter(|method| !RESERVED.contains(method)).collect())
    });
    Some(Homing { method, offset, methods: methods.unwrap_or_default() })
}

/// The values of the overlay's enumeration.
fn enumerated(device: &Device, entry: &Entry) -> Option<Vec<i8>> {
    let Meaning::Enumeration(name) = &entry.meaning else { return None };
    let values = device.enumerations.get(name)?.values.iter();
    Some(values.filter_map(|named| i8::try_from(named.value).ok()).collect())
}

/// The values from the low to the high limit; `None` if the limits are those of the data type, or equal (tools write 0
/// and 0 for no limits).
fn between_limits(entry: &Entry) -> Option<Vec<i8>> {
    let limit = |value: &Option<Value>| entry.data_type.fit(value.as_ref()?.as_integer()?);
    let (low, high) = (limit(&entry.low)?, limit(&entry.high)?);
    let (low, high) = (i8::try_from(low).ok()?, i8::try_from(high).ok()?);
    (low < high && (low, high) != (i8::MIN, i8::MAX)).then(|| (low..=high).collect())
}
