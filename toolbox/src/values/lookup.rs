//! Resolves objects as users name them: by address, by path, or by name.

use lexican_eds::model::{Device, Entry, Object};
use lexican_runtime::cia301;
use lexican_runtime::object::Address;

use crate::values::text::parse_hex;
use crate::values::{address, name};

/// Why a text does not name an object.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum ObjectError {
    /// It is no address, and names need a data sheet.
    #[error("{text:?} is not an address such as 6064 or 2410:05")]
    NoDataSheet { text: String },
    /// It looks like an address, but is not valid.
    #[error("{text:?} is not an address such as 6064 or 2410:05")]
    Malformed { text: String },
    /// The data sheet has no object of this name.
    #[error("the data sheet names no object {text:?}")]
    Unknown {
        text: String,
        /// Entries with similar names, the most similar first.
        similar: Vec<String>,
    },
    /// Several entries have this name.
    #[error("{text:?} is the name of several entries")]
    Ambiguous { text: String, entries: Vec<String> },
}

impl ObjectError {
    /// What to do about it.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            ObjectError::NoDataSheet { .. } => "names are resolved if --device gives the device of the node".to_owned(),
            ObjectError::Malformed { .. } => {
                "an address has four hexadecimal digits, from 1000 on, and two after the colon".to_owned()
            }
            ObjectError::Unknown { similar, .. } if similar.is_empty() => {
                "`lexican eds dump` lists the objects of a data sheet".to_owned()
            }
            ObjectError::Unknown { similar, .. } => format!("did you mean {}?", similar.join(" or ")),
            ObjectError::Ambiguous { entries, .. } => entries.join("; "),
        }
    }
}

/// Resolves an entry by address (`6064`, `2410:05`, `0x1018:1`), by path (`2410/5`, `2410/v-Pos`, `Motor Parameter
/// Set/v-Pos`), or by name ("Position Actual Value").
///
/// Errors: [`ObjectError`] also if several entries have the name.
pub fn resolve(device: Option<&Device>, text: &str) -> Result<Address, ObjectError> {
    if let Some(address) = parse_address(text) {
        return Ok(address);
    }
    let text = text.to_owned();
    let Some(device) = device else { return Err(ObjectError::NoDataSheet { text }) };
    if let Some(address) = parse_path(device, &text) {
        return Ok(address);
    }
    let wanted = plain(&text);
    let found: Vec<_> = device.entries().filter(|entry| names(device, entry).contains(&wanted)).collect();
    match found.as_slice() {
        [entry] => Ok(address(entry)),
        [] if is_like_an_address(&text) => Err(ObjectError::Malformed { text }),
        [] => Err(ObjectError::Unknown { text, similar: similar(device, &wanted) }),
        several => {
            let entries = several.iter().map(|entry| describe(device, entry)).collect();
            Err(ObjectError::Ambiguous { text, entries })
        }
    }
}

/// As [`resolve`], but an index alone, or the name of a record or array, means all its entries.
pub fn resolve_all(device: Option<&Device>, text: &str) -> Result<Vec<Address>, ObjectError> {
    let whole = |object: &Object| object.entries.iter().map(address).collect();
    let object = device.and_then(|device| match parse_index(text) {
        Some(index) => device.object(index),
        None => named(device, text),
    });
    match resolve(device, text) {
        Ok(entry) => match object.filter(|object| object.index == entry.index() && parse_index(text).is_some()) {
            Some(object) => Ok(whole(object)),
            None => Ok(vec![entry]),
        },
        Err(error) => object.map(whole).ok_or(error),
    }
}

/// The object with this name, if there is only one.
fn named<'a>(device: &'a Device, text: &str) -> Option<&'a Object> {
    let wanted = plain(text);
    let mut same = device.objects.iter().filter(|object| plain(&object.name) == wanted);
    same.next().filter(|_| same.next().is_none())
}

/// `Motor Parameter Set/5`, `2410/v-Pos`: an object by index or name, and an entry by sub-index or name.
fn parse_path(device: &Device, text: &str) -> Option<Address> {
    let (object, entry) = text.rsplit_once('/')?;
    let object = match parse_index(object) {
        Some(index) => device.object(index)?,
        None => named(device, object)?,
    };
    let wanted = plain(entry);
    let mut same = object.entries.iter().filter(|entry| plain(&entry.name) == wanted);
    let by_name = same.next().filter(|_| same.next().is_none());
    by_name.map(address).or_else(|| Some(Address::new(object.index, parse_hex(entry, 2)? as u8)))
}

/// `2410:05 Motor Parameter Set, v-Pos`.
pub fn describe(device: &Device, entry: &Entry) -> String {
    format!("{} {}", address(entry), name(device, entry))
}

fn parse_address(text: &str) -> Option<Address> {
    let (index, sub) = text.split_once([':', '/']).unwrap_or((text, "0"));
    Some(Address::new(parse_index(index)?, parse_hex(sub, 2)? as u8))
}

/// Objects begin at 1000h; a lower number is a mistake.
fn parse_index(text: &str) -> Option<u16> {
    parse_hex(text, 4).filter(|index| *index >= cia301::COMMUNICATION.start)
}

/// Whether a text is probably meant as an address.
fn is_like_an_address(text: &str) -> bool {
    let letters = |letter: char| letter.is_ascii_hexdigit() || matches!(letter, ':' | 'x' | 'X' | 'h' | 'H');
    text.starts_with(|first: char| first.is_ascii_digit()) && text.chars().all(letters)
}

/// The names of an entry: its own, and with the name of its object before it.
fn names(device: &Device, entry: &Entry) -> Vec<String> {
    let mut names = vec![plain(&entry.name)];
    names.extend(device.object(entry.index).map(|object| plain(&object.name) + &plain(&entry.name)));
    names
}

/// Whether names are equal except for case, blanks and punctuation: `vendor-id` and `Vendor ID`.
#[must_use]
pub fn same_name(one: &str, other: &str) -> bool {
    plain(one) == plain(other)
}

/// Letters and digits in lower case, in which `Position actual value`, `position-actual-value` and
/// `POSITION_ACTUAL_VALUE` are equal.
fn plain(text: &str) -> String {
    text.chars().filter(|letter| letter.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// At most three entries with the most similar names.
fn similar(device: &Device, wanted: &str) -> Vec<String> {
    let mut near: Vec<_> = device
        .entries()
        .map(|entry| {
            let nearness = names(device, entry).iter().map(|name| nearness(name, wanted)).fold(0.0, f64::max);
            (nearness, entry)
        })
        .filter(|(nearness, _)| *nearness > 0.8)
        .collect();
    near.sort_by(|one, two| two.0.total_cmp(&one.0));
    near.into_iter().take(3).map(|(_, entry)| describe(device, entry)).collect()
}

fn nearness(name: &str, wanted: &str) -> f64 {
    if wanted.len() > 3 && name.contains(wanted) { 0.99 } else { strsim::jaro_winkler(name, wanted) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::drive;

    #[test]
    fn addresses_and_names_are_resolved() {
        let device = drive();
        for (text, found) in [
            ("6064", "6064:00"),
            ("0x6064:0", "6064:00"),
            ("2410:05", "2410:05"),
            ("1018h:1", "1018:01"),
            ("Position Actual Value", "6064:00"),
            ("position-actual-value", "6064:00"),
            ("controlword", "6040:00"),
            ("2410/5", "2410:05"),
            ("0x2410/05", "2410:05"),
            ("2410/v-pos", "2410:05"),
            ("Motor Parameter Set/5", "2410:05"),
            ("motor parameter set/v-Pos", "2410:05"),
        ] {
            let address = resolve(Some(&device), text).map(|address| address.to_string());
            assert_eq!(address.ok().as_deref(), Some(found), "{text}");
        }
    }

    #[test]
    fn an_index_and_the_name_of_a_record_are_all_of_its_entries() {
        let device = drive();
        let all = |text: &str| {
            let entries = resolve_all(Some(&device), text).unwrap();
            (entries[0].to_string(), entries.len())
        };
        let entries = device.object(0x2410).unwrap().entries.len();
        assert!(entries > 5);
        for (text, first, len) in [
            ("2410", "2410:00", entries),
            ("Motor Parameter Set", "2410:00", entries),
            ("2410:00", "2410:00", 1),
            ("2410/5", "2410:05", 1),
            ("6064", "6064:00", 1),
            ("Position Actual Value", "6064:00", 1),
            ("2FFF", "2FFF:00", 1),
        ] {
            assert_eq!(all(text), (first.to_owned(), len), "{text}");
        }
        assert_eq!(resolve_all(None, "2410").unwrap(), [Address::new(0x2410, 0)]);
        assert!(resolve_all(Some(&device), "60").is_err());
    }

    #[test]
    fn other_texts_are_refused() {
        for text in
            ["", "60", "60640", "6064:100", "6064:", "no such thing", "6064:0:0", "2410/zz", "2410/", "no set/1"]
        {
            assert!(resolve(Some(&drive()), text).is_err(), "{text}");
        }
        assert!(resolve(None, "controlword").is_err());
        let advice = |text| resolve(Some(&drive()), text).unwrap_err().advice();
        for text in ["60", "60640", "6064:100", "6064:", "0x60", "6064:0:0"] {
            assert!(advice(text).contains("four hexadecimal digits"), "{text}");
        }
        assert!(advice("2nd target").contains("eds dump"));
    }

    #[test]
    fn a_misspelt_name_finds_its_object() {
        let near = |wanted| similar(&drive(), wanted);
        assert!(near("positionactualvalu")[0].starts_with("6064:00"));
        assert!(near("actualvalue").iter().any(|entry| entry.starts_with("606C:00")));
        assert!(near("qqq").is_empty());
    }
}
