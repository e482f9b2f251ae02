//! Edits of a data sheet: keys, objects and sub-indices. Each edit is a [`Patch`] of the affected lines, which include
//! counts and lists; comments and the order of everything else stay.
//!
//! ```
//! use lexican_eds::edit::{Place, set};
//! use lexican_eds::Source;
//!
//! let sheet = Source::new("drive.eds", "[2000]\n; as shipped\nDefaultValue = 0x05\nObjectType=7\n");
//! let patch = set(&sheet, Place::Object(0x2000), "defaultvalue", Some("6"))?;
//! assert_eq!(patch.apply(&sheet), "[2000]\n; as shipped\nDefaultValue = 6\nObjectType=7\n");
//! # Ok::<(), lexican_eds::edit::EditError>(())
//! ```
//!
//! An edit does not judge its result; [`load`](crate::load) does.

pub(crate) mod lists;

use std::ops::RangeInclusive;

use thiserror::Error;

use crate::finding::Findings;
use crate::model::keys::{COMMISSIONING, DEVICE_INFO, FILE_INFO, KEYS, Key};
use crate::model::{Entry, Object};
use crate::outline::Outline;
use crate::parse::section::{ObjectPart, SectionKind};
use crate::parse::syntax::{Pair, Section, Syntax, tokenize, with};
use crate::parse::{number, position};
use crate::patch::{Change, Patch};
use crate::text::Source;
use crate::{write, xdd};
use lexican_cia::cia301;

/// The section that a key belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// `[FileInfo]`.
    FileInfo,
    /// `[DeviceInfo]`.
    DeviceInfo,
    /// `[DeviceComissioning]` of a DCF.
    Commissioning,
    /// An object: `[2000]`.
    Object(u16),
    /// A sub-index of an ARRAY or RECORD: `[2000sub1]`.
    Sub(u16, u8),
}

/// Why an edit is refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum EditError {
    /// There is no such section.
    #[error("there is no section [{0}]")]
    NoSection(String),
    /// CiA 306-1 has no such key in the section.
    #[error("{section} has no key {key:?}")]
    UnknownKey {
        /// The section.
        section: String,
        /// The key as given.
        key: String,
        /// The keys that the section may have.
        known: &'static [&'static str],
    },
    /// A value must have one line.
    #[error("a value has one line only")]
    SeveralLines,
    /// The object or sub-index is there already.
    #[error("[{0}] is there already")]
    AlreadyThere(String),
    /// A VAR has no sub-indices.
    #[error("{0:04X} has no sub-indices: it is no ARRAY or RECORD")]
    NoSubs(u16),
    /// `CompactSubObj` or `CompactPDO` describes it, so it has no section.
    #[error("{0} has no section of its own: CompactSubObj or CompactPDO stands for it")]
    Compact(String),
    /// Two lines of the list have the same number.
    #[error("the list [{0}] gives two objects the same number")]
    AmbiguousList(String),
    /// XML cannot express the key, or not in this section.
    #[error("XML has no place for {key} of {section}")]
    NotInXml {
        /// The section.
        section: String,
        /// The key.
        key: &'static str,
    },
}

/// Sets the value of a key, or removes the key if `value` is `None`. Keys are those of CiA 306-1, in upper or lower
/// case.
pub fn set(sheet: &Source, place: Place, key: &str, value: Option<&str>) -> Result<Patch, EditError> {
    if value.is_some_and(|value| value.contains(['\r', '\n'])) {
        return Err(EditError::SeveralLines);
    }
    let (name, known) = place.name_and_keys();
    let key = position(known, key.trim()).map(|at| known[at]).ok_or_else(|| EditError::UnknownKey {
        section: name.clone(),
        key: key.to_owned(),
        known,
    })?;
    if xdd::is_xml(sheet) {
        let in_words = xdd::in_words(sheet).ok_or_else(|| EditError::NoSection(name.clone()))?;
        let patch = set(&in_words, place, key, value)?;
        if patch.is_empty() {
            return Ok(patch);
        }
        let wanted = in_words.with_text(patch.apply(&in_words));
        let patch = xdd::set(sheet, (place.kind(), &name), key, value.map(str::trim), wanted);
        return patch.ok_or(EditError::NotInXml { section: name, key });
    }
    let editor = Editor::new(sheet);
    editor.read(|syntax| {
        let section = section(syntax, place.kind()).ok_or_else(|| match place {
            Place::Sub(index, _) if is_compact(syntax, index) => EditError::Compact(name.clone()),
            _ => EditError::NoSection(name.clone()),
        })?;
        let value = value.map(str::trim);
        let change = match (section.get(key), value) {
            (Some(pair), Some(value)) if pair.value == value => None,
            (Some(pair), Some(value)) => Some(syntax.with_value(pair, value)),
            (Some(pair), None) => Some(Change::Remove(pair.line + 1, pair.line + 1)),
            (None, Some(value)) => Some(added(syntax, section, known, key, value)),
            (None, None) => None,
        };
        Ok(change.into_iter().collect())
    })
}

/// Adds an object: its sections after those of smaller indices, and its line at the end of its list.
pub fn add_object(sheet: &Source, object: &Object) -> Result<Patch, EditError> {
    let index = object.index;
    Editor::new(sheet).read(|syntax| {
        if parts(syntax, index).next().is_some() {
            return Err(EditError::AlreadyThere(format!("{index:04X}")));
        }
        let mut patch = lines_after(object_end(syntax, index), &write::object_lines(object));
        let name = write::list_name(object.list);
        match section(syntax, SectionKind::of(name)) {
            Some(list) => patch.extend(rewritten(syntax, list, None, &[index])?),
            None => {
                let lines = [format!("[{name}]"), format!("{}=1", lists::COUNT), format!("1=0x{index:04X}")];
                patch.extend(lines_after(list_end(syntax), &lines));
            }
        }
        patch.extend(pdo_count(syntax, index, 1));
        Ok(patch)
    })
}

/// Adds a sub-index to an ARRAY or RECORD, after the smaller ones. Updates `SubNumber`, and the default of sub-index 0
/// if that was the highest sub-index.
pub fn add_entry(sheet: &Source, entry: &Entry) -> Result<Patch, EditError> {
    let (index, sub) = (entry.index, entry.sub);
    Editor::new(sheet).read(|syntax| {
        let header = with_subs(syntax, index)?;
        if section(syntax, SectionKind::Object(index, ObjectPart::Sub(sub))).is_some() {
            return Err(EditError::AlreadyThere(Place::Sub(index, sub).name_and_keys().0));
        }
        let before =
            parts(syntax, index).filter(|section| section.kind < SectionKind::Object(index, ObjectPart::Sub(sub)));
        let after = before.map(|section| lines(section).end() + 1).max().unwrap_or(header.line + 1);
        let mut patch = lines_after(after, &write::entry_lines(entry));
        patch.extend(counts(syntax, header, |subs| subs.push(sub)));
        Ok(patch)
    })
}

/// Removes an object: its sections, and its line in a list.
pub fn remove_object(sheet: &Source, index: u16) -> Result<Patch, EditError> {
    Editor::new(sheet).read(|syntax| {
        if parts(syntax, index).next().is_none() {
            return Err(EditError::NoSection(format!("{index:04X}")));
        }
        let mut patch: Patch = parts(syntax, index).map(|section| removed(syntax, section)).collect();
        for kind in [SectionKind::MandatoryObjects, SectionKind::OptionalObjects, SectionKind::ManufacturerObjects] {
            if let Some(list) = section(syntax, kind) {
                let names_it =
                    |pair: &Pair<'_>| number::integer(pair.value).is_some_and(|read| read.value == index.into());
                if list.pairs.iter().any(names_it) {
                    patch.extend(rewritten(syntax, list, Some(index), &[])?);
                }
            }
        }
        patch.extend(pdo_count(syntax, index, -1));
        Ok(patch)
    })
}

/// Removes a sub-index of an ARRAY or RECORD, and updates the counts as [`add_entry`] does.
pub fn remove_entry(sheet: &Source, index: u16, sub: u8) -> Result<Patch, EditError> {
    Editor::new(sheet).read(|syntax| {
        let header = with_subs(syntax, index)?;
        let entry = section(syntax, SectionKind::Object(index, ObjectPart::Sub(sub)));
        let entry = entry.ok_or_else(|| EditError::NoSection(Place::Sub(index, sub).name_and_keys().0))?;
        let mut patch = Patch::from_iter([removed(syntax, entry)]);
        patch.extend(counts(syntax, header, |subs| subs.retain(|&other| other != sub)));
        Ok(patch)
    })
}

/// Changes the index of an object: in its sections, in lists, links and PDO mappings. The sections stay where they are.
pub fn renumber(sheet: &Source, from: u16, to: u16) -> Result<Patch, EditError> {
    let outline = Outline::new(sheet);
    let has = |index: u16| outline.sections.iter().any(|section| section.object.is_some_and(|(it, _)| it == index));
    match (has(from), has(to)) {
        (false, _) => return Err(EditError::NoSection(format!("{from:04X}"))),
        (true, true) => return Err(EditError::AlreadyThere(format!("{to:04X}"))),
        (true, false) => {}
    }
    let mentions = outline.mentions().filter(|mention| mention.index == from);
    Ok(mentions.map(|mention| with(sheet, mention.span, &mention.of_other(to))).collect())
}

impl Place {
    fn kind(self) -> SectionKind {
        match self {
            Self::FileInfo => SectionKind::FileInfo,
            Self::DeviceInfo => SectionKind::DeviceInfo,
            Self::Commissioning => SectionKind::Commissioning,
            Self::Object(index) => SectionKind::Object(index, ObjectPart::Header),
            Self::Sub(index, sub) => SectionKind::Object(index, ObjectPart::Sub(sub)),
        }
    }

    fn name_and_keys(self) -> (String, &'static [&'static str]) {
        match self {
            Self::FileInfo => ("FileInfo".to_owned(), &FILE_INFO),
            Self::DeviceInfo => ("DeviceInfo".to_owned(), &DEVICE_INFO),
            Self::Commissioning => ("DeviceComissioning".to_owned(), &COMMISSIONING),
            Self::Object(index) => (format!("{index:04X}"), &KEYS),
            Self::Sub(index, sub) => (format!("{index:04X}sub{sub:X}"), &KEYS),
        }
    }
}

struct Editor<'a>(&'a Source);

impl<'a> Editor<'a> {
    fn new(sheet: &'a Source) -> Self {
        Self(sheet)
    }

    fn read<T>(&self, read: impl FnOnce(&Syntax<'_>) -> T) -> T {
        let tokens = tokenize(self.0, &mut Findings::default(), None);
        read(&Syntax::new(self.0, &tokens.text, tokens.lengths))
    }
}

/// The first section of a kind: only that one counts.
fn section<'s, 'a>(syntax: &'s Syntax<'a>, kind: SectionKind) -> Option<&'s Section<'a>> {
    syntax.sections.iter().find(|section| section.kind == kind)
}

/// All sections of an object.
fn parts<'s, 'a>(syntax: &'s Syntax<'a>, index: u16) -> impl Iterator<Item = &'s Section<'a>> {
    syntax
        .sections
        .iter()
        .filter(move |section| matches!(section.kind, SectionKind::Object(other, _) if other == index))
}

/// The header section of an object whose sub-indices have sections of their own.
fn with_subs<'s, 'a>(syntax: &'s Syntax<'a>, index: u16) -> Result<&'s Section<'a>, EditError> {
    let header = section(syntax, Place::Object(index).kind());
    let header = header.ok_or_else(|| EditError::NoSection(format!("{index:04X}")))?;
    if is_compact(syntax, index) {
        return Err(EditError::Compact(format!("the sub-indices of {index:04X}")));
    }
    let is_several = value_of(header, Key::ObjectType).is_some_and(|code| matches!(code, 6 | 8 | 9));
    let has_subs =
        parts(syntax, index).any(|section| matches!(section.kind, SectionKind::Object(_, ObjectPart::Sub(_))));
    if is_several || has_subs { Ok(header) } else { Err(EditError::NoSubs(index)) }
}

fn is_compact(syntax: &Syntax<'_>, index: u16) -> bool {
    let header = section(syntax, Place::Object(index).kind());
    header.and_then(|header| value_of(header, Key::CompactSubObj)).is_some_and(|count| count > 0)
}

fn value_of(section: &Section<'_>, key: Key) -> Option<i128> {
    number::integer(section.get(key.name())?.value).map(|read| read.value)
}

/// The lines (from 0) of a section, from its name to its last key.
fn lines(section: &Section<'_>) -> RangeInclusive<u32> {
    section.line..=section.pairs.last().map_or(section.line, |pair| pair.line)
}

/// Removes a section and the empty line after it.
fn removed(syntax: &Syntax<'_>, section: &Section<'_>) -> Change {
    let (first, last) = lines(section).into_inner();
    let blank_after =
        (last as usize + 1 < syntax.source.line_count()) && syntax.source.line(last as usize + 1).trim().is_empty();
    Change::Remove(first + 1, last + 1 + u32::from(blank_after))
}

/// Inserts a line for a new key in the order of CiA 306, with blanks around the equals sign if the other keys have
/// them.
fn added(syntax: &Syntax<'_>, section: &Section<'_>, known: &[&str], key: &str, value: &str) -> Change {
    let rank = |key: &str| position(known, key);
    let before = section.pairs.iter().filter(|pair| rank(pair.key) < rank(key)).max_by_key(|pair| rank(pair.key));
    let like = before.or(section.pairs.first()).map(|pair| {
        let (from, to) = (syntax.key_span(pair).end, syntax.value_span(pair).start);
        syntax.source.text().get(from as usize..to as usize).unwrap_or("=")
    });
    let equals = like.filter(|equals| equals.trim() == "=").unwrap_or("=");
    let line = before.map_or(section.line, |pair| pair.line) + 1;
    Change::After(line, format!("{key}{equals}{value}"))
}

/// Inserts sections after a line, each with an empty line before it.
fn lines_after(line: u32, lines: &[String]) -> Patch {
    let starts = |line: &String| line.starts_with('[');
    let lines = lines.iter().flat_map(|line| starts(line).then(String::new).into_iter().chain([line.clone()]));
    lines.map(|text| Change::After(line, text)).collect()
}

/// The line (from 1) after which the sections of a new object go: the end of the objects with smaller indices, else of
/// the lists, else of the file.
fn object_end(syntax: &Syntax<'_>, index: u16) -> u32 {
    let before = |section: &&Section<'_>| matches!(section.kind, SectionKind::Object(other, _) if other < index);
    let nearest = syntax.sections.iter().filter(before).max_by_key(|section| (section.kind, section.line));
    let nearest = nearest.and_then(|nearest| match nearest.kind {
        SectionKind::Object(index, _) => parts(syntax, index).map(|part| lines(part).end() + 1).max(),
        _ => None,
    });
    nearest.unwrap_or_else(|| list_end(syntax))
}

/// The last line (from 1) of the sections before the objects, or of the file if there are none.
fn list_end(syntax: &Syntax<'_>) -> u32 {
    let before = syntax.sections.iter().take_while(|section| !matches!(section.kind, SectionKind::Object(..)));
    before.last().map_or(syntax.source.line_count() as u32, |section| lines(section).end() + 1)
}

/// A list without one object, or with others appended.
fn rewritten(syntax: &Syntax<'_>, list: &Section<'_>, without: Option<u16>, added: &[u16]) -> Result<Patch, EditError> {
    let patch = lists::rewritten(syntax, list, |_, index| Some(index) == without, added);
    patch.ok_or_else(|| EditError::AmbiguousList(list.name.to_owned()))
}

/// Updates `NrOfRXPDO` or `NrOfTXPDO` when the communication parameter of a PDO is added or removed.
fn pdo_count(syntax: &Syntax<'_>, index: u16, more: i128) -> Option<Change> {
    let key = match index {
        cia301::RPDO_1..=cia301::RPDO_512 => "NrOfRXPDO",
        cia301::TPDO_1..=cia301::TPDO_512 => "NrOfTXPDO",
        _ => return None,
    };
    let pair = section(syntax, SectionKind::DeviceInfo)?.get(key)?;
    let count = number::integer(pair.value)?.value + more;
    (count >= 0).then(|| syntax.with_value(pair, &count.to_string()))
}

/// Updates `SubNumber`, and the default of sub-index 0 if that was the highest sub-index.
fn counts(syntax: &Syntax<'_>, header: &Section<'_>, change: impl FnOnce(&mut Vec<u8>)) -> Vec<Change> {
    let SectionKind::Object(index, _) = header.kind else { return Vec::new() };
    let sub = |section: &Section<'_>| match section.kind {
        SectionKind::Object(_, ObjectPart::Sub(sub)) => Some(sub),
        _ => None,
    };
    let mut subs: Vec<u8> = parts(syntax, index).filter_map(sub).collect();
    subs.sort_unstable();
    subs.dedup();
    let highest = |subs: &[u8]| subs.iter().copied().filter(|&sub| sub < 0xFF).max();
    let before = highest(&subs);
    change(&mut subs);
    let after = highest(&subs);
    let mut changes = Vec::new();
    if let Some(pair) = header.get(Key::SubNumber.name()) {
        changes.push(syntax.with_value(pair, &like(pair.value, subs.len())));
    }
    let count = section(syntax, Place::Sub(index, 0).kind());
    if let (Some(pair), Some(before), Some(after)) =
        (count.and_then(|it| it.get(Key::DefaultValue.name())), before, after)
        && number::integer(pair.value).is_some_and(|read| read.value == before.into())
        && before != after
        && subs.contains(&0)
        && !cia301::counts_entries(index)
    {
        changes.push(syntax.with_value(pair, &like(pair.value, after.into())));
    }
    changes
}

/// A number in the same notation as `other`.
fn like(other: &str, number: usize) -> String {
    match other.get(..2) {
        Some(prefix @ ("0x" | "0X")) => format!("{prefix}{number:0digits$X}", digits = other.len() - 2),
        _ => number.to_string(),
    }
}
