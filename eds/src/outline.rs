//! The sections, the keys and every mention of an object in a data sheet, however incorrect it is. Editors use it, and
//! so does renumbering an object.

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
    /// Also those of unknown names.
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
    /// The object that it belongs to, and the sub-index if it describes one.
    pub object: Option<(u16, Option<u8>)>,
    kind: SectionKind,
}

/// A mention of an object.
pub struct Mention {
    /// The digits in the name of a section, or the whole number elsewhere.
    pub span: Span,
    /// The object.
    pub index: u16,
    /// The sub-index, if it is mentioned as well.
    pub sub: Option<u8>,
    /// `0x`; empty in the name of a section.
    prefix: &'static str,
    /// Sub-index and length of an entry of a PDO mapping.
    rest: String,
}

impl<'a> Outline<'a> {
    #[must_use]
    /// Reads the sections of a text, which never fails.
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

    /// The section that a line (from 0) is in. Lines after the last key belong to it.
    #[must_use]
    pub fn section_at(&self, line: usize) -> Option<&Section> {
        self.sections[..self.sections.partition_point(|section| section.lines[0] as usize <= line)].last()
    }

    /// The section that describes an object or sub-index.
    #[must_use]
    pub fn describing(&self, index: u16, sub: Option<u8>) -> Option<&Section> {
        let find = |sub| self.sections.iter().find(|section| section.object == Some((index, sub)));
        find(sub).or_else(|| find(None))
    }

    /// All mentions of objects: in section names, lists, links and PDO mappings.
    pub fn mentions(&self) -> impl Iterator<Item = Mention> {
        self.sections.iter().flat_map(|section| {
            let of_pair = |(key, value): &(Span, Span)| section.mention(self.source, *key, *value);
            section.own_mention(self.source).into_iter().chain(section.pairs.iter().filter_map(of_pair))
        })
    }

    /// The mention at a byte offset.
    #[must_use]
    pub fn mention_at(&self, offset: u32) -> Option<Mention> {
        self.mentions().find(|mention| (mention.span.start..=mention.span.end).contains(&offset))
    }
}

impl Section {
    /// Whether it is a list of objects.
    #[must_use]
    pub fn is_list(&self) -> bool {
        use SectionKind as S;
        let is_of_device = matches!(self.kind, S::MandatoryObjects | S::OptionalObjects | S::ManufacturerObjects);
        is_of_device || matches!(self.kind, S::Object(_, ObjectPart::Links))
    }

    /// Whether the key is an entry of a PDO mapping.
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

    /// The keys that CiA 306 defines for it, except keys that are numbers.
    #[must_use]
    pub fn known_keys(&self) -> &'static [&'static str] {
        keys_of(self.kind)
    }

    fn own_mention(&self, source: &Source) -> Option<Mention> {
        let ((index, sub), name) = (self.object?, source.get(self.name));
        // Try the longest index first, as parsing does: the `De` of `40Denotation` are hexadecimal digits, too.
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
    /// Whether it is in the name of a section.
    #[must_use]
    pub fn is_section(&self) -> bool {
        self.prefix.is_empty()
    }

    /// The text that mentions another object instead.
    #[must_use]
    pub fn of_other(&self, index: u16) -> String {
        format!("{}{index:04X}{}", self.prefix, self.rest)
    }
}
