//! The data sheet as a whole: its findings, its device information, and its model against the generated code.

use std::collections::BTreeMap;
use std::fmt::Debug;

use lexican_eds::model::{Entry, Meaning, Object, ObjectKind};
use lexican_eds::types::DataType;
use lexican_runtime::object::Condition;

use super::objects::Described;
use crate::checker::Checker;
use crate::drive::Case;
use crate::notation::snake;
use crate::rig::{Rig, Simulator, once};
use crate::sheet::{Sheet, address};

pub(crate) fn check<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let sheet = case.sheet;
    // Intended deviations from CiA are accepted in the overlay.
    sheet.findings.iter().for_each(|finding| checker.finding(format!("{}: {finding}", case.drive.data_sheet)));
    device_information::<S>(checker, case);
    // Other tools refuse any other type of sub-index 0; the overlay has the one that the manual prints.
    for object in sheet.alone.objects.iter().filter(|object| object.kind != ObjectKind::Variable) {
        let count = object.entries.iter().find(|entry| entry.sub == 0).map(|entry| entry.data_type);
        checker.require(count == Some(DataType::Unsigned8), || format!("{:04X}:00 is {count:?}", object.index));
    }
    // If a table has object codes, those are compared.
    let has_codes = case.manual.rows("objects.csv").first().is_some_and(|row| row.has("object_code"));
    for object in sheet.device.objects.iter().filter(|object| object.kind.has_subs() && !has_codes) {
        let is_array = case.drive.arrays.contains(&object.index);
        let agrees = (object.kind == ObjectKind::Array) == is_array;
        checker.require(agrees, || format!("{:04X} is of the kind {}", object.index, object.kind.name()));
    }
    for unit in sheet.device.quantities.values().flat_map(|quantity| &quantity.units) {
        let known = METHODS.iter().any(|(symbol, method)| *symbol == unit.symbol && *method == unit.method);
        checker.require(known, || format!("the unit {} has the method {}", unit.symbol, unit.method));
    }
    if !sheet.code_is_stale {
        against_the_code(checker, sheet);
    }
}

/// Symbols of units, and the methods generated for them.
const METHODS: &[(&str, &str)] = &[
    ("increments", "increments"),
    ("mm", "millimetres"),
    ("rev/min", "revolutions_per_minute"),
    ("%", "percent"),
    ("V", "volts"),
    ("mA", "milliamperes"),
    ("°C", "degrees_celsius"),
    ("ms", "milliseconds"),
    ("µs", "microseconds"),
    ("ns", "nanoseconds"),
    ("units", "position_units"),
    ("units", "velocity_units"),
    ("units", "acceleration_units"),
    ("units", "parameter_units"),
    ("‰", "per_mille_of_rated_torque"),
    ("‰", "per_mille_of_rated_current"),
    ("Ω", "ohms"),
];

/// Compares `[DeviceInfo]`, `[DummyUsage]` and the file's name with the manual's names and with the drive.
fn device_information<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let device = &case.sheet.device;
    let info = &device.info;
    let drive = once::<S, _>((), observed::<S>);
    let mut same = |what: &str, sheet: &dyn Debug, drive: &dyn Debug| {
        let (sheet, drive) = (format!("{sheet:?}"), format!("{drive:?}"));
        checker.require(sheet == drive, || format!("{what}: {sheet} in the data sheet, {drive} in the drive"));
    };
    let names = [&info.vendor_name, &info.product_name, &info.order_code].map(|name| name.as_deref().unwrap_or(""));
    same("the names", &names, &[case.drive.vendor, case.drive.title, case.drive.title]);
    same("the device profile", &device.profile, &drive.profile);
    same("SimpleBootUpSlave", &info.simple_boot_up_slave, &drive.boots);
    same("SimpleBootUpMaster", &info.simple_boot_up_master, &drive.commands);
    // What a drive does not have, or what differs from drive to drive, is 0 in the data sheet.
    let fixed = |(sub, number): (u8, Option<u32>)| match device.entry(0x1018, sub) {
        Some(entry) if entry.default.is_none() => Some(0),
        _ => number.or(Some(0)),
    };
    let numbers = [(1, drive.identity[0]), (2, drive.identity[1]), (3, drive.identity[2])].map(fixed);
    same("1018h", &[info.vendor_number, info.product_number, info.revision_number], &numbers);
    same("NrOfRXPDO and NrOfTXPDO", &[info.receive_pdos, info.transmit_pdos], &drive.pdos.map(Some));
    same("GroupMessaging", &info.group_messaging, &drive.multiplexes);
    // If nothing can be mapped, there is no granularity.
    same("Granularity", &info.granularity, &Some(if drive.maps_nothing_else { 0 } else { 8 }));
    let dummies: Vec<u16> = device.dummies.iter().map(|data_type| data_type.code()).collect();
    same("DummyUsage", &dummies, &drive.dummies);
    same("DynamicChannelsSupported", &info.dynamic_channels, &drive.is_programmable);
    same("LSS_Supported", &info.lss, &drive.answers_lss);
    // Each object of the PDOs has a section, so none is compact.
    same("CompactPDO", &info.compact_pdo, &0);
    same("FileName", &device.file.name.as_deref(), &case.drive.data_sheet.rsplit('/').next());
    let file = (device.file.eds_version.as_deref(), device.file.version, device.file.revision);
    same("FileInfo", &file, &(Some("4.0"), Some(1), Some(0)));
}

/// The sizes of the data types 1 to 7.
const DUMMY_BITS: [u8; 7] = [1, 8, 16, 32, 8, 16, 32];

/// What a drive shows of `[DeviceInfo]`.
#[derive(Clone)]
struct Observed {
    /// The lower half of 1000h.
    profile: Option<u16>,
    /// Whether it boots by itself.
    boots: bool,
    /// Whether it sends NMT commands.
    commands: bool,
    /// 1018h:01 to 03, unless the table of objects has them; 04 differs from drive to drive.
    identity: [Option<u32>; 3],
    /// The numbers of receive and transmit PDOs with parameters.
    pdos: [u16; 2],
    /// Whether it has multiplex PDOs: 254 and 255 as the number of mapped objects.
    multiplexes: bool,
    maps_nothing_else: bool,
    /// The data types that fill a gap between mapped objects.
    dummies: Vec<u16>,
    /// Whether it has program objects, which begin at A000h.
    is_programmable: bool,
    answers_lss: bool,
}

fn observed<S: Simulator>() -> Observed {
    let mut rig = Rig::<S>::as_delivered();
    let heard = rig.hear(1000);
    let boot_up = heard.first().is_some_and(|frame| frame.id().raw() == u32::from(Rig::<S>::own(0x700)));
    let mut count = |first: u16| (first..first + 0x200).filter(|index| rig.read(*index, 1).is_ok()).count() as u16;
    let pdos = [count(0x1400), count(0x1800)];
    let mapping = (0..4).flat_map(|at| [0x1600 + at, 0x1A00 + at]);
    let lengths: Vec<u32> = mapping.clone().map(|index| rig.read(index, 0).unwrap_or(0)).collect();
    let maps_nothing_else = mapping.clone().all(|index| rig.write(index, 0, 0, 1).is_err());
    let mut fills = |(dummy, bits): &(u16, u8)| {
        let mapped = i64::from(*dummy) << 16 | i64::from(*bits);
        rig.write(0x1600, 1, mapped, 4).is_ok()
    };
    let dummies = (1..).zip(DUMMY_BITS).filter(|dummy| fills(dummy)).map(|(dummy, _)| dummy).collect();
    let mut observed = Observed {
        profile: rig.read(0x1000, 0).ok().map(|word| word as u16),
        boots: boot_up && rig.nmt_state().code() == 127,
        commands: heard.iter().any(|frame| frame.id().raw() == 0),
        identity: [1, 2, 3].map(|sub| rig.read(0x1018, sub).ok()),
        pdos,
        multiplexes: lengths.iter().any(|length| *length >= 254),
        maps_nothing_else,
        dummies,
        is_programmable: (0xA000_u16..0xA900).step_by(0x40).any(|index| rig.read(index, 0).is_ok()),
        answers_lss: false,
    };
    rig.nmt(0x02);
    rig.send(0x7E5, &[4, 1, 0, 0, 0, 0, 0, 0]);
    rig.send(0x7E5, &[94, 0, 0, 0, 0, 0, 0, 0]);
    observed.answers_lss = !rig.hear_from(0x7E4, 100).is_empty();
    observed
}

/// Compares the data sheet with the code that was generated from it.
fn against_the_code(checker: &mut Checker<'_>, sheet: &Sheet) {
    let (info, code) = (&sheet.device.info, &sheet.code.identity);
    let names = [&info.vendor_name, &info.product_name, &info.order_code].map(|name| name.as_deref().unwrap_or(""));
    let numbers = [info.vendor_number, info.product_number, info.revision_number];
    same(checker, "the names", &names, &code.names);
    same(checker, "the identity", &numbers, &code.numbers.map(Some));
    same(checker, "the device profile", &sheet.device.profile, &Some(code.profile));
    same(checker, "BaudRate", &info.bit_rates_kbit.as_slice(), &code.bit_rates_kbit);
    for object in &sheet.device.objects {
        object.entries.iter().for_each(|entry| entry_and_handle(checker, sheet, object, entry));
    }
    for address in sheet.code.handles.keys() {
        let there = sheet.device.entry(address.index(), address.sub()).is_some();
        checker.require(there, || format!("{address}: the code has a handle, the data sheet no entry"));
    }
    newtypes(checker, sheet);
}

/// Compares an entry of the data sheet with its handle in the code.
fn entry_and_handle(checker: &mut Checker<'_>, sheet: &Sheet, object: &Object, entry: &Entry) {
    let address = address(entry);
    let Some(handle) = sheet.handle(entry) else {
        return checker.finding(format!("{address}: the code has no handle"));
    };
    let (of, member) = (snake(&object.name).to_uppercase(), snake(&entry.name));
    let path = match handle.path.split_once('.') {
        // The elements of an array have numbers instead of names.
        Some((_, method @ ("at" | "len_object"))) => format!("{of}.{method}"),
        Some(_) => format!("{of}.{member}"),
        None => of,
    };
    same(checker, &format!("{address}: the name"), &path.as_str(), &handle.path);
    let meaning = match &entry.meaning {
        Meaning::Plain => plain(entry.data_type),
        Meaning::Quantity(name) | Meaning::Enumeration(name) | Meaning::BitField(name) => name.clone(),
    };
    same(checker, &format!("{address}: the meaning"), &meaning.as_str(), &handle.value_type);
    let (mut written, mut generated) = (Described::written(sheet, entry), Described::generated(sheet, handle, address));
    // Limits that are those of the data type are not in the handle; the length of an array has none.
    written.limits = written.limits.filter(|limits| Some(*limits) != entry.data_type.range());
    if handle.path.ends_with(".len_object") {
        for described in [&mut written, &mut generated] {
            (described.default, described.limits) = (None, None);
        }
    }
    same(checker, &address.to_string(), &written, &generated);
}

/// The plain type of a value: `u16` for UNSIGNED16.
fn plain(data_type: DataType) -> String {
    data_type.name().replace("UNSIGNED", "u").replace("INTEGER", "i").replace("VISIBLE_STRING", "VisibleString")
}

fn newtypes(checker: &mut Checker<'_>, sheet: &Sheet) {
    let (device, code) = (&sheet.device, &sheet.code);
    let written = device.enumerations.iter().map(|(name, enumeration)| {
        (name.as_str(), enumeration.values.iter().map(|named| (named.value, named.name.as_str())).collect::<Vec<_>>())
    });
    let generated = code.enumerations.iter().map(|(name, values)| {
        (*name, values.iter().map(|named| (i128::from(named.raw), named.name)).collect::<Vec<_>>())
    });
    same_names(checker, "enumeration", written, generated);
    let written = device.bit_fields.iter().map(|(name, field)| {
        let bits = field.fields.iter();
        let bits = bits.map(|bit| (bit.value.low, bit.value.high - bit.value.low + 1, bit.name.as_str()));
        (name.as_str(), bits.collect::<Vec<_>>())
    });
    let generated = code
        .bit_fields
        .iter()
        .map(|(name, bits)| (*name, bits.iter().map(|bit| (bit.low, bit.width, bit.name)).collect::<Vec<_>>()));
    same_names(checker, "bit field", written, generated);
    let condition =
        |when: &lexican_eds::model::Condition| Condition::new(when.index, when.sub, when.equal, when.value as u64);
    let written = device.quantities.iter().map(|(name, quantity)| {
        let units = quantity.units.iter();
        let units = units.map(|unit| (unit.symbol.as_str(), unit.num, unit.den, unit.when.as_ref().map(condition)));
        (name.as_str(), units.collect::<Vec<_>>())
    });
    let generated = code.quantities.iter().map(|(name, units)| {
        (*name, units.iter().map(|unit| (unit.symbol, unit.num, unit.den, unit.when)).collect::<Vec<_>>())
    });
    same_names(checker, "quantity", written, generated);
}

fn same_names<'a, T: PartialEq + Debug>(
    checker: &mut Checker<'_>,
    kind: &str,
    written: impl Iterator<Item = (&'a str, T)>,
    generated: impl Iterator<Item = (&'a str, T)>,
) {
    let [written, generated]: [BTreeMap<_, _>; 2] = [written.collect(), generated.collect()];
    for name in written.keys().chain(generated.keys()) {
        same(checker, &format!("{kind} {name}"), &written.get(name), &generated.get(name));
    }
}

fn same<T: PartialEq + Debug>(checker: &mut Checker<'_>, what: &str, written: &T, generated: &T) {
    checker
        .require(written == generated, || format!("{what}: {written:?} in the data sheet, {generated:?} in the code"));
}
