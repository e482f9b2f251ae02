//! What rules look at, and where it is written.

use crate::eds::Facts;
use crate::model::{Device, Entry, Mapped, Object, Pdo};
use crate::object::{Key, ObjectFacts};
use crate::overlay::{Changes, Extra};
use crate::section::SectionKind;
use crate::source::Span;

/// What a rule looks at.
pub(crate) struct Context<'a> {
    pub(crate) device: &'a Device,
    pub(crate) facts: &'a Facts<'a>,
    pub(crate) changes: &'a Changes,
}

impl<'a> Context<'a> {
    /// The objects with what is known of them beyond the model.
    pub(super) fn objects(&self) -> impl Iterator<Item = (&'a Object, &'a ObjectFacts)> {
        self.device.objects.iter().zip(&self.facts.objects)
    }

    /// All mappings: the PDO, the number of the mapping from 1, and what is mapped.
    pub(super) fn mapped(&self) -> impl Iterator<Item = (&'a Pdo, u8, Mapped)> {
        let of_pdo = |pdo: &'a Pdo| pdo.mapping.iter().zip(1..).map(move |(&mapped, number)| (pdo, number, mapped));
        self.device.pdos.iter().flat_map(of_pdo)
    }

    /// The place of a key's value in `[DeviceInfo]`.
    pub(super) fn device_info(&self, key: &str) -> Option<Span> {
        let pair = self.facts.section(SectionKind::DeviceInfo)?.get(key)?;
        Some(self.facts.syntax.value_span(pair))
    }

    /// The place of a mapping; that of the number of mappings for 0.
    pub(super) fn mapping_span(&self, pdo: &Pdo, number: u8) -> Span {
        let object = self.device.object(crate::pdo::mapping_parameter(pdo.direction, pdo.number));
        self.parameter_span(pdo, object, number, |pdo| !pdo.mapping.is_empty())
    }

    /// The place of an entry of the communication parameter.
    pub(super) fn pdo_span(&self, pdo: &Pdo, sub: u8) -> Span {
        let object = self.device.object(crate::pdo::communication_parameter(pdo.direction, pdo.number));
        self.parameter_span(pdo, object, sub, |pdo| pdo.transmission_type.is_some() || pdo.cob_id.is_some())
    }

    pub(super) fn cob_id_span(&self, pdo: &Pdo) -> Span {
        self.pdo_span(pdo, 1)
    }

    fn parameter_span(&self, pdo: &Pdo, object: Option<&Object>, sub: u8, says: impl Fn(&Pdo) -> bool) -> Span {
        let same = |extra: &&Extra| (extra.pdo.direction, extra.pdo.number) == (pdo.direction, pdo.number);
        if let Some(extra) = self.changes.pdos.iter().rev().find(|extra| same(extra) && says(&extra.pdo)) {
            return extra.span;
        }
        let Some(object) = object else { return Span::default() };
        let Some(entry) = object.entry(sub) else { return object.span };
        let key = if entry.configured.is_some() { Key::ParameterValue } else { Key::DefaultValue };
        self.entry_span(entry, key)
    }

    /// The place of a key's value in the section of an object or entry; the name of the section without that key.
    pub(super) fn value_span(&self, of: Span, key: Key) -> Span {
        let syntax = &self.facts.syntax;
        let pair = syntax.section_at(of).and_then(|section| section.get(key.name()));
        pair.map_or(of, |pair| syntax.value_span(pair))
    }

    /// The place of a key's value of an entry; in the overlay when that corrects it.
    pub(super) fn entry_span(&self, entry: &Entry, key: Key) -> Span {
        let corrected = self.changes.correction(entry.index, entry.sub, key);
        corrected.unwrap_or_else(|| self.value_span(entry.span, key))
    }
}
