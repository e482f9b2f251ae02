//! The three lists of objects (CiA 306-1).

use crate::model::ObjectList;
use crate::read::Reader;
use crate::section::SectionKind;
use crate::source::Span;
use crate::syntax::Section;

/// One of the lists.
#[derive(Clone, Debug)]
pub(crate) struct List {
    pub(crate) list: ObjectList,
    /// The name of the section.
    pub(crate) span: Span,
    /// `SupportedObjects`.
    pub(crate) said: Option<(u32, Span)>,
    /// What is listed, in the order of the numbers.
    pub(crate) entries: Vec<Listed>,
}

/// `7=0x1018`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listed {
    pub(crate) number: u32,
    pub(crate) index: u16,
    /// The index.
    pub(crate) span: Span,
}

impl<'a, 's> Reader<'a, 's> {
    /// The list that a section is, if it is one.
    pub(crate) fn list(&mut self, section: &'s Section<'a>) -> Option<List> {
        let list = match section.kind {
            SectionKind::MandatoryObjects => ObjectList::Mandatory,
            SectionKind::OptionalObjects => ObjectList::Optional,
            SectionKind::ManufacturerObjects => ObjectList::Manufacturer,
            _ => return None,
        };
        let ([said], lines) = self.numbered(section, "", 10, &["SupportedObjects"]);
        let said = said.and_then(|pair| Some((self.number(Some(pair))?, self.syntax.value_span(pair))));
        let mut entries = Vec::with_capacity(lines.len());
        for line in lines {
            if let Some(index) = self.number(Some(line.pair)) {
                entries.push(Listed { number: line.number, index, span: self.syntax.value_span(line.pair) });
            }
        }
        Some(List { list, span: self.syntax.name_span(section), said, entries })
    }
}

/// The list that an object belongs into by its index, when none names it.
pub(crate) fn natural_list(index: u16) -> ObjectList {
    match index {
        0x1000 | 0x1001 | 0x1018 => ObjectList::Mandatory,
        0x2000..=0x5FFF => ObjectList::Manufacturer,
        _ => ObjectList::Optional,
    }
}
