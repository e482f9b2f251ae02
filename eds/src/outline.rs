//! What stands where in a data sheet, however wrong it is: sections, keys, and every place that names an object. It is for
//! editors, and for what follows an object through a file.

use crate::fmt::keys_of;
use crate::model::keys::Key;
use crate::parse::number;
use crate::parse::position;
use crate::parse::reader::number_of_key;
use crate::parse::section::{ObjectPart, SectionKind, without_blanks};
use crate::parse::syntax::{Line, part};
use crate::text::{Source, Span};
use lexican_cia::cia301;

/// The sections of a data sheet, in the order of the file.
#[derive(Clone, Debug, Default)]
pub struct Outline {
    /// The sections.
    pub sections: Vec<Section>,
}

/// A section and its keys.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its name, without brackets.
    pub name: Span,
    /// The line of its name, from 0.
    pub first_line: u32,
    /// The line of its last key.
    pub last_line: u32,
    /// Its keys.
    pub pairs: Vec<Pair>,
    kind: SectionKind,
}

/// A key and its value.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// The key.
    pub key: Span,
    /// The value; the place where it would be, if there is none.
    pub value: Span,
}

/// A place that names an object.
#[derive(Clone, Copy, Debug)]
pub struct Mention {
    /// The digits in the name of a section; else the whole number.
    pub span: Span,
    /// The object.
    pub index: u16,
    /// The sub-index, where it is named as well.
    pub sub: Option<u8>,
    form: Form,
}

/// How a place names an object.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// `1018`, of a section.
    Digits,
    /// `0x1018`, of a list.
    Number,
    /// `0x60400010`, of a PDO mapping: sub-index and length are the lower half.
    Mapping(u16),
}

impl Outline {
    /// The sections of a text.
    #[must_use]
    pub fn new(source: &Source) -> Self {
        let mut sections: Vec<Section> = Vec::new();
        for (number, line) in (0..source.line_count()).zip(0..) {
            let (start, text) = (source.line_range(number).0, source.line(number));
            match (Line::of(text), sections.last_mut()) {
                (Line::Section { name, .. }, _) => sections.push(Section {
                    name: part(start, text, name),
                    first_line: line,
                    last_line: line,
                    pairs: Vec::new(),
                    kind: SectionKind::of(name),
                }),
                (Line::Pair { key, value, .. }, Some(section)) => {
                    section.last_line = line;
                    section.pairs.push(Pair { key: part(start, text, key), value: part(start, text, value) });
                }
                _ => {}
            }
        }
        Self { sections }
    }

    /// The section that a line (from 0) is in, with what follows its last key.
    #[must_use]
    pub fn section_at(&self, line: u32) -> Option<&Section> {
        self.sections[..self.sections.partition_point(|section| section.first_line <= line)].last()
    }

    /// The section that describes an object, or one of its sub-indices.
    #[must_use]
    pub fn describing(&self, index: u16, sub: Option<u8>) -> Option<&Section> {
        let find = |sub| self.sections.iter().find(|section| section.address() == Some((index, sub)));
        find(sub).or_else(|| find(None))
    }

    /// Every place that names an object: sections, lists, links, and PDO mappings.
    pub fn mentions<'s>(&'s self, source: &'s Source) -> impl Iterator<Item = Mention> + 's {
        self.sections.iter().flat_map(move |section| {
            let of_pair = move |pair: &Pair| section.mention_of(pair, source);
            section.own_mention(source).into_iter().chain(section.pairs.iter().filter_map(of_pair))
        })
    }

    /// The place that names an object at an offset.
    #[must_use]
    pub fn mention_at(&self, source: &Source, offset: u32) -> Option<Mention> {
        self.mentions(source).find(|mention| (mention.span.start..=mention.span.end).contains(&offset))
    }
}

impl Section {
    /// The object that it is about, and the sub-index if it is about one.
    #[must_use]
    pub fn address(&self) -> Option<(u16, Option<u8>)> {
        match self.kind {
            SectionKind::Object(index, ObjectPart::Sub(sub)) => Some((index, Some(sub))),
            SectionKind::Object(index, ObjectPart::Header) => Some((index, None)),
            _ => None,
        }
    }

    /// The object that it belongs to, also in a part such as `[1018Name]`.
    #[must_use]
    pub fn object(&self) -> Option<u16> {
        match self.kind {
            SectionKind::Object(index, _) => Some(index),
            _ => None,
        }
    }

    /// Whether it lists objects.
    #[must_use]
    pub fn is_list(&self) -> bool {
        use SectionKind as S;
        matches!(
            self.kind,
            S::MandatoryObjects | S::OptionalObjects | S::ManufacturerObjects | S::Object(_, ObjectPart::Links)
        )
    }

    /// The keys that CiA 306 has for it, but for those that are numbers.
    #[must_use]
    pub fn known_keys(&self) -> &'static [&'static str] {
        keys_of(self.kind)
    }

    /// Whether the value of a key is what a PDO maps.
    #[must_use]
    pub fn is_mapping(&self, key: &str) -> bool {
        let holds = |key: &str| position(&[Key::DefaultValue.name(), Key::ParameterValue.name()], key).is_some();
        match self.kind {
            SectionKind::Object(index, ObjectPart::Sub(1..)) => cia301::is_pdo_mapping(index) && holds(key),
            SectionKind::Object(index, ObjectPart::Values) => {
                cia301::is_pdo_mapping(index) && number_of_key(&without_blanks(key), "", 10) > Some(0)
            }
            _ => false,
        }
    }

    fn own_mention(&self, source: &Source) -> Option<Mention> {
        let SectionKind::Object(index, part) = self.kind else { return None };
        let sub = if let ObjectPart::Sub(sub) = part { Some(sub) } else { None };
        let name = source.get(self.name);
        // From the longest down, as sections are read: the `De` of `40Denotation` are digits as well.
        let is_index = |digits: &usize| name.get(..*digits).is_some_and(|it| u16::from_str_radix(it, 16) == Ok(index));
        let digits = (1..=4).rev().find(is_index)?;
        let span = Span { end: self.name.start + digits as u32, ..self.name };
        Some(Mention { span, index, sub, form: Form::Digits })
    }

    fn mention_of(&self, pair: &Pair, source: &Source) -> Option<Mention> {
        let key = source.get(pair.key);
        let is_mapping = self.is_mapping(key);
        if !is_mapping && !(self.is_list() && number_of_key(&without_blanks(key), "", 10).is_some()) {
            return None;
        }
        let read = number::integer(source.get(pair.value)).filter(|read| read.oddity.is_none())?;
        let number = u32::try_from(read.value).ok()?;
        let (index, sub, form) = match is_mapping {
            true => ((number >> 16) as u16, Some((number >> 8) as u8), Form::Mapping(number as u16)),
            false => (u16::try_from(number).ok()?, None, Form::Number),
        };
        Some(Mention { span: pair.value, index, sub, form })
    }
}

impl Mention {
    /// The text that names another object in its place.
    #[must_use]
    pub fn of_other(&self, index: u16) -> String {
        match self.form {
            Form::Digits => format!("{index:04X}"),
            Form::Number => format!("0x{index:04X}"),
            Form::Mapping(rest) => format!("0x{index:04X}{rest:04X}"),
        }
    }
}
