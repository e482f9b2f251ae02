//! What stands where in a data sheet, however wrong it is: sections, keys, and every place that names an object. It is for
//! editors, and for what follows an object through a file.

use crate::fmt::keys_of;
use crate::parse::number;
use crate::parse::position;
use crate::parse::reader::number_of_key;
use crate::parse::section::{ObjectPart, SectionKind, without_blanks};
use crate::parse::syntax::{Line, part};
use crate::text::{Source, Span};
use lexican_cia::cia301;

/// The sections of a data sheet, in the order of the file.
pub struct Outline<'a> {
    source: &'a Source,
    /// The sections.
    pub sections: Vec<Section>,
}

/// A section and its keys.
pub struct Section {
    /// Its name, without brackets.
    pub name: Span,
    /// The lines of its name and of its last key, from 0.
    pub lines: [u32; 2],
    /// Its keys and their values.
    pub pairs: Vec<(Span, Span)>,
    /// The object that it belongs to, and the sub-index that it describes.
    pub object: Option<(u16, Option<u8>)>,
    kind: SectionKind,
}

/// A place that names an object.
pub struct Mention {
    /// The digits in the name of a section; else the whole number.
    pub span: Span,
    /// The object.
    pub index: u16,
    /// The sub-index, where it is named as well.
    pub sub: Option<u8>,
    /// `0x`, but in the name of a section.
    prefix: &'static str,
    /// Sub-index and length of a PDO mapping.
    rest: String,
}

impl<'a> Outline<'a> {
    /// The sections of a text.
    #[must_use]
    pub fn new(source: &'a Source) -> Self {
        let mut sections: Vec<Section> = Vec::new();
        for number in 0..source.line_count() {
            let (start, text, line) = (source.line_range(number).0, source.line(number), number as u32);
            match (Line::of(text), sections.last_mut()) {
                (Line::Section { name, .. }, _) => {
                    let kind = SectionKind::of(name);
                    let object = match kind {
                        SectionKind::Object(index, ObjectPart::Sub(sub)) => Some((index, Some(sub))),
                        SectionKind::Object(index, _) => Some((index, None)),
                        _ => None,
                    };
                    let (name, pairs) = (part(start, text, name), Vec::new());
                    sections.push(Section { name, lines: [line; 2], pairs, object, kind });
                }
                (Line::Pair { key, value, .. }, Some(section)) => {
                    section.lines[1] = line;
                    section.pairs.push((part(start, text, key), part(start, text, value)));
                }
                _ => {}
            }
        }
        Self { source, sections }
    }

    /// The section that a line (from 0) is in, with what follows its last key.
    #[must_use]
    pub fn section_at(&self, line: usize) -> Option<&Section> {
        self.sections[..self.sections.partition_point(|section| section.lines[0] as usize <= line)].last()
    }

    /// The section that describes an object, or one of its sub-indices.
    #[must_use]
    pub fn describing(&self, index: u16, sub: Option<u8>) -> Option<&Section> {
        let find = |sub| self.sections.iter().find(|section| section.object == Some((index, sub)));
        find(sub).or_else(|| find(None))
    }

    /// Every place that names an object: sections, lists, links, and PDO mappings.
    pub fn mentions(&self) -> impl Iterator<Item = Mention> {
        self.sections.iter().flat_map(|section| {
            let of_pair = |(key, value): &(Span, Span)| section.mention(self.source, *key, *value);
            section.own_mention(self.source).into_iter().chain(section.pairs.iter().filter_map(of_pair))
        })
    }

    /// The place that names an object at an offset.
    #[must_use]
    pub fn mention_at(&self, offset: u32) -> Option<Mention> {
        self.mentions().find(|mention| (mention.span.start..=mention.span.end).contains(&offset))
    }
}

impl Section {
    /// Whether it lists objects.
    #[must_use]
    pub fn is_list(&self) -> bool {
        use SectionKind as S;
        let is_of_device = matches!(self.kind, S::MandatoryObjects | S::OptionalObjects | S::ManufacturerObjects);
        is_of_device || matches!(self.kind, S::Object(_, ObjectPart::Links))
    }

    /// Whether the value of a key is what a PDO maps.
    #[must_use]
    pub fn is_mapping(&self, key: &str) -> bool {
        let SectionKind::Object(index, part) = self.kind else { return false };
        cia301::is_pdo_mapping(index)
            && match part {
                ObjectPart::Sub(1..) => position(&["DefaultValue", "ParameterValue"], key).is_some(),
                ObjectPart::Values => number_of_key(&without_blanks(key), "", 10) > Some(0),
                _ => false,
            }
    }

    /// The keys that CiA 306 has for it, but for those that are numbers.
    #[must_use]
    pub fn known_keys(&self) -> &'static [&'static str] {
        keys_of(self.kind)
    }

    fn own_mention(&self, source: &Source) -> Option<Mention> {
        let ((index, sub), name) = (self.object?, source.get(self.name));
        // From the longest down, as sections are read: the `De` of `40Denotation` are digits as well.
        let is_index = |digits: &usize| name.get(..*digits).is_some_and(|it| u16::from_str_radix(it, 16) == Ok(index));
        let span = Span { end: self.name.start + (1..=4).rev().find(is_index)? as u32, ..self.name };
        Some(Mention { span, index, sub, prefix: "", rest: String::new() })
    }

    fn mention(&self, source: &Source, key: Span, span: Span) -> Option<Mention> {
        let key = source.get(key);
        let is_listed = self.is_list() && number_of_key(&without_blanks(key), "", 10).is_some();
        let read = number::integer(source.get(span)).filter(|read| read.oddity.is_none())?;
        let number = u32::try_from(read.value).ok()?;
        let (index, sub, rest) = match self.is_mapping(key) {
            true => ((number >> 16) as u16, Some((number >> 8) as u8), format!("{:04X}", number & 0xFFFF)),
            false if is_listed => (u16::try_from(number).ok()?, None, String::new()),
            false => return None,
        };
        Some(Mention { span, index, sub, prefix: "0x", rest })
    }
}

impl Mention {
    /// Whether it is the name of a section.
    #[must_use]
    pub fn is_section(&self) -> bool {
        self.prefix.is_empty()
    }

    /// The text that names another object in its place.
    #[must_use]
    pub fn of_other(&self, index: u16) -> String {
        format!("{}{index:04X}{}", self.prefix, self.rest)
    }
}
