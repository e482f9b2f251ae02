//! The lists of objects: a count, and lines numbered from 1 without gap.

use crate::parse::number;
use crate::parse::reader::number_of_key;
use crate::parse::section::without_blanks;
use crate::parse::syntax::{Pair, Section, Syntax};
use crate::patch::{Change, Patch};

/// The key that holds the number of objects in a list.
pub(crate) const COUNT: &str = "SupportedObjects";

/// Removes objects from a list and appends others, and numbers it from 1. Lines that stay keep their order and
/// spelling. `None` if two lines have the same number: readers differ in which of them counts.
pub(crate) fn rewritten(
    syntax: &Syntax<'_>,
    list: &Section<'_>,
    goes: impl Fn(&Pair<'_>, u16) -> bool,
    added: &[u16],
) -> Option<Patch> {
    let mut listed: Vec<(u32, u16, &Pair<'_>)> = list.pairs.iter().filter_map(listed).collect();
    listed.sort_by_key(|(number, ..)| *number);
    if listed.windows(2).any(|pair| pair[0].0 == pair[1].0) {
        return None;
    }
    let mut patch = Vec::new();
    let mut count = 0;
    for (number, index, pair) in listed {
        if goes(pair, index) {
            patch.push(Change::Remove(pair.line + 1, pair.line + 1));
            continue;
        }
        count += 1;
        if number != count {
            patch.push(syntax.with(syntax.key_span(pair), &count.to_string()));
        }
    }
    let end = list.pairs.last().map_or(list.line, |pair| pair.line) + 1;
    for index in added {
        count += 1;
        patch.push(Change::After(end, format!("{count}=0x{index:04X}")));
    }
    let said = list.get(COUNT).map(|pair| (pair, number::integer(pair.value).map(|read| read.value)));
    let counted = match said {
        Some((_, Some(said))) if said == i128::from(count) => None,
        Some((pair, _)) => Some(syntax.with_value(pair, &count.to_string())),
        None => Some(Change::After(list.line + 1, format!("{COUNT}={count}"))),
    };
    Some(counted.into_iter().chain(patch).collect())
}

/// The number of a list's line, and the object that it names.
pub(crate) fn listed<'s, 'a>(pair: &'s Pair<'a>) -> Option<(u32, u16, &'s Pair<'a>)> {
    let number = number_of_key(&without_blanks(pair.key), "", 10)?;
    let index = u16::try_from(number::integer(pair.value)?.value).ok()?;
    Some((number, index, pair))
}
