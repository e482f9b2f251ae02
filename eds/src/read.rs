//! From sections and keys to objects: what every part of reading needs.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::check::{self, Rule};
use crate::diagnostics::{Diagnostics, MAX_PER_CODE};
use crate::number::{self, Read};
use crate::source::Span;
use crate::syntax::{Pair, Section, Syntax};

/// Reads keys and reports what is wrong with them.
pub(crate) struct Reader<'a, 's> {
    pub(crate) syntax: &'s Syntax<'a>,
    pub(crate) out: &'s mut Diagnostics,
    grouped: BTreeMap<&'static str, Groups>,
    /// How many entries `CompactSubObj` stood for so far.
    pub(crate) compact_entries: usize,
}

/// Findings of one rule, each told once for all keys of a name.
struct Groups {
    rule: &'static Rule,
    /// By the name in lower case: so many as findings of a rule are kept.
    by_key: BTreeMap<Box<str>, Group>,
    /// How many keys had other names.
    more: usize,
}

/// All keys of a name.
struct Group {
    /// As it is spelled first.
    key: Box<str>,
    first: Span,
    count: usize,
}

/// A key of the form `Line7` or `7`.
pub(crate) struct Numbered<'a, 's> {
    pub(crate) number: u32,
    pub(crate) pair: &'s Pair<'a>,
}

impl<'a, 's> Reader<'a, 's> {
    pub(crate) fn new(syntax: &'s Syntax<'a>, out: &'s mut Diagnostics) -> Self {
        Self { syntax, out, grouped: BTreeMap::new(), compact_entries: 0 }
    }

    /// The pairs of a section by the position of their keys in a table; unknown and repeated keys are reported.
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

    /// The pairs whose keys are `prefix` and a number, ascending; and those in `table`.
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

    /// A text; `None` when the key is absent or empty.
    pub(crate) fn text(&self, pair: Option<&Pair<'_>>) -> Option<String> {
        pair.filter(|pair| !pair.value.is_empty()).map(|pair| pair.value.to_owned())
    }

    /// A number of some type; `None` when the key is absent or empty, or after a report.
    pub(crate) fn number<T: TryFrom<i128>>(&mut self, pair: Option<&Pair<'_>>) -> Option<T> {
        let pair = pair?;
        if pair.value.is_empty() {
            self.group(&check::numbers_are_not_empty::RULE, pair.key, self.syntax.key_span(pair));
            return None;
        }
        let span = self.syntax.value_span(pair);
        let Some(Read { value, oddity }) = number::integer(pair.value) else {
            self.out.push(check::numbers_are_numbers::found(pair.key, span));
            return None;
        };
        self.oddity(oddity, pair);
        let number = T::try_from(value).ok();
        if number.is_none() {
            self.out.push(check::numbers_fit_their_keys::found(pair.key, value, span));
        }
        number
    }

    /// A flag that is 0 or 1; absent or empty is 0.
    pub(crate) fn flag(&mut self, pair: Option<&Pair<'_>>) -> bool {
        let Some(pair) = pair else { return false };
        match pair.value {
            // The most frequent values of the most frequent keys.
            "0" | "0x0" => return false,
            "1" | "0x1" => return true,
            _ => {}
        }
        let value: i128 = self.number(Some(pair)).unwrap_or(0);
        if !matches!(value, 0 | 1) {
            self.out.push(check::flags_are_zero_or_one::found(pair.key, self.syntax.value_span(pair)));
        }
        value != 0
    }

    /// Reports what was odd about a number.
    pub(crate) fn oddity(&mut self, oddity: Option<number::Oddity>, pair: &Pair<'_>) {
        if let Some(oddity) = oddity {
            let span = self.syntax.value_span(pair);
            self.out.push(check::oddity(oddity, pair.key, pair.value, span));
        }
    }

    /// Reports a key once for all its occurrences.
    pub(crate) fn group(&mut self, rule: &'static Rule, key: &str, span: Span) {
        let groups = self.grouped.entry(rule.code);
        let groups = groups.or_insert_with(|| Groups { rule, by_key: BTreeMap::new(), more: 0 });
        let name = key.to_ascii_lowercase();
        if let Some(group) = groups.by_key.get_mut(name.as_str()) {
            group.count += 1;
        } else if groups.by_key.len() < MAX_PER_CODE {
            groups.by_key.insert(name.into(), Group { key: key.into(), first: span, count: 1 });
        } else {
            groups.more += 1;
        }
    }

    /// Hands over what was grouped.
    pub(crate) fn finish(self) {
        for Groups { rule, by_key, more } in self.grouped.into_values() {
            for group in by_key.into_values() {
                self.out.push(check::grouped(rule, &group.key, group.count, group.first));
            }
            self.out.count_only(rule.code, more);
        }
    }

    pub(crate) fn unknown(&mut self, pair: &Pair<'_>) {
        self.group(&check::keys_are_known::RULE, pair.key, self.syntax.key_span(pair));
    }

    /// Fills a slot; of several pairs with one key the first counts.
    pub(crate) fn keep_first(&mut self, slot: &mut Option<&'s Pair<'a>>, pair: &'s Pair<'a>) {
        match slot {
            Some(first) => self.repeated(first, pair),
            None => *slot = Some(pair),
        }
    }

    fn repeated(&mut self, first: &Pair<'_>, second: &Pair<'_>) {
        let (first_span, second_span) = (self.syntax.key_span(first), self.syntax.key_span(second));
        self.out.push(check::keys_are_unique::found(second.key, first.value == second.value, first_span, second_span));
    }
}

/// Where a key is in a table, in any case and with blanks anywhere.
pub(crate) fn position(table: &[&str], key: &str) -> Option<usize> {
    let find = |key: &str| table.iter().position(|name| name.eq_ignore_ascii_case(key));
    find(key).or_else(|| key.contains(char::is_whitespace).then(|| find(&without_blanks(key)))?)
}

fn without_blanks(text: &str) -> Cow<'_, str> {
    if text.contains(char::is_whitespace) { Cow::Owned(text.split_whitespace().collect()) } else { Cow::Borrowed(text) }
}

fn number_of_key(key: &str, prefix: &str, radix: u32) -> Option<u32> {
    let rest = key.get(prefix.len()..).filter(|_| key[..prefix.len()].eq_ignore_ascii_case(prefix))?;
    let (digits, radix) = match rest.strip_prefix("0x").or_else(|| rest.strip_prefix("0X")) {
        Some(hex) => (hex, 16),
        None => (rest, radix),
    };
    (!digits.starts_with('+')).then(|| u32::from_str_radix(digits, radix).ok())?
}
