//! The rules: one per file, named after what holds where it finds nothing.
//!
//! Some rules are applied while reading, where the odd text is at hand (`check: None`); the others to the
//! finished model. Each has a stable code, and a golden case under `tests/golden/` that shows what it finds.

use crate::diagnostics::{Diagnostic, Diagnostics, Severity};
use crate::eds::Facts;
use crate::model::{Device, Entry};
use crate::number::Oddity;
use crate::object::Key;
use crate::overlay::Changes;
use crate::source::Span;

/// A rule.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// The code of its findings.
    pub code: &'static str,
    /// How bad its findings are.
    pub severity: Severity,
    /// What holds where it finds nothing: one sentence.
    pub holds: &'static str,
    /// Why that matters, and what is done about it: one paragraph.
    pub explain: &'static str,
    /// Finds what breaks the rule in a finished model; `None` when that is done while reading.
    check: Option<fn(&Context<'_>, &mut Diagnostics)>,
}

/// What a rule looks at.
pub(crate) struct Context<'a> {
    pub(crate) device: &'a Device,
    pub(crate) facts: &'a Facts<'a>,
    pub(crate) changes: &'a Changes,
}

macro_rules! rules {
    ($($name:ident,)*) => {
        $(pub(crate) mod $name;)*

        const RULES: &[&Rule] = &[$(&$name::RULE),*];
    };
}

rules! {
    file_is_within_bounds,
    file_is_not_xml,
    text_is_ascii_or_utf8,
    lines_are_at_most_255_characters_long,
    section_names_are_closed,
    nothing_follows_a_section_name,
    keys_and_values_are_separated_by_equals_signs,
    lines_are_sections_keys_or_comments,
    tokenizer_and_locator_agree,
    keys_are_in_sections,
    sections_are_known,
    sections_are_unique,
    keys_are_known,
    keys_have_a_meaning_where_they_stand,
    keys_are_unique,
    numbers_are_not_empty,
    numbers_are_numbers,
    numbers_fit_their_keys,
    flags_are_zero_or_one,
    numbers_are_not_octal_by_mistake,
    numbers_have_no_comment_behind_them,
    numbers_are_spelled_as_in_c,
    node_id_is_the_only_variable,
    octet_strings_are_hexadecimal,
    values_are_values_of_their_type,
    tables_are_counted,
    tables_name_existing_entries,
    subs_are_single_values,
    object_types_are_known,
    entries_have_a_data_type,
    data_types_are_known,
    entries_have_an_access_type,
    access_types_are_known,
    dummies_are_data_types,
    dynamic_channels_have_a_range,
    listed_objects_are_described,
    overlays_are_toml,
    overlays_name_their_format,
    overlay_keys_are_known,
    overlay_values_are_of_their_kind,
    overlay_objects_exist,
    overlay_corrections_have_a_reason,
    overlay_corrections_change_something,
    overlay_entries_have_one_meaning,
    overlay_ranges_are_in_order,
    enumerations_are_unambiguous,
    bit_fields_do_not_overlap,
    units_are_decided_by_conditions,
    overlay_names_are_defined,
    overlay_names_are_used,
    users_of_a_name_share_a_data_type,
    meanings_fit_their_data_type,
    conditions_ask_for_existing_entries,
}

/// All rules, in the order in which they are applied.
#[must_use]
pub fn rules() -> &'static [&'static Rule] {
    RULES
}

/// The rule with this code.
#[must_use]
pub fn rule(code: &str) -> Option<&'static Rule> {
    rules().iter().copied().find(|rule| rule.code == code)
}

/// Applies all rules to a finished model.
pub(crate) fn all(context: &Context<'_>, out: &mut Diagnostics) {
    for check in RULES.iter().filter_map(|rule| rule.check) {
        check(context, out);
    }
}

impl Rule {
    fn finding(&self, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(self.code, self.severity, message)
    }
}

impl Context<'_> {
    /// The place of a key's value in the section of an object or entry; the name of the section without that key.
    fn value_span(&self, of: Span, key: Key) -> Span {
        let syntax = &self.facts.syntax;
        let pair = syntax.section_at(of).and_then(|section| section.get(key.name()));
        pair.map_or(of, |pair| syntax.value_span(pair))
    }

    /// The place of a key's value of an entry; in the overlay when that corrects it.
    fn entry_span(&self, entry: &Entry, key: Key) -> Span {
        let corrected = self.changes.correction(entry.index, entry.sub, key);
        corrected.unwrap_or_else(|| self.value_span(entry.span, key))
    }
}

/// What was odd about a number, by the rule that it breaks.
pub(crate) fn oddity(oddity: Oddity, key: &str, text: &str, span: Span) -> Diagnostic {
    match oddity {
        Oddity::Comment => numbers_have_no_comment_behind_them::found(key, span),
        Oddity::Octal => numbers_are_not_octal_by_mistake::found(key, text, true, span),
        Oddity::NotOctal => numbers_are_not_octal_by_mistake::found(key, text, false, span),
        Oddity::Spelling => numbers_are_spelled_as_in_c::found(key, text, span),
        Oddity::Variable => node_id_is_the_only_variable::found(key, span),
        Oddity::NotHex => octet_strings_are_hexadecimal::found(key, span),
    }
}

/// A finding that is told once for all occurrences of a key.
pub(crate) fn grouped(rule: &Rule, key: &str, count: usize, first: Span) -> Diagnostic {
    let what = match rule.code {
        code if code == keys_are_known::RULE.code => "is unknown and ignored",
        code if code == numbers_are_not_empty::RULE.code => "is empty",
        _ => "means nothing here and is ignored",
    };
    let times = if count == 1 { String::new() } else { format!(" ({count} times)") };
    rule.finding(format!("the key `{key}` {what}{times}")).at(first, if count == 1 { "" } else { "first here" })
}

/// `1 key`, `2 keys`, `2 entries`.
fn plural(count: usize, word: &str) -> String {
    match (count, word.strip_suffix('y').filter(|stem| !stem.ends_with(['a', 'e', 'o']))) {
        (1, _) => format!("1 {word}"),
        (_, Some(stem)) => format!("{count} {stem}ies"),
        _ => format!("{count} {word}s"),
    }
}

/// `is 1 key`, `are 2 keys`.
fn are(count: usize, word: &str) -> String {
    format!("{} {}", if count == 1 { "is" } else { "are" }, plural(count, word))
}
