//! Reads keys: what the files for all kinds of sections share.

use std::collections::BTreeMap;

use crate::diagnostic::MAX_PER_CODE;
use crate::finding::{Findings, Kind, Oddity, Repeated};
use crate::parse::facts::Unlimited;
use crate::parse::number::{self, Read};
use crate::parse::section::{position, without_blanks};
use crate::parse::syntax::{Pair, Section, Syntax};
use crate::text::Span;

/// Reads keys and reports what is wrong with them.
pub(crate) struct Reader<'a, 's> {
    pub(crate) syntax: &'s Syntax<'a>,
    pub(crate) out: &'s mut Findings,
    grouped: BTreeMap<Group, Groups>,
    /// The number of entries that `CompactSubObj` has added so far, and the bytes of their texts.
    pub(crate) compact_entries: usize,
    pub(crate) compact_bytes: usize,
    /// Entries whose limits are both 0.
    pub(crate) unlimited: Vec<Unlimited>,
}

/// Findings that are reported once for all keys of the same name.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Group {
    Unknown,
    Empty,
    WithoutEffect,
    RealBits,
}

#[derive(Default)]
struct Groups {
    /// By the name in lower case; at most as many names as findings of one kind are kept.
    by_key: BTreeMap<Box<str>, (Repeated, Span)>,
    /// The number of keys with further names.
    more: usize,
}

/// A key of the form `Line7` or `7`.
pub(crate) struct Numbered<'a, 's> {
    pub(crate) number: u32,
    pub(crate) pair: &'s Pair<'a>,
}

impl<'a, 's> Reader<'a, 's> {
    pub(crate) fn new(syntax: &'s Syntax<'a>, out: &'s mut Findings) -> Self {
        Self { syntax, out, grouped: BTreeMap::new(), compact_entries: 0, compact_bytes: 0, unlimited: Vec::new() }
    }

    /// The pairs of a section, each at the position of its key in `table`. Reports unknown and repeated keys.
    pub(crate) fn fields<const N: usize>(
        &mut self,
        section: &'s Section<'a>,
        table: &[&str; N],
    ) -> [Option<&'s Pair<'a>>; N] {
        let mut fields = [None; N];
        for pair in &section.pairs {
            match position(table, pair.key) {
                Some(at) => self.keep_first(&mut fields[at], pair),
                None => self.unknown(pair),
            }
        }
        fields
    }

    /// The pairs whose keys are `prefix` and a number, in ascending order, and those whose keys are in `table`.
    pub(crate) fn numbered<const N: usize>(
        &mut self,
        section: &'s Section<'a>,
        prefix: &str,
        radix: u32,
        table: &[&str; N],
    ) -> ([Option<&'s Pair<'a>>; N], Vec<Numbered<'a, 's>>) {
        let mut fields = [None; N];
        let mut found = Vec::with_capacity(section.pairs.len());
        for pair in &section.pairs {
            if let Some(at) = position(table, pair.key) {
                self.keep_first(&mut fields[at], pair);
            } else if let Some(number) = number_of_key(&without_blanks(pair.key), prefix, radix) {
                found.push(Numbered { number, pair });
            } else {
                self.unknown(pair);
            }
        }
        found.sort_by_key(|numbered| numbered.number);
        found.dedup_by(|second, first| {
            let same = second.number == first.number;
            if same {
                self.repeated(first.pair, second.pair);
            }
            same
        });
        (fields, found)
    }

    /// Reads a text; `None` if the key is absent or empty.
    pub(crate) fn text(&self, pair: Option<&Pair<'_>>) -> Option<String> {
        pair.filter(|pair| !pair.value.is_empty()).map(|pair| pair.value.to_owned())
    }

    /// Reads a number in the range of `T`; `None` if the key is absent or empty, or was reported.
    pub(crate) fn number<T: TryFrom<i128>>(&mut self, pair: Option<&Pair<'_>>) -> Option<T> {
        let pair = pair?;
        if pair.value.is_empty() {
            self.group(Group::Empty, pair.key, self.syntax.key_span(pair));
            return None;
        }
        let Some(Read { value, oddity }) = number::integer(pair.value) else {
            self.out.push(Kind::BadNumber { key: pair.key.into() }, self.syntax.value_span(pair));
            return None;
        };
        self.oddity(oddity, pair);
        let number = T::try_from(value).ok();
        if number.is_none() {
            let kind = Kind::NumberTooLarge { key: pair.key.into(), value };
            self.out.push(kind, self.syntax.value_span(pair));
        }
        number
    }

    /// Reads a flag, 0 or 1; absent or empty means 0.
    pub(crate) fn flag(&mut self, pair: Option<&Pair<'_>>) -> bool {
        let Some(pair) = pair else { return false };
        match pair.value {
            // Shortcut for the most frequent values.
            "0" | "0x0" => return false,
            "1" | "0x1" => return true,
            _ => {}
        }
        let value: i128 = self.number(Some(pair)).unwrap_or(0);
        if !matches!(value, 0 | 1) {
            self.out.push(Kind::BadFlag { key: pair.key.into() }, self.syntax.value_span(pair));
        }
        value != 0
    }

    /// Reports the irregularity of a number.
    pub(crate) fn oddity(&mut self, oddity: Option<Oddity>, pair: &Pair<'_>) {
        if let Some(oddity) = oddity {
            let span = self.syntax.value_span(pair);
            if oddity == Oddity::Bits {
                return self.group(Group::RealBits, pair.key, span);
            }
            self.out.push(Kind::OddNumber { key: pair.key.into(), text: pair.value.into(), oddity }, span);
        }
    }

    /// Reports a key once for all its occurrences.
    pub(crate) fn group(&mut self, group: Group, key: &str, span: Span) {
        let groups = self.grouped.entry(group).or_default();
        let name = key.to_ascii_lowercase();
        if let Some((repeated, _)) = groups.by_key.get_mut(name.as_str()) {
            repeated.count += 1;
        } else if groups.by_key.len() < MAX_PER_CODE {
            groups.by_key.insert(name.into(), (Repeated { key: key.into(), count: 1 }, span));
        } else {
            groups.more += 1;
        }
    }

    /// Hands over the grouped findings.
    pub(crate) fn finish(self) -> Vec<Unlimited> {
        for (group, Groups { by_key, mut more }) in self.grouped {
            let kind = match group {
                Group::Unknown => Kind::UnknownKey,
                Group::Empty => Kind::EmptyNumber,
                Group::WithoutEffect => Kind::KeyWithoutEffect,
                Group::RealBits => Kind::RealBits,
            };
            for (repeated, span) in by_key.into_values() {
                self.out.push_many(kind(repeated), span, std::mem::take(&mut more));
            }
        }
        self.unlimited
    }

    pub(crate) fn unknown(&mut self, pair: &Pair<'_>) {
        self.group(Group::Unknown, pair.key, self.syntax.key_span(pair));
    }

    /// Fills a slot; the first of several pairs with the same key counts.
    pub(crate) fn keep_first(&mut self, slot: &mut Option<&'s Pair<'a>>, pair: &'s Pair<'a>) {
        match slot {
            Some(first) => self.repeated(first, pair),
            None => *slot = Some(pair),
        }
    }

    fn repeated(&mut self, first: &Pair<'_>, second: &Pair<'_>) {
        let (first_span, second_span) = (self.syntax.key_span(first), self.syntax.key_span(second));
        let same = first.value == second.value;
        self.out.push(Kind::DuplicateKey { key: second.key.into(), same, first: first_span }, second_span);
    }
}

pub(crate) fn number_of_key(key: &str, prefix: &str, radix: u32) -> Option<u32> {
    let rest = key.get(prefix.len()..).filter(|_| key[..prefix.len()].eq_ignore_ascii_case(prefix))?;
    let (digits, radix) = match rest.strip_prefix("0x").or_else(|| rest.strip_prefix("0X")) {
        Some(hex) => (hex, 16),
        None => (rest, radix),
    };
    (!digits.starts_with('+')).then(|| u32::from_str_radix(digits, radix).ok())?
}
