//! Reads the whole data sheet: groups its sections, and hands each group to the file for its kind.

mod compact;
mod compact_pdo;
pub(crate) mod facts;
mod info;
mod modules;
pub(crate) mod number;
mod object;
pub(crate) mod reader;
pub(crate) mod section;
pub(crate) mod syntax;

pub(crate) use compact_pdo::DEFINED_BITS as COMPACT_PDO_BITS;
pub(crate) use section::position;

use facts::Facts;
use reader::Reader;
use section::{ModulePart, ObjectPart, SectionKind};
use syntax::{Pair, Section, Syntax};

use crate::finding::{Findings, Kind};
use crate::model::{Device, Module, ObjectList};
use crate::text::{Encoding, Source, Span};

/// Whether a text is XML, judged by its first character.
#[must_use]
pub fn is_xml(sheet: &Source) -> bool {
    sheet.text().trim_start().starts_with('<')
}

/// Whether a text can be a data sheet at all; otherwise adds a finding.
pub(crate) fn is_readable(eds: &Source, out: &mut Findings) -> bool {
    if let Some(refusal) = eds.refusal() {
        out.push(Kind::FileSize(refusal), Span::eds(0, 0));
        return false;
    }
    // XML declares its own encoding.
    if eds.encoding() != Encoding::Utf8 && !is_xml(eds) {
        let first = eds.text().char_indices().find(|(_, c)| !c.is_ascii());
        let (start, end) = first.map_or((0, 0), |(at, c)| (at, at + c.len_utf8()));
        out.push(Kind::Encoding, Span::eds(start as u32, end as u32));
    }
    true
}

/// Whether it is a CPJ (CiA 306-3): sections of nodes in a network, and no objects.
pub(crate) fn is_project(syntax: &Syntax<'_>, out: &mut Findings) -> bool {
    let topology = syntax.sections.iter().find(|section| section.name.eq_ignore_ascii_case("Topology"));
    let topology = topology.filter(|_| !syntax.sections.iter().any(|section| is_object(section.kind)));
    topology.inspect(|section| out.push(Kind::Project, syntax.name_span(section))).is_some()
}

/// Reads all sections; the objects of the result are in ascending order.
pub(crate) fn read<'a>(syntax: Syntax<'a>, out: &mut Findings) -> (Device, Facts<'a>) {
    let mut reader = Reader::new(&syntax, out);
    let sections = sorted(&mut reader);
    let mut lists = Vec::new();
    // Reserve the exact number: objects are large and many, and spare room would take most of all memory.
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
            SectionKind::Unnamed => {
                let span = section.pairs.first().map_or(syntax.name_span(section), |pair| syntax.key_span(pair));
                reader.out.push(Kind::KeyOutsideSection { keys: section.pairs.len() }, span);
            }
            SectionKind::Unknown => {
                for section in group {
                    let span = syntax.name_span(section);
                    let kind = Kind::UnknownSection { name: section.name.into(), keys: section.pairs.len() };
                    reader.out.push(kind, span);
                }
            }
            _ => lists.extend(reader.list(section)),
        }
    }
    // Modules with their own sections replace those that are only listed.
    let described = |module: &Module| modules.binary_search_by_key(&module.number, |other| other.number).is_ok();
    device.modules.retain(|module| !described(module));
    device.modules.append(&mut modules);
    device.modules.sort_by_key(|module| module.number);
    let unlimited = reader.finish();
    drop(sections);
    let mut facts = Facts::new(syntax, lists, objects);
    facts.unlimited = unlimited;
    compact_pdo::expand(&mut device, &mut facts, out);
    assign_lists(&mut device, &mut facts);
    for listed in facts.lists.iter().flat_map(|list| &list.entries) {
        if device.object(listed.index).is_none() {
            out.push(Kind::ObjectWithoutSection { index: listed.index, module: false }, listed.span);
        }
    }
    (device, facts)
}

/// The sections sorted by kind, without those that repeat an earlier one.
fn sorted<'a, 's>(reader: &mut Reader<'a, 's>) -> Vec<&'s Section<'a>> {
    let syntax = reader.syntax;
    let mut sections: Vec<&'s Section<'a>> = syntax.sections.iter().collect();
    sections.sort_unstable_by_key(|section| (section.kind, section.line));
    sections.dedup_by(|second, first| {
        let same = second.kind == first.kind && second.kind != SectionKind::Unknown;
        if same {
            let kind = Kind::DuplicateSection {
                name: second.name.into(),
                same: equal(first, second),
                first: syntax.name_span(first),
            };
            reader.out.push(kind, syntax.name_span(second));
        }
        same
    });
    sections
}

fn equal(a: &Section<'_>, b: &Section<'_>) -> bool {
    let same = |(a, b): (&Pair<'_>, &Pair<'_>)| a.key.eq_ignore_ascii_case(b.key) && a.value == b.value;
    a.pairs.len() == b.pairs.len() && a.pairs.iter().zip(&b.pairs).all(same)
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

/// Sets the list of each object: the one that names it, or the one that its index belongs to.
fn assign_lists(device: &mut Device, facts: &mut Facts<'_>) {
    let mut listed: Vec<(u16, ObjectList)> = Vec::new();
    for list in &facts.lists {
        listed.extend(list.entries.iter().map(|entry| (entry.index, list.list)));
    }
    listed.sort();
    for (object, facts) in device.objects.iter_mut().zip(&mut facts.objects) {
        let at = listed.partition_point(|&(index, _)| index < object.index);
        facts.listed = listed.get(at).filter(|(index, _)| *index == object.index).map(|&(_, list)| list);
        object.list = facts.listed.unwrap_or_else(|| ObjectList::of_index(object.index));
    }
}
