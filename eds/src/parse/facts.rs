//! What rules need to know about a data sheet besides the model.

use std::collections::BTreeMap;

use crate::model::{ObjectKind, ObjectList};
use crate::parse::section::{ObjectPart, SectionKind};
use crate::parse::syntax::{Section, Syntax};
use crate::text::{Source, Span};

/// Sections and keys, lists, and facts about objects.
pub(crate) struct Facts<'a> {
    pub(crate) syntax: Syntax<'a>,
    pub(crate) lists: Vec<List>,
    /// One for each object of the model, in the same order.
    pub(crate) objects: Vec<ObjectFacts>,
    pub(crate) unlimited: Vec<Unlimited>,
    /// The positions of sections that describe entries in a table.
    tables: BTreeMap<(u16, ObjectPart), usize>,
}

impl<'a> Facts<'a> {
    pub(crate) fn new(syntax: Syntax<'a>, lists: Vec<List>, objects: Vec<ObjectFacts>) -> Self {
        let mut tables = BTreeMap::new();
        for (number, section) in syntax.sections.iter().enumerate() {
            if let SectionKind::Object(
                index,
                part @ (ObjectPart::Names | ObjectPart::Values | ObjectPart::Denotations),
            ) = section.kind
            {
                tables.entry((index, part)).or_insert(number);
            }
        }
        Self { syntax, lists, objects, unlimited: Vec::new(), tables }
    }

    /// For a text that is no data sheet.
    pub(crate) fn none(source: &'a Source) -> Self {
        Self::new(Syntax { source, sections: Vec::new() }, Vec::new(), Vec::new())
    }

    /// The first section of a kind.
    pub(crate) fn section(&self, kind: SectionKind) -> Option<&Section<'a>> {
        self.syntax.sections.iter().find(|section| section.kind == kind)
    }

    /// The first section `[2000Name]`, `[2000Value]` or `[2000Denotation]`, by part.
    pub(crate) fn table(&self, index: u16, part: ObjectPart) -> Option<&Section<'a>> {
        Some(&self.syntax.sections[*self.tables.get(&(index, part))?])
    }

    /// The object that a place in the data sheet is about, and the sub-index if it has its own section. `None` for the
    /// beginning of the file, which stands for the whole file.
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

/// An entry whose limits are both 0: editors write that for "no limits".
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unlimited {
    pub(crate) index: u16,
    pub(crate) sub: u8,
    pub(crate) limits: [Span; 2],
}

/// What rules need to know about an object besides the model.
#[derive(Clone, Debug)]
pub(crate) struct ObjectFacts {
    /// Whether there is a section `[1018]`.
    pub(crate) header: bool,
    /// The number of sections `[1018subN]`.
    pub(crate) subs: u16,
    pub(crate) sub_number: Option<u16>,
    /// `CompactSubObj`; 0 without it.
    pub(crate) compact: u8,
    /// `ObjectType`, if it is given and valid.
    pub(crate) declared: Option<ObjectKind>,
    /// The list that names it.
    pub(crate) listed: Option<ObjectList>,
    /// Whether it has no section, but follows from `CompactPDO`.
    pub(crate) implied: bool,
}

impl ObjectFacts {
    /// For an object without any section.
    pub(crate) fn implied(kind: ObjectKind) -> Self {
        Self { header: true, subs: 0, sub_number: None, compact: 0, declared: Some(kind), listed: None, implied: true }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct List {
    pub(crate) list: ObjectList,
    /// The name of the section.
    pub(crate) span: Span,
    /// The count that `SupportedObjects` states.
    pub(crate) said: Option<(u32, Span)>,
    /// The listed objects, in the order of their numbers.
    pub(crate) entries: Vec<Listed>,
    /// Lines whose number another line has already; they are not read as listed.
    pub(crate) doubled: Vec<Listed>,
}

/// `7=0x1018`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listed {
    pub(crate) number: u32,
    pub(crate) index: u16,
    /// Where the index is.
    pub(crate) span: Span,
}
