//! Compact descriptions of many entries at once (CiA 306-1): `CompactSubObj` with `[xxxxName]`, and in a DCF
//! `[xxxxValue]` and `[xxxxDenotation]`.

use crate::finding::Kind;
use crate::model::keys::Key;
use crate::model::types::DataType;
use crate::model::{Entry, Object, ObjectKind, Value};
use crate::parse::facts::ObjectFacts;
use crate::parse::object::{Fields, Parts};
use crate::parse::reader::{Numbered, Reader};
use crate::parse::section::ObjectPart;
use crate::parse::syntax::{Pair, Section};

/// The most entries that are expanded in one file; see the rule `eds::too-many-entries`.
const MAX_COMPACT_ENTRIES: usize = 100_000;
/// The most bytes that the texts of all expanded entries may take: each entry has its own copy.
const MAX_COMPACT_BYTES: usize = 16 << 20;

impl<'a, 's> Reader<'a, 's> {
    /// Expands `CompactSubObj`. Without it, reports keys that have no meaning in the header of an object.
    pub(crate) fn compact_entries(&mut self, object: &mut Object, facts: &ObjectFacts, fields: &Fields<'a, 's>) {
        if facts.compact == 0 {
            let unused = [Key::DataType, Key::AccessType, Key::PdoMapping, Key::DefaultValue, Key::ParameterValue];
            let limits = [Key::LowLimit, Key::HighLimit, Key::UploadFile, Key::DownloadFile];
            let safety = [Key::SrdoMapping, Key::InvertedSrad];
            // An object without any sub-index may be meant as a single value, which another rule reports.
            for key in unused.into_iter().chain(limits).chain(safety).filter(|_| facts.subs > 0) {
                self.without_effect(fields[key as usize]);
            }
            return;
        }
        object.entries.push(Entry {
            name: "NrOfObjects".to_owned(),
            data_type: DataType::Unsigned8,
            default: Some(Value::Integer(facts.compact.into())),
            ..Entry::new(object.index, 0, object.span)
        });
        let mut fields = *fields;
        // Denotation and reference designator belong to the object, not to its entries.
        fields[Key::Denotation as usize] = None;
        fields[Key::ParamRefd as usize] = None;
        let template = self.entry(object.index, 0, object.span, &fields, ObjectKind::Variable);
        self.compact_entries += usize::from(facts.compact);
        self.compact_bytes += usize::from(facts.compact) * (object.name.len() + texts(&template));
        if self.compact_entries > MAX_COMPACT_ENTRIES || self.compact_bytes > MAX_COMPACT_BYTES {
            self.out.push(Kind::TooManyEntries(object.index), object.span);
            return;
        }
        for sub in 1..=facts.compact.min(0xFE) {
            let name = format!("{}{sub}", object.name);
            object.entries.push(Entry { sub, name, ..template.clone() });
        }
    }

    /// `[xxxxName]`, `[xxxxValue]`, `[xxxxDenotation]` and `[xxxxObjectLinks]`.
    pub(crate) fn tables(&mut self, object: &mut Object, parts: &Parts<'a, 's>) {
        for &(part, section) in parts {
            match part {
                ObjectPart::Header | ObjectPart::Sub(_) => {}
                ObjectPart::Names => self.table(object, section, |_, entry, line| {
                    entry.name = line.pair.value.to_owned();
                }),
                ObjectPart::Values => self.table(object, section, |reader, entry, line| {
                    entry.configured = reader.value(Some(line.pair), entry.data_type);
                }),
                ObjectPart::Denotations => self.table(object, section, |_, entry, line| {
                    entry.denotation = Some(line.pair.value.to_owned());
                }),
                ObjectPart::Links => self.links(object, section),
            }
        }
    }

    fn table(
        &mut self,
        object: &mut Object,
        section: &'s Section<'a>,
        mut apply: impl FnMut(&mut Self, &mut Entry, &Numbered<'a, 's>),
    ) {
        let ([count], lines) = self.numbered(section, "", 10, &["NrOfEntries"]);
        self.count(count, lines.len());
        for line in lines {
            let entry = u8::try_from(line.number).ok().and_then(|sub| {
                let at = object.entries.binary_search_by_key(&sub, |entry| entry.sub).ok()?;
                object.entries.get_mut(at)
            });
            match entry {
                Some(entry) => apply(self, entry, &line),
                None => {
                    let span = self.syntax.key_span(line.pair);
                    self.out.push(Kind::ValueWithoutEntry { index: object.index, sub: line.number }, span);
                }
            }
        }
    }

    fn links(&mut self, object: &mut Object, section: &'s Section<'a>) {
        let ([count], lines) = self.numbered(section, "", 10, &["ObjectLinks"]);
        self.count(count, lines.len());
        object.links = lines.iter().filter_map(|line| self.number(Some(line.pair))).collect();
    }

    /// Compares `NrOfEntries` and the like with the number of entries found.
    pub(crate) fn count(&mut self, said: Option<&'s Pair<'a>>, found: usize) {
        let Some(pair) = said else { return };
        if let Some(said) = self.number::<usize>(Some(pair)).filter(|&said| said != found) {
            self.out.push(Kind::EntryCount { said, found }, self.syntax.value_span(pair));
        }
    }
}

/// The bytes of text in an entry that is expanded many times.
fn texts(entry: &Entry) -> usize {
    let values = [&entry.default, &entry.configured, &entry.low, &entry.high].into_iter().flatten();
    let of_value = |value: &Value| match value {
        Value::Text(text) => text.len(),
        Value::Bytes(bytes) => bytes.len(),
        Value::Integer(_) | Value::Real(_) | Value::NodeIdPlus(_) => 0,
    };
    let files = [&entry.upload_file, &entry.download_file].into_iter().flatten();
    values.map(of_value).sum::<usize>() + files.map(String::len).sum::<usize>()
}
