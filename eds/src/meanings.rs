//! Adds the meanings that CiA 301 and CiA 402 give to numbers, where the overlay gives none and the object has the data
//! type of the standard.

use std::collections::BTreeMap;

use crate::model::{self, BitField, Bits, Device, Enumeration, Named};
use crate::standard::{self, Meaning, Numbers};
use crate::text::Span;

/// A copy of the device with the meanings of the standards.
#[must_use]
pub fn complete(device: &Device) -> Device {
    let mut device = device.clone();
    let mut objects = std::mem::take(&mut device.objects);
    // Several objects may share one meaning.
    let mut names: BTreeMap<&str, String> = BTreeMap::new();
    for object in &mut objects {
        let Some(standard) = standard::object(object.index, device.profile) else { continue };
        let Some(meaning) = standard.meaning else { continue };
        let elements = standard.kind.has_subs();
        for entry in object.entries.iter_mut().filter(|entry| (entry.sub > 0) == elements) {
            if standard.data_type(entry.sub) == Some(entry.data_type) && entry.meaning == model::Meaning::Plain {
                let name =
                    names.entry(meaning.name).or_insert_with(|| define(&mut device, meaning, entry.span)).clone();
                entry.meaning = match meaning.numbers {
                    Numbers::Values(_) => model::Meaning::Enumeration(name),
                    Numbers::Bits(_) => model::Meaning::BitField(name),
                };
            }
        }
    }
    device.objects = objects;
    device
}

/// Adds a meaning and returns its name: a different one if the overlay uses the standard's name for something else.
fn define(device: &mut Device, meaning: &Meaning, span: Span) -> String {
    fn named<T>(name: &str, value: T) -> Named<T> {
        Named { name: name.into(), description: None, value }
    }
    let is_known = device.enumerations.contains_key(meaning.name)
        || device.bit_fields.contains_key(meaning.name)
        || device.quantities.contains_key(meaning.name);
    let name = if is_known { format!("{} standard", meaning.name) } else { meaning.name.to_owned() };
    let description = Some(meaning.description.to_owned());
    match meaning.numbers {
        Numbers::Values(values) => {
            let values = values.iter().map(|&(value, name)| named(name, value)).collect();
            device.enumerations.insert(name.clone(), Enumeration { description, values, is_hex: false, span });
        }
        Numbers::Bits(fields) => {
            let fields = fields.iter().map(|&(low, high, name)| named(name, Bits { low, high })).collect();
            device
                .bit_fields
                .insert(name.clone(), BitField { description, fields, not_simulated: BTreeMap::new(), span });
        }
    }
    name
}
