//! A change of a text by its lines: what it does not name stays byte for byte.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use crate::text::Source;

/// One change. Lines count from 1, as they are before any change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// The line becomes this.
    Line(u32, String),
    /// This comes after the line.
    After(u32, String),
    /// The lines from the first to the last go.
    Remove(u32, u32),
}

/// Changes of a text that are made together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Patch(Vec<Change>);

impl Patch {
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

    /// The text with the changes. New lines end as most lines of the text do.
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

    /// The lines that it reads or changes, so that no other patch may.
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

/// What a patch begins with as help of a finding.
pub(crate) const HEADING: &str = "in the data sheet:";

/// `in the data sheet:` and a line for each change, as help of a finding.
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
