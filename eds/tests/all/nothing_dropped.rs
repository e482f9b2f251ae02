//! No section or key of a data sheet is dropped silently: what the reader does not understand, it reports.

use crate::cases;
use std::collections::BTreeSet;

use lexican_eds::{Input, Source, load};

/// A key and a section that CiA 306 does not have.
const KEY: &str = "Zzyzx=1";
const SECTION: &str = "[Zzyzx]";

/// The data sheets of all golden cases, which contain everything that the reader knows.
fn sheets() -> Vec<(String, String)> {
    let sheets = cases::cases().into_iter().map(|case| (case.code, case.input.eds.text().to_owned()));
    // A file that is no data sheet has one finding for all of it.
    let sheets: Vec<_> = sheets.filter(|(code, _)| code != "eds::project").collect();
    assert!(sheets.len() > 50, "the cases are found");
    sheets
}

/// Whether a finding points into a line, counted from 0.
fn is_found(text: &str, line: usize) -> bool {
    let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
    let end = start + text.split_inclusive('\n').nth(line).map_or(0, str::len);
    let input = Input::new(Source::new("x.eds", text));
    let (_, diagnostics) = load(&input);
    let mut labels = diagnostics.iter().flat_map(|finding| &finding.labels);
    labels.any(|label| (label.span.start as usize) < end && start <= label.span.end as usize)
}

/// Inserts `line` after the head of every section. Returns the sections in which no finding points to it.
fn unnoticed(line: &str, matters: fn(&str, &str) -> bool) -> Vec<String> {
    let mut unnoticed = Vec::new();
    // Most sections come from the base, and are the same in all cases.
    let mut seen = BTreeSet::new();
    for (path, text) in sheets() {
        let lines: Vec<&str> = text.lines().collect();
        let heads = lines.iter().enumerate().filter(|(_, line)| line.trim_start().starts_with('['));
        for (at, head) in heads.filter(|(_, head)| matters(&path, head.trim())) {
            let next = lines[at + 1..].iter().take_while(|line| !line.starts_with('['));
            if !seen.insert([&[*head], next.copied().collect::<Vec<_>>().as_slice()].concat().join("\n")) {
                continue;
            }
            let more = [&lines[..=at], &[line], &lines[at + 1..]].concat().join("\n");
            if !is_found(&more, at + 1) {
                unnoticed.push(format!("{path}:{}: {line} in {head}", at + 2));
            }
        }
    }
    unnoticed
}

#[test]
fn a_key_that_nobody_knows_is_found_in_every_section() {
    // A section may have one finding for all of it, and comments may have any keys.
    let unnoticed = unnoticed(KEY, |path, head| {
        let is_found_whole = path.contains("duplicate-section") || path.contains("unknown-section");
        !is_found_whole && !head.eq_ignore_ascii_case("[Comments]")
    });
    assert!(unnoticed.is_empty(), "{}", unnoticed.join("\n"));
}

#[test]
fn a_section_that_nobody_knows_is_found_wherever_it_stands() {
    let unnoticed = unnoticed(SECTION, |_, _| true);
    assert!(unnoticed.is_empty(), "{}", unnoticed.join("\n"));
}
