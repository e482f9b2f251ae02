//! A device that is made of a data sheet holds what the data sheet declares, and takes back what it holds.
//!
//! What a data sheet declares is worked out here from its own words, not by what the simulation starts with. All data sheets of
//! the library, of the tests and of the corpus (`eds/tests/corpus_files`) are tried.

use crate::corpus_files;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{fs, thread};

use lexican_eds::model::{AccessType, Device, Entry, Value};
use lexican_eds::types::{Class, DataType};
use lexican_eds::{Input, Source, load};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{AbortCode, Duration, NodeId};
use lexican_simulation::VirtualDevice;

const NODE: NodeId = NodeId::literal(5);

#[test]
fn a_simulated_device_holds_what_its_data_sheet_declares() {
    let sheets = sheets();
    let (next, tried) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let faults = Mutex::new(BTreeMap::<String, usize>::new());
    let work = || {
        while let Some((name, device)) = sheets.get(next.fetch_add(1, Ordering::Relaxed)) {
            let found = tried_out(device, &tried);
            let mut faults = faults.lock().unwrap();
            for fault in found {
                *faults.entry(format!("{fault} ({name})")).or_default() += 1;
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let faults = faults.into_inner().unwrap();
    println!("{} entries of {} data sheets", tried.into_inner(), sheets.len());
    let lines: Vec<String> = faults.into_keys().collect();
    assert!(lines.is_empty(), "{} faults:\n{}", lines.len(), lines.join("\n"));
}

/// What no data sheet of the library has, each in a line; without the corpus, too.
#[test]
fn odd_defaults_are_kept() {
    let object = |index: &str, data_type: u8, keys: &str| {
        format!("[{index}]\nParameterName=x{index}\nDataType={data_type}\nAccessType=rw\n{keys}\n")
    };
    let sheet = [
        object("1012", 7, "DefaultValue=0x40000100"),
        object("1014", 7, "DefaultValue=0x81"),
        object("1015", 6, "DefaultValue=9"),
        object("1019", 5, "DefaultValue=0"),
        object("1280sub1", 7, "DefaultValue=0"),
        object("1F50sub1", 15, ""),
        object("1F51sub1", 5, "DefaultValue=1"),
        object("1F56sub1", 7, "DefaultValue=0x12345678"),
        object("1F57sub1", 7, "DefaultValue=0"),
        object("2000", 6, "DefaultValue=9\nHighLimit=5"),
        object("2001", 7, "DefaultValue=$NODEID+0x180"),
        object("2002", 3, "LowLimit=0\nHighLimit=0xFFFF\nDefaultValue=7"),
    ];
    let (device, _) = load(&Input::new(Source::new("odd.eds", sheet.concat())));
    let tried = AtomicUsize::new(0);
    assert_eq!(tried_out(&device, &tried), [""; 0]);
    assert_eq!(tried.into_inner(), 11);
}

/// Reads each entry that has a value by its data sheet, and writes it back.
fn tried_out(device: &Device, tried: &AtomicUsize) -> Vec<String> {
    let bus = VirtualBus::new();
    bus.attach(VirtualDevice::power_on(bus.now(), NODE, device));
    let mut network = Network::new(bus.link());
    bus.advance(Duration::from_millis(1));
    let mut faults = Vec::new();
    for entry in device.entries().filter(|entry| entry.access != AccessType::Wo) {
        let Some(declared) = declared(entry) else { continue };
        tried.fetch_add(1, Ordering::Relaxed);
        let address = Address::new(entry.index, entry.sub);
        let held = match read(&mut network, address) {
            Ok(held) => held,
            // 7.5.2.4: without an error there is no field of the history.
            Err(AbortCode::NO_DATA) if entry.index == 0x1003 && entry.sub > 0 => continue,
            Err(code) => {
                faults.push(format!("{address} cannot be read: {code}"));
                continue;
            }
        };
        if held != declared && !is_another_by_right(entry) {
            faults.push(format!("{address} holds {held:02X?}, and not {declared:02X?}"));
        }
        if is_written_back(entry)
            && let Err(code) = write(&mut network, address, &held)
        {
            faults.push(format!("{address} does not take its own {held:02X?}: {code}"));
        }
    }
    faults
}

/// What the device itself determines, whatever its data sheet says.
fn is_another_by_right(entry: &Entry) -> bool {
    match entry.index {
        // CiA 301, 7.5.2.2 and 7.5.2.4: no error has occurred since power-on.
        0x1001 => true,
        0x1003 => entry.sub == 0,
        // What a drive measures: its state, and where it is.
        _ => simulator::servo::measures(Address::new(entry.index, entry.sub)),
    }
}

/// What takes back its own value: all that is written as a value.
fn is_written_back(entry: &Entry) -> bool {
    let is_command = match entry.index {
        // 7.5.2.4: 0 only, which erases the history; 7.5.2.13, 7.5.2.14: a signature only.
        0x1003 | 0x1010 | 0x1011 => true,
        // CiA 302-3: a program and commands to its loader; CiA 302-2, 1F82h: commands to nodes.
        0x1F50 | 0x1F51 | 0x1F82 => true,
        // 7.5.2.36 and 7.5.2.38: a mapping is changed while the PDO does not exist.
        0x1600..=0x17FF | 0x1A00..=0x1BFF => true,
        _ => false,
    };
    let writable = matches!(entry.access, AccessType::Rw | AccessType::Rwr | AccessType::Rww);
    writable && !is_command
}

fn read(network: &mut Network<VirtualLink>, address: Address) -> Result<Vec<u8>, AbortCode> {
    network.read_bytes(NODE, address).map_err(aborted)
}

fn write(network: &mut Network<VirtualLink>, address: Address, data: &[u8]) -> Result<(), AbortCode> {
    network.write_bytes(NODE, address, data).map_err(aborted)
}

#[track_caller]
fn aborted(error: impl Into<AccessError>) -> AbortCode {
    match error.into() {
        AccessError::Sdo { error: SdoError::Aborted { code, .. }, .. } => code,
        other => panic!("{other:?}"),
    }
}

/// The bytes that `ParameterValue`, or else `DefaultValue`, stands for; none if the data type has no such value.
fn declared(entry: &Entry) -> Option<Vec<u8>> {
    [&entry.configured, &entry.default].into_iter().flatten().find_map(|value| bytes(value, entry.data_type))
}

fn bytes(value: &Value, data_type: DataType) -> Option<Vec<u8>> {
    let integer = |number: i128| {
        let size = usize::from(data_type.bits()?.div_ceil(8));
        let bits = u32::from(data_type.bits()?);
        // Two's complement, which data sheets also write as the unsigned number.
        let low = if data_type.class() == Class::Signed { -(1_i128 << (bits - 1)) } else { 0 };
        (low..1 << bits).contains(&number).then(|| number.to_le_bytes()[..size].to_vec())
    };
    match (value, data_type.class()) {
        (Value::Integer(number), Class::Real) if data_type == DataType::Real32 => {
            Some((*number as f32).to_le_bytes().to_vec())
        }
        (Value::Integer(number), Class::Real) => Some((*number as f64).to_le_bytes().to_vec()),
        (Value::Integer(number), _) => integer(*number),
        (Value::NodeIdPlus(base), _) => {
            // Only what is a value in the device of any node-ID.
            integer(i128::from(*base) + 127)?;
            integer(i128::from(*base) + i128::from(NODE.get()))
        }
        (Value::Real(number), Class::Real) if data_type == DataType::Real32 => {
            Some(*number as f32).filter(|number| number.is_finite()).map(|number| number.to_le_bytes().to_vec())
        }
        (Value::Real(number), Class::Real) => Some(number.to_le_bytes().to_vec()),
        (Value::Text(text), Class::Text) if data_type == DataType::UnicodeString => {
            Some(text.encode_utf16().flat_map(u16::to_le_bytes).collect())
        }
        (Value::Text(text), Class::Text) => text.chars().map(|letter| u8::try_from(letter).ok()).collect(),
        (Value::Bytes(bytes), Class::Bytes) => Some(bytes.clone()),
        _ => None,
    }
}

/// All data sheets that can be read, with their names.
fn sheets() -> Vec<(String, Device)> {
    let mut sheets: Vec<(String, Device)> =
        lexican_eds::library::all().iter().map(|shipped| (shipped.id.to_owned(), load(&shipped.input()).0)).collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files: Vec<PathBuf> = vec![root.join("eds/tests/golden/base.eds")];
    files.extend(corpus_files::corpus().unwrap_or_default());
    for path in files {
        let is_sheet =
            path.extension().is_some_and(|it| it.eq_ignore_ascii_case("eds") || it.eq_ignore_ascii_case("dcf"));
        let Some(bytes) = is_sheet.then(|| fs::read(&path).ok()).flatten() else { continue };
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (device, findings) = load(&Input::new(Source::from_bytes(name.as_str(), &bytes)));
        if !findings.has_errors() && !device.objects.is_empty() {
            sheets.push((name, device));
        }
    }
    sheets
}
