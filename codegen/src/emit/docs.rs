//! Doc comments of items: the same facts in the same order, escaped.

use lexican_eds::model::number::Number;
use lexican_eds::model::{Condition, Entry, Meaning, NmtState, Unit, Value};

use super::context::Context;
use super::literal;
use crate::plan::{Access, Default, Handle, Item, Mapping, ParameterItem};

/// Doc lines before an item that is indented by `indent`; empty lines separate paragraphs.
fn text(lines: &[String], aliases: &[String], indent: &str) -> String {
    let mut text = String::new();
    for line in lines {
        text.extend([indent, if line.is_empty() { "///" } else { "/// " }, line, "\n"]);
    }
    // rustdoc allows no other characters in an alias.
    let is_allowed =
        |alias: &&String| !alias.is_empty() && alias.chars().all(|c| c.is_ascii_graphic() && !matches!(c, '"' | '\''));
    let aliases: Vec<String> = aliases.iter().filter(is_allowed).map(|alias| format!("\"{alias}\"")).collect();
    if aliases.is_empty() {
        return text;
    }
    text + indent + &format!("#[doc(alias({}))]\n", aliases.join(", "))
}

/// The docs of an entry, with its address as a search alias.
pub(super) fn handle(
    context: &Context<'_>,
    title: &str,
    object_text: Option<&str>,
    handle: &Handle<'_>,
    indent: &str,
) -> String {
    let entry = handle.entry;
    let full = format!("0x{:04X}:{:02X}", entry.index, entry.sub);
    let mut lines = vec![sentence(title, &address(entry.index, entry.sub)), String::new()];
    lines.push(format!("Address {full} · {}", facts(context, handle)));
    lines.extend(remarks(context, entry, object_text));
    text(&lines, &[full, format!("{:04X}", entry.index)], indent)
}

pub(super) fn parameter(context: &Context<'_>, item: &ParameterItem<'_>) -> String {
    let parameter = item.parameter;
    let number = parameter.number.to_string();
    let mut entry = parameter.entry.clone();
    entry.data_type = parameter.data_type;
    let mut facts =
        format!("{} · {}", escape(&number), facts(context, &Handle { entry: &entry, ..item.handle.clone() }));
    let object = parameter.object().map(|(index, sub)| address(index, sub));
    if let Some(object) = &object {
        facts += &format!(" · object {object}");
    }
    if parameter.elements > 1 {
        facts += &format!(" · {0} elements, `.at(0)` to `.at({1})`", parameter.elements, parameter.elements - 1);
    }
    if let Some(when) = &parameter.when {
        facts += &format!(" · {}", condition(context, when));
    }
    let mut lines = vec![sentence(&parameter.entry.name, &number), String::new(), facts];
    lines.extend(remarks(context, &parameter.entry, None));
    let aliases: Vec<String> = object.into_iter().chain([number]).collect();
    text(&lines, &aliases, "")
}

pub(super) fn whole(context: &Context<'_>, item: &Item<'_>, first: Option<&Handle<'_>>) -> String {
    let object = item.object;
    let kind = object.kind.name();
    let index = format!("{:04X}", object.index);
    let mut lines = vec![sentence(&object.name, &index), String::new()];
    match first {
        Some(first) => {
            let elements = || object.entries.iter().filter(|entry| entry.sub > 0);
            let mut entry = first.entry.clone();
            let mut shared = first.clone();
            if elements().any(|element| element.configured != entry.configured) {
                (entry.configured, shared.configured) = (None, None);
            }
            let shared = Handle { entry: &entry, ..shared };
            let last = object.entries.last().map_or(1, |entry| entry.sub);
            lines.push(format!(
                "Address 0x{index} · {kind} of {last}, `.at(1)` to `.at({last})` · {}",
                facts(context, &shared)
            ));
            let mut like_all = first.entry.clone();
            if object.entries.iter().any(|entry| entry.sub > 0 && entry.description != like_all.description) {
                like_all.description = None;
            }
            lines.extend(remarks(context, &like_all, object.description.as_deref()));
        }
        None => {
            lines.push(format!("Address 0x{index} · {kind}"));
            lines.extend(paragraph(object.description.as_deref()));
        }
    }
    text(&lines, &[format!("0x{index}"), index], "")
}

/// The name as the first line.
pub(super) fn sentence(name: &str, otherwise: &str) -> String {
    let escaped = escape(name);
    if escaped.is_empty() { otherwise.to_owned() } else { escaped }
}

/// A paragraph, with an empty line before it.
pub(super) fn paragraph(text: Option<&str>) -> Vec<String> {
    let escaped = escape(text.unwrap_or_default());
    if escaped.is_empty() { Vec::new() } else { vec![String::new(), escaped] }
}

/// Single blanks between words, and no invisible characters.
pub(super) fn one_line(text: &str) -> String {
    let words: Vec<&str> = text
        .split(|c: char| c.is_whitespace() || c.is_control() || turns_text(c))
        .filter(|word| !word.is_empty())
        .collect();
    words.join(" ")
}

/// Whether a character changes the text direction. rustc refuses these in comments, because they make code look
/// different from what it is (`text_direction_codepoint_in_comment`).
fn turns_text(c: char) -> bool {
    matches!(c, '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

/// Escapes Markdown; the result is one line.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for (at, c) in one_line(text).char_indices() {
        let is_markup = matches!(c, '\\' | '`' | '*' | '_' | '[' | ']' | '<' | '>' | '#' | '|' | '~' | '$' | '&');
        // At the start of a line, these begin lists, quotes or headings; so does `1.`.
        let starts_block = at == 0 && matches!(c, '-' | '+' | '=' | '/' | ':' | '!');
        let ends_number = matches!(c, '.' | ')') && escaped.chars().all(|c| c.is_ascii_digit());
        // `http://` would be a bare link.
        let makes_link = c == ':' && (escaped.ends_with("http") || escaped.ends_with("https"));
        if is_markup || starts_block || ends_number || makes_link {
            escaped.push('\\');
        }
        escaped.push(c);
    }
    escaped
}

fn address(index: u16, sub: u8) -> String {
    format!("{index:04X}:{sub:02X}")
}

/// `UNSIGNED16 · rw · default 100 · limits 1…500`.
fn facts(context: &Context<'_>, handle: &Handle<'_>) -> String {
    let entry = handle.entry;
    let in_hex = context.is_hex(entry);
    let mut facts = vec![escape(&entry.data_type.to_string()), access(handle.access).to_owned()];
    let shown = |value: &Value| escape(&shown(value, in_hex));
    let initial = [("default", &handle.default, &entry.default), ("configured", &handle.configured, &entry.configured)];
    for (what, typed, value) in initial {
        let value = match (typed, value) {
            (Some(Default::Number(number)), _) => shown_number(*number, in_hex),
            (Some(Default::NodeIdPlus(base)), _) => node_id_plus(*base),
            (None, Some(value @ (Value::Text(_) | Value::Bytes(_)))) => shown(value),
            (None, _) => continue,
        };
        facts.push(format!("{what} {value}"));
    }
    if let Some((low, high)) = handle.limits {
        let [low, high] = [low, high].map(|number| shown_number(number, in_hex));
        facts.push(format!("limits {low}…{high}"));
    }
    match handle.mapping {
        Mapping::Unmapped => {}
        Mapping::Tpdo => facts.push("mappable: TPDO".into()),
        Mapping::Rpdo => facts.push("mappable: RPDO".into()),
        Mapping::Both => facts.push("mappable: RPDO, TPDO".into()),
    }
    facts.join(" · ")
}

fn access(access: Access) -> &'static str {
    match access {
        Access::Ro => "ro",
        Access::Wo => "wo",
        Access::Rw => "rw",
        Access::Const => "const",
    }
}

/// The descriptions, the unit and other facts of the overlay.
fn remarks(context: &Context<'_>, entry: &Entry, object_text: Option<&str>) -> Vec<String> {
    let mut text = paragraph(object_text);
    // A single value is both an object and an entry, which an overlay may describe with the same text.
    text.extend(paragraph(entry.description.as_deref().filter(|text| Some(*text) != object_text)));
    let mut facts = Vec::new();
    if let Meaning::Quantity(name) = &entry.meaning
        && let Some(quantity) = context.plan.device.quantities.get(name)
    {
        facts.extend(quantity.units.iter().map(|unit| format!("Unit: {}.", self::unit(context, unit))));
    }
    for range in &entry.ranges {
        facts.push(format!("Limits {}…{} {}.", range.low, range.high, condition(context, &range.when)));
    }
    if entry.persistent {
        facts.push("Kept without power.".into());
    }
    if let Some(states) = &entry.writable_in {
        let state = |state: &NmtState| match state {
            NmtState::PreOperational => "PRE-OPERATIONAL",
            NmtState::Operational => "OPERATIONAL",
        };
        facts.push(format!("Writable in {} only.", states.iter().map(state).collect::<Vec<_>>().join(" and ")));
    }
    if !facts.is_empty() {
        text.extend([String::new(), facts.join(" ")]);
    }
    text
}

/// `V, 1/10 per count while Range (2102:00) is 2`.
pub(super) fn unit(context: &Context<'_>, unit: &Unit) -> String {
    let worth = match (unit.num, unit.den) {
        (1, 1) => String::new(),
        (num, 1) => format!(", {num} per count"),
        (num, den) => format!(", {num}/{den} per count"),
    };
    let when = unit.when.as_ref().map(|when| format!(" {}", condition(context, when))).unwrap_or_default();
    format!("{}{worth}{when}", escape(&unit.symbol))
}

fn condition(context: &Context<'_>, condition: &Condition) -> String {
    let verb = if condition.equal { "is" } else { "is not" };
    let address = address(condition.index, condition.sub);
    let who = match context.plan.name(condition.index, condition.sub).map(escape) {
        Some(name) if !name.is_empty() => format!("{name} ({address})"),
        _ => address,
    };
    let in_hex = context.plan.entry(condition.index, condition.sub).is_some_and(|entry| context.is_hex(entry));
    format!("while {who} {verb} {}", literal::integer(condition.value, in_hex))
}

fn shown_number(number: Number, in_hex: bool) -> String {
    match number {
        Number::Integer(integer) => shown(&Value::Integer(integer), in_hex),
        Number::Real(real) => shown(&Value::Real(real), in_hex),
    }
}

fn shown(value: &Value, in_hex: bool) -> String {
    match value {
        Value::Integer(integer) => literal::integer(*integer, in_hex),
        // Use the fewest digits that give the same number.
        Value::Real(real) if f64::from(*real as f32) == *real => format!("{:?}", *real as f32),
        Value::Real(real) => format!("{real:?}"),
        Value::Text(text) => format!("\"{text}\""),
        Value::Bytes(bytes) => format!("{} bytes", bytes.len()),
        Value::NodeIdPlus(base) => node_id_plus(*base),
    }
}

fn node_id_plus(base: i64) -> String {
    match base {
        0 => "node-ID".into(),
        1.. => format!("0x{base:X} + node-ID"),
        _ => format!("node-ID - 0x{:X}", base.unsigned_abs()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_means_itself_in_markdown() {
        let check = |text: &str, expected: &str| assert_eq!(escape(text), expected);
        check("  a\n   b\tc ", "a b c");
        check("Velocity [rpm] <x> *y* `z`", "Velocity \\[rpm\\] \\<x\\> \\*y\\* \\`z\\`");
        check("- item", "\\- item");
        check("1. item 2.5", "1\\. item 2.5");
        check("see https://a.b", "see https\\://a.b");
        check("/// x", "\\/// x");
        check("a\u{202E}b \u{2066}c\u{2069}", "a b c");
    }
}
