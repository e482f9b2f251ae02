//! Objects on the command line: by address or by name.

use lexican_eds::model::{Device, Entry};
use lexican_runtime::cia301;
use lexican_runtime::object::Address;

use crate::output::Failure;
use crate::values::text::parse_hex;
use crate::values::{address, name};

/// Resolves `6064`, `2410:05`, `0x1018:1`, or a name such as "Position Actual Value".
pub(crate) fn resolve(device: Option<&Device>, text: &str) -> Result<Address, Failure> {
    if let Some(address) = parse_address(text) {
        return Ok(address);
    }
    let no_address = || Failure::new(format_args!("{text:?} is not an address such as 6064 or 2410:05"));
    let Some(device) = device else {
        return Err(no_address().help("names are resolved if --device gives the device of the node"));
    };
    let wanted = plain(text);
    let found: Vec<_> = device.entries().filter(|entry| names(device, entry).contains(&wanted)).collect();
    match found.as_slice() {
        [entry] => Ok(address(entry)),
        [] if is_like_an_address(text) => {
            Err(no_address().help("an address has four hexadecimal digits, from 1000 on, and two after the colon"))
        }
        [] => Err(Failure::new(format_args!("the data sheet names no object {text:?}")).help(advice(device, &wanted))),
        several => {
            let list: Vec<_> = several.iter().map(|entry| describe(device, entry)).collect();
            Err(Failure::new(format_args!("{text:?} is the name of several entries")).help(list.join("; ")))
        }
    }
}

/// `2410:05 Motor Parameter Set, v-Pos`.
pub(crate) fn describe(device: &Device, entry: &Entry) -> String {
    format!("{} {}", address(entry), name(device, entry))
}

fn parse_address(text: &str) -> Option<Address> {
    let (index, sub) = text.split_once(':').unwrap_or((text, "0"));
    // 1000h is the lowest index of an object; a shorter number is a mistake.
    let index = parse_hex(index, 4).filter(|index| *index >= cia301::COMMUNICATION.start)?;
    Some(Address::new(index, parse_hex(sub, 2)? as u8))
}

/// Whether a text is probably a mistyped address.
fn is_like_an_address(text: &str) -> bool {
    let letters = |letter: char| letter.is_ascii_hexdigit() || matches!(letter, ':' | 'x' | 'X' | 'h' | 'H');
    text.starts_with(|first: char| first.is_ascii_digit()) && text.chars().all(letters)
}

/// The names of an entry: its own, and that after the name of its object.
fn names(device: &Device, entry: &Entry) -> Vec<String> {
    let mut names = vec![plain(&entry.name)];
    names.extend(device.object(entry.index).map(|object| plain(&object.name) + &plain(&entry.name)));
    names
}

/// Letters and digits in lower case: `Position actual value`, `position-actual-value` and
/// `POSITION_ACTUAL_VALUE` are the same name.
fn plain(text: &str) -> String {
    text.chars().filter(|letter| letter.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

fn advice(device: &Device, wanted: &str) -> String {
    let mut near: Vec<_> = device
        .entries()
        .map(|entry| {
            let nearness = names(device, entry).iter().map(|name| nearness(name, wanted)).fold(0.0, f64::max);
            (nearness, describe(device, entry))
        })
        .filter(|(nearness, _)| *nearness > 0.8)
        .collect();
    near.sort_by(|one, two| two.0.total_cmp(&one.0));
    let near: Vec<_> = near.into_iter().take(3).map(|(_, text)| text).collect();
    match near.is_empty() {
        true => "`lexican eds dump` lists the objects of a data sheet".to_owned(),
        false => format!("did you mean {}?", near.join(" or ")),
    }
}

fn nearness(name: &str, wanted: &str) -> f64 {
    if wanted.len() > 3 && name.contains(wanted) { 0.99 } else { strsim::jaro_winkler(name, wanted) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::samples::drive;

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
        ] {
            let address = resolve(Some(&device), text).map(|address| address.to_string());
            assert_eq!(address.ok().as_deref(), Some(found), "{text}");
        }
    }

    #[test]
    fn other_texts_are_refused() {
        for text in ["", "60", "60640", "6064:100", "6064:", "no such thing", "6064:0:0"] {
            assert!(resolve(Some(&drive()), text).is_err(), "{text}");
        }
        assert!(resolve(None, "controlword").is_err());
        let advice = |text| resolve(Some(&drive()), text).unwrap_err().words().1.unwrap_or_default().to_owned();
        for text in ["60", "60640", "6064:100", "6064:", "0x60", "6064:0:0"] {
            assert!(advice(text).contains("four hexadecimal digits"), "{text}");
        }
        assert!(advice("2nd target").contains("eds dump"));
    }

    #[test]
    fn a_misspelt_name_finds_its_object() {
        assert!(advice(&drive(), "positionactualvalu").contains("6064:00"));
        assert!(advice(&drive(), "actualvalue").contains("606C:00"));
        assert!(advice(&drive(), "qqq").contains("eds dump"));
    }
}
