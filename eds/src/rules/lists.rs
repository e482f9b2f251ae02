//! Rules about the lists of objects.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::context::{Context, listed, plural};
use super::remedy::MAX_STEPS;
use super::rule::{Out, note};
use crate::diagnostic::Diagnostic;
use crate::edit::lists::{COUNT, rewritten};
use crate::finding::{Finding, Kind};
use crate::model::{Object, ObjectList};
use crate::parse::facts::Listed;
use crate::parse::syntax::Pair;
use crate::patch::{Change, Patch};
use crate::text::Span;

pub(super) fn object_without_section(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::ObjectWithoutSection { index, module } = finding.kind else { return None };
    let module = if module { " of the module" } else { "" };
    let note = note(format!("the object {index:04X}{module} is listed, but not described"));
    Some(note.at(finding.span, "ignored"))
}

const FIRST_THE_NUMBERS: &str = "two objects of this list have the same number; give one of them another one first";

/// A patch for a line whose number is taken: gives it the smallest free number, if its object is described and not
/// listed elsewhere.
pub(super) fn numbered_anew(cx: &Context<'_>, key: Span) -> Option<Patch> {
    let (line, _) = cx.line(key)?;
    let is_here = |doubled: &Listed| cx.line(doubled.span).is_some_and(|(there, _)| there == line);
    let list = cx.facts.lists.iter().find(|list| list.doubled.iter().any(is_here))?;
    let section = cx.facts.syntax.section_at(list.span)?;
    let at = list.doubled.iter().position(is_here)?;
    let index = list.doubled[at].index;
    let (_, facts) = cx.objects().find(|(object, _)| object.index == index)?;
    let is_again = list.doubled[..at].iter().any(|doubled| doubled.index == index);
    let is_free = |number: &u32| list.entries.iter().all(|listed| listed.number != *number);
    let free = (1..).filter(is_free).nth(at).filter(|_| facts.listed.is_none() && !is_again)?;
    let renumbered = cx.facts.syntax.with(key, &free.to_string());
    // The count after the fix; the file may state it already.
    let count = list.entries.len() + list.doubled.len();
    let is_counted = list.said.is_some_and(|(said, _)| said as usize == count) || list.doubled.len() > 1;
    let counted = (!is_counted).then(|| cx.set_in(section, COUNT, &count.to_string()));
    Some(counted.into_iter().chain([renumbered]).collect())
}

pub(super) fn list_count(cx: &Context<'_>, out: &mut Out<'_>) {
    for list in &cx.facts.lists {
        let found = list.entries.len();
        let set = || cx.set(list.span, COUNT, &found.to_string());
        // An object whose number is taken is not among the entries, but the count includes it.
        let is_doubled = !list.doubled.is_empty();
        match list.said {
            Some((said, _)) if is_doubled && said as usize == found + list.doubled.len() => {}
            Some((said, span)) if said as usize != found => {
                let note = note(format!("the list has {}, not {said}", plural(found, "object")));
                let note = note.at(span, "says otherwise");
                out.push(if is_doubled { note.help(FIRST_THE_NUMBERS) } else { note.fix(set()) });
            }
            None if found > 0 => {
                let note = note("the list does not say how many objects it has");
                out.push(note.at(list.span, "").fix(set()));
            }
            _ => {}
        }
    }
}

pub(super) fn list_gap(cx: &Context<'_>, out: &mut Out<'_>) {
    let mut in_order = InOrder::default();
    for list in &cx.facts.lists {
        let gap = list.entries.iter().zip(1..).find(|(listed, number)| listed.number != *number);
        if let Some((listed, number)) = gap {
            let note = note(format!("the list has no number {number}"));
            let note = note.at(listed.span, format!("this is number {}", listed.number));
            out.push(if list.doubled.is_empty() { note.fix(in_order.get(cx)) } else { note.help(FIRST_THE_NUMBERS) });
        }
    }
}

/// The result of [`in_order`], computed once for all findings.
#[derive(Default)]
struct InOrder(Option<Option<Arc<Patch>>>);

impl InOrder {
    fn get(&mut self, cx: &Context<'_>) -> Option<Arc<Patch>> {
        self.0.get_or_insert_with(|| in_order(cx).map(Arc::new)).clone()
    }
}

/// A patch that puts each object once into the list that its index belongs to, and numbers the lists from 1.
fn in_order(cx: &Context<'_>) -> Option<Patch> {
    let is_misplaced = |list: ObjectList, index: u16| {
        (list == ObjectList::Manufacturer) != (ObjectList::of_index(index) == ObjectList::Manufacturer)
    };
    let mut kept = BTreeSet::new();
    let mut goes = BTreeSet::new();
    let mut moved: Vec<u16> = Vec::new();
    for list in &cx.facts.lists {
        for listed in &list.entries {
            if is_misplaced(list.list, listed.index) {
                goes.insert(listed.span);
                moved.push(listed.index);
            } else if !kept.insert(listed.index) {
                goes.insert(listed.span);
            }
        }
    }
    moved.retain(|&index| kept.insert(index));
    let mut patch = Patch::default();
    for list in &cx.facts.lists {
        let section = cx.facts.syntax.section_at(list.span)?;
        let (here, elsewhere) = moved.into_iter().partition(|&index| ObjectList::of_index(index) == list.list);
        moved = elsewhere;
        let goes = |pair: &Pair<'_>, _| goes.contains(&cx.facts.syntax.value_span(pair));
        patch.extend(rewritten(&cx.facts.syntax, section, goes, &here)?);
    }
    // An object left over would belong to a list that the file lacks.
    moved.is_empty().then_some(patch)
}

pub(super) fn object_not_listed(cx: &Context<'_>, out: &mut Out<'_>) {
    let unlisted = cx.objects().filter(|(_, facts)| facts.listed.is_none() && !facts.implied);
    let unlisted: Vec<&Object> = unlisted.map(|(object, _)| object).collect();
    let indices = listed(&unlisted, |object| format!("{:04X}", object.index));
    let message = match unlisted.len() {
        0 => return,
        1 => format!("the object {indices} is in none of the lists"),
        number => format!("{number} objects are in none of the lists: {indices}"),
    };
    let places = unlisted.iter().map(|object| object.span);
    let finding = note(message).at_each(places, "other readers do not see it", "nor it");
    const NAME_THEM: &str = "name them in `[OptionalObjects]`, or from 2000h to 5FFFh in `[ManufacturerObjects]`";
    out.push(finding.help(added(cx, &unlisted).unwrap_or_else(|| NAME_THEM.to_owned())));
}

/// A remedy that appends objects to the lists.
fn added(cx: &Context<'_>, objects: &[&Object]) -> Option<String> {
    let mut lines = Vec::new();
    for kind in [ObjectList::Mandatory, ObjectList::Optional, ObjectList::Manufacturer] {
        let new: Vec<_> = objects.iter().filter(|object| object.list == kind).collect();
        if new.is_empty() {
            continue;
        }
        let list = cx.facts.lists.iter().find(|list| list.list == kind)?;
        let section = cx.facts.syntax.section_at(list.span)?;
        let last = list.entries.iter().map(|listed| listed.number).max().unwrap_or(0);
        let end = section.pairs.last().map_or(section.line, |pair| pair.line) + 1;
        let said = list.said.filter(|&(said, _)| said as usize == list.entries.len())?.0;
        lines.push(cx.set_in(section, COUNT, &(said as usize + new.len()).to_string()));
        let add = |(object, number): (&&&Object, u32)| Change::After(end, format!("{number}=0x{:04X}", object.index));
        lines.extend(new.iter().zip(last + 1..).map(add));
    }
    (lines.len() <= MAX_STEPS).then(|| Patch::from_iter(lines).to_string())
}

pub(super) fn listed_twice(cx: &Context<'_>, out: &mut Out<'_>) {
    let mut seen: BTreeMap<u16, Span> = BTreeMap::new();
    let mut in_order = InOrder::default();
    for listed in cx.facts.lists.iter().flat_map(|list| &list.entries) {
        match seen.get(&listed.index) {
            Some(&first) => {
                let note = note(format!("the object {:04X} is listed again", listed.index));
                out.push(note.at(listed.span, "").and(first, "first here").fix(in_order.get(cx)));
            }
            None => {
                seen.insert(listed.index, listed.span);
            }
        }
    }
}

pub(super) fn wrong_list(cx: &Context<'_>, out: &mut Out<'_>) {
    let mut in_order = InOrder::default();
    for list in &cx.facts.lists {
        for listed in &list.entries {
            let manufacturers = matches!(listed.index, 0x2000..=0x5FFF);
            if manufacturers != (list.list == ObjectList::Manufacturer) {
                let right = if manufacturers { "the manufacturer's" } else { "not the manufacturer's" };
                let note = note(format!("the object {:04X} is {right}", listed.index));
                out.push(note.at(listed.span, "").and(list.span, "in this list").fix(in_order.get(cx)));
            }
        }
    }
}
