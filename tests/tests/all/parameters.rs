//! The parameters of SIKO's drives on all their interfaces, side by side: `PARAMETERS.md` in each drive's crate; and
//! how they differ from the objects.
//!
//! `cargo xtask bless` writes the tables anew.

use std::collections::BTreeMap;
use std::path::Path;
use std::{env, fs};

use lexican_eds::library;
use lexican_eds::model::{AccessType, Device, Interface, Meaning, Named, Parameter};

const BLESS: &str = "LEXICAN_BLESS";

/// The drives, with the folders of their crates.
const DRIVES: [(&str, &str); 2] = [("siko/ag02", "siko-ag02"), ("siko/ag03-1", "siko-ag03-1")];

fn device(name: &str) -> Device {
    lexican_eds::load(&library::find(name).expect("the library has it").input()).0
}

#[test]
fn the_golden_tables_of_parameters_are_current() {
    for (name, folder) in DRIVES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../drives").join(folder).join("PARAMETERS.md");
        let table = table(name, &device(name));
        if env::var_os(BLESS).is_some() {
            fs::write(&path, table).expect("the table can be written");
        } else {
            let old = fs::read_to_string(&path).unwrap_or_default();
            assert_eq!(old, table, "{}: review and accept: cargo xtask bless", path.display());
        }
    }
}

#[test]
fn what_differs_is_known() {
    let differences = |name| {
        let device = device(name);
        let of = |(door, interface): (&String, &Interface)| {
            let differs = |it: &Parameter| {
                let texts = differences(&device, interface, it);
                (!texts.is_empty()).then(|| format!("{door} {}: {}", it.number, texts.join("; ")))
            };
            interface.parameters.iter().filter_map(differs).collect::<Vec<_>>()
        };
        device.interfaces.iter().flat_map(of).collect::<Vec<_>>()
    };
    let [ag02, ag03_1] = DRIVES.map(|(name, _)| differences(name));
    let (ag02_profibus, serial) = ag02.split_at(ag02.len() - SERIAL.len());
    assert_eq!(serial, SERIAL);
    let of_both = |of_945, more: &[&'static str]| -> Vec<&str> {
        let [before, after] = [&PROFIBUS[..2], &PROFIBUS[2..]];
        [before, &[of_945], after, more].concat()
    };
    assert_eq!(ag02_profibus, of_both(AG02_945, &["profibus 1021: no object"]));
    assert_eq!(ag03_1, of_both(AG03_1_945, &[]));
}

const PROFIBUS: [&str; 7] = [
    "profibus 918: no object",
    "profibus 930: 1 for 2, 2 for 1",
    // CANopen clears the history by writing 1003h:00; here it is PNU 970.
    "profibus 952: read only, the object is read and written",
    "profibus 965: no object",
    "profibus 970: no object",
    "profibus 1016: changes places with 1017",
    "profibus 1017: changes places with 1016",
];
const AG02_945: &str =
    "profibus 945: 0h for 0h, 41h for 3120h, 42h for 7121h, 43h for 2100h, 44h for 4310h, 45h for F000h";
const AG03_1_945: &str = "profibus 945: 0h for 0h, 41h for 3120h, 42h for 7121h, 43h for 2100h, 44h for 4310h, \
                          45h for 7300h, 46h for FF01h, 47h for 3210h, 4Ah for FF09h";
const SERIAL: [&str; 6] = [
    "serial E0/F0: by the operating mode",
    "serial E0/F0: by the operating mode",
    "serial E1/F1: changes places with E2/F2",
    "serial E2/F2: changes places with E1/F1",
    "serial Q/X: 0 for 1, 1 for 2",
    "serial T: no object",
];

/// How a parameter differs from its object, besides number and name.
fn differences(device: &Device, interface: &Interface, parameter: &Parameter) -> Vec<String> {
    let Some((index, sub)) = parameter.object() else { return vec!["no object".to_owned()] };
    let entry = device.entry(index, sub).expect("the rules find others");
    let mut found = Vec::new();
    let rights = |access: AccessType| match access {
        AccessType::Ro | AccessType::Const => "read only",
        AccessType::Wo => "write only",
        AccessType::Rw | AccessType::Rwr | AccessType::Rww => "read and written",
    };
    if rights(parameter.entry.access) != rights(entry.access) {
        found.push(format!("{}, the object is {}", rights(parameter.entry.access), rights(entry.access)));
    }
    if (&parameter.entry.low, &parameter.entry.high) != (&entry.low, &entry.high) {
        found.push("another range".to_owned());
    }
    if parameter.data_type != entry.data_type {
        found.push(format!("carried as {}", parameter.data_type));
    }
    if !parameter.values.is_empty() {
        let Meaning::Enumeration(name) = &entry.meaning else { panic!("the rules find others") };
        let enumeration = &device.enumerations[name];
        let pair = |value: &Named<i128>| {
            let there = enumeration.values.iter().find(|known| known.name == value.name);
            let numbers = [value.value, there.expect("the rules find others").value];
            let [here, there] =
                numbers.map(|number| if enumeration.is_hex { format!("{number:X}h") } else { number.to_string() });
            format!("{here} for {there}")
        };
        found.push(parameter.values.iter().map(pair).collect::<Vec<_>>().join(", "));
    }
    // Neighbours of an object that are in the opposite order here.
    let is_swapped = |other: &&Parameter| {
        let Some((other_index, other_sub)) = other.object().filter(|_| other.elements == 1) else { return false };
        let is_neighbour = other_index == index && other_sub != sub && other_sub > 0 && sub > 0;
        is_neighbour && (other.number < parameter.number) != (other_sub < sub)
    };
    if parameter.elements == 1
        && let Some(other) = interface.parameters.iter().find(is_swapped)
    {
        found.push(format!("changes places with {}", other.number));
    }
    if parameter.when.is_some() {
        found.push("by the operating mode".to_owned());
    }
    found
}

/// The parameter's number in the manuals, which is in its description.
fn number(parameter: &Parameter) -> Option<u8> {
    let (_, rest) = parameter.entry.description.as_deref()?.split_once("parameter ")?;
    rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// Sorts rows by number, then by object; a parameter without either has its name.
type Key<'a> = (u8, Option<(u16, u8)>, &'a str);

/// A row for each parameter, by number, and a column for each interface.
fn table(name: &str, device: &Device) -> String {
    let mut rows: BTreeMap<Key<'_>, Vec<(&str, &Parameter)>> = BTreeMap::new();
    for (door, interface) in &device.interfaces {
        for parameter in &interface.parameters {
            let own = if parameter.object().is_none() { parameter.entry.name.as_str() } else { "" };
            let key = (number(parameter).unwrap_or(u8::MAX), parameter.object(), own);
            rows.entry(key).or_default().push((door, parameter));
        }
    }
    let doors: Vec<&str> = device.interfaces.keys().map(String::as_str).collect();
    let mut text = format!(
        "# Parameters by interface\n\n\
         The parameters of `{name}` side by side, made of the overlay beside its data sheet by `cargo xtask bless`:\n\
         their number in the manuals, the CANopen object, and the number of each other interface. What is not said to\n\
         differ is as the object has it.\n\n\
         | Parameter | | CANopen | {} | What differs |\n|---|---|---|{}---|\n",
        doors.join(" | "),
        "---|".repeat(doors.len()),
    );
    for ((number, object, _), found) in rows {
        let number = if number == u8::MAX { String::new() } else { number.to_string() };
        let object = object.map_or(String::new(), |(index, sub)| {
            let elements = found.iter().map(|(_, parameter)| parameter.elements).max().unwrap_or(1);
            let last = if elements > 1 { format!(" to :{:02X}", sub + elements - 1) } else { String::new() };
            format!("{index:04X}:{sub:02X}{last}")
        });
        let at = |door: &&str| found.iter().find(|(other, _)| other == door);
        let cells: Vec<String> =
            doors.iter().map(|door| at(door).map_or(String::new(), |(_, it)| it.number.to_string())).collect();
        let differs = found.iter().flat_map(|(door, parameter)| {
            let of = differences(device, &device.interfaces[*door], parameter);
            of.into_iter().map(move |text| format!("{door}: {text}"))
        });
        let differs: Vec<String> = differs.collect();
        let title = &found[0].1.entry.name;
        text += &format!("| {number} | {title} | {object} | {} | {} |\n", cells.join(" | "), differs.join("; "));
    }
    text
}
