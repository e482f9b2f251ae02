//! The rules: one per file, named after what holds where it finds nothing.
//!
//! Some rules are applied while reading, where the odd text is at hand (`check: None`); the others to the
//! finished model. Each has a stable code, and a golden case under `tests/golden/` that shows what it finds.

pub(crate) use context::Context;

use crate::diagnostics::{Diagnostic, Diagnostics, Severity};
use crate::model::{Direction, Entry, Mapped, Pdo, Value};
use crate::number::Oddity;
use crate::object::Key;
use crate::source::Span;
use crate::types::DataType;

mod context;
mod standard;

// The rules, by name.
pub(crate) mod a_bit_rate_is_supported;
pub(crate) mod accepted_findings_are_found;
pub(crate) mod access_types_are_known;
pub(crate) mod an_error_control_is_there;
pub(crate) mod arrays_and_records_have_subs;
pub(crate) mod arrays_have_one_data_type;
pub(crate) mod bit_fields_do_not_overlap;
pub(crate) mod commissioned_bit_rate_is_supported;
pub(crate) mod commissioned_node_id_is_possible;
pub(crate) mod communication_parameters_are_not_mappable;
pub(crate) mod compact_objects_have_at_most_254_subs;
pub(crate) mod compact_objects_stand_for_a_bounded_number_of_entries;
pub(crate) mod compact_pdos_are_written_out;
pub(crate) mod compact_pdos_can_be_written_out;
pub(crate) mod conditions_ask_for_existing_entries;
pub(crate) mod configured_values_are_within_their_limits;
pub(crate) mod configured_values_can_be_written;
pub(crate) mod connected_modules_are_supported;
pub(crate) mod constants_have_a_default;
pub(crate) mod data_types_are_known;
pub(crate) mod dates_and_times_have_their_form;
pub(crate) mod default_sdo_has_its_cob_ids;
pub(crate) mod defaults_are_within_their_limits;
pub(crate) mod defaults_are_within_their_type;
pub(crate) mod device_info_is_complete;
pub(crate) mod dummies_are_data_types;
pub(crate) mod dynamic_channels_are_announced;
pub(crate) mod dynamic_channels_have_a_range;
pub(crate) mod emergency_has_its_cob_id;
pub(crate) mod entries_are_described_one_by_one;
pub(crate) mod entries_have_a_data_type;
pub(crate) mod entries_have_an_access_type;
pub(crate) mod enumerations_are_unambiguous;
pub(crate) mod file_is_not_xml;
pub(crate) mod file_is_within_bounds;
pub(crate) mod findings_are_few;
pub(crate) mod flags_are_zero_or_one;
pub(crate) mod granularity_is_possible;
pub(crate) mod guarding_has_both_parameters;
pub(crate) mod heartbeat_and_guarding_exclude_each_other;
pub(crate) mod heartbeat_consumer_watches_others;
pub(crate) mod identity_agrees_with_device_info;
pub(crate) mod indices_are_not_reserved;
pub(crate) mod keys_and_values_are_separated_by_equals_signs;
pub(crate) mod keys_are_in_sections;
pub(crate) mod keys_are_known;
pub(crate) mod keys_are_unique;
pub(crate) mod keys_have_a_meaning_where_they_stand;
pub(crate) mod limits_are_in_order;
pub(crate) mod limits_are_within_their_type;
pub(crate) mod limits_leave_a_choice;
pub(crate) mod lines_are_at_most_255_characters_long;
pub(crate) mod lines_are_sections_keys_or_comments;
pub(crate) mod links_lead_to_objects;
pub(crate) mod listed_objects_are_described;
pub(crate) mod lists_of_objects_are_counted;
pub(crate) mod lists_of_objects_are_numbered;
pub(crate) mod mandatory_objects_are_there;
pub(crate) mod mappable_entries_have_a_size;
pub(crate) mod mapped_dummies_are_usable;
pub(crate) mod mapped_lengths_are_those_of_the_types;
pub(crate) mod mapped_lengths_respect_the_granularity;
pub(crate) mod mapped_objects_are_mappable;
pub(crate) mod mapped_objects_exist;
pub(crate) mod mapped_objects_go_the_right_way;
pub(crate) mod mappings_are_counted;
pub(crate) mod mappings_fit_into_a_frame;
pub(crate) mod meanings_fit_their_data_type;
pub(crate) mod names_are_at_most_241_characters_long;
pub(crate) mod names_differ_as_identifiers;
pub(crate) mod node_id_is_the_only_variable;
pub(crate) mod nothing_follows_a_section_name;
pub(crate) mod numbers_are_not_empty;
pub(crate) mod numbers_are_not_octal_by_mistake;
pub(crate) mod numbers_are_numbers;
pub(crate) mod numbers_are_spelled_as_in_c;
pub(crate) mod numbers_fit_their_keys;
pub(crate) mod numbers_have_no_comment_behind_them;
pub(crate) mod object_types_are_known;
pub(crate) mod objects_are_in_their_list;
pub(crate) mod objects_are_listed;
pub(crate) mod objects_are_listed_once;
pub(crate) mod objects_have_names;
pub(crate) mod octet_strings_are_hexadecimal;
pub(crate) mod overlay_corrections_change_something;
pub(crate) mod overlay_corrections_have_a_reason;
pub(crate) mod overlay_entries_have_one_meaning;
pub(crate) mod overlay_keys_are_known;
pub(crate) mod overlay_names_are_defined;
pub(crate) mod overlay_names_are_used;
pub(crate) mod overlay_objects_exist;
pub(crate) mod overlay_ranges_are_in_order;
pub(crate) mod overlay_values_are_of_their_kind;
pub(crate) mod overlays_are_toml;
pub(crate) mod overlays_name_their_format;
pub(crate) mod pdo_cob_ids_are_not_restricted;
pub(crate) mod pdo_cob_ids_differ;
pub(crate) mod pdo_cob_ids_have_11_bits;
pub(crate) mod pdos_are_counted;
pub(crate) mod pdos_have_both_parameters;
pub(crate) mod process_data_are_mappable;
pub(crate) mod profile_objects_are_there;
pub(crate) mod required_sections_are_there;
pub(crate) mod sdo_parameters_can_be_switched_off;
pub(crate) mod section_names_are_closed;
pub(crate) mod sections_are_known;
pub(crate) mod sections_are_unique;
pub(crate) mod standard_constants_are_not_writable;
pub(crate) mod standard_objects_have_their_data_type;
pub(crate) mod standard_objects_have_their_object_type;
pub(crate) mod sub_index_0_is_an_unsigned8;
pub(crate) mod sub_index_0_is_the_highest_sub_index;
pub(crate) mod sub_index_0_is_there;
pub(crate) mod sub_indices_are_hexadecimal;
pub(crate) mod subs_are_counted;
pub(crate) mod subs_are_single_values;
pub(crate) mod subs_have_an_object;
pub(crate) mod supported_modules_are_described;
pub(crate) mod sync_cob_id_is_free;
pub(crate) mod tables_are_counted;
pub(crate) mod tables_name_existing_entries;
pub(crate) mod text_is_ascii_or_utf8;
pub(crate) mod tokenizer_and_locator_agree;
pub(crate) mod transmission_types_are_defined;
pub(crate) mod units_are_decided_by_conditions;
pub(crate) mod user_defined_types_are_described;
pub(crate) mod users_of_a_name_share_a_data_type;
pub(crate) mod values_are_values_of_their_type;
pub(crate) mod variables_have_no_subs;

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
    /// How an overlay mends what it finds; empty where that depends on the finding, or where no overlay can.
    pub help: &'static str,
    /// Finds what breaks the rule in a finished model; `None` when that is done while reading.
    check: Option<fn(&Context<'_>, &mut Diagnostics)>,
}

/// How to mend a limit.
const OVERLAY_LIMITS: &str = "an overlay can give the right ones: `low` and `high` with a reason";

/// In the order in which they are applied.
const RULES: &[&Rule] = &[
    &file_is_within_bounds::RULE,
    &file_is_not_xml::RULE,
    &text_is_ascii_or_utf8::RULE,
    &lines_are_at_most_255_characters_long::RULE,
    &section_names_are_closed::RULE,
    &nothing_follows_a_section_name::RULE,
    &keys_and_values_are_separated_by_equals_signs::RULE,
    &lines_are_sections_keys_or_comments::RULE,
    &tokenizer_and_locator_agree::RULE,
    &keys_are_in_sections::RULE,
    &sections_are_known::RULE,
    &sections_are_unique::RULE,
    &keys_are_known::RULE,
    &keys_have_a_meaning_where_they_stand::RULE,
    &keys_are_unique::RULE,
    &numbers_are_not_empty::RULE,
    &numbers_are_numbers::RULE,
    &numbers_fit_their_keys::RULE,
    &flags_are_zero_or_one::RULE,
    &numbers_are_not_octal_by_mistake::RULE,
    &numbers_have_no_comment_behind_them::RULE,
    &numbers_are_spelled_as_in_c::RULE,
    &node_id_is_the_only_variable::RULE,
    &octet_strings_are_hexadecimal::RULE,
    &values_are_values_of_their_type::RULE,
    &tables_are_counted::RULE,
    &tables_name_existing_entries::RULE,
    &subs_are_single_values::RULE,
    &object_types_are_known::RULE,
    &entries_have_a_data_type::RULE,
    &data_types_are_known::RULE,
    &entries_have_an_access_type::RULE,
    &access_types_are_known::RULE,
    &dummies_are_data_types::RULE,
    &dynamic_channels_have_a_range::RULE,
    &listed_objects_are_described::RULE,
    &overlays_are_toml::RULE,
    &overlays_name_their_format::RULE,
    &overlay_keys_are_known::RULE,
    &overlay_values_are_of_their_kind::RULE,
    &overlay_objects_exist::RULE,
    &overlay_corrections_have_a_reason::RULE,
    &overlay_corrections_change_something::RULE,
    &overlay_entries_have_one_meaning::RULE,
    &overlay_ranges_are_in_order::RULE,
    &enumerations_are_unambiguous::RULE,
    &bit_fields_do_not_overlap::RULE,
    &units_are_decided_by_conditions::RULE,
    &overlay_names_are_defined::RULE,
    &overlay_names_are_used::RULE,
    &users_of_a_name_share_a_data_type::RULE,
    &meanings_fit_their_data_type::RULE,
    &conditions_ask_for_existing_entries::RULE,
    &accepted_findings_are_found::RULE,
    &required_sections_are_there::RULE,
    &device_info_is_complete::RULE,
    &a_bit_rate_is_supported::RULE,
    &dates_and_times_have_their_form::RULE,
    &granularity_is_possible::RULE,
    &dynamic_channels_are_announced::RULE,
    &compact_pdos_are_written_out::RULE,
    &compact_pdos_can_be_written_out::RULE,
    &commissioned_node_id_is_possible::RULE,
    &commissioned_bit_rate_is_supported::RULE,
    &supported_modules_are_described::RULE,
    &connected_modules_are_supported::RULE,
    &lists_of_objects_are_counted::RULE,
    &lists_of_objects_are_numbered::RULE,
    &objects_are_listed::RULE,
    &objects_are_listed_once::RULE,
    &objects_are_in_their_list::RULE,
    &mandatory_objects_are_there::RULE,
    &indices_are_not_reserved::RULE,
    &objects_have_names::RULE,
    &names_are_at_most_241_characters_long::RULE,
    &names_differ_as_identifiers::RULE,
    &subs_have_an_object::RULE,
    &subs_are_counted::RULE,
    &variables_have_no_subs::RULE,
    &arrays_and_records_have_subs::RULE,
    &sub_index_0_is_there::RULE,
    &sub_index_0_is_an_unsigned8::RULE,
    &sub_index_0_is_the_highest_sub_index::RULE,
    &arrays_have_one_data_type::RULE,
    &sub_indices_are_hexadecimal::RULE,
    &compact_objects_have_at_most_254_subs::RULE,
    &user_defined_types_are_described::RULE,
    &links_lead_to_objects::RULE,
    &compact_objects_stand_for_a_bounded_number_of_entries::RULE,
    &entries_are_described_one_by_one::RULE,
    &limits_are_in_order::RULE,
    &limits_are_within_their_type::RULE,
    &defaults_are_within_their_type::RULE,
    &defaults_are_within_their_limits::RULE,
    &configured_values_are_within_their_limits::RULE,
    &limits_leave_a_choice::RULE,
    &configured_values_can_be_written::RULE,
    &constants_have_a_default::RULE,
    &mappable_entries_have_a_size::RULE,
    &process_data_are_mappable::RULE,
    &communication_parameters_are_not_mappable::RULE,
    &mapped_objects_exist::RULE,
    &mapped_objects_are_mappable::RULE,
    &mapped_lengths_are_those_of_the_types::RULE,
    &mappings_fit_into_a_frame::RULE,
    &mappings_are_counted::RULE,
    &mapped_objects_go_the_right_way::RULE,
    &mapped_dummies_are_usable::RULE,
    &pdos_have_both_parameters::RULE,
    &pdos_are_counted::RULE,
    &pdo_cob_ids_differ::RULE,
    &pdo_cob_ids_are_not_restricted::RULE,
    &pdo_cob_ids_have_11_bits::RULE,
    &transmission_types_are_defined::RULE,
    &mapped_lengths_respect_the_granularity::RULE,
    &standard_objects_have_their_object_type::RULE,
    &standard_objects_have_their_data_type::RULE,
    &standard_constants_are_not_writable::RULE,
    &profile_objects_are_there::RULE,
    &an_error_control_is_there::RULE,
    &guarding_has_both_parameters::RULE,
    &heartbeat_and_guarding_exclude_each_other::RULE,
    &identity_agrees_with_device_info::RULE,
    &emergency_has_its_cob_id::RULE,
    &sync_cob_id_is_free::RULE,
    &default_sdo_has_its_cob_ids::RULE,
    &sdo_parameters_can_be_switched_off::RULE,
    &heartbeat_consumer_watches_others::RULE,
    &findings_are_few::RULE,
];

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
        let finding = Diagnostic::new(self.code, self.severity, message);
        if self.help.is_empty() { finding } else { finding.help(self.help) }
    }
}

/// Reports a number that its data type cannot have.
fn outside_type(
    rule: &Rule,
    context: &Context<'_>,
    entry: &Entry,
    key: Key,
    value: Option<&Value>,
    out: &mut Diagnostics,
) {
    // Of a type that the device defines nobody knows whether it has a sign.
    let defined = || context.device.bits(entry.data_type).map(|bits| (-(1 << (bits - 1)), (1 << bits) - 1));
    let range = entry.data_type.range().or_else(|| matches!(entry.data_type, DataType::Other(_)).then(defined)?);
    let within = |low: &i128, high: &i128| range.is_none_or(|range| range.0 <= *low && *high <= range.1);
    let fits = match value {
        Some(Value::Integer(value)) => within(value, value),
        // For every node it must.
        Some(&Value::NodeIdPlus(offset)) => within(&(i128::from(offset) + 1), &(i128::from(offset) + 127)),
        Some(&Value::Real(value)) => entry.data_type != DataType::Real32 || (value as f32).is_finite(),
        Some(Value::Text(_) | Value::Bytes(_)) | None => true,
    };
    if !fits {
        let range = range.map_or(format!("{:e} to {:e}", f32::MIN, f32::MAX), |(low, high)| format!("{low} to {high}"));
        let finding = rule.finding(format!("`{}` does not fit into {}", key.name(), entry.data_type));
        let finding = finding.at(context.entry_span(entry, key), format!("{range} do"));
        out.push(finding.and(context.entry_span(entry, Key::DataType), "the data type"));
    }
}

/// Reports a value that lies outside its limits.
fn outside_limits(
    rule: &Rule,
    context: &Context<'_>,
    entry: &Entry,
    key: Key,
    value: Option<&Value>,
    out: &mut Diagnostics,
) {
    let Some(value) = value else { return };
    let above = |a: &Value, b: &Value| match (a, b) {
        (Value::Integer(a), Value::Integer(b)) => a > b,
        (Value::Real(a), Value::Real(b)) => a > b,
        _ => false,
    };
    // Reversed limits have a rule of their own.
    if let Some((low, high)) = entry.low.as_ref().zip(entry.high.as_ref())
        && above(low, high)
    {
        return;
    }
    let limit = if entry.low.as_ref().is_some_and(|low| above(low, value)) {
        Key::LowLimit
    } else if entry.high.as_ref().is_some_and(|high| above(value, high)) {
        Key::HighLimit
    } else {
        return;
    };
    let side = if limit == Key::LowLimit { "below the low limit" } else { "above the high limit" };
    let finding = rule.finding(format!("`{}` is {side}", key.name())).at(context.entry_span(entry, key), "");
    out.push(finding.and(context.entry_span(entry, limit), "the limit").help(OVERLAY_LIMITS));
}

/// Whether a mapping leaves a gap as long as a data type.
fn is_dummy(mapped: Mapped) -> bool {
    mapped.index < 0x20 && mapped.sub == 0
}

/// `RPDO 1`, `TPDO 512`.
fn pdo_name(pdo: &Pdo) -> String {
    let direction = if pdo.direction == Direction::Receive { "RPDO" } else { "TPDO" };
    format!("{direction} {}", pdo.number)
}

/// Whether CiA 301 (7.3.5) keeps a COB-ID for something else than PDO, SYNC, TIME and EMCY.
fn is_restricted(cob_id: i128) -> bool {
    matches!(cob_id, 0..=0x7F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x7FF)
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
    match word {
        _ if count == 1 => format!("1 {word}"),
        "entry" => format!("{count} entries"),
        "sub-index" => format!("{count} sub-indices"),
        _ => format!("{count} {word}s"),
    }
}

/// `2000`, `2000 and 2001`, `2000, 2001, 2002 and 17 more`.
fn listed<T>(things: &[T], word: impl Fn(&T) -> String) -> String {
    const SHOWN: usize = 6;
    let words = |things: &[T]| things.iter().map(&word).collect::<Vec<_>>().join(", ");
    match things {
        [] => String::new(),
        [only] => word(only),
        [first @ .., last] if things.len() <= SHOWN => format!("{} and {}", words(first), word(last)),
        _ => format!("{} and {} more", words(&things[..SHOWN - 1]), things.len() - (SHOWN - 1)),
    }
}

/// `is 1 key`, `are 2 keys`.
fn are(count: usize, word: &str) -> String {
    format!("{} {}", if count == 1 { "is" } else { "are" }, plural(count, word))
}
