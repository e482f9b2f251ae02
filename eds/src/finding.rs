//! What parsing and overlays find, as data: a kind with its values, and the place. The rules put it into words.

use std::mem::{Discriminant, discriminant};

use crate::diagnostic::MAX_PER_CODE;
use crate::model::keys::Key;
use crate::model::types::DataType;
use crate::model::{AccessType, ObjectKind};
use crate::text::{Refusal, Span};

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Finding {
    pub(crate) kind: Kind,
    pub(crate) span: Span,
    /// How many later findings of the same kind were not kept.
    pub(crate) more: usize,
}

/// What was found. Spans in it are places that disagree with that of the finding.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    FileSize(Refusal),
    Xml { why: Box<str>, help: &'static str },
    DanglingReference(Box<str>),
    DuplicateId { id: Box<str>, first: Span },
    Unread(Box<[(Box<str>, usize)]>),
    Project,
    Encoding,
    LongLine { characters: usize },
    UnclosedSection,
    TextAfterSection,
    NoEqualsSign(Separator),
    StrayText,
    Tokenizer,
    KeyOutsideSection { keys: usize },
    UnknownSection { name: Box<str>, keys: usize },
    DuplicateSection { name: Box<str>, same: bool, first: Span },
    UnknownKey(Repeated),
    KeyWithoutEffect(Repeated),
    EmptyNumber(Repeated),
    RealBits(Repeated),
    DuplicateKey { key: Box<str>, same: bool, first: Span },
    BadNumber { key: Box<str> },
    NumberTooLarge { key: Box<str>, value: i128 },
    BadFlag { key: Box<str> },
    OddNumber { key: Box<str>, text: Box<str>, oddity: Oddity },
    BadValue { key: Box<str>, text: Box<str>, data_type: DataType },
    EntryCount { said: usize, found: usize },
    ValueWithoutEntry { index: u16, sub: u32 },
    NestedObject(ObjectKind),
    BadObjectType(u8),
    MissingDataType,
    UnknownDataType(DataType),
    MissingAccessType,
    BadAccessType { word: Box<str>, access: AccessType, sure: bool },
    BadDummy(u32),
    BadChannel,
    ObjectWithoutSection { index: u16, module: bool },
    TooManyEntries(u16),

    OverlaySyntax(Box<str>),
    OverlayWithoutFormat,
    OverlayFormat(i128),
    OverlayKey { key: Box<str>, known: Box<str> },
    OverlayKeyOfRecord(Box<str>),
    OverlayValue { expected: Box<str> },
    OverlayObject(Box<str>),
    OverlayReason(Box<str>),
    OverlayNoEffect { index: u16, sub: u8, key: Key },
    OverlayMeanings { first: Span },
    OverlayRange,
    OverlayDuplicateValue { values: [(i128, Box<str>); 2] },
    OverlayBits { names: [Box<str>; 2] },
    OverlayUnits { units: usize },
    OverlayDuplicateParameter { number: Box<str>, first: Span },
}

/// A key that is reported once for all its occurrences.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Repeated {
    /// The spelling of its first occurrence.
    pub(crate) key: Box<str>,
    pub(crate) count: usize,
}

/// What stands between a key and its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Separator {
    Equals,
    Colon,
    /// A blank; accepted only after keys of an object.
    Blank,
}

/// An irregularity in a number that could be read nevertheless.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Oddity {
    /// A comment follows on the same line.
    Comment,
    /// A leading zero makes it octal, which people rarely mean.
    Octal,
    /// A leading zero, but digits that are not octal.
    NotOctal,
    /// `NULL`, `true`, `1.0`, `1.0f`, `0x1F80h`, a decimal comma.
    Spelling,
    /// A variable other than `$NODEID`.
    Variable,
    /// Text where an OCTET_STRING should be hexadecimal.
    NotHex,
    /// The bits of a REAL.
    Bits,
}

/// The findings in the order in which they were made; at most [`MAX_PER_CODE`] of each kind are kept.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    list: Vec<Finding>,
    /// For each kind: the number of findings, and the position of the last one kept.
    seen: Vec<(Discriminant<Kind>, usize, usize)>,
    total: usize,
}

impl Findings {
    pub(crate) fn push(&mut self, kind: Kind, span: Span) {
        self.push_many(kind, span, 0);
    }

    /// Adds a finding that stands for `more` others of its kind.
    pub(crate) fn push_many(&mut self, kind: Kind, span: Span, more: usize) {
        self.total += 1;
        let of_kind = discriminant(&kind);
        let at = match self.seen.iter().position(|(seen, ..)| *seen == of_kind) {
            Some(at) => at,
            None => {
                self.seen.push((of_kind, 0, 0));
                self.seen.len() - 1
            }
        };
        let (_, count, last) = &mut self.seen[at];
        *count += 1;
        if *count <= MAX_PER_CODE {
            *last = self.list.len();
            self.list.push(Finding { kind, span, more });
        } else {
            self.list[*last].more += 1 + more;
        }
    }

    /// The number of findings, including those that were not kept.
    pub(crate) fn total(&self) -> usize {
        self.total
    }

    /// Whether the finding is already among those from position `since` on.
    pub(crate) fn has(&self, since: usize, kind: &Kind, span: Span) -> bool {
        self.list.iter().skip(since).any(|finding| finding.span == span && finding.kind == *kind)
    }

    pub(crate) fn kept(&self) -> usize {
        self.list.len()
    }

    pub(crate) fn iter(&self) -> std::slice::Iter<'_, Finding> {
        self.list.iter()
    }
}
