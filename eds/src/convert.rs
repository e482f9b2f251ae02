//! Converts data sheets to other formats, and lists what those formats cannot express.

use std::collections::BTreeMap;
use std::path::Path;

use crate::model::{Device, Entry, Meaning, Object};
use crate::write::{self, difference};
use crate::{Input, Source, xdd};

/// A file format of data sheets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// CiA 306: the data sheet of a device.
    Eds,
    /// CiA 306: a configured device.
    Dcf,
    /// CiA 311: the data sheet of a device.
    Xdd,
    /// CiA 311: a configured device.
    Xdc,
}

impl Format {
    /// The format by the extension of a file. An XPD, which describes a part of a device, counts as an XDD.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "eds" => Self::Eds,
            "dcf" => Self::Dcf,
            "xdd" | "xpd" => Self::Xdd,
            "xdc" => Self::Xdc,
            _ => return None,
        })
    }

    /// The text of a device in this format.
    #[must_use]
    pub fn write(self, device: &Device) -> String {
        match self {
            Self::Eds => write::eds(device),
            Self::Dcf => write::dcf(device),
            Self::Xdd => xdd::xdd(device),
            Self::Xdc => xdd::xdc(device),
        }
    }
}

/// What the text loses of the device, found by reading the text again: one line for each loss.
#[must_use]
pub fn losses(device: &Device, text: &str) -> Vec<String> {
    let read = crate::device(&Input::new(Source::new("", text)));
    let mut by_key: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for said in difference(&write::dcf(&read), &write::dcf(device)) {
        by_key.entry(said.key).or_default().push(format!("[{}]", said.section));
    }
    for ((what, mut places), (_, kept)) in beyond(device).into_iter().zip(beyond(&read)) {
        places.retain(|place| !kept.contains(place));
        if !places.is_empty() {
            by_key.insert(what.to_owned(), places);
        }
    }
    by_key.into_iter().map(|(what, places)| format!("{what} of {}", shortened(&places))).collect()
}

/// What CiA 306 has no key for, each with the objects and entries that have it.
fn beyond(device: &Device) -> Vec<(&'static str, Vec<String>)> {
    let entries = |has: fn(&Entry) -> bool| -> Vec<String> {
        device
            .entries()
            .filter(|entry| has(entry))
            .map(|entry| format!("{:04X}:{:02X}", entry.index, entry.sub))
            .collect()
    };
    let objects = |has: fn(&Object) -> bool| -> Vec<String> {
        device.objects.iter().filter(|object| has(object)).map(|object| format!("{:04X}", object.index)).collect()
    };
    vec![
        ("the unit", entries(|entry| matches!(entry.meaning, Meaning::Quantity(_)))),
        ("the enumeration", entries(|entry| matches!(entry.meaning, Meaning::Enumeration(_)))),
        ("the bit field", entries(|entry| matches!(entry.meaning, Meaning::BitField(_)))),
        ("the conditional limits", entries(|entry| !entry.ranges.is_empty())),
        ("the order of characters", entries(|entry| entry.first_character_high)),
        ("being persistent", entries(|entry| entry.persistent)),
        ("not being simulated", entries(|entry| entry.not_simulated.is_some())),
        ("the NMT states", entries(|entry| entry.writable_in.is_some())),
        ("the description", entries(|entry| entry.description.is_some())),
        ("the description as a whole", objects(|object| object.kind.has_subs() && object.description.is_some())),
        ("the properties", entries(|entry| entry.properties.is_some())),
        ("the properties as a whole", objects(|object| object.properties.is_some())),
        ("the parameters", device.interfaces.keys().map(|name| format!("the interface {name}")).collect()),
        ("writing four bytes", device.sdo_writes_four_bytes.then(|| "every SDO".to_owned()).into_iter().collect()),
        ("the mapping", device.pdos.iter().map(|pdo| format!("{:?} PDO {}", pdo.direction, pdo.number)).collect()),
    ]
}

fn shortened(places: &[String]) -> String {
    const SHOWN: usize = 3;
    match places.len().checked_sub(SHOWN).filter(|more| *more > 0) {
        Some(more) => format!("{} and {more} more", places[..SHOWN].join(", ")),
        None => places.join(", "),
    }
}
