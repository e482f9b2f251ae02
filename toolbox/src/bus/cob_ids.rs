//! COB-IDs in the notation of users.

use std::ops::RangeInclusive;
use std::str::FromStr;

use lexican_runtime::CobId;

/// Identifiers: `185,280-28F,00000185`, in hexadecimal; eight digits are an extended one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CobIds(Vec<RangeInclusive<CobId>>);

impl CobIds {
    /// Whether an identifier is among them.
    #[must_use]
    pub fn contains(&self, id: CobId) -> bool {
        self.0.iter().any(|range| range.contains(&id))
    }
}

impl FromStr for CobIds {
    type Err = InvalidIds;

    fn from_str(text: &str) -> Result<Self, InvalidIds> {
        let range = |word: &str| {
            let (first, last) = word.split_once('-').unwrap_or((word, word));
            let (first, last) = (cob_id(first)?, cob_id(last)?);
            (first <= last && first.is_extended() == last.is_extended()).then_some(first..=last)
        };
        let ranges: Option<Vec<_>> = text.split(',').map(|word| range(word.trim())).collect();
        ranges.map(CobIds).ok_or_else(|| InvalidIds { text: text.to_owned() })
    }
}

fn cob_id(word: &str) -> Option<CobId> {
    let number = crate::log::number::hex(word)?;
    match word.len() {
        1..=3 => CobId::standard(u16::try_from(number).ok()?),
        8 => CobId::extended(number),
        _ => None,
    }
}

/// The text does not name COB-IDs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` names no identifiers; write 185,280-28F in hexadecimal, with eight digits for extended ones")]
pub struct InvalidIds {
    /// The text.
    pub text: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_lists_of_ranges() {
        let ids = |text: &str| text.parse::<CobIds>().unwrap();
        let (standard, extended) = (CobId::standard(0x185).unwrap(), CobId::extended(0x185).unwrap());
        assert!(ids("80,181-1FF").contains(standard) && !ids("80,181-184").contains(standard));
        assert!(ids("00000180-000001FF").contains(extended) && !ids("00000180-000001FF").contains(standard));
        for text in ["", "185,", "800", "1F-10", "180-00000200", "0185", "+18", "20000000"] {
            assert!(text.parse::<CobIds>().is_err(), "{text:?}");
        }
    }
}
