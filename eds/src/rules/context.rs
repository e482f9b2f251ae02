//! What rules look at, with its places, and words that rules share.

use crate::model::keys::Key;
use crate::model::types::DataType;
use crate::model::{Device, Direction, Entry, Mapped, Object, Pdo, Value};
use crate::overlay::{Changes, Extra};
use crate::parse::facts::{Facts, ObjectFacts};
use crate::parse::section::{ObjectPart, SectionKind};
use crate::patch::Patch;
use crate::text::Span;
use lexican_cia::cia301;

/// What a rule looks at.
pub(super) struct Context<'a> {
    pub(super) device: &'a Device,
    pub(super) facts: &'a Facts<'a>,
    pub(super) changes: &'a Changes,
}

impl<'a> Context<'a> {
    /// The objects with the facts about them.
    pub(super) fn objects(&self) -> impl Iterator<Item = (&'a Object, &'a ObjectFacts)> {
        self.device.objects.iter().zip(&self.facts.objects)
    }

    /// All mapped objects, each with its PDO and its number (from 1) in the mapping.
    pub(super) fn mapped(&self) -> impl Iterator<Item = (&'a Pdo, u8, Mapped)> {
        let of_pdo = |pdo: &'a Pdo| pdo.mapping.iter().zip(1..).map(move |(&mapped, number)| (pdo, number, mapped));
        self.device.pdos.iter().flat_map(of_pdo)
    }

    /// The place of a key's value in a section that occurs once.
    pub(super) fn value_in(&self, kind: SectionKind, key: &str) -> Option<Span> {
        let pair = self.facts.section(kind)?.get(key)?;
        Some(self.facts.syntax.value_span(pair))
    }

    /// The place of a key's value in `[DeviceInfo]`.
    pub(super) fn device_info(&self, key: &str) -> Option<Span> {
        self.value_in(SectionKind::DeviceInfo, key)
    }

    /// The place of a section's name, or of the whole file without that section.
    pub(super) fn section_span(&self, kind: SectionKind) -> Span {
        self.facts.section(kind).map_or(Span::eds(0, 0), |section| self.facts.syntax.name_span(section))
    }

    /// The place of an entry of a PDO mapping; `number` 0 is the count.
    pub(super) fn mapping_span(&self, pdo: &Pdo, number: u8) -> Span {
        let object = self.device.object(pdo.direction.mapping_parameter(pdo.number));
        self.parameter_span(pdo, object, number, |pdo| !pdo.mapping.is_empty())
    }

    /// The place of an entry of the communication parameter.
    pub(super) fn pdo_span(&self, pdo: &Pdo, sub: u8) -> Span {
        let object = self.device.object(pdo.direction.communication_parameter(pdo.number));
        self.parameter_span(pdo, object, sub, |pdo| pdo.transmission_type.is_some() || pdo.cob_id.is_some())
    }

    /// Whether an overlay describes the PDO.
    pub(super) fn is_extra(&self, pdo: &Pdo) -> bool {
        self.changes.pdos.iter().any(|extra| same_pdo(extra, pdo))
    }

    fn parameter_span(&self, pdo: &Pdo, object: Option<&Object>, sub: u8, says: impl Fn(&Pdo) -> bool) -> Span {
        let says = |extra: &&Extra| same_pdo(extra, pdo) && says(&extra.pdo);
        if let Some(extra) = self.changes.pdos.iter().rev().find(says) {
            return extra.span;
        }
        let Some(object) = object else { return Span::default() };
        object.entry(sub).map_or(object.span, |entry| self.entry_span(entry, held_by(entry)))
    }

    /// The place of a key's value in the section of an object or entry, or of the section's name without that key.
    pub(super) fn value_span(&self, of: Span, key: Key) -> Span {
        let syntax = &self.facts.syntax;
        let pair = syntax.section_at(of).and_then(|section| section.get(key.name()));
        pair.map_or(of, |pair| syntax.value_span(pair))
    }

    /// The place of a key's value for an entry: in the overlay that corrects it, or in `[2000Value]` and the like if
    /// its value is there.
    pub(super) fn entry_span(&self, entry: &Entry, key: Key) -> Span {
        let corrected = self.changes.correction(entry.index, entry.sub, key);
        corrected.or_else(|| self.in_table(entry, key)).unwrap_or_else(|| self.value_span(entry.span, key))
    }

    fn in_table(&self, entry: &Entry, key: Key) -> Option<Span> {
        let part = match key {
            Key::ParameterName => ObjectPart::Names,
            Key::ParameterValue => ObjectPart::Values,
            Key::Denotation => ObjectPart::Denotations,
            _ => return None,
        };
        let section = self.facts.table(entry.index, part)?;
        let is_of_entry = |key: &str| key.trim().parse() == Ok(entry.sub);
        let pair = section.pairs.iter().find(|pair| is_of_entry(pair.key))?;
        Some(self.facts.syntax.value_span(pair))
    }

    /// A patch that sets a key in the section of an entry; `None` if the entry has no section of its own or an overlay
    /// corrects that key.
    pub(super) fn set_own(&self, entry: &Entry, key: Key, value: &str) -> Option<Patch> {
        let section = self.facts.syntax.section_at(entry.span)?;
        let own = match section.kind {
            SectionKind::Object(_, ObjectPart::Sub(_)) => true,
            _ => !self.device.object(entry.index)?.kind.has_subs(),
        };
        let corrected = self.changes.correction(entry.index, entry.sub, key).is_some();
        (own && !corrected).then(|| Patch::from_iter([self.set_in(section, key.name(), value)]))
    }

    /// The object or entry that a place in the data sheet or in an overlay is about.
    pub(super) fn address_of(&self, span: Span) -> Option<(u16, Option<u8>)> {
        let at = || self.changes.corrections.iter().find(|correction| correction.span == span);
        self.facts.address_of(span).or_else(|| at().map(|correction| (correction.index, Some(correction.sub))))
    }

    /// The number (from 1) and the text of the data sheet's line with this place.
    pub(super) fn line(&self, span: Span) -> Option<(u32, &'a str)> {
        let source = self.facts.syntax.source;
        let line = source.position(span.start).line;
        (span.source == 0).then(|| (line, source.line(line as usize - 1)))
    }

    /// The address of an entry in overlays: `2000`, `2000:01`.
    pub(super) fn address(&self, entry: &Entry) -> String {
        match self.device.object(entry.index) {
            Some(object) if !object.kind.has_subs() => format!("{:04X}", entry.index),
            _ => place(entry),
        }
    }

    /// Whether a PDO of the data sheet maps the entry.
    pub(super) fn is_mapped(&self, entry: &Entry) -> bool {
        self.mapped().any(|(_, _, mapped)| (mapped.index, mapped.sub) == (entry.index, entry.sub))
    }

    /// The smallest and the largest number of a data type. For a type that the device defines, the sign is unknown, so
    /// both are included.
    pub(super) fn range(&self, data_type: DataType) -> Option<(i128, i128)> {
        let defined = || self.device.bits(data_type).map(|bits| (-(1 << (bits - 1)), (1 << bits) - 1));
        data_type.range().or_else(|| matches!(data_type, DataType::Other(_)).then(defined)?)
    }

    /// Whether a value is in the range of a data type for every node-ID.
    pub(super) fn fits(&self, data_type: DataType, value: Option<&Value>) -> bool {
        let range = self.range(data_type);
        let within = |low: i128, high: i128| range.is_none_or(|range| range.0 <= low && high <= range.1);
        match value {
            Some(&Value::Integer(value)) => within(value, value),
            Some(&Value::NodeIdPlus(offset)) => within(i128::from(offset) + 1, i128::from(offset) + 127),
            Some(&Value::Real(value)) => data_type != DataType::Real32 || (value as f32).is_finite(),
            Some(Value::Text(_) | Value::Bytes(_)) | None => true,
        }
    }

    /// Whether `value` could be the default: it fits data type and limits, and does not turn a configured value into
    /// one that cannot be downloaded.
    pub(super) fn can_default(&self, entry: &Entry, value: i128) -> bool {
        let limit = |limit: &Option<Value>| limit.as_ref().and_then(Value::as_integer);
        let within =
            limit(&entry.low).is_none_or(|low| low <= value) && limit(&entry.high).is_none_or(|high| value <= high);
        let downloads = entry.configured.is_none() || entry.access.writable();
        within && downloads && self.fits(entry.data_type, Some(&Value::Integer(value)))
    }

    /// Whether all values of an entry fit another integer type, and no PDO depends on its length.
    pub(super) fn can_become(&self, entry: &Entry, data_type: DataType) -> bool {
        let values = [&entry.default, &entry.configured, &entry.low, &entry.high];
        let integers = data_type.range().is_some() && entry.data_type.range().is_some();
        integers && !self.is_mapped(entry) && values.into_iter().all(|value| self.fits(data_type, value.as_ref()))
    }
}

fn same_pdo(extra: &Extra, pdo: &Pdo) -> bool {
    (extra.pdo.direction, extra.pdo.number) == (pdo.direction, pdo.number)
}

/// The key that holds the value of an entry.
pub(super) fn held_by(entry: &Entry) -> Key {
    if entry.configured.is_some() { Key::ParameterValue } else { Key::DefaultValue }
}

/// `2000:01`.
pub(super) fn place(entry: &Entry) -> String {
    format!("{:04X}:{:02X}", entry.index, entry.sub)
}

/// Whether a mapped object is a data type, which leaves a gap.
pub(super) fn is_dummy(mapped: Mapped) -> bool {
    mapped.index < 0x20 && mapped.sub == 0
}

/// `RPDO 1`, `TPDO 512`.
pub(super) fn pdo_name(pdo: &Pdo) -> String {
    let direction = if pdo.direction == Direction::Receive { "RPDO" } else { "TPDO" };
    format!("{direction} {}", pdo.number)
}

/// Mask of the 29-bit identifier in a COB-ID parameter.
pub(super) const IDENTIFIER: i128 = cia301::IDENTIFIER as i128;
/// Mask of the 11-bit identifier.
pub(super) const BASE_IDENTIFIER: i128 = cia301::BASE_IDENTIFIER as i128;
/// The bit that makes the identifier one of 29 bits.
pub(super) const EXTENDED: i128 = cia301::EXTENDED as i128;
/// The bit that disables the COB-ID.
pub(super) const INVALID: i128 = cia301::INVALID as i128;

/// `1 key`, `2 keys`, `2 entries`.
pub(super) fn plural(count: usize, word: &str) -> String {
    match word {
        _ if count == 1 => format!("1 {word}"),
        "entry" => format!("{count} entries"),
        "sub-index" => format!("{count} sub-indices"),
        _ => format!("{count} {word}s"),
    }
}

/// `2000`, `2000 and 2001`, `2000, 2001, 2002 and 17 more`.
pub(super) fn listed<T>(things: &[T], word: impl Fn(&T) -> String) -> String {
    const SHOWN: usize = 6;
    let words = |things: &[T]| things.iter().map(&word).collect::<Vec<_>>().join(", ");
    match things {
        [] => String::new(),
        [only] => word(only),
        [first @ .., last] if things.len() <= SHOWN => format!("{} and {}", words(first), word(last)),
        _ => format!("{} and {} more", words(&things[..SHOWN - 1]), things.len() - (SHOWN - 1)),
    }
}

/// `is 1 key`, `are 2 keys`.
pub(super) fn are(count: usize, word: &str) -> String {
    format!("{} {}", if count == 1 { "is" } else { "are" }, plural(count, word))
}
