//! The golden cases: `golden/<code>.txt` describes a change of `golden/base.eds`, which has no findings, and the
//! findings after the change. A case has up to three parts:
//!
//! - the difference: `@[2000]` moves to a section, `@end` to the end of the file, `@start` to its beginning. A line with
//!   `-` is removed; a line with `+` is inserted in its place, after the last line named, or at the end of the section;
//!   a line with a blank only names a position. `-[2000]` removes a section. With `file:`, the whole file follows instead;
//! - `overlay:` and the overlay;
//! - `findings:` and the findings as text.
//!
//! `\xB0` is a byte that is not UTF-8.

use std::path::{Path, PathBuf};
use std::{env, fs};

use lexican_eds::{Input, Source};

/// A golden case.
#[allow(dead_code, reason = "not every test needs all of it")]
pub(crate) struct Case {
    /// The code of the rule.
    pub(crate) code: String,
    pub(crate) path: PathBuf,
    /// Everything before the findings.
    pub(crate) given: String,
    /// The findings.
    pub(crate) found: String,
    pub(crate) input: Input,
}

/// All cases, by code.
pub(crate) fn cases() -> Vec<Case> {
    // The toolbox's tests include this file, too.
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../eds/tests/golden");
    let base = fs::read_to_string(root.join("base.eds")).expect("the base is beside the cases");
    let entries = fs::read_dir(&root).expect("the cases are beside this test");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "txt"));
    paths.sort();
    paths.into_iter().map(|path| case(&base, path)).collect()
}

fn case(base: &str, path: PathBuf) -> Case {
    let text = fs::read_to_string(&path).expect("the case is readable");
    let (given, found) = text.split_once("findings:\n").unwrap_or((&text, ""));
    let (delta, overlay) = match given.split_once("overlay:\n") {
        Some((delta, overlay)) => (delta, Some(overlay)),
        None => (given, None),
    };
    let eds = match delta.strip_prefix("file:\n") {
        Some(file) => file.to_owned(),
        None => applied(base, delta),
    };
    let mut input = Input::new(Source::from_bytes("input.eds", &bytes(&eds)));
    if let Some(overlay) = overlay {
        input = input.overlay(Source::new("overlay.toml", overlay));
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let code = name.replacen('-', "::", 1);
    Case { code, given: given.to_owned(), found: found.to_owned(), input, path }
}

/// The base with a difference.
fn applied(base: &str, delta: &str) -> String {
    let mut lines: Vec<&str> = base.lines().collect();
    // The lines of the changed section, and the place of the next line; `None` for the end of the section.
    let (mut section, mut at) = (0..0, None);
    for step in delta.lines() {
        let (sign, text) = step.split_at_checked(1).unwrap_or(("+", ""));
        match sign {
            "@" => (section, at) = (section_of(&lines, text), None),
            "-" if text.starts_with('[') => {
                lines.drain(section_of(&lines, text));
            }
            " " | "-" => {
                let from = at.unwrap_or(section.start);
                let found = lines[from..section.end].iter().position(|line| *line == text);
                let found = from + found.unwrap_or_else(|| panic!("there is no {text:?} to change"));
                at = Some(found + 1);
                if sign == "-" {
                    lines.remove(found);
                    section.end -= 1;
                    at = Some(found);
                }
            }
            "+" => {
                let blank = lines[section.clone()].iter().rev().take_while(|line| line.is_empty()).count();
                let to = at.unwrap_or(section.end - blank);
                lines.insert(to, text);
                section.end += 1;
                at = at.map(|at| at + 1);
            }
            _ => panic!("{step:?} is no step of a case"),
        }
    }
    lines.join("\n") + "\n"
}

/// The lines of a section, its header included.
fn section_of(lines: &[&str], name: &str) -> std::ops::Range<usize> {
    let next =
        |from: usize| lines[from..].iter().position(|line| line.starts_with('[')).map_or(lines.len(), |at| from + at);
    match name {
        "end" => lines.len()..lines.len(),
        "start" => 0..next(0),
        name => {
            let start = lines.iter().position(|line| *line == name);
            let start = start.unwrap_or_else(|| panic!("there is no {name}"));
            start..next(start + 1)
        }
    }
}

/// The text with `\xB0` as bytes.
fn bytes(text: &str) -> Vec<u8> {
    let mut pieces = text.split("\\x");
    let mut bytes = pieces.next().unwrap_or_default().as_bytes().to_vec();
    for piece in pieces {
        bytes.push(u8::from_str_radix(&piece[..2], 16).expect("two hexadecimal digits"));
        bytes.extend(&piece.as_bytes()[2..]);
    }
    bytes
}
