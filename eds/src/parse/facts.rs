//! What the rules need to know of a data sheet beyond the model.

use std::collections::BTreeMap;

use crate::model::{ObjectKind, ObjectList};
use crate::parse::section::{ObjectPart, SectionKind};
use crate::parse::syntax::{Section, Syntax};
use crate::text::{Source, Span};

/// The sections and keys, and what they say of lists and objects.
pub(crate) struct Facts<'a> {
    pub(crate) syntax: Syntax<'a>,
    pub(crate) lists: Vec<List>,
    /// As many as the model has objects, and in the same order.
    pub(crate) objects: Vec<ObjectFacts>,
    pub(crate) unlimited: Vec<Unlimited>,
    /// The sections that describe entries in a table, by their numbers in the file.
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

    /// Of a text that is no data sheet.
    pub(crate) fn none(source: &'a Source) -> Self {
        Self::new(Syntax { source, sections: Vec::new() }, Vec::new(), Vec::new())
    }

    /// The first section of a kind.
    pub(crate) fn section(&self, kind: SectionKind) -> Option<&Section<'a>> {
        self.syntax.sections.iter().find(|section| section.kind == kind)
    }

    /// `[2000Name]`, `[2000Value]` and `[2000Denotation]`.
    pub(crate) fn table(&self, index: u16, part: ObjectPart) -> Option<&Section<'a>> {
        Some(&self.syntax.sections[*self.tables.get(&(index, part))?])
    }

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

/// An entry whose limits are both 0, which editors write where nothing was entered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unlimited {
    pub(crate) index: u16,
    pub(crate) sub: u8,
    /// Where they are.
    pub(crate) limits: [Span; 2],
}

/// What the rules want to know of an object beyond the model.
#[derive(Clone, Debug)]
pub(crate) struct ObjectFacts {
    /// Whether there is a section `[1018]`.
    pub(crate) header: bool,
    /// How many `[1018subN]` there are.
    pub(crate) subs: u16,
    pub(crate) sub_number: Option<u16>,
    /// `CompactSubObj`, when it is not 0.
    pub(crate) compact: u8,
    /// `ObjectType`, where it is given and understood.
    pub(crate) declared: Option<ObjectKind>,
    /// The list that names it.
    pub(crate) listed: Option<ObjectList>,
    /// Whether no section describes it: it follows from `CompactPDO`.
    pub(crate) implied: bool,
}

impl ObjectFacts {
    /// Of an object that no section describes.
    pub(crate) fn implied(kind: ObjectKind) -> Self {
        Self { header: true, subs: 0, sub_number: None, compact: 0, declared: Some(kind), listed: None, implied: true }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct List {
    pub(crate) list: ObjectList,
    /// The name of the section.
    pub(crate) span: Span,
    /// `SupportedObjects`.
    pub(crate) said: Option<(u32, Span)>,
    /// What is listed, in the order of the numbers.
    pub(crate) entries: Vec<Listed>,
    /// What has the number of another object, and so is not listed.
    pub(crate) doubled: Vec<Listed>,
}

/// `7=0x1018`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listed {
    pub(crate) number: u32,
    pub(crate) index: u16,
    /// The index.
    pub(crate) span: Span,
}
