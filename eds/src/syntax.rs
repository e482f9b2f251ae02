//! Sections and keys, and where they are.
//!
//! rust-ini is the tokeniser. A pass over the lines goes first: it hands on only lines that are a section or a
//! key, in a form that rust-ini reads as CiA 306 means it, reports what it had to repair, and remembers the line
//! of each. So the n-th section and the n-th key of rust-ini are those of the n-th remembered line, which is all
//! it takes to find the columns again when a finding needs them.

use ini::{Ini, ParseOption};

use crate::check;
use crate::diagnostics::Diagnostics;
use crate::source::{Source, Span};

/// The longest line that CiA 306-1 allows.
pub(crate) const MAX_LINE_LENGTH: usize = 255;

/// The first half: what rust-ini made of the repaired lines. [`Syntax`] borrows from it.
pub(crate) struct Tokens {
    ini: Ini,
    /// The line of every section, and how many keys follow it; keys before the first section come first.
    sections: Vec<(u32, usize)>,
    /// The line of every key.
    keys: Vec<u32>,
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
    /// From 0.
    pub(crate) line: u32,
    pub(crate) pairs: Vec<Pair<'a>>,
}

/// `key=value`, both without blanks around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair<'a> {
    pub(crate) key: &'a str,
    pub(crate) value: &'a str,
    /// From 0.
    pub(crate) line: u32,
}

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line<'a> {
    /// Nothing.
    Blank,
    /// `; comment`.
    Comment(&'a str),
    /// `[name]`, and what follows.
    Section { name: &'a str, closed: bool, rest: &'a str },
    /// `key=value`, separated by a colon when the line has no equals sign.
    Pair { key: &'a str, value: &'a str, separator: Separator },
    /// Anything else.
    Other(&'a str),
}

/// What stands between key and value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Separator {
    Equals,
    Colon,
    /// A blank, after one of the keys of an object.
    Blank,
}

impl<'a> Line<'a> {
    /// Total: every line is one of these.
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
            crate::object::Key::of(key)?;
            (key, value, Separator::Blank)
        };
        let (key, value) = (key.trim(), value.trim());
        (!key.is_empty()).then_some(Line::Pair { key, value, separator })
    }
}

/// Repairs the lines, reports what was repaired, and lets rust-ini read the rest.
pub(crate) fn tokenize(source: &Source, out: &mut Diagnostics) -> Tokens {
    let mut clean = String::with_capacity(source.text().len() + 16);
    let mut tokens = Tokens { ini: Ini::new(), sections: vec![(0, 0)], keys: Vec::new() };
    for number in 0..source.line_count() {
        let text = source.line(number);
        match Line::of(text) {
            Line::Blank | Line::Comment(_) => continue,
            Line::Section { name, .. } => {
                tokens.sections.push((number as u32, 0));
                push_section(&mut clean, name);
            }
            Line::Pair { key, value, .. } => {
                tokens.keys.push(number as u32);
                if let Some((_, keys)) = tokens.sections.last_mut() {
                    *keys += 1;
                }
                push_pair(&mut clean, key, value);
            }
            Line::Other(_) => {}
        }
        report(source, number, out);
    }
    let options = ParseOption { enabled_quote: false, enabled_escape: false, ..ParseOption::default() };
    match Ini::load_from_str_opt(&clean, options) {
        Ok(ini) => tokens.ini = ini,
        Err(error) => out.push(check::tokenizer_and_locator_agree::refused(&error.to_string())),
    }
    tokens
}

impl<'a> Syntax<'a> {
    /// Gives every section and key of rust-ini its line.
    pub(crate) fn new(source: &'a Source, tokens: &'a Tokens, out: &mut Diagnostics) -> Self {
        match tokens.with_lines() {
            Some(sections) => Self { source, sections },
            None => {
                out.push(check::tokenizer_and_locator_agree::different());
                Self { source, sections: tokens.by_lines(source) }
            }
        }
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

    /// The value of a pair; the place behind the separator when it is empty.
    pub(crate) fn value_span(&self, pair: &Pair<'_>) -> Span {
        let (start, text) = self.line(pair.line);
        let Line::Pair { value, .. } = Line::of(text) else { return Span::eds(start, start) };
        part(start, text, value)
    }

    /// The section whose name has this span.
    pub(crate) fn section_at(&self, span: Span) -> Option<&Section<'a>> {
        let line = self.source.position(span.start).line - 1;
        let at = self.sections.binary_search_by_key(&line, |section| section.line).ok()?;
        (span.source == 0).then(|| &self.sections[at])
    }

    fn line(&self, line: u32) -> (u32, &'a str) {
        (self.source.line_range(line as usize).0, self.source.line(line as usize))
    }
}

impl<'a> Section<'a> {
    /// The first pair with this key, in any case.
    pub(crate) fn get(&self, key: &str) -> Option<&Pair<'a>> {
        self.pairs.iter().find(|pair| crate::read::position(&[key], pair.key).is_some())
    }
}

impl Tokens {
    fn with_lines(&self) -> Option<Vec<Section<'_>>> {
        let mut keys = self.keys.iter();
        let mut sections = Vec::with_capacity(self.sections.len());
        let mut tokenized = self.ini.iter().filter(|(name, pairs)| name.is_some() || !pairs.is_empty()).peekable();
        for &(line, count) in &self.sections {
            if sections.is_empty() && count == 0 && tokenized.peek().is_none_or(|(name, _)| name.is_some()) {
                // No keys before the first section.
                sections.push(Section { name: "", line, pairs: Vec::new() });
                continue;
            }
            let (name, properties) = tokenized.next()?;
            let mut pairs = Vec::with_capacity(count);
            for (key, value) in properties {
                pairs.push(Pair { key, value, line: *keys.next()? });
            }
            if pairs.len() != count {
                return None;
            }
            sections.push(Section { name: name.unwrap_or_default(), line, pairs });
        }
        tokenized.next().is_none().then(|| without_empty_start(sections))
    }

    fn by_lines<'a>(&self, source: &'a Source) -> Vec<Section<'a>> {
        let mut keys = self.keys.iter();
        let sections = self.sections.iter().map(|&(line, count)| {
            let name = match Line::of(source.line(line as usize)) {
                Line::Section { name, .. } => name,
                _ => "",
            };
            let pair = |&line: &u32| match Line::of(source.line(line as usize)) {
                Line::Pair { key, value, .. } => Pair { key, value, line },
                _ => Pair { key: "", value: "", line },
            };
            Section { name, line, pairs: keys.by_ref().take(count).map(pair).collect() }
        });
        without_empty_start(sections.collect())
    }
}

/// The unnamed section before the first is one only when it holds something.
fn without_empty_start(mut sections: Vec<Section<'_>>) -> Vec<Section<'_>> {
    if sections.first().is_some_and(|section| section.pairs.is_empty()) {
        sections.remove(0);
    }
    sections
}

/// A backslash would hide the bracket from rust-ini.
fn push_section(clean: &mut String, name: &str) {
    clean.push('[');
    push_replaced(clean, name, &['\\']);
    clean.push_str("]\n");
}

/// A colon would separate, a backslash would hide the equals sign or join lines.
fn push_pair(clean: &mut String, key: &str, value: &str) {
    push_replaced(clean, key, &['\\', ':']);
    clean.push('=');
    clean.push_str(value);
    clean.push_str(if value.ends_with('\\') { " \n" } else { "\n" });
}

fn push_replaced(clean: &mut String, text: &str, forbidden: &[char]) {
    if text.contains(forbidden) { clean.push_str(&text.replace(forbidden, "_")) } else { clean.push_str(text) }
}

fn part(start: u32, line: &str, part: &str) -> Span {
    // Both are slices of the same line.
    let offset = (part.as_ptr() as usize).wrapping_sub(line.as_ptr() as usize);
    let offset = if offset <= line.len() { offset as u32 } else { line.len() as u32 };
    Span::eds(start + offset, start + offset + part.len() as u32)
}

fn report(source: &Source, number: usize, out: &mut Diagnostics) {
    let text = source.line(number);
    let start = source.line_range(number).0;
    if text.len() > MAX_LINE_LENGTH {
        out.push(check::lines_are_at_most_255_characters_long::found(text, start));
    }
    match Line::of(text) {
        Line::Section { closed: false, name, .. } => {
            out.push(check::section_names_are_closed::found(part(start, text, name)));
        }
        Line::Section { rest, .. } if !rest.is_empty() && !rest.starts_with([';', '#']) => {
            out.push(check::nothing_follows_a_section_name::found(part(start, text, rest)));
        }
        Line::Pair { key, separator: separator @ (Separator::Colon | Separator::Blank), .. } => {
            out.push(check::keys_and_values_are_separated_by_equals_signs::found(part(start, text, key), separator));
        }
        Line::Other(other) => out.push(check::lines_are_sections_keys_or_comments::found(part(start, text, other))),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, check: impl FnOnce(&Syntax<'_>, &Diagnostics)) {
        let source = Source::new("x.eds", text);
        let mut out = Diagnostics::default();
        let tokens = tokenize(&source, &mut out);
        let syntax = Syntax::new(&source, &tokens, &mut out);
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
                assert!(out.iter().all(|d| d.code != check::tokenizer_and_locator_agree::RULE.code));
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
