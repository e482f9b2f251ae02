//! Rules about files, lines, sections and keys.

use super::context::{Context, plural};
use super::lists::numbered_anew;
use super::remedy::MAX_STEPS;
use super::rule::note;
use crate::diagnostic::Diagnostic;
use crate::finding::{Finding, Kind, Repeated, Separator};
use crate::model::keys::{COMMISSIONING, DEVICE_INFO, FILE_INFO, KEYS};
use crate::parse::position;
use crate::parse::section::SectionKind;
use crate::parse::syntax::Line;
use crate::patch::{Change, Patch};
use crate::text::{Encoding, MAX_BYTES, MAX_LINES, Refusal, Span};

pub(super) fn file_size(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::FileSize(refusal) = finding.kind else { return None };
    Some(note(match refusal {
        // Reading stopped there, so the size of the rest is unknown.
        Refusal::TooLong { .. } => format!("the file has more than {MAX_BYTES} bytes, which is as many as are read"),
        Refusal::TooManyLines { lines } => format!("the file has {lines} lines; at most {MAX_LINES} are read"),
    }))
}

pub(super) fn xml(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::Xml { why, help } = &finding.kind else { return None };
    Some(note(why.as_ref()).at(finding.span, "").help(*help))
}

pub(super) fn project(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::Project = finding.kind else { return None };
    let note = note("this is a CPJ, which describes a network, not a device").at(finding.span, "");
    Some(note.help("the data sheets are the files that it names, for each node one DCF"))
}

pub(super) fn encoding(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::Encoding = finding.kind else { return None };
    let message = match cx.facts.syntax.source.encoding() {
        Encoding::Utf8 => return None,
        Encoding::Utf8WithMark => "the file begins with a byte order mark".to_owned(),
        encoding @ (Encoding::Utf16Le { .. } | Encoding::Utf16Be { .. }) => {
            format!("the file is in {}", encoding.name())
        }
        encoding => format!("the file is not UTF-8; it is read as {}", encoding.name()),
    };
    let text = if finding.span.end > 0 { "first here" } else { "" };
    Some(note(message).at(finding.span, text).help("save the file as UTF-8 without byte order mark"))
}

pub(super) fn long_line(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::LongLine { characters } = finding.kind else { return None };
    let note = note(format!("the line has {characters} characters"));
    Some(note.at(finding.span, "other readers may cut this off"))
}

pub(super) fn unclosed_section(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::UnclosedSection = finding.kind else { return None };
    let mended = cx.line(finding.span).and_then(|(line, text)| match Line::of(text) {
        Line::Section { name, .. } => Some(Patch::from_iter([Change::Line(line, format!("[{name}]"))])),
        _ => None,
    });
    let note = note("the section name has no closing bracket").at(finding.span, "read as the name");
    // The extent of an unknown section is unknown as well.
    let known = cx.facts.syntax.section_at(finding.span).is_some_and(|section| section.kind != SectionKind::Unknown);
    Some(if known { note.fix(mended) } else { note.mend(mended) })
}

pub(super) fn text_after_section(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::TextAfterSection = finding.kind else { return None };
    let mended = cx.line(finding.span).and_then(|(line, text)| match Line::of(text) {
        Line::Section { name, rest, .. } => Some(Patch::from_iter([Change::Line(line, format!("[{name}] ; {rest}"))])),
        _ => None,
    });
    Some(note("there is text behind the section name").at(finding.span, "ignored").fix(mended))
}

pub(super) fn no_equals_sign(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::NoEqualsSign(separator) = finding.kind else { return None };
    let what = if separator == Separator::Colon { "a colon" } else { "a blank" };
    let note = note(format!("{what} stands for the equals sign")).at(finding.span, "read as a key");
    let (line, text) = cx.line(finding.span)?;
    let Line::Pair { key, value, .. } = Line::of(text) else { return Some(note) };
    let mended = Some(Patch::from_iter([Change::Line(line, format!("{key}={value}"))]));
    // A text with a colon looks like a key, too.
    let known =
        [&KEYS[..], &FILE_INFO, &DEVICE_INFO, &COMMISSIONING].iter().any(|table| position(table, key).is_some());
    Some(if known { note.fix(mended) } else { note.mend(mended) })
}

pub(super) fn stray_text(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::StrayText = finding.kind else { return None };
    let mended = cx.line(finding.span).map(|(line, text)| Change::Line(line, format!("; {}", text.trim())));
    let mended = mended.map(|mended| Patch::from_iter([mended]));
    Some(note("the line is neither section, key nor comment").at(finding.span, "ignored").mend(mended))
}

pub(super) fn tokenizer(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::Tokenizer = finding.kind else { return None };
    let message = "the tokeniser sees other sections or keys than there are lines";
    Some(note(message).at(finding.span, "").help("please report it with the file; nothing is wrong with that"))
}

pub(super) fn key_outside_section(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::KeyOutsideSection { keys } = finding.kind else { return None };
    let message = match keys {
        0 => "a section has no name".to_owned(),
        keys => format!("{} before the first section or in one without name", plural(keys, "key")),
    };
    Some(note(message).at(finding.span, "ignored").mend(commented_out(cx, finding.span)))
}

fn commented_out(cx: &Context<'_>, span: Span) -> Option<Patch> {
    let (line, _) = cx.line(span)?;
    let sections = &cx.facts.syntax.sections;
    let after = sections.partition_point(|section| section.line < line);
    let section = sections.get(after.checked_sub(1)?)?;
    let source = cx.facts.syntax.source;
    let header = matches!(Line::of(source.line(section.line as usize)), Line::Section { .. });
    let header = header.then(|| Change::Remove(section.line + 1, section.line + 1));
    let keys = section.pairs.iter().map(|pair| {
        let text = source.line(pair.line as usize).trim();
        Change::Line(pair.line + 1, format!("; {text}"))
    });
    (section.pairs.len() < MAX_STEPS).then(|| header.into_iter().chain(keys).collect())
}

pub(super) fn unknown_section(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::UnknownSection { name, keys } = &finding.kind else { return None };
    let note = note(format!("the section `{name}` with {} is unknown", plural(*keys, "key")));
    Some(note.at(finding.span, "ignored").help(IS_IT_MISSPELT))
}

const IS_IT_MISSPELT: &str = "see whether it is misspelt; what the tool of a vendor has added does no harm";

pub(super) fn duplicate_section(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::DuplicateSection { name, same, first } = &finding.kind else { return None };
    let words = if *same { "with the same content" } else { "with other content" };
    let section = cx.facts.syntax.section_at(finding.span);
    let lines = section.map(|section| section.line..=section.pairs.last().map_or(section.line, |pair| pair.line));
    let removed = lines.clone().map(|lines| Patch::from_iter([Change::Remove(lines.start() + 1, lines.end() + 1)]));
    let note = note(format!("the section `{name}` comes again {words}")).at(finding.span, "ignored");
    let note = note.and(*first, "this one counts");
    let is_comment = |line: u32| matches!(Line::of(cx.facts.syntax.source.line(line as usize)), Line::Comment(_));
    let says_more = lines.into_iter().flatten().any(is_comment);
    Some(if *same && !says_more { note.fix(removed) } else { note.mend(removed) })
}

pub(super) fn duplicate_key(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::DuplicateKey { key, same, first } = &finding.kind else { return None };
    let words = if *same { "with the same value" } else { "with another value" };
    let note = note(format!("the key `{key}` comes again {words}")).at(finding.span, "ignored");
    let (note, removed) = (note.and(*first, "this one counts"), cx.remove(finding.span));
    if let Some(numbered) = numbered_anew(cx, finding.span) {
        return Some(note.mend(Some(numbered)));
    }
    Some(if *same { note.fix(removed) } else { note.mend(removed) })
}

pub(super) fn unknown_key(_: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::UnknownKey(key) = &finding.kind else { return None };
    Some(repeated(key, "is unknown and ignored", finding.span).help(IS_IT_MISSPELT))
}

pub(super) fn key_without_effect(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::KeyWithoutEffect(key) = &finding.kind else { return None };
    Some(removable(cx, key, repeated(key, "means nothing here and is ignored", finding.span)))
}

pub(super) fn empty_number(cx: &Context<'_>, finding: &Finding) -> Option<Diagnostic> {
    let Kind::EmptyNumber(key) = &finding.kind else { return None };
    Some(removable(cx, key, repeated(key, "is empty", finding.span)))
}

/// A finding that stands for all occurrences of a key.
fn repeated(key: &Repeated, what: &str, first: Span) -> Diagnostic {
    let Repeated { key, count } = key;
    let times = if *count == 1 { String::new() } else { format!(" ({count} times)") };
    note(format!("the key `{key}` {what}{times}")).at(first, if *count == 1 { "" } else { "first here" })
}

/// Makes lines that nothing is read from removable.
fn removable(cx: &Context<'_>, key: &Repeated, note: Diagnostic) -> Diagnostic {
    let only = note.span().filter(|_| key.count == 1 && !is_required(&key.key));
    match only.and_then(|span| cx.remove(span)) {
        Some(remedy) => note.help(remedy.to_string()),
        None => note.help("nothing is read from these lines; they do no harm, and may go where nothing requires them"),
    }
}

/// Whether another rule reports the absence of the key.
fn is_required(key: &str) -> bool {
    position(&super::info::REQUIRED, key).is_some()
        || key.eq_ignore_ascii_case("SupportedObjects")
        || key.bytes().all(|b| b.is_ascii_digit())
}

/// A patch that removes a key, in sections where nothing counts or refers to it.
pub(super) fn without_key(cx: &Context<'_>, span: Span, key: &str) -> Option<Patch> {
    let (line, _) = cx.line(span)?;
    let sections = &cx.facts.syntax.sections;
    let after = sections.partition_point(|section| section.line < line);
    let table: &[&str] = match sections.get(after.checked_sub(1)?)?.kind {
        SectionKind::FileInfo => &FILE_INFO,
        SectionKind::DeviceInfo => &DEVICE_INFO,
        SectionKind::Commissioning => &COMMISSIONING,
        _ => return None,
    };
    let can_go = position(table, key).is_some() && !is_required(key);
    can_go.then(|| Patch::from_iter([Change::Remove(line, line)]))
}
