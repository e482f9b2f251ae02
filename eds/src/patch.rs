//! Changes of a text by lines. Lines that are not named stay byte for byte.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;

use crate::text::Source;

/// One change. Lines count from 1, in the text before any change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// Replaces a line.
    Line(u32, String),
    /// Inserts text after a line.
    After(u32, String),
    /// Removes the lines from the first to the last.
    Remove(u32, u32),
}

/// Changes that are applied together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Patch(Vec<Change>);

impl Patch {
    /// Replaces byte ranges, which do not overlap, by other texts.
    pub(crate) fn of_bytes(source: &Source, mut edits: Vec<(Range<usize>, String)>) -> Self {
        edits.sort_by_key(|(at, _)| (at.start, at.end));
        let line = |at: usize| source.position(at as u32).line;
        let shares_line = |a: &(Range<usize>, String), b: &(Range<usize>, String)| line(a.0.end) >= line(b.0.start);
        let mut changes = Vec::new();
        for together in edits.chunk_by(shares_line) {
            let [first, last] = [together[0].0.start, together[together.len() - 1].0.end].map(line);
            let (start, end) = (source.line_range(first as usize - 1).0, source.line_range(last as usize - 1).1);
            let (mut text, mut at) = (String::new(), start as usize);
            for (range, becomes) in together {
                text.extend([&source.text()[at..range.start], becomes]);
                at = range.end;
            }
            changes.push(Change::Line(first, text + &source.text()[at..end as usize]));
            changes.extend((first < last).then_some(Change::Remove(first + 1, last)));
        }
        Self(changes)
    }

    /// The changes.
    #[must_use]
    pub fn changes(&self) -> &[Change] {
        &self.0
    }

    /// Whether it changes nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The text after the changes. New lines end as most lines of the text do.
    #[must_use]
    pub fn apply(&self, source: &Source) -> String {
        let mut becomes: BTreeMap<u32, Option<&str>> = BTreeMap::new();
        let mut added: BTreeMap<u32, Vec<&str>> = BTreeMap::new();
        for change in &self.0 {
            match change {
                Change::Line(line, text) => drop(becomes.insert(*line, Some(text))),
                Change::After(line, text) => added.entry(*line).or_default().push(text),
                Change::Remove(first, last) => becomes.extend((*first..=*last).map(|line| (line, None))),
            }
        }
        let end_of_line = source.end_of_line();
        let mut text = String::with_capacity(source.text().len() + 256);
        for number in 1..=source.line_count() as u32 {
            let (start, end) = source.line_range(number as usize - 1);
            let (next, _) = source.line_range(number as usize);
            let [line, end] = [(start, end), (end, next)].map(|(from, to)| &source.text()[from as usize..to as usize]);
            match becomes.get(&number) {
                None => text.extend([line, end]),
                Some(Some(line)) => text.extend([*line, end]),
                Some(None) => {}
            }
            for line in added.remove(&number).unwrap_or_default() {
                if !text.is_empty() && !text.ends_with(['\r', '\n']) {
                    text.push_str(end_of_line);
                }
                text.extend([line, end_of_line]);
            }
        }
        text
    }

    /// The lines that it reads or changes; patches are independent if they share none.
    pub(crate) fn lines(&self) -> BTreeSet<u32> {
        let of_change = |change: &Change| match change {
            Change::Line(line, _) | Change::After(line, _) => *line..=*line,
            Change::Remove(first, last) => *first..=*last,
        };
        self.0.iter().flat_map(of_change).collect()
    }
}

impl FromIterator<Change> for Patch {
    fn from_iter<T: IntoIterator<Item = Change>>(changes: T) -> Self {
        Self(changes.into_iter().collect())
    }
}

impl Extend<Change> for Patch {
    fn extend<T: IntoIterator<Item = Change>>(&mut self, changes: T) {
        self.0.extend(changes);
    }
}

impl IntoIterator for Patch {
    type Item = Change;
    type IntoIter = std::vec::IntoIter<Change>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

/// The first line of a patch in the help of a finding.
pub(crate) const HEADING: &str = "in the data sheet:";

/// The help of a finding: `in the data sheet:` and a line for each change.
impl fmt::Display for Patch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(HEADING)?;
        self.0.iter().try_for_each(|change| match change {
            Change::Line(line, becomes) => write!(f, "\nline {line}: {becomes}"),
            Change::After(line, added) => write!(f, "\nafter line {line}: {added}"),
            Change::Remove(first, last) if first == last => write!(f, "\nno line {first}"),
            Change::Remove(first, last) => write!(f, "\nno lines {first} to {last}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_replaced_by_the_lines_they_are_in() {
        let source = Source::new("x", "one two\r\nthree\r\nfour");
        let becomes = |edits: &[(Range<usize>, &str)]| {
            let edits = edits.iter().map(|(at, text)| (at.clone(), (*text).to_owned())).collect();
            Patch::of_bytes(&source, edits).apply(&source)
        };
        assert_eq!(becomes(&[(4..7, "2"), (0..3, "1")]), "1 2\r\nthree\r\nfour");
        assert_eq!(becomes(&[(7..14, ""), (16..20, "4")]), "one two\r\n4");
        assert_eq!(becomes(&[(14..14, "\r\n3b"), (20..20, "!")]), "one two\r\nthree\r\n3b\r\nfour!");
    }

    #[test]
    fn what_is_not_named_stays_byte_for_byte() {
        for (before, changes, after) in [
            ("a\r\nb\nc\rd", vec![Change::Line(2, "B".into())], "a\r\nB\nc\rd"),
            ("a\r\nb\r\n", vec![Change::After(1, "x".into()), Change::After(1, "y".into())], "a\r\nx\r\ny\r\nb\r\n"),
            ("a\nb\nc\n", vec![Change::Remove(1, 2)], "c\n"),
            ("a\nb", vec![Change::After(2, "c".into())], "a\nb\nc\n"),
            ("a\n", vec![Change::After(2, "b".into())], "a\nb\n"),
            ("a\nb", vec![Change::Remove(2, 2), Change::After(2, "c".into())], "a\nc\n"),
            ("", vec![Change::After(1, "a".into())], "a\n"),
            ("a\n", vec![Change::Remove(7, 8), Change::Line(9, "x".into())], "a\n"),
        ] {
            let patch: Patch = changes.into_iter().collect();
            assert_eq!(patch.apply(&Source::new("x", before)), after, "{before:?}: {patch}");
        }
    }
}
