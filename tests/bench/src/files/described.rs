//! What a file describes, by a count that knows nothing of any reader.

use std::collections::{BTreeMap, BTreeSet};

/// Index and sub-index of a value.
pub(super) type Address = (u16, u8);

/// What a reader makes of a file; `None` when it refuses it.
pub(super) type Reading = Option<BTreeSet<Address>>;

/// The values that the sections `[xxxx]` and `[xxxxsubN]` of a data sheet stand for. An object whose elements
/// are described has no value of its own, nor has an ARRAY or RECORD; `CompactSubObj` stands for sub-index 0
/// and so many more, of which 254 is the last (CiA 301, 7.4.4).
pub(super) fn described(text: &str) -> BTreeSet<Address> {
    let mut objects: BTreeMap<u16, Object> = BTreeMap::new();
    let mut values = BTreeSet::new();
    let mut open = None;
    for line in text.split(['\r', '\n']).map(str::trim) {
        if let Some(name) = line.strip_prefix('[') {
            let name: String = name.split(']').next().unwrap_or_default().split_whitespace().collect();
            let name = name.to_ascii_lowercase();
            open = None;
            if let Some((index, sub)) = name.split_once("sub") {
                if let (Some(index), Some(sub)) = (hex(index, 4), hex(sub, 2)) {
                    values.insert((index, u8::try_from(sub).expect("two digits")));
                    objects.entry(index).or_default().has_elements = true;
                }
            } else if let Some(index) = hex(&name, 4) {
                objects.entry(index).or_default();
                open = Some(index);
            }
        } else if let (Some(index), Some((key, value))) = (open, line.split_once('=')) {
            let object = objects.entry(index).or_default();
            let (key, number) = (key.trim().to_ascii_lowercase(), number(value.trim()));
            match (&*key, number) {
                ("objecttype", Some(8 | 9)) => object.has_elements = true,
                ("compactsubobj", Some(elements @ 1..)) => {
                    values.extend((0..=elements.min(254)).map(|sub| (index, sub)));
                    object.has_elements = true;
                }
                _ => {}
            }
        }
    }
    values.extend(objects.iter().filter(|(_, object)| !object.has_elements).map(|(index, _)| (*index, 0)));
    values
}

#[derive(Default)]
struct Object {
    has_elements: bool,
}

fn hex(text: &str, most: usize) -> Option<u16> {
    let digits = (1..=most).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    u16::from_str_radix(text, 16).ok().filter(|_| digits)
}

fn number(text: &str) -> Option<u8> {
    match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) => u8::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}
