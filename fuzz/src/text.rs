//! No file and no text makes a reader panic, and what a reader has read is written so that it reads the same.

use std::collections::BTreeSet;
use std::fmt::{Debug, Display};
use std::io::Cursor;
use std::str::FromStr;

use lexican_codegen::{Options, compile};
use lexican_eds::{Input, Source, load};
use lexican_machine::{BusYml, Files, Machine};
use lexican_runtime::host::BusUrl;
use lexican_runtime::host::candump::Line;
use lexican_runtime::host::slcan::{Decoder, Message, line};
use lexican_runtime::procedure::ConciseDcf;
use lexican_toolbox::log::{Format, Reader, Record, Writer};
use lexican_toolbox::parameters::archive::Archive;
use siko_ag03_1::od;
use siko_ag03_1::sim::script::Script;
use siko_ag03_1::sim::{MODEL, NonVolatile};

/// Separates a data sheet from its overlay.
const OVERLAY: &[u8] = b"\n=== overlay ===\n";

/// A data sheet, and the overlay after [`OVERLAY`].
fn input(data: &[u8]) -> Input {
    let split = data.windows(OVERLAY.len()).position(|window| window == OVERLAY);
    let Some(at) = split else { return Input::new(Source::from_bytes("x.eds", data)) };
    let overlay = String::from_utf8_lossy(&data[at + OVERLAY.len()..]);
    Input::new(Source::from_bytes("x.eds", &data[..at])).overlay(Source::new("x.toml", overlay))
}

/// All operations on a data sheet.
pub fn eds(data: &[u8]) {
    super::exercise::exercise(&input(data));
}

/// A data sheet that was read is written as XML that reads the same.
pub fn xdd(data: &[u8]) {
    let input = input(data);
    super::exercise::exercise(&input);
    let text = lexican_eds::xdd::xdc(&load(&input).0);
    let again = load(&Input::new(Source::new("x.xdc", text.as_str()))).0;
    assert_eq!(lexican_eds::xdd::xdc(&again), text, "written again it is another text");
}

/// Generated code is valid Rust.
pub fn codegen(data: &[u8]) {
    let (device, _) = load(&input(data));
    let whole = Options { storage: true, names: true, driver: true, ..Options::default() };
    for options in [Options::default(), whole] {
        let code = compile(&device, &options).code;
        if let Err(error) = syn::parse_file(&code) {
            panic!("{error} at {:?}\n{code}", error.span());
        }
    }
}

/// A value that was parsed prints as a text that parses to the same value.
#[track_caller]
fn round_trip<T: FromStr + Display + PartialEq + Debug>(text: &str) {
    let Ok(read) = text.parse::<T>() else { return };
    let printed = read.to_string();
    assert_eq!(printed.parse().ok().as_ref(), Some(&read), "{text:?} prints as {printed:?}");
}

/// Lines of `candump -L`.
pub fn log(data: &[u8]) {
    String::from_utf8_lossy(data).lines().for_each(round_trip::<Line>);
}

/// Logs of a format that the first byte names, or that is recognised from the rest. A log that was read is written in
/// another format, and reads the same.
pub fn logs(data: &[u8]) {
    let (first, rest) = data.split_first().unwrap_or((&0, data));
    let format = |at: u8| Format::all().nth(usize::from(at));
    let Ok(reader) = Reader::new("log", Cursor::new(rest.to_vec()), format(first & 0x0F)) else { return };
    let records: Vec<Record> = reader.map_while(Result::ok).collect();
    let to = format(first >> 4).unwrap_or(Format::Pcapng);
    let mut writer = Writer::in_memory(to);
    let kept: Vec<&Record> = records.iter().filter(|record| writer.write(record).is_ok()).collect();
    let again = Reader::new("log", Cursor::new(writer.into_bytes()), Some(to)).expect("what was written can be opened");
    let again: Vec<Record> = again.map(|record| record.expect("what was written can be read")).collect();
    assert!(again.iter().map(|record| record.frame).eq(kept.iter().map(|record| record.frame)), "{to}");
}

/// Names of buses.
pub fn bus_url(data: &[u8]) {
    String::from_utf8_lossy(data).lines().for_each(round_trip::<BusUrl>);
}

/// Bytes on a serial line.
pub fn slcan(data: &[u8]) {
    let mut decoder = Decoder::default();
    for message in data.iter().filter_map(|byte| decoder.take(*byte)) {
        if let Message::Frame(frame) = message {
            let mut again = Decoder::default();
            let read: Vec<Message> = (line(&frame) + "\r").bytes().filter_map(|byte| again.take(byte)).collect();
            assert_eq!(read, [Message::Frame(frame)]);
        }
    }
}

/// Scripts of the simulated drive.
pub fn script(data: &[u8]) {
    if let Err(error) = Script::from_toml(&MODEL, &String::from_utf8_lossy(data)) {
        assert!(!error.to_string().is_empty());
    }
}

/// The backup of a machine: if it can be read, it is written, and reads the same.
pub fn archive(data: &[u8]) {
    let Ok(read) = Archive::read(data) else { return };
    let names: BTreeSet<_> = read.nodes.iter().map(|node| &node.name).collect();
    if names.len() == read.nodes.len()
        && let Ok(bytes) = read.to_bytes()
    {
        assert_eq!(Archive::read(&bytes).expect("what was written can be read"), read);
    }
}

/// The file of the values that a drive keeps without power: any text, and the text of any values.
pub fn parameters(data: &[u8]) {
    let read = |text: &str| NonVolatile::from_text(&MODEL, text);
    if let Ok(kept) = read(&String::from_utf8_lossy(data)) {
        assert_eq!(read(&kept.to_text(&MODEL)).ok(), Some(kept));
    }
    let mut kept = NonVolatile::default();
    for value in data.chunks(9) {
        let (at, bytes) = value.split_at(1);
        let mut raw = [0; 8];
        raw[..bytes.len()].copy_from_slice(bytes);
        let address = od::PERSISTENT[usize::from(at[0]) % od::PERSISTENT.len()];
        kept.eeprom.insert(address, u64::from_le_bytes(raw));
        kept.position = i32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]]);
    }
    let text = kept.to_text(&MODEL);
    assert_eq!(read(&text).ok(), Some(kept));
    // No part of the text is taken for the whole.
    let cut = data.len() % text.trim_end().len();
    assert!(read(&text[..cut]).is_err());
}

/// A `bus.yml`: read, and made into a machine.
pub fn bus_yml(data: &[u8]) {
    let read = BusYml::read(Source::from_bytes("bus.yml", data), Files::Embedded(&[]), &str::to_owned);
    let _ = read.findings.render(&read.input);
    let text = read.draft.text();
    if text.is_empty() {
        return;
    }
    assert_eq!(lexican_machine::format(&text).as_ref(), Ok(&text));
    let machine = Machine::parse(Source::new("machine.toml", text.as_str()), Files::Embedded(&[]));
    // A mistake of the network may be one of the machine, but the file must be well formed.
    for finding in machine.findings.iter() {
        assert!(!["machine::syntax", "machine::key", "machine::value"].contains(&finding.code), "{text}");
    }
}

/// The file of a machine: read, formatted, and made into the writes at its boot.
pub fn machine(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    if let Ok(formatted) = lexican_machine::format(&text) {
        assert_eq!(lexican_machine::format(&formatted).ok().as_ref(), Some(&formatted));
    }
    let machine = Machine::parse(Source::new("machine.toml", text), Files::Embedded(&[]));
    let _ = machine.findings.render(&machine.input);
    if machine.findings.has_errors() {
        return;
    }
    for node in &machine.nodes {
        assert!(ConciseDcf::new(&machine.concise_dcf(node)).check().is_ok());
    }
    assert!(machine.load().is_none_or(|load| load.percent.is_finite()));
    let _ = machine.boot_plan();
}
