//! Rules about the notation of numbers and values.

use super::context::{Context, are};
use super::lines::without_key;
use super::rule::note;
use crate::diagnostic::Diagnostic;
use crate::dump::value_text;
use crate::finding::{Finding, Kind, Oddity};
use crate::model::Value;
use crate::model::types::DataType;
use crate::parse::number;
use crate::patch::{Change, Patch};

pub(super) fn bad_number(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::BadNumber { key } = &finding.kind else { return None };
    let note = note(format!("`{key}` is not a number")).at(finding.span, "read as absent");
    Some(note.mend(without_key(cx, finding.span, key)))
}

pub(super) fn number_too_large(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::NumberTooLarge { key, value } = &finding.kind else { return None };
    let note = note(format!("{value} is out of range for `{key}`")).at(finding.span, "read as absent");
    Some(note.mend(without_key(cx, finding.span, key)))
}

pub(super) fn bad_flag(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::BadFlag { key } = &finding.kind else { return None };
    Some(note(format!("`{key}` is neither 0 nor 1")).at(finding.span, "").fix(cx.replace(finding.span, "1")))
}

pub(super) fn octal_number(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let (key, text, oddity) = odd(finding)?;
    let what = match oddity {
        Oddity::Octal => "has a leading zero, which makes it octal",
        Oddity::NotOctal => "has a leading zero, but is not octal",
        _ => return None,
    };
    let value = number::integer(text).map_or(0, |read| read.value);
    let note = note(format!("`{key}` {what}")).at(finding.span, format!("read as decimal {value}"));
    let digits = text.trim_start_matches(['0', '+', '-']);
    let plain = plain(text).and_then(|plain| cx.replace(finding.span, &plain));
    Some(match oddity {
        Oddity::NotOctal => note.fix(plain),
        _ if text.bytes().all(|b| b.is_ascii_digit()) => {
            note.mend(plain.map(|remedy| format!("unless decimal {digits} was meant, {remedy}")))
        }
        _ => note.mend(plain),
    })
}

pub(super) fn inline_comment(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let (key, text, Oddity::Comment) = odd(finding)? else { return None };
    let note = note(format!("a comment follows the value of `{key}`")).at(finding.span, "the comment is ignored");
    let at = text.find([';', '#'])?;
    let moved = cx.line(finding.span).map(|(line, _)| {
        let value = format!("{key}={}", text[..at].trim_end());
        Patch::from_iter([Change::Line(line, value), Change::After(line, text[at..].to_owned())])
    });
    Some(note.fix(moved))
}

pub(super) fn odd_number(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let (key, text, Oddity::Spelling) = odd(finding)? else { return None };
    let plain = match DataType::from_name(text) {
        _ if text.eq_ignore_ascii_case("null") => Some(String::new()),
        Some(data_type) => Some(format!("0x{:04X}", data_type.code())),
        None => plain(text).or_else(|| Some(text.trim_end_matches(['f', 'F']).replace(',', "."))),
    };
    let note = note(format!("`{text}` is an odd spelling for `{key}`")).at(finding.span, "");
    let mended = plain.and_then(|plain| cx.replace(finding.span, &plain));
    // For a REAL, 0xFFFF could also mean the bits.
    if text.starts_with("0x") || text.starts_with("0X") {
        return Some(note.mend(mended.map(|mended| format!("as it is read, {mended}"))));
    }
    Some(note.fix(mended))
}

pub(super) fn unknown_variable(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let (key, text, Oddity::Variable) = odd(finding)? else { return None };
    let note = note(format!("`{key}` uses a variable other than $NODEID")).at(finding.span, "read as $NODEID");
    Some(note.mend(plain(text).and_then(|plain| cx.replace(finding.span, &plain))))
}

pub(super) fn octet_string(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let (key, text, Oddity::NotHex) = odd(finding)? else { return None };
    let note = note(format!("`{key}` of an OCTET_STRING is not hexadecimal")).at(finding.span, "kept as text");
    let hex = value_text(&Value::Bytes(text.as_bytes().to_vec()));
    Some(note.mend(cx.replace(finding.span, &hex).map(|remedy| format!("for these very characters, {remedy}"))))
}

fn odd(finding: &Finding) -> Option<(&str, &str, Oddity)> {
    match &finding.kind {
        Kind::OddNumber { key, text, oddity } => Some((key, text, *oddity)),
        _ => None,
    }
}

/// A number or formula in the notation of CiA 306.
fn plain(text: &str) -> Option<String> {
    if let Some(formula) = number::formula(text) {
        return Some(value_text(&Value::NodeIdPlus(formula.value)));
    }
    let value = number::integer(text)?.value;
    let hexadecimal = text.ends_with(['h', 'H']) && value >= 0;
    Some(if hexadecimal { format!("0x{value:X}") } else { value.to_string() })
}

pub(super) fn bad_value(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::BadValue { key, text, data_type } = &finding.kind else { return None };
    let is_hexadecimal = text.bytes().all(|b| b.is_ascii_hexdigit());
    let hint = if is_hexadecimal { "; hexadecimal numbers begin with `0x`" } else { "" };
    let note = note(format!("`{key}` is not a value of its data type"));
    let note = note.at(finding.span, format!("expected {data_type}{hint}"));
    let hex = format!("0x{text}");
    let value = number::value(&hex, *data_type).ok().flatten().filter(|_| is_hexadecimal);
    let fits = value.is_some_and(|read| cx.fits(*data_type, Some(&read.value)));
    Some(note.mend(if fits { cx.replace(finding.span, &hex) } else { None }))
}

pub(super) fn entry_count(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::EntryCount { said, found } = finding.kind else { return None };
    let note = note(format!("there {}, not {said}", are(found, "entry"))).at(finding.span, "says otherwise");
    Some(note.fix(cx.replace(finding.span, &found.to_string())))
}

pub(super) fn value_without_entry(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::ValueWithoutEntry { index, sub } = finding.kind else { return None };
    Some(note(format!("the object {index:04X} has no sub-index {sub}")).at(finding.span, "ignored"))
}
