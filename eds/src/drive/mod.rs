//! What a data sheet says about a CiA 402 drive: indices and sizes of its objects, its modes, the contents of its PDOs,
//! its identity. Drivers, generated ones as well, start from this.
//!
//! It leaves out what CiA 402 leaves to the manufacturer and no data sheet says: which bits refuse which order, how
//! long things take, which codes are faults.

mod data;
mod finding;
mod modes;
mod objects;
mod pdo;

pub use data::{Code, Drive, Homing, Identity, Number, Outputs, Pdo, Profile, Signal, Torque};
pub use finding::{FINDINGS, Finding};

use crate::diagnostic::Diagnostics;
use crate::model::pdo::held;
use crate::model::types::DataType;
use crate::model::{Device, Meaning, Named, Value};
use lexican_cia::cia301;
use lexican_cia::cia402::Modes;
use objects::{Need, Reader};

/// Reads what a driver has to know about a drive.
///
/// The drive is `None` if there is a finding of severity error: the device is no CiA 402 drive, or lacks something that
/// every driver needs. An object that is left out because it contradicts CiA 402 is a warning.
#[must_use]
pub fn read(device: &Device) -> (Option<Drive>, Diagnostics) {
    let mut reader = Reader::new(device);
    let drive = drive(&mut reader);
    let mut findings = reader.findings;
    findings.finish();
    (drive.filter(|_| !findings.has_errors()), findings)
}

fn drive(reader: &mut Reader<'_>) -> Option<Drive> {
    profile(reader);
    // Look up everything first, so that all missing objects are reported at once.
    let control_word = reader.needed(0x6040, "control word", Need::Word);
    let status_word = reader.needed(0x6041, "status word", Need::Status);
    let mode = reader.needed(0x6060, "mode of operation", Need::Written);
    let vendor_ids = vendor_ids(reader);
    let target_position = reader.optional((0x607A, 0), "target position", Need::Target);
    let actual_position = reader.optional((0x6064, 0), "actual position", Need::Moved);
    if target_position.is_some() && reader.device.entry(0x6064, 0).is_none() {
        let help = "the driver does without positions; if the drive has 6064h, add it to the data sheet";
        let message = "607A (target position) is there, and no 6064h (actual position)";
        reader.report("drive::left-out", message, reader.nearest(0x607A), help);
    }
    let actual_velocity = actual_velocity(reader, actual_position);
    let target_velocity = reader.optional((0x60FF, 0), "target velocity", Need::Target);
    let torque = torque(reader);
    let interpolated_position = reader.optional((0x60C1, 1), "interpolated position", Need::Target);
    let targets = [
        (0x607A, target_position.is_some() && actual_position.is_some()),
        (0x60FF, target_velocity.is_some()),
        (0x6071, torque.is_some()),
        (0x60C1, interpolated_position.is_some()),
    ];
    let modes = modes::modes(reader, &targets);
    let all = modes.as_deref().unwrap_or_default();
    let has =
        |target: u16| Modes::CIA_402.0.iter().any(|(number, mode)| mode.object() == target && all.contains(number));
    let mut drive = Drive {
        name: name(reader.device),
        identity: Identity {
            vendor_ids,
            profile: device_type(reader.device).unwrap_or(402),
            name: device_name(reader.device),
        },
        always_four_bytes: reader.device.sdo_writes_four_bytes,
        control_word: control_word?,
        status_word: status_word?,
        mode: mode?,
        mode_display: reader.optional((0x6061, 0), "mode of operation display", Need::Read),
        actual_position,
        actual_velocity: actual_velocity?,
        profile: profile_of_travels(reader).filter(|_| all.contains(&1)),
        target_position,
        target_velocity: target_velocity.filter(|_| has(0x60FF)),
        torque: torque.filter(|_| has(0x6071)),
        interpolated_position: interpolated_position.filter(|_| has(0x60C1)),
        position_window: reader.optional((0x6067, 0), "position window", Need::Read),
        position_limits: None,
        latest_fault: reader.optional((cia301::PREDEFINED_ERROR_FIELD, 1), "error history", Need::Read),
        modes: modes?,
        homing: None,
        option_codes: (0x605A..=0x605E)
            .filter_map(|index| reader.optional((index, 0), "option code", Need::Written))
            .collect(),
        latched: latched(reader),
        outputs: Outputs::default(),
        inputs: Vec::new(),
        store: reader.optional((cia301::STORE_PARAMETERS, 1), "all parameters to store", Need::Written),
        restore: reader.optional((cia301::RESTORE_DEFAULT_PARAMETERS, 1), "all parameters to restore", Need::Written),
        emergencies: reader.optional((cia301::COB_ID_EMCY, 0), "COB-ID of emergencies", Need::Written),
        velocity_unit: velocity_unit(reader.device),
        codes: codes(reader.device),
    };
    let limits = [1, 2].map(|sub| reader.optional((0x607D, sub), "software position limit", Need::Moved));
    if let [Some(low), Some(high)] = limits {
        drive.position_limits = Some([low, high]);
    }
    drive.homing = modes::homing(reader, &drive.modes);
    (drive.outputs, drive.inputs) = pdo::pdos(reader, &drive);
    Some(drive)
}

fn torque(reader: &mut Reader<'_>) -> Option<Torque> {
    let target = reader.optional((0x6071, 0), "target torque", Need::Target);
    let actual = reader.optional((0x6077, 0), "actual torque", Need::Moved);
    Some(Torque { target: target?, actual: actual? })
}

/// The latched positions of the touch probes, where data types are those of CiA 402.
fn latched(reader: &mut Reader<'_>) -> Vec<Number> {
    let control = reader.optional((0x60B8, 0), "touch probe function", Need::Word);
    let status = reader.optional((0x60B9, 0), "touch probe status", Need::Status);
    if control.zip(status).is_none() {
        return Vec::new();
    }
    let positions = (0x60BA..=0x60BD).filter_map(|index| reader.optional((index, 0), "latched position", Need::Moved));
    positions.filter(|number| number.data_type == DataType::Integer32).collect()
}

/// The device profile in the low half of 1000h.
fn device_type(device: &Device) -> Option<u16> {
    let device_type = held(device.entry(cia301::DEVICE_TYPE, 0)?)?.as_integer()?;
    Some(device_type as u16).filter(|_| device_type != 0)
}

fn profile(reader: &mut Reader<'_>) {
    if let Some(other) = reader.device.profile.filter(|&profile| profile != 402) {
        let span = reader.nearest(cia301::DEVICE_TYPE);
        let help = "the driver goes by the objects of CiA 402; that this is right, an overlay says: `[overlay]`, `profile = 402`";
        reader.report("drive::profile", format!("1000h has device profile {other}, not 402"), span, help);
    }
}

/// 606Ch. `Some(None)` if the drive lacks it but has 6064h to measure velocity with.
fn actual_velocity(reader: &mut Reader<'_>, actual_position: Option<Number>) -> Option<Option<Number>> {
    if actual_position.is_none() {
        return reader.needed(0x606C, "actual velocity", Need::Moved).map(Some);
    }
    let number = reader.optional((0x606C, 0), "actual velocity", Need::Moved);
    if number.is_none() {
        let help =
            "the driver sees by 6064h whether the drive stands; if the drive has 606Ch, add it to the data sheet";
        let message = "there is no 606Ch (actual velocity) that a driver can use";
        reader.report("drive::velocity", message, reader.nearest(0x606C), help);
    }
    Some(number)
}

fn profile_of_travels(reader: &mut Reader<'_>) -> Option<Profile> {
    Some(Profile {
        velocity: reader.optional((0x6081, 0), "profile velocity", Need::Written)?,
        acceleration: reader.optional((0x6083, 0), "profile acceleration", Need::Written),
        deceleration: reader.optional((0x6084, 0), "profile deceleration", Need::Written),
    })
}

/// The vendor-IDs that the drive may answer. 0 stands for "not given" in 1018h and in `[DeviceInfo]`, but a device
/// answers what its 1018h holds.
fn vendor_ids(reader: &mut Reader<'_>) -> Vec<u32> {
    let device = reader.device;
    let entry = device.entry(cia301::IDENTITY, 1);
    let in_object = entry.and_then(held).and_then(Value::as_integer).and_then(|id| u32::try_from(id).ok());
    let known = match (in_object, device.info.vendor_number.filter(|&id| id != 0)) {
        (Some(id @ 1..), _) => return vec![id],
        (None, Some(number)) if entry.is_some() => return vec![number],
        (_, number) => number,
    };
    let (message, help) = match (known, entry.is_some()) {
        (None, _) => (
            "neither 1018h:01 nor `VendorNumber` has a vendor-ID".to_owned(),
            "the driver takes a drive of any vendor for this one; an overlay says whose it is: \
             `[object.\"1018:01\"]`, `default = 0x…`",
        ),
        (Some(number), true) => (
            format!("`VendorNumber` is 0x{number:X}, and 1018h:01 has the vendor-ID 0"),
            "the driver takes either for this drive; an overlay says which it is: `[object.\"1018:01\"]`, `default = 0x…`",
        ),
        (Some(number), false) => (
            format!("`VendorNumber` is 0x{number:X}, and there is no 1018h:01"),
            "the driver takes a drive without vendor-ID for this one, too; if it has the object, add it to the data sheet",
        ),
    };
    reader.report("drive::vendor", message, reader.nearest(cia301::IDENTITY), help);
    known.map_or_else(Vec::new, |number| vec![number, 0])
}

fn name(device: &Device) -> String {
    let product = device.info.product_name.as_deref().map(str::trim).filter(|name| !name.is_empty());
    product.map(str::to_owned).or_else(|| device_name(device).filter(|name| !name.is_empty())).unwrap_or("drive".into())
}

/// The value of 1008h without padding; `None` without the object.
fn device_name(device: &Device) -> Option<String> {
    Some(match held(device.entry(cia301::MANUFACTURER_DEVICE_NAME, 0)?) {
        Some(Value::Text(name)) => name.trim_matches(|c: char| c.is_whitespace() || c == '\0').to_owned(),
        _ => String::new(),
    })
}

/// The unit of 606Ch, if it has exactly one.
fn velocity_unit(device: &Device) -> Option<String> {
    let Meaning::Quantity(name) = &device.entry(0x606C, 0)?.meaning else { return None };
    let [unit] = device.quantities.get(name)?.units.as_slice() else { return None };
    Some(unit.to_string())
}

/// The emergency codes that the overlay names for 1003h or 603Fh.
fn codes(device: &Device) -> Vec<Code> {
    let of = |index, sub| match &device.entry(index, sub)?.meaning {
        Meaning::Enumeration(name) => device.enumerations.get(name),
        _ => None,
    };
    let values = of(cia301::PREDEFINED_ERROR_FIELD, 1).or_else(|| of(0x603F, 0)).map(|known| &*known.values);
    let code = |named: &Named<i128>| {
        Some(Code { number: u16::try_from(named.value).ok().filter(|&number| number != 0)?, text: named.name.clone() })
    };
    values.unwrap_or_default().iter().filter_map(code).collect()
}
