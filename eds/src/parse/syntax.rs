//! Sections and keys, and where they are.
//!
//! rust-ini is the tokeniser. A first pass over the lines hands rust-ini only lines that are a section or a key, in a
//! form that rust-ini reads as CiA 306 means it, reports what it had to repair, and remembers the number of each line.
//! The n-th section or key of rust-ini is then the n-th remembered line, from which its columns are found when a
//! finding needs them.

use std::collections::BTreeMap;
use std::ops::Range;

use ini::{Ini, ParseOption};

use crate::finding::{Findings, Kind, Separator};
use crate::model::keys::Key;
use crate::parse::section::{SectionKind, position};
use crate::patch::Change;
use crate::text::{Source, Span};

/// The longest line that CiA 306-1 allows.
pub(crate) const MAX_LINE_LENGTH: usize = 255;

/// The tokens of a file: the text that rust-ini made of the repaired lines, in one piece. [`Syntax`] borrows the text,
/// and then no longer needs the lengths.
#[derive(Default)]
pub(crate) struct Tokens {
    /// All names, keys and values concatenated.
    pub(crate) text: String,
    pub(crate) lengths: Lengths,
}

/// The lengths that take the text apart again.
#[derive(Default)]
pub(crate) struct Lengths {
    sections: Vec<SectionToken>,
    keys: Vec<KeyToken>,
}

/// A section: its line, the length of its name, and how many keys follow it.
struct SectionToken {
    line: u32,
    name: u32,
    keys: u32,
}

/// A key: its line, and the lengths of its name and its value.
struct KeyToken {
    line: u32,
    key: u32,
    value: u32,
}

/// A data sheet as sections of keys, in the order of the file.
pub(crate) struct Syntax<'a> {
    pub(crate) source: &'a Source,
    pub(crate) sections: Vec<Section<'a>>,
}

/// `[name]` and the keys under it.
#[derive(Debug)]
pub(crate) struct Section<'a> {
    pub(crate) name: &'a str,
    pub(crate) kind: SectionKind,
    /// From 0.
    pub(crate) line: u32,
    pub(crate) pairs: Box<[Pair<'a>]>,
}

/// `key=value`, both without blanks around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair<'a> {
    pub(crate) key: &'a str,
    pub(crate) value: &'a str,
    /// From 0.
    pub(crate) line: u32,
}

/// The kinds of lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line<'a> {
    /// Nothing.
    Blank,
    /// `; comment`.
    Comment(&'a str),
    /// `[name]`, and the rest of the line.
    Section { name: &'a str, closed: bool, rest: &'a str },
    /// `key=value`, separated by a colon when the line has no equals sign.
    Pair { key: &'a str, value: &'a str, separator: Separator },
    /// Anything else.
    Other(&'a str),
}

impl<'a> Line<'a> {
    /// Classifies a line.
    pub(crate) fn of(text: &'a str) -> Self {
        let text = text.trim();
        match text.as_bytes() {
            [] => Line::Blank,
            [b';' | b'#', ..] => Line::Comment(text),
            [b'[', ..] => match text[1..].split_once(']') {
                Some((name, rest)) => Line::Section { name: name.trim(), closed: true, rest: rest.trim() },
                None => Line::Section { name: text[1..].trim(), closed: false, rest: "" },
            },
            _ => Self::pair(text).unwrap_or(Line::Other(text)),
        }
    }

    fn pair(text: &'a str) -> Option<Self> {
        let (key, value, separator) = if let Some((key, value)) = text.split_once('=') {
            (key, value, Separator::Equals)
        } else if let Some((key, value)) = text.split_once(':') {
            (key, value, Separator::Colon)
        } else {
            let (key, value) = text.split_once(char::is_whitespace)?;
            Key::of(key)?;
            (key, value, Separator::Blank)
        };
        let (key, value) = (key.trim(), value.trim());
        (!key.is_empty()).then_some(Line::Pair { key, value, separator })
    }
}

/// About how many bytes of a section rust-ini gets at a time: its result takes about twenty times the memory. In tests,
/// almost every line begins a portion.
const PORTION: u32 = if cfg!(test) { 8 } else { 64 * 1024 };

/// Repairs the lines, reports the repairs, and lets rust-ini read every portion that is not in `memory` already.
pub(crate) fn tokenize(source: &Source, out: &mut Findings, mut memory: Option<&mut Memory>) -> Tokens {
    // Keys before the first section belong to a section without name.
    let mut tokens = Tokens::default();
    tokens.lengths.sections.push(SectionToken { line: 0, name: 0, keys: 0 });
    let (mut first, mut start, mut is_read) = (0, 0, true);
    // Shortcut: most lines are keys.
    let begins_with_key =
        |start: u32| source.text().as_bytes().get(start as usize).is_some_and(u8::is_ascii_alphanumeric);
    let is_section = |line: usize| source.line(line).trim_start().starts_with('[');
    for next in 1..=source.line_count() {
        let end = source.line_start(next);
        let is_more = next < source.line_count() && end - start < PORTION;
        if is_more && (begins_with_key(end) || !is_section(next)) {
            continue;
        }
        let read = || Portion::read(source, first..next);
        let mut unknown = None;
        let portion = match &mut memory {
            Some(memory) => memory.recall(source.get(Span::eds(start, end)), read),
            None => unknown.insert(read()),
        };
        tokens.add(portion, first as u32);
        for (kind, span) in &portion.findings {
            out.push(kind.clone(), Span::eds(start + span.start, start + span.end));
        }
        is_read &= portion.is_read;
        (first, start) = (next, end);
    }
    if !is_read {
        out.push(Kind::Tokenizer, Span::eds(0, 0));
    }
    if let Some(memory) = memory {
        memory.forget();
    }
    tokens
}

/// The tokens of the last reading of a data sheet, reused when it is read again: while somebody types, most sections
/// stay as they are.
#[derive(Default)]
pub struct Memory {
    /// By the text of the portion; the flag says whether it occurred in the current reading.
    portions: BTreeMap<Box<str>, (Portion, bool)>,
}

impl Memory {
    fn recall(&mut self, text: &str, read: impl FnOnce() -> Portion) -> &Portion {
        if !self.portions.contains_key(text) {
            self.portions.insert(text.into(), (read(), true));
        }
        let (portion, is_there) = self.portions.get_mut(text).expect("it was inserted if it was not there");
        *is_there = true;
        portion
    }

    /// Drops portions that no longer occur.
    fn forget(&mut self) {
        self.portions.retain(|_, (_, is_there)| std::mem::take(is_there));
    }
}

/// A section, or a part of a large one. Lines and places count from its beginning, so that it can move within the file.
#[derive(Default)]
struct Portion {
    /// The length of the section's name, if the portion begins with it.
    name: Option<u32>,
    keys: Vec<KeyToken>,
    /// Name, keys and values concatenated.
    text: String,
    findings: Vec<(Kind, Span)>,
    /// Whether rust-ini found as many sections and keys as the lines have.
    is_read: bool,
}

impl Portion {
    fn read(source: &Source, lines: Range<usize>) -> Self {
        let start = source.line_start(lines.start);
        let (mut portion, mut clean) = (Self::default(), String::new());
        for number in lines.clone() {
            let text = source.line(number);
            let line = Line::of(text);
            match line {
                Line::Blank | Line::Comment(_) => continue,
                Line::Section { name, .. } => {
                    portion.name = Some(0);
                    push_section(&mut clean, name);
                }
                Line::Pair { key, value, .. } => {
                    portion.keys.push(KeyToken { line: (number - lines.start) as u32, key: 0, value: 0 });
                    push_pair(&mut clean, key, value);
                }
                Line::Other(_) => {}
            }
            report(line, text, source.line_start(number) - start, &mut portion.findings);
        }
        portion.is_read = portion.fill(&clean).is_some();
        if !portion.is_read {
            portion.fill_from_lines(source, lines.start);
        }
        portion
    }

    /// Fills in the tokens of rust-ini; `None` if there are more or fewer than the lines have.
    fn fill(&mut self, clean: &str) -> Option<()> {
        let options = ParseOption { enabled_quote: false, enabled_escape: false, ..ParseOption::default() };
        let ini = Ini::load_from_str_opt(clean, options).ok()?;
        let mut sections = ini.iter().filter(|(name, pairs)| name.is_some() || !pairs.is_empty());
        let (name, pairs) = sections.next().map_or((None, None), |(name, pairs)| (name, Some(pairs)));
        (name.is_some() == self.name.is_some()).then_some(())?;
        self.name = name.map(|name| name.len() as u32);
        self.text.push_str(name.unwrap_or_default());
        let mut tokens = self.keys.iter_mut();
        for (key, value) in pairs.into_iter().flat_map(|pairs| pairs.iter()) {
            let token = tokens.next()?;
            (token.key, token.value) = (key.len() as u32, value.len() as u32);
            self.text.push_str(key);
            self.text.push_str(value);
        }
        (tokens.next().is_none() && sections.next().is_none()).then_some(())
    }

    /// Fills in the tokens from the lines, without rust-ini.
    fn fill_from_lines(&mut self, source: &Source, first: usize) {
        self.text.clear();
        if let Line::Section { name, .. } = Line::of(source.line(first)) {
            self.name = Some(name.len() as u32);
            self.text.push_str(name);
        }
        for token in &mut self.keys {
            let Line::Pair { key, value, .. } = Line::of(source.line(first + token.line as usize)) else { continue };
            (token.key, token.value) = (key.len() as u32, value.len() as u32);
            self.text.push_str(key);
            self.text.push_str(value);
        }
    }
}

impl Tokens {
    fn add(&mut self, portion: &Portion, line: u32) {
        let Lengths { sections, keys } = &mut self.lengths;
        sections.extend(portion.name.map(|name| SectionToken { line, name, keys: 0 }));
        if let Some(section) = sections.last_mut() {
            section.keys += portion.keys.len() as u32;
        }
        keys.extend(portion.keys.iter().map(|token| KeyToken { line: line + token.line, ..*token }));
        self.text.push_str(&portion.text);
    }
}

impl<'a> Syntax<'a> {
    pub(crate) fn new(source: &'a Source, text: &'a str, lengths: Lengths) -> Self {
        let mut rest = text;
        let mut next = |length: u32| {
            let (text, after) = rest.split_at_checked(length as usize).unwrap_or((rest, ""));
            rest = after;
            text
        };
        let mut keys = lengths.keys.iter();
        let mut sections = Vec::with_capacity(lengths.sections.len());
        for section in &lengths.sections {
            let name = next(section.name);
            let of_section = keys.by_ref().take(section.keys as usize);
            let pairs: Box<[Pair<'a>]> = of_section
                .map(|token| Pair { key: next(token.key), value: next(token.value), line: token.line })
                .collect();
            // The keys before the first section name count as a section only if there are any.
            if !sections.is_empty() || !pairs.is_empty() || section.line > 0 || !name.is_empty() {
                sections.push(Section { name, kind: SectionKind::of(name), line: section.line, pairs });
            }
        }
        Self { source, sections }
    }

    /// The name of a section.
    pub(crate) fn name_span(&self, section: &Section<'_>) -> Span {
        let (start, text) = self.line(section.line);
        let Line::Section { name, .. } = Line::of(text) else { return Span::eds(start, start) };
        part(start, text, name)
    }

    /// The key of a pair, as written.
    pub(crate) fn key_span(&self, pair: &Pair<'_>) -> Span {
        let (start, text) = self.line(pair.line);
        let Line::Pair { key, .. } = Line::of(text) else { return Span::eds(start, start) };
        part(start, text, key)
    }

    /// The value of a pair; if empty, the position behind the separator.
    pub(crate) fn value_span(&self, pair: &Pair<'_>) -> Span {
        let (start, text) = self.line(pair.line);
        let Line::Pair { value, .. } = Line::of(text) else { return Span::eds(start, start) };
        part(start, text, value)
    }

    /// Replaces a place within its line.
    pub(crate) fn with(&self, span: Span, by: &str) -> Change {
        with(self.source, span, by)
    }

    /// Replaces the value of a pair.
    pub(crate) fn with_value(&self, pair: &Pair<'_>, value: &str) -> Change {
        self.with(self.value_span(pair), value)
    }

    /// The section whose name has this span.
    pub(crate) fn section_at(&self, span: Span) -> Option<&Section<'a>> {
        let line = self.source.position(span.start).line - 1;
        let at = self.sections.binary_search_by_key(&line, |section| section.line).ok()?;
        (span.source == 0).then(|| &self.sections[at])
    }

    fn line(&self, line: u32) -> (u32, &'a str) {
        (self.source.line_start(line as usize), self.source.line(line as usize))
    }
}

impl<'a> Section<'a> {
    /// The first pair with this key, in upper or lower case.
    pub(crate) fn get(&self, key: &str) -> Option<&Pair<'a>> {
        self.pairs.iter().find(|pair| position(&[key], pair.key).is_some())
    }
}

/// A backslash would hide the bracket from rust-ini.
fn push_section(clean: &mut String, name: &str) {
    clean.push('[');
    push_replaced(clean, name, &['\\']);
    clean.push_str("]\n");
}

/// To rust-ini, a colon separates, and a backslash hides the equals sign or joins lines.
fn push_pair(clean: &mut String, key: &str, value: &str) {
    push_replaced(clean, key, &['\\', ':']);
    clean.push('=');
    clean.push_str(value);
    clean.push_str(if value.ends_with('\\') { " \n" } else { "\n" });
}

fn push_replaced(clean: &mut String, text: &str, forbidden: &[char]) {
    if text.contains(forbidden) { clean.push_str(&text.replace(forbidden, "_")) } else { clean.push_str(text) }
}

/// Replaces a place within its line.
pub(crate) fn with(source: &Source, span: Span, by: &str) -> Change {
    let line = source.line_at(span.start);
    let (start, text) = (source.line_range(line).0, source.line(line));
    let [from, to] = [span.start, span.end].map(|at| (at.saturating_sub(start) as usize).min(text.len()));
    Change::Line(line as u32 + 1, [&text[..from], by, &text[to..]].concat())
}

/// The place of `part`, a slice of the line that begins at offset `start`.
pub(crate) fn part(start: u32, line: &str, part: &str) -> Span {
    let offset = (part.as_ptr() as usize).wrapping_sub(line.as_ptr() as usize);
    let offset = if offset <= line.len() { offset as u32 } else { line.len() as u32 };
    Span::eds(start + offset, start + offset + part.len() as u32)
}

/// Reports irregularities of the line that begins at offset `start`.
fn report(line: Line<'_>, text: &str, start: u32, out: &mut Vec<(Kind, Span)>) {
    if text.len() > MAX_LINE_LENGTH
        && let Some((cut, _)) = text.char_indices().nth(MAX_LINE_LENGTH)
    {
        let beyond = Span::eds(start + cut as u32, start + text.len() as u32);
        out.push((Kind::LongLine { characters: text.chars().count() }, beyond));
    }
    match line {
        Line::Section { closed: false, name, .. } => out.push((Kind::UnclosedSection, part(start, text, name))),
        Line::Section { rest, .. } if !rest.is_empty() && !rest.starts_with([';', '#']) => {
            out.push((Kind::TextAfterSection, part(start, text, rest)));
        }
        Line::Pair { key, separator: separator @ (Separator::Colon | Separator::Blank), .. } => {
            out.push((Kind::NoEqualsSign(separator), part(start, text, key)));
        }
        Line::Other(other) => out.push((Kind::StrayText, part(start, text, other))),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, check: impl FnOnce(&Syntax<'_>, &Findings)) {
        let source = Source::new("x.eds", text);
        let mut out = Findings::default();
        let Tokens { text, lengths } = tokenize(&source, &mut out, None);
        let syntax = Syntax::new(&source, &text, lengths);
        check(&syntax, &out);
    }

    /// `name: key=value@line …`, one section a line.
    fn listing(syntax: &Syntax<'_>) -> String {
        let pair = |p: &Pair<'_>| format!(" {}={}@{}", p.key, p.value, p.line + 1);
        let section = |s: &Section<'_>| format!("{}:{}\n", s.name, s.pairs.iter().map(pair).collect::<String>());
        syntax.sections.iter().map(section).collect()
    }

    #[test]
    fn the_traps_of_the_tokenizer_are_repaired() {
        let check =
            |text: &str, expected: &str| read(text, |syntax, _| assert_eq!(listing(syntax), expected, "{text:?}"));
        check("[a]\nx=1\ny=2", "a: x=1@2 y=2@3\n");
        check("x=1\n[a]\n", ": x=1@1\na:\n");
        check("[a]\r\nDataType 0x7\r\ny=2", "a: DataType=0x7@2 y=2@3\n");
        check("[a]\nParameterName\nDataType=7", "a: DataType=7@3\n");
        check("[a] ; behind\nx=1", "a: x=1@2\n");
        check("[a] x\nx=1", "a: x=1@2\n");
        check("[a\nx=1", "a: x=1@2\n");
        check("[ a ]\n  x = 1 \n", "a: x=1@2\n");
        check("[a]\n  ; x=1\n ;\n# y\nz=3", "a: z=3@5\n");
        check("[a]\nx=C:\\eds\\new.eds\ny=2", "a: x=C:\\eds\\new.eds@2 y=2@3\n");
        check("[a]\nx=1\\\ny=2", "a: x=1\\@2 y=2@3\n");
        check("[a\\]\nx=1", "a_: x=1@2\n");
        check("[a]\nx\\=1\ny=2", "a: x_=1@2 y=2@3\n");
        check("[a]\nx:y=1", "a: x_y=1@2\n");
        check("[a]\nx: 1", "a: x=1@2\n");
        check("[a]\n=1\ny=2", "a: y=2@3\n");
        check("[a]\nx=1;2 \"3\" '4'", "a: x=1;2 \"3\" '4'@2\n");
        check("[a]\nx=\ny=", "a: x=@2 y=@3\n");
        check("[a]\nx=1\nX=2\nx=3\n[a]\nx=4", "a: x=1@2 X=2@3 x=3@4\na: x=4@6\n");
        check("", "");
        check("[]\nx=1", ": x=1@2\n");
    }

    #[test]
    fn places_are_found_again() {
        read("[ a ]\n\tkey =  value \r\nempty=\n", |syntax, _| {
            let text = |span: Span| &syntax.source.text()[span.start as usize..span.end as usize];
            let section = &syntax.sections[0];
            assert_eq!(text(syntax.name_span(section)), "a");
            assert_eq!(text(syntax.key_span(&section.pairs[0])), "key");
            assert_eq!(text(syntax.value_span(&section.pairs[0])), "value");
            let place = syntax.value_span(&section.pairs[1]);
            assert_eq!(syntax.source.position(place.start).to_string(), "3:7");
        });
    }

    proptest::proptest! {
        #[test]
        fn tokenizer_and_locator_see_the_same(text in "([\\[\\]=:;#\\\\ \t\r\na-c\u{e9}\u{a0}\"']|\\[a\\]\n|b=c\n){0,60}") {
            read(&text, |syntax, out| {
                assert!(out.iter().all(|finding| finding.kind != Kind::Tokenizer));
                for section in &syntax.sections {
                    for pair in &section.pairs {
                        let line = Line::of(syntax.source.line(pair.line as usize));
                        let Line::Pair { key, value, .. } = line else { panic!("{line:?}") };
                        assert_eq!(pair.key, key.replace(['\\', ':'], "_"));
                        assert_eq!(pair.value, value);
                    }
                }
            });
        }
    }
}
