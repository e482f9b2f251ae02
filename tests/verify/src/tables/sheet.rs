//! The data sheet as a whole: its findings, its device information, and its model against the generated code.

use std::collections::BTreeMap;

use lexican_eds::model::{Device, Entry, Meaning, ObjectKind, Unit, Value};
use lexican_eds::types::DataType;
use lexican_eds::{Input, Source};
use lexican_runtime::object::{Address, Condition};
use siko_ag03_1::od;
use siko_ag03_1::sim::BIT_RATES;

use crate::Inputs;
use crate::bench::{Bench, NODE};
use crate::checker::Checker;
use crate::code::{self, Handle};
use crate::manual::Manual;
use crate::notation::snake;

/// The data sheet with its overlay, and the code that was generated from it.
pub(crate) struct Sheet {
    pub(crate) device: Device,
    /// The data sheet as other tools read it, without the overlay.
    alone: Device,
    pub(crate) handles: BTreeMap<Address, Handle>,
    pub(crate) overlay: String,
    findings: Vec<String>,
    code_is_stale: bool,
}

impl Sheet {
    pub(crate) fn new(inputs: &Inputs) -> Self {
        let eds = Source::new("SIKOAG03.EDS", inputs.eds.as_str());
        let (alone, _) = lexican_eds::load(&Input::new(eds.clone()));
        let input = Input::new(eds).overlay(Source::new("SIKOAG03.toml", inputs.overlay.as_str()));
        let (device, diagnostics) = lexican_eds::load(&input);
        let findings = diagnostics.iter().map(|finding| format!("{} {}", finding.code, finding.message)).collect();
        let (overlay, code_is_stale) = (inputs.overlay.clone(), inputs.code_is_stale);
        Sheet { device, alone, handles: code::handles(), overlay, findings, code_is_stale }
    }

    pub(crate) fn handle(&self, entry: &Entry) -> Option<&Handle> {
        self.handles.get(&address(entry))
    }

    /// `7.12.2.N`: the manual describes the objects in the order of their indices.
    pub(crate) fn chapter(&self, index: u16) -> String {
        let at = self.device.objects.iter().position(|object| object.index == index);
        format!("7.12.2.{}", at.map_or(0, |at| at + 1))
    }
}

pub(crate) fn address(entry: &Entry) -> Address {
    Address::new(entry.index, entry.sub)
}

/// A value for [`NODE`].
pub(crate) fn number(value: Option<&Value>) -> Option<i128> {
    match value? {
        Value::Integer(number) => Some(*number),
        Value::NodeIdPlus(base) => Some(i128::from(*base) + i128::from(NODE.get())),
        _ => None,
    }
}

pub(crate) fn check(checker: &mut Checker<'_>, _manual: &Manual, sheet: &Sheet) {
    // What deviates from CiA, and stays so, is accepted in the overlay.
    sheet.findings.iter().for_each(|finding| checker.finding(format!("SIKOAG03: {finding}")));
    device_information(checker, &sheet.device);
    // Other tools refuse any other type there; the overlay has what the manual prints.
    for object in sheet.alone.objects.iter().filter(|object| object.kind != ObjectKind::Variable) {
        let count = object.entries.iter().find(|entry| entry.sub == 0).map(|entry| entry.data_type);
        checker.require(count == Some(DataType::Unsigned8), || format!("{:04X}:00 is {count:?}", object.index));
    }
    for unit in sheet.device.quantities.values().flat_map(|quantity| &quantity.units) {
        let known = METHODS.iter().any(|(symbol, method)| *symbol == unit.symbol && *method == unit.method);
        checker.require(known, || format!("the unit {} has the method {}", unit.symbol, unit.method));
    }
    // Whoever asks for the file by either name of chapter 7.11 finds it.
    let names = sheet.overlay.lines().find(|line| line.starts_with("names = "));
    let both = names == Some(r#"names = ["SIKOAG03/1.EDS", "SIKOAG03.EDS"]"#);
    checker.require(both, || format!("the overlay answers to {names:?}"));
    if !sheet.code_is_stale {
        against_the_code(checker, sheet);
    }
}

/// The code that was generated from the data sheet.
fn against_the_code(checker: &mut Checker<'_>, sheet: &Sheet) {
    identity(checker, &sheet.device);
    for object in &sheet.device.objects {
        let index = object.index;
        let handle = sheet.handles.get(&Address::new(index, 0));
        let kind = match handle {
            _ if ARRAYS.contains(&index) => ObjectKind::Array,
            Some(handle) if !handle.path.contains('.') => ObjectKind::Variable,
            _ => ObjectKind::Record,
        };
        checker.require(object.kind == kind, || format!("{index:04X}: the code has a {}", kind.name()));
        object.entries.iter().for_each(|entry| entry_and_handle(checker, sheet, &object.name, entry));
    }
    for address in sheet.handles.keys() {
        let there = sheet.device.entry(address.index(), address.sub()).is_some();
        checker.require(there, || format!("{address}: the code has a handle, the data sheet no entry"));
    }
    newtypes(checker, &sheet.device);
}

/// The objects that CiA 301 and 402 describe as arrays.
const ARRAYS: &[u16] = &[0x1003, 0x1011, 0x607D, 0x6091];

fn identity(checker: &mut Checker<'_>, device: &Device) {
    let info = &device.info;
    let mut same = |what: &str, sheet: String, code: String| {
        checker.require(sheet == code, || format!("{what}: {sheet} in the data sheet, {code} in the code"));
    };
    let text = |text: &Option<String>| text.clone().unwrap_or_default();
    same("VendorName", text(&info.vendor_name), od::VENDOR_NAME.into());
    same("ProductName", text(&info.product_name), od::PRODUCT_NAME.into());
    same("OrderCode", text(&info.order_code), od::ORDER_CODE.into());
    same("VendorNumber", format!("{:?}", info.vendor_number), format!("{:?}", Some(od::VENDOR_ID)));
    same("ProductNumber", format!("{:?}", info.product_number), format!("{:?}", Some(od::PRODUCT_CODE)));
    same("RevisionNumber", format!("{:?}", info.revision_number), format!("{:?}", Some(od::REVISION_NUMBER)));
    same("the device profile", format!("{:?}", device.profile), format!("{:?}", Some(od::DEVICE_PROFILE)));
    same("BaudRate", format!("{:?}", info.bit_rates_kbit), format!("{:?}", od::BIT_RATES_KBIT));
}

fn device_information(checker: &mut Checker<'_>, device: &Device) {
    let info = &device.info;
    let mut same = |what: &str, sheet: String, drive: String| {
        checker.require(sheet == drive, || format!("{what}: {sheet} in the data sheet, {drive} in the drive"));
    };
    let text = |text: &Option<String>| text.clone().unwrap_or_default();
    // What the drive answers with, which objects.csv compares; 1018h:04 differs from drive to drive.
    let mut bench = Bench::new();
    let mut read = |index, sub| bench.read(index, sub).ok();
    same("VendorNumber", format!("{:?}", info.vendor_number), format!("{:?}", read(0x1018, 1)));
    same("ProductNumber", format!("{:?}", info.product_number), format!("{:?}", read(0x1018, 2)));
    same("RevisionNumber", format!("{:?}", info.revision_number), format!("{:?}", read(0x1018, 3)));
    // The bit rates that have a key, of those that the drive can be set to.
    let rates: Vec<u32> = BIT_RATES.iter().map(|rate| rate / 1000).filter(|rate| KEYS.contains(rate)).collect();
    let listed: Vec<u32> = info.bit_rates_kbit.iter().map(|rate| u32::from(*rate)).collect();
    same("BaudRate", format!("{listed:?}"), format!("{rates:?}"));
    // The boot-up message comes by itself (7.2.2.2), four PDOs each way have parameters (7.2.4), mapping is
    // static and in bytes, and there is neither LSS nor anything programmable.
    let rest = (info.simple_boot_up_master, info.simple_boot_up_slave, info.dynamic_channels, info.group_messaging);
    same("boot-up and channels", format!("{rest:?}"), "(false, true, false, false)".into());
    let rest = (info.receive_pdos, info.transmit_pdos, info.granularity, info.lss, info.compact_pdo);
    same("PDOs and LSS", format!("{rest:?}"), "(Some(4), Some(4), Some(0), false, 0)".into());
    same("DummyUsage", format!("{:?}", device.dummies), "[]".into());
    let file = (text(&device.file.name), text(&device.file.eds_version), device.file.version, device.file.revision);
    same("FileInfo", format!("{file:?}"), r#"("SIKOAG03.EDS", "4.0", Some(1), Some(0))"#.into());
}

/// The bit rates that CiA 306 has keys for, in kbit/s.
const KEYS: [u32; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

/// An entry of the data sheet and the handle that the code has for it.
fn entry_and_handle(checker: &mut Checker<'_>, sheet: &Sheet, object: &str, entry: &Entry) {
    let address = address(entry);
    let Some(handle) = sheet.handle(entry) else {
        return checker.finding(format!("{address}: the code has no handle"));
    };
    let (of, member) = (snake(object).to_uppercase(), snake(&entry.name));
    let path = match handle.path.split_once('.') {
        // The elements of an array have numbers for names.
        Some((_, "at" | "len_object")) => handle.path.replace("PRE_DEFINED_ERROR_FIELD", &of),
        Some(_) => format!("{of}.{member}"),
        None => of,
    };
    let meaning = match &entry.meaning {
        Meaning::Plain => None,
        Meaning::Quantity(name) | Meaning::Enumeration(name) | Meaning::BitField(name) => Some(name.as_str()),
    };
    // A record's members and an array's elements have defaults and limits; the length of an array has none.
    let is_len = handle.path.ends_with(".len_object");
    let mut same = |what: &str, sheet: String, code: String| {
        checker.require(sheet == code, || format!("{address}: {what}: {sheet} in the data sheet, {code} in the code"));
    };
    same("the name", path, handle.path.clone());
    same("the data type", entry.data_type.name().into(), handle.data_type.clone());
    same("the meaning", meaning.unwrap_or_else(|| plain(handle)).into(), handle.value_type.into());
    if !is_len {
        same("the default", format!("{:?}", number(entry.default.as_ref())), format!("{:?}", handle.default));
        let limits = number(entry.low.as_ref()).zip(number(entry.high.as_ref()));
        // Limits that are those of the data type are no limits to a handle.
        let limits = limits.filter(|limits| Some(*limits) != entry.data_type.range());
        same("the limits", format!("{limits:?}"), format!("{:?}", handle.limits));
    }
}

/// The type of a number that is nothing else.
fn plain(handle: &Handle) -> &'static str {
    match handle.data_type.as_str() {
        "UNSIGNED8" => "u8",
        "UNSIGNED16" => "u16",
        "UNSIGNED32" => "u32",
        "INTEGER16" => "i16",
        "INTEGER32" => "i32",
        _ => "",
    }
}

fn newtypes(checker: &mut Checker<'_>, device: &Device) {
    let rows = |names: &[lexican_runtime::object::ValueName]| {
        names.iter().map(|named| (i128::from(named.raw), named.name.to_owned())).collect::<Vec<_>>()
    };
    let code: BTreeMap<_, _> =
        code::enumerations().into_iter().map(|(name, rows_of)| (name.to_owned(), rows(rows_of))).collect();
    let sheet = device.enumerations.iter().map(|(name, enumeration)| {
        (name.clone(), enumeration.values.iter().map(|named| (named.value, named.name.clone())).collect())
    });
    same(checker, "enumeration", &sheet.collect(), &code);
    let code: BTreeMap<_, Vec<_>> = code::bit_fields()
        .into_iter()
        .map(|(name, bits)| {
            (name.to_owned(), bits.iter().map(|bit| (bit.low, bit.width, bit.name.to_owned())).collect())
        })
        .collect();
    let sheet = device.bit_fields.iter().map(|(name, field)| {
        let bits = field.fields.iter().map(|bit| (bit.value.low, bit.value.high - bit.value.low + 1, bit.name.clone()));
        (name.clone(), bits.collect())
    });
    same(checker, "bit field", &sheet.collect(), &code);
    let code: BTreeMap<_, Vec<_>> = code::quantities()
        .into_iter()
        .map(|(name, units)| {
            let unit = |unit: &lexican_runtime::object::Unit| (unit.symbol.to_owned(), unit.num, unit.den, unit.when);
            (name.to_owned(), units.iter().map(unit).collect())
        })
        .collect();
    let sheet = device.quantities.iter().map(|(name, quantity)| {
        let unit = |unit: &Unit| (unit.symbol.clone(), unit.num, unit.den, unit.when.as_ref().map(condition));
        (name.clone(), quantity.units.iter().map(unit).collect())
    });
    same(checker, "quantity", &sheet.collect(), &code);
}

/// Symbols of units and the methods that are generated for them.
const METHODS: &[(&str, &str)] = &[
    ("increments", "increments"),
    ("mm", "millimetres"),
    ("rev/min", "revolutions_per_minute"),
    ("%", "percent"),
    ("V", "volts"),
    ("mA", "milliamperes"),
    ("°C", "degrees_celsius"),
    ("ms", "milliseconds"),
];

fn condition(of: &lexican_eds::model::Condition) -> Condition {
    Condition::new(of.index, of.sub, of.equal, of.value as u64)
}

fn same<T: PartialEq + std::fmt::Debug>(
    checker: &mut Checker<'_>,
    kind: &str,
    sheet: &BTreeMap<String, T>,
    code: &BTreeMap<String, T>,
) {
    for name in sheet.keys().chain(code.keys()) {
        let (sheet, code) = (sheet.get(name), code.get(name));
        checker.require(sheet == code, || format!("{kind} {name}: {sheet:?} in the overlay, {code:?} in the code"));
    }
}
