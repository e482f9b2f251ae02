//! The whole data sheet: its sections in groups, each read by the part of CiA 306 it belongs to.

use crate::check;
use crate::compact_pdo;
use crate::diagnostics::Diagnostics;
use crate::lists::{List, natural_list};
use crate::model::{Device, Module, ObjectList};
use crate::object::ObjectFacts;
use crate::read::Reader;
use crate::section::{ModulePart, ObjectPart, SectionKind};
use crate::source::Span;
use crate::syntax::{Section, Syntax};

/// What the rules want to know beyond the model.
pub(crate) struct Facts<'a> {
    pub(crate) syntax: Syntax<'a>,
    /// What kinds of sections there are, ascending.
    pub(crate) kinds: Vec<SectionKind>,
    pub(crate) lists: Vec<List>,
    /// As many as the model has objects, and in the same order.
    pub(crate) objects: Vec<ObjectFacts>,
}

impl<'a> Facts<'a> {
    /// The first section of a kind.
    pub(crate) fn section(&self, kind: SectionKind) -> Option<&Section<'a>> {
        self.syntax.sections.iter().find(|section| SectionKind::of(section.name) == kind)
    }
}

impl Facts<'_> {
    /// The object that a place in the data sheet is about, and the sub-index when it has a section of its own.
    pub(crate) fn address_of(&self, span: Span) -> Option<(u16, Option<u8>)> {
        if span.source != 0 {
            return None;
        }
        let sections = &self.syntax.sections;
        let line = self.syntax.source.position(span.start).line - 1;
        let after = sections.partition_point(|section| section.line <= line);
        match SectionKind::of(sections.get(after.checked_sub(1)?)?.name) {
            SectionKind::Object(index, ObjectPart::Sub(sub)) => Some((index, Some(sub))),
            SectionKind::Object(index, _) => Some((index, None)),
            _ => None,
        }
    }
}

/// A section with its kind.
type Sorted<'a, 's> = (SectionKind, &'s Section<'a>);

/// Reads all sections; the objects are ascending by index.
pub(crate) fn read<'a>(syntax: Syntax<'a>, out: &mut Diagnostics) -> (Device, Facts<'a>) {
    let mut reader = Reader::new(&syntax, out);
    let sections = sorted(&mut reader);
    let mut lists = Vec::new();
    // They are large, and there may be many: room for more than there are would cost most of all memory.
    let count = sections.chunk_by(|a, b| together(a.0, b.0)).filter(|group| is_object(group[0].0)).count();
    let mut device = Device { objects: Vec::with_capacity(count), ..Device::default() };
    let mut objects = Vec::with_capacity(count);
    let mut modules: Vec<Module> = Vec::new();
    for group in sections.chunk_by(|a, b| together(a.0, b.0)) {
        let (kind, section) = group[0];
        match kind {
            SectionKind::Object(index, _) => {
                let parts: Vec<_> = group.iter().filter_map(|&(kind, section)| object_part(kind, section)).collect();
                let (object, facts) = reader.object(index, &parts);
                device.objects.push(object);
                objects.push(facts);
            }
            SectionKind::Module(number, _) => {
                let parts: Vec<_> = group.iter().filter_map(|&(kind, section)| module_part(kind, section)).collect();
                modules.push(reader.module(number, &parts));
            }
            _ if reader.info(kind, section, &mut device) || reader.extras(kind, section, &mut device) => {}
            SectionKind::Unnamed => reader.out.push(check::keys_are_in_sections::found(&syntax, section)),
            SectionKind::Unknown => {
                for &(_, section) in group {
                    let span = syntax.name_span(section);
                    reader.out.push(check::sections_are_known::found(section.name, section.pairs.len(), span));
                }
            }
            _ => lists.extend(reader.list(kind, section)),
        }
    }
    // Those that are described stand for those that are only counted.
    let described = |module: &Module| modules.binary_search_by_key(&module.number, |other| other.number).is_ok();
    device.modules.retain(|module| !described(module));
    device.modules.append(&mut modules);
    device.modules.sort_by_key(|module| module.number);
    reader.finish();
    let kinds = sections.iter().map(|&(kind, _)| kind).collect();
    drop(sections);
    let mut facts = Facts { syntax, kinds, lists, objects };
    compact_pdo::expand(&mut device, &mut facts);
    assign_lists(&mut device, &mut facts);
    (device, facts)
}

/// The sections by kind, without those that repeat an earlier one.
fn sorted<'a, 's>(reader: &mut Reader<'a, 's>) -> Vec<Sorted<'a, 's>> {
    let syntax = reader.syntax;
    let with_kind = |section: &'s Section<'a>| (SectionKind::of(section.name), section);
    let mut sections: Vec<Sorted<'a, 's>> = syntax.sections.iter().map(with_kind).collect();
    sections.sort_by_key(|&(kind, section)| (kind, section.line));
    sections.dedup_by(|second, first| {
        let same = second.0 == first.0 && second.0 != SectionKind::Unknown;
        if same {
            reader.out.push(check::sections_are_unique::found(syntax, first.1, second.1));
        }
        same
    });
    sections
}

/// Whether two sections are read together.
fn together(a: SectionKind, b: SectionKind) -> bool {
    use SectionKind as S;
    match (a, b) {
        (S::Object(a, _), S::Object(b, _)) | (S::Module(a, _), S::Module(b, _)) => a == b,
        _ => a == b,
    }
}

fn is_object(kind: SectionKind) -> bool {
    matches!(kind, SectionKind::Object(..))
}

fn object_part<'a, 's>(kind: SectionKind, section: &'s Section<'a>) -> Option<(ObjectPart, &'s Section<'a>)> {
    match kind {
        SectionKind::Object(_, part) => Some((part, section)),
        _ => None,
    }
}

fn module_part<'a, 's>(kind: SectionKind, section: &'s Section<'a>) -> Option<(ModulePart, &'s Section<'a>)> {
    match kind {
        SectionKind::Module(_, part) => Some((part, section)),
        _ => None,
    }
}

/// Gives each object the list that names it, or the one it belongs into.
fn assign_lists(device: &mut Device, facts: &mut Facts<'_>) {
    let mut listed: Vec<(u16, ObjectList)> = Vec::new();
    for list in &facts.lists {
        listed.extend(list.entries.iter().map(|entry| (entry.index, list.list)));
    }
    listed.sort();
    for (object, facts) in device.objects.iter_mut().zip(&mut facts.objects) {
        let at = listed.partition_point(|&(index, _)| index < object.index);
        facts.listed = listed.get(at).filter(|(index, _)| *index == object.index).map(|&(_, list)| list);
        object.list = facts.listed.unwrap_or_else(|| natural_list(object.index));
    }
}
