//! Objects and their entries (CiA 306-1).

use crate::finding::{Kind, Oddity};
use crate::model::keys::{KEYS, Key};
use crate::model::types::DataType;
use crate::model::{AccessType, Entry, EntryDetails, Object, ObjectKind, Value};
use crate::parse::facts::{ObjectFacts, Unlimited};
use crate::parse::number;
use crate::parse::reader::{Group, Reader};
use crate::parse::section::ObjectPart;
use crate::parse::syntax::{Pair, Section};
use crate::text::Span;

/// The pairs of a section by [`Key`].
pub(crate) type Fields<'a, 's> = [Option<&'s Pair<'a>>; KEYS.len()];

/// The sections that belong to one index, ordered by part; never empty.
pub(crate) type Parts<'a, 's> = [(ObjectPart, &'s Section<'a>)];

impl<'a, 's> Reader<'a, 's> {
    /// An object from its sections.
    pub(crate) fn object(&mut self, index: u16, parts: &Parts<'a, 's>) -> (Object, ObjectFacts) {
        let header = parts.iter().find(|(part, _)| *part == ObjectPart::Header).map(|&(_, section)| section);
        let subs = parts.iter().filter(|(part, _)| matches!(part, ObjectPart::Sub(_))).count();
        let place = parts.first().map_or(Span::default(), |(_, section)| self.syntax.name_span(section));
        let fields = header.map_or([None; KEYS.len()], |header| self.fields(header, &KEYS));
        let facts = ObjectFacts {
            header: header.is_some(),
            subs: subs as u16,
            sub_number: self.number(nonempty(fields[Key::SubNumber as usize])),
            compact: self.number(nonempty(fields[Key::CompactSubObj as usize])).unwrap_or(0),
            declared: self.object_type(fields[Key::ObjectType as usize]),
            listed: None,
            implied: false,
        };
        let kind = kind(&facts);
        let mut object = Object {
            name: self.text(fields[Key::ParameterName as usize]).unwrap_or_default(),
            entries: Vec::with_capacity(subs.max(1)),
            flags: self.number(nonempty(fields[Key::ObjFlags as usize])).unwrap_or(0),
            ..Object::new(index, kind, place)
        };
        if kind.has_subs() {
            if let Some(denotation) = self.text(fields[Key::Denotation as usize]) {
                object.denotation = Some(denotation);
            }
            if let Some(designator) = self.text(fields[Key::ParamRefd as usize]) {
                object.designator = Some(designator);
            }
            self.compact_entries(&mut object, &facts, &fields);
            self.sub_entries(&mut object, parts);
        } else if header.is_some() {
            object.entries.push(self.entry(index, 0, place, &fields, kind));
        }
        self.tables(&mut object, parts);
        (object, facts)
    }

    /// An entry from the keys of its section.
    pub(crate) fn entry(
        &mut self,
        index: u16,
        sub: u8,
        span: Span,
        fields: &Fields<'a, 's>,
        kind: ObjectKind,
    ) -> Entry {
        let field = |key: Key| fields[key as usize];
        let data_type = self.data_type(field(Key::DataType), kind, span);
        let entry = Entry {
            name: self.text(field(Key::ParameterName)).unwrap_or_default(),
            data_type,
            access: self.access(field(Key::AccessType), kind, span),
            pdo_mapping: self.flag(field(Key::PdoMapping)),
            default: self.value(field(Key::DefaultValue), data_type),
            ..Entry::new(index, sub, span)
        };
        let configured = self.value(field(Key::ParameterValue), data_type);
        let srad = self.number::<u32>(nonempty(field(Key::InvertedSrad)));
        let [low, high] = self.limits(index, sub, [field(Key::LowLimit), field(Key::HighLimit)], data_type);
        entry.with_details(EntryDetails {
            configured,
            low,
            high,
            denotation: self.text(field(Key::Denotation)),
            designator: self.text(field(Key::ParamRefd)),
            srdo_mapping: self.flag(field(Key::SrdoMapping)),
            inverted: srad.map(|srad| ((srad >> 8) as u16, srad as u8)),
            upload_file: self.text(field(Key::UploadFile)),
            download_file: self.text(field(Key::DownloadFile)),
            ..EntryDetails::default()
        })
    }

    /// Reads `DefaultValue`, `ParameterValue` or a limit; `None` if it is absent or was reported.
    pub(crate) fn value(&mut self, pair: Option<&Pair<'_>>, data_type: DataType) -> Option<Value> {
        let pair = pair.filter(|pair| !pair.value.is_empty())?;
        match number::value(pair.value, data_type) {
            Ok(Some(read)) => {
                self.oddity(read.oddity, pair);
                Some(read.value)
            }
            Ok(None) => {
                self.oddity(Some(Oddity::Spelling), pair);
                None
            }
            Err(()) => {
                let span = self.syntax.value_span(pair);
                self.out.push(Kind::BadValue { key: pair.key.into(), text: pair.value.into(), data_type }, span);
                None
            }
        }
    }

    /// Reads the limits. Both are absent if both are 0: editors write that for "no limits".
    fn limits(
        &mut self,
        index: u16,
        sub: u8,
        pairs: [Option<&Pair<'_>>; 2],
        data_type: DataType,
    ) -> [Option<Value>; 2] {
        let mut limits = pairs.map(|pair| self.value(pair, data_type));
        // For "no limits" editors write the range of the unsigned type: 0 to 0xFFFF for an INTEGER16.
        if let [Some(Value::Integer(0..)), Some(Value::Integer(high @ ..0))] = &mut limits
            && let Some(bits) = data_type.bits()
            && pairs[1].is_some_and(|pair| !pair.value.starts_with('-'))
        {
            *high += 1 << bits;
        }
        let is_zero = |limit: &Option<Value>| matches!(limit, Some(Value::Integer(0) | Value::Real(0.0)));
        let ([Some(low), Some(high)], true) = (pairs, limits.iter().all(is_zero)) else { return limits };
        let limits = [low, high].map(|pair| self.syntax.value_span(pair));
        self.unlimited.push(Unlimited { index, sub, limits });
        [None, None]
    }

    /// The kind of `[1018sub1]`: a variable or a domain.
    fn sub_kind(&mut self, fields: &Fields<'a, 's>) -> ObjectKind {
        match self.object_type(fields[Key::ObjectType as usize]) {
            Some(kind) if kind.has_subs() => {
                let pair = fields[Key::ObjectType as usize];
                let span = pair.map_or(Span::default(), |pair| self.syntax.value_span(pair));
                self.out.push(Kind::NestedObject(kind), span);
                ObjectKind::Variable
            }
            Some(kind) => kind,
            None => ObjectKind::Variable,
        }
    }

    /// Reads `ObjectType`; `None` if it is empty or invalid.
    pub(crate) fn object_type(&mut self, pair: Option<&'s Pair<'a>>) -> Option<ObjectKind> {
        let pair = nonempty(pair)?;
        let code: u8 = self.number(Some(pair))?;
        let kind = ObjectKind::from_code(code);
        if kind.is_none() {
            self.out.push(Kind::BadObjectType(code), self.syntax.value_span(pair));
        }
        kind
    }

    /// Reads `DataType` of the object or entry described at `span`.
    pub(crate) fn data_type(&mut self, pair: Option<&'s Pair<'a>>, kind: ObjectKind, span: Span) -> DataType {
        let missing = if kind == ObjectKind::Domain { DataType::Domain } else { DataType::Other(0) };
        let Some(pair) = nonempty(pair) else {
            // A DOMAIN needs no data type besides its object code, and a NULL has none.
            if !matches!(kind, ObjectKind::Domain | ObjectKind::Null) {
                self.out.push(Kind::MissingDataType, span);
            }
            return missing;
        };
        if let Some(data_type) = DataType::from_name(pair.value) {
            self.oddity(Some(Oddity::Spelling), pair);
            return data_type;
        }
        let data_type = self.number(Some(pair)).map_or(missing, DataType::from_code);
        if data_type.is_unknown() {
            self.out.push(Kind::UnknownDataType(data_type), self.syntax.value_span(pair));
        }
        data_type
    }

    /// Reads `AccessType` of the object or entry described at `span`.
    pub(crate) fn access(&mut self, pair: Option<&'s Pair<'a>>, kind: ObjectKind, span: Span) -> AccessType {
        let Some(pair) = nonempty(pair) else {
            if !matches!(kind, ObjectKind::Domain | ObjectKind::Null | ObjectKind::DefType) {
                self.out.push(Kind::MissingAccessType, span);
            }
            return if kind == ObjectKind::DefType { AccessType::Ro } else { AccessType::Rw };
        };
        AccessType::from_name(pair.value).unwrap_or_else(|| {
            let (access, sure) = guess_access(pair.value);
            self.out.push(Kind::BadAccessType { word: pair.value.into(), access, sure }, self.syntax.value_span(pair));
            access
        })
    }

    fn sub_entries(&mut self, object: &mut Object, parts: &Parts<'a, 's>) {
        for &(part, section) in parts {
            let ObjectPart::Sub(sub) = part else { continue };
            let fields = self.fields(section, &KEYS);
            for key in [Key::SubNumber, Key::CompactSubObj] {
                self.without_effect(fields[key as usize]);
            }
            let kind = self.sub_kind(&fields);
            object.flags |= self.number::<u32>(nonempty(fields[Key::ObjFlags as usize])).unwrap_or(0);
            let entry = self.entry(object.index, sub, self.syntax.name_span(section), &fields, kind);
            match object.entries.binary_search_by_key(&sub, |entry| entry.sub) {
                Ok(at) => object.entries[at] = entry,
                Err(at) => object.entries.insert(at, entry),
            }
        }
    }

    /// Reports a key that has a value but no meaning in its section.
    pub(crate) fn without_effect(&mut self, pair: Option<&'s Pair<'a>>) {
        if let Some(pair) = nonempty(pair).filter(|pair| !matches!(pair.value, "0" | "0x0")) {
            self.group(Group::WithoutEffect, pair.key, self.syntax.key_span(pair));
        }
    }
}

/// The pair, unless its value is empty.
pub(crate) fn nonempty<'a, 's>(pair: Option<&'s Pair<'a>>) -> Option<&'s Pair<'a>> {
    pair.filter(|pair| !pair.value.is_empty())
}

/// The kind of the object: not a variable if it has sub-indices, even if `ObjectType` says so.
fn kind(facts: &ObjectFacts) -> ObjectKind {
    // An object without its own section is known only by its sub-indices.
    let several = facts.subs > 0 || facts.compact > 0 || !facts.header;
    match facts.declared {
        Some(kind) if kind.has_subs() || !several => kind,
        _ if facts.compact > 0 && facts.subs == 0 => ObjectKind::Array,
        _ if several => ObjectKind::Record,
        // CiA 306-1, 6.5.2: without ObjectType it is a VAR.
        _ => ObjectKind::Variable,
    }
}

/// The meaning of a non-standard access word, and whether it is beyond doubt.
fn guess_access(word: &str) -> (AccessType, bool) {
    match word.to_ascii_lowercase().as_str() {
        "r" | "read" | "readonly" | "read only" | "read-only" => (AccessType::Ro, true),
        "w" | "write" | "writeonly" | "write only" | "write-only" => (AccessType::Wo, true),
        "wr" | "r/w" | "readwrite" | "read/write" | "rw/rw" => (AccessType::Rw, true),
        "constant" | "cst" => (AccessType::Const, true),
        _ => (AccessType::Rw, false),
    }
}
