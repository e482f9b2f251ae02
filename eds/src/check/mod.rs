//! The rules: one per file, named after what holds where it finds nothing.
//!
//! Some rules are applied while reading, where the odd text is at hand (`check: None`); the others to the
//! finished model. Each has a stable code, and a golden case under `tests/golden/` that shows what it finds.

use crate::diagnostics::{Diagnostic, Diagnostics, Severity};
use crate::eds::Facts;
use crate::model::{Device, Direction, Entry, Mapped, Object, Pdo, Value};
use crate::number::Oddity;
use crate::object::{Key, ObjectFacts};
use crate::overlay::{Changes, Extra};
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
    /// How an overlay mends what it finds; empty where that depends on the finding, or where no overlay can.
    pub help: &'static str,
    /// Finds what breaks the rule in a finished model; `None` when that is done while reading.
    check: Option<fn(&Context<'_>, &mut Diagnostics)>,
}

/// What a rule looks at.
pub(crate) struct Context<'a> {
    pub(crate) device: &'a Device,
    pub(crate) facts: &'a Facts<'a>,
    pub(crate) changes: &'a Changes,
}

/// How to mend a limit.
const OVERLAY_LIMITS: &str = "an overlay can give the right ones: `low` and `high` with a reason";

mod standard;

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
    accepted_findings_are_found,
    required_sections_are_there,
    device_info_is_complete,
    a_bit_rate_is_supported,
    dates_and_times_have_their_form,
    granularity_is_possible,
    dynamic_channels_are_announced,
    compact_pdos_are_written_out,
    commissioned_node_id_is_possible,
    commissioned_bit_rate_is_supported,
    supported_modules_are_described,
    connected_modules_are_supported,
    lists_of_objects_are_counted,
    lists_of_objects_are_numbered,
    objects_are_listed,
    objects_are_listed_once,
    objects_are_in_their_list,
    mandatory_objects_are_there,
    indices_are_not_reserved,
    objects_have_names,
    names_are_at_most_241_characters_long,
    names_differ_as_identifiers,
    subs_have_an_object,
    subs_are_counted,
    variables_have_no_subs,
    arrays_and_records_have_subs,
    sub_index_0_is_there,
    sub_index_0_is_an_unsigned8,
    sub_index_0_is_the_highest_sub_index,
    arrays_have_one_data_type,
    sub_indices_are_hexadecimal,
    compact_objects_have_at_most_254_subs,
    user_defined_types_are_described,
    links_lead_to_objects,
    compact_objects_stand_for_a_bounded_number_of_entries,
    entries_are_described_one_by_one,
    limits_are_in_order,
    limits_are_within_their_type,
    defaults_are_within_their_type,
    defaults_are_within_their_limits,
    configured_values_are_within_their_limits,
    limits_leave_a_choice,
    configured_values_can_be_written,
    constants_have_a_default,
    mappable_entries_have_a_size,
    process_data_are_mappable,
    communication_parameters_are_not_mappable,
    mapped_objects_exist,
    mapped_objects_are_mappable,
    mapped_lengths_are_those_of_the_types,
    mappings_fit_into_a_frame,
    mappings_are_counted,
    mapped_objects_go_the_right_way,
    mapped_dummies_are_usable,
    pdos_have_both_parameters,
    pdos_are_counted,
    pdo_cob_ids_differ,
    pdo_cob_ids_are_not_restricted,
    pdo_cob_ids_have_11_bits,
    transmission_types_are_defined,
    mapped_lengths_respect_the_granularity,
    standard_objects_have_their_object_type,
    standard_objects_have_their_data_type,
    standard_constants_are_not_writable,
    profile_objects_are_there,
    an_error_control_is_there,
    guarding_has_both_parameters,
    heartbeat_and_guarding_exclude_each_other,
    identity_agrees_with_device_info,
    emergency_has_its_cob_id,
    sync_cob_id_is_free,
    default_sdo_has_its_cob_ids,
    sdo_parameters_can_be_switched_off,
    heartbeat_consumer_watches_others,
    findings_are_few,
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
        let finding = Diagnostic::new(self.code, self.severity, message);
        if self.help.is_empty() { finding } else { finding.help(self.help) }
    }
}

impl<'a> Context<'a> {
    /// The objects with what is known of them beyond the model.
    fn objects(&self) -> impl Iterator<Item = (&'a Object, &'a ObjectFacts)> {
        self.device.objects.iter().zip(&self.facts.objects)
    }

    /// All mappings: the PDO, the number of the mapping from 1, and what is mapped.
    fn mapped(&self) -> impl Iterator<Item = (&'a Pdo, u8, Mapped)> {
        let of_pdo = |pdo: &'a Pdo| pdo.mapping.iter().zip(1..).map(move |(&mapped, number)| (pdo, number, mapped));
        self.device.pdos.iter().flat_map(of_pdo)
    }

    /// The place of a mapping; that of the number of mappings for 0.
    fn mapping_span(&self, pdo: &Pdo, number: u8) -> Span {
        let object = self.device.object(crate::pdo::mapping_parameter(pdo.direction, pdo.number));
        self.parameter_span(pdo, object, number, |pdo| !pdo.mapping.is_empty())
    }

    /// The place of an entry of the communication parameter.
    fn pdo_span(&self, pdo: &Pdo, sub: u8) -> Span {
        let object = self.device.object(crate::pdo::communication_parameter(pdo.direction, pdo.number));
        self.parameter_span(pdo, object, sub, |pdo| pdo.transmission_type.is_some() || pdo.cob_id.is_some())
    }

    fn cob_id_span(&self, pdo: &Pdo) -> Span {
        self.pdo_span(pdo, 1)
    }

    fn parameter_span(&self, pdo: &Pdo, object: Option<&Object>, sub: u8, says: impl Fn(&Pdo) -> bool) -> Span {
        let same = |extra: &&Extra| (extra.pdo.direction, extra.pdo.number) == (pdo.direction, pdo.number);
        if let Some(extra) = self.changes.pdos.iter().rev().find(|extra| same(extra) && says(&extra.pdo)) {
            return extra.span;
        }
        let Some(object) = object else { return Span::default() };
        let Some(entry) = object.entry(sub) else { return object.span };
        let key = if entry.configured.is_some() { Key::ParameterValue } else { Key::DefaultValue };
        self.entry_span(entry, key)
    }

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

/// Reports an integer that its data type cannot have.
fn outside_type(
    rule: &Rule,
    context: &Context<'_>,
    entry: &Entry,
    key: Key,
    value: Option<&Value>,
    out: &mut Diagnostics,
) {
    let Some((Value::Integer(value), (low, high))) = value.zip(entry.data_type.range()) else { return };
    if !(low..=high).contains(value) {
        let finding = rule.finding(format!("`{}` does not fit into {}", key.name(), entry.data_type));
        let finding = finding.at(context.entry_span(entry, key), format!("{low} to {high} do"));
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

/// `is 1 key`, `are 2 keys`.
fn are(count: usize, word: &str) -> String {
    format!("{} {}", if count == 1 { "is" } else { "are" }, plural(count, word))
}
