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
    pub(crate) lists: Vec<List>,
    /// As many as the model has objects, and in the same order.
    pub(crate) objects: Vec<ObjectFacts>,
}

impl<'a> Facts<'a> {
    /// The first section of a kind.
    pub(crate) fn section(&self, kind: SectionKind) -> Option<&Section<'a>> {
        self.syntax.sections.iter().find(|section| section.kind == kind)
    }
}

impl Facts<'_> {
    /// The object that a place in the data sheet is about, and the sub-index when it has a section of its own; none
    /// for the beginning of the file, which stands for the whole.
    pub(crate) fn address_of(&self, span: Span) -> Option<(u16, Option<u8>)> {
        if span.source != 0 || span == Span::eds(0, 0) {
            return None;
        }
        let sections = &self.syntax.sections;
        let line = self.syntax.source.position(span.start).line - 1;
        let after = sections.partition_point(|section| section.line <= line);
        match sections.get(after.checked_sub(1)?)?.kind {
            SectionKind::Object(index, ObjectPart::Sub(sub)) => Some((index, Some(sub))),
            SectionKind::Object(index, _) => Some((index, None)),
            _ => None,
        }
    }
}

/// Reads all sections; the objects are ascending by index.
pub(crate) fn read<'a>(syntax: Syntax<'a>, out: &mut Diagnostics) -> (Device, Facts<'a>) {
    let mut reader = Reader::new(&syntax, out);
    let sections = sorted(&mut reader);
    let mut lists = Vec::new();
    // They are large, and there may be many: room for more than there are would cost most of all memory.
    let count = sections.chunk_by(together).filter(|group| is_object(group[0].kind)).count();
    let mut device = Device { objects: Vec::with_capacity(count), ..Device::default() };
    let mut objects = Vec::with_capacity(count);
    let mut modules: Vec<Module> = Vec::new();
    for group in sections.chunk_by(together) {
        let section = group[0];
        match section.kind {
            SectionKind::Object(index, _) => {
                let parts: Vec<_> = group.iter().copied().filter_map(object_part).collect();
                let (object, facts) = reader.object(index, &parts);
                device.objects.push(object);
                objects.push(facts);
            }
            SectionKind::Module(number, _) => {
                let parts: Vec<_> = group.iter().copied().filter_map(module_part).collect();
                modules.push(reader.module(number, &parts));
            }
            _ if reader.info(section, &mut device) || reader.extras(section, &mut device) => {}
            SectionKind::Unnamed => reader.out.push(check::keys_are_in_sections::found(&syntax, section)),
            SectionKind::Unknown => {
                for section in group {
                    let span = syntax.name_span(section);
                    reader.out.push(check::sections_are_known::found(section.name, section.pairs.len(), span));
                }
            }
            _ => lists.extend(reader.list(section)),
        }
    }
    // Those that are described stand for those that are only counted.
    let described = |module: &Module| modules.binary_search_by_key(&module.number, |other| other.number).is_ok();
    device.modules.retain(|module| !described(module));
    device.modules.append(&mut modules);
    device.modules.sort_by_key(|module| module.number);
    reader.finish();
    drop(sections);
    let mut facts = Facts { syntax, lists, objects };
    compact_pdo::expand(&mut device, &mut facts);
    assign_lists(&mut device, &mut facts);
    (device, facts)
}

/// The sections by kind, without those that repeat an earlier one.
fn sorted<'a, 's>(reader: &mut Reader<'a, 's>) -> Vec<&'s Section<'a>> {
    let syntax = reader.syntax;
    let mut sections: Vec<&'s Section<'a>> = syntax.sections.iter().collect();
    sections.sort_unstable_by_key(|section| (section.kind, section.line));
    sections.dedup_by(|second, first| {
        let same = second.kind == first.kind && second.kind != SectionKind::Unknown;
        if same {
            reader.out.push(check::sections_are_unique::found(syntax, first, second));
        }
        same
    });
    sections
}

/// Whether two sections are read together.
fn together(a: &&Section<'_>, b: &&Section<'_>) -> bool {
    use SectionKind as S;
    match (a.kind, b.kind) {
        (S::Object(a, _), S::Object(b, _)) | (S::Module(a, _), S::Module(b, _)) => a == b,
        (a, b) => a == b,
    }
}

fn is_object(kind: SectionKind) -> bool {
    matches!(kind, SectionKind::Object(..))
}

fn object_part<'a, 's>(section: &'s Section<'a>) -> Option<(ObjectPart, &'s Section<'a>)> {
    match section.kind {
        SectionKind::Object(_, part) => Some((part, section)),
        _ => None,
    }
}

fn module_part<'a, 's>(section: &'s Section<'a>) -> Option<(ModulePart, &'s Section<'a>)> {
    match section.kind {
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
