//! The comparison in short, in `tests/bench/README.md`: each of its figures is one of the pages that the tasks write.

use std::fs;
use std::path::Path;

const PAGE: &str = "tests/bench/README.md";
const BEGIN: &str = "<!-- made by cargo xtask bench compared -->\n";
const END: &str = "<!-- until here -->";

/// What a row says, and where its figures stand.
struct Row {
    what: &'static str,
    /// `tests/bench/<page>.md`
    page: &'static str,
    /// A cell of the line from which they are looked for: a case, a heading of the page or of a column.
    from: &'static str,
    /// The cells before them, ours first; a version may follow.
    stacks: &'static [&'static str],
    /// How far each figure stands behind that cell.
    at: &'static [usize],
    /// With a place for each: `{ns}` for a time in nanoseconds, `{}` for anything else.
    words: &'static str,
}

const fn sdo(what: &'static str, from: &'static str, stacks: &'static [&'static str]) -> Row {
    Row { what, page: "sdo", from, stacks, at: &[1], words: "{ns}" }
}

const fn files(what: &'static str, at: &'static [usize]) -> Row {
    let stacks = &["lexican", "canopen-host", "python-canopen", "node-canopen"];
    Row { what, page: "files", from: "reader", stacks, at, words: "{}" }
}

const fn bus(what: &'static str, from: &'static str) -> Row {
    let (stacks, words) = (&["lexican, blocking", "python-canopen"], "{}/s, {} us");
    Row { what, page: "bus", from, stacks, at: &[2, 3], words }
}

const ROWS: [Row; 11] = [
    files("real data sheets read, of 328", &[1]),
    files("their values kept, of 206,782", &[2]),
    Row {
        what: "one of 131 kB; by lexican with positions and all rules",
        page: "eds",
        from: "lexican-bench-131614.eds",
        stacks: &["lexican", "canopen-host", "python-canopen"],
        at: &[1],
        words: "{ns}",
    },
    sdo(
        "SDO read of 4 bytes among 10 objects, both sides, no bus",
        "u32 read, 10 objects",
        &["lexican", "canopen-rs", "canopen-sdo", "zencan"],
    ),
    sdo("the same among 1,000 objects", "u32 read, 1000 objects", &["lexican", "canopen-rs", "canopen-sdo", "zencan"]),
    sdo(
        "SDO write of 32 bytes in segments",
        "32 bytes write, segmented",
        &["lexican", "canopen-rs", "canopen-sdo", "zencan"],
    ),
    sdo(
        "SDO block read of 1,200 bytes; canopen-rs and canopen-sdo have no blocks",
        "1200 bytes read, block",
        &["lexican", "zencan"],
    ),
    sdo("a frame of another node", "frame of another node", &["lexican", "canopen-rs", "zencan"]),
    Row {
        what: "a manager's work for a heartbeat, of 1 node and of 127",
        page: "instructions",
        from: "1 node",
        stacks: &["manager: a heartbeat"],
        at: &[1, 2],
        words: "{} and {} instructions",
    },
    bus("SDO round trips over slcan, and processor time per frame", "slcan over a pty"),
    bus("the same over vcan, in a guest", "vcan"),
];

/// Writes the comparison anew, by the pages as they are.
pub(super) fn write(root: &Path) -> Result<(), String> {
    let (before, _, after) = parts(root)?;
    fs::write(root.join(PAGE), before + BEGIN + &table(root)? + END + &after)
        .map_err(|error| format!("{PAGE}: {error}"))
}

/// The page before the table, the table, and what comes after it.
fn parts(root: &Path) -> Result<(String, String, String), String> {
    let page = read(root, PAGE)?;
    let parts = page.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?)));
    let (before, (table, after)) = parts.ok_or_else(|| format!("{PAGE} lacks {BEGIN}or {END}"))?;
    Ok((before.to_owned(), table.to_owned(), after.to_owned()))
}

fn table(root: &Path) -> Result<String, String> {
    let mut table = "\n| what | lexican | others | page |\n| --- | --- | --- | --- |\n".to_owned();
    for row in &ROWS {
        let name = format!("{}.md", row.page);
        let page = read(root, &format!("tests/bench/{name}"))?;
        let said =
            |stack: &&str| row.said(&page, stack).ok_or_else(|| format!("{name}: no {stack:?} at {:?}", row.from));
        let ours = said(&row.stacks[0])?;
        let others = row.stacks[1..].iter().map(|stack| Ok(format!("{stack} {}", said(stack)?)));
        let others = others.collect::<Result<Vec<_>, String>>()?.join("; ");
        let others = if others.is_empty() { "not counted here" } else { &others };
        table += &format!("| {} | {ours} | {others} | [{}]({name}) |\n", row.what, row.page);
    }
    Ok(table + "\n")
}

impl Row {
    /// What the page says of a stack; `None` if it does not.
    fn said(&self, page: &str, stack: &str) -> Option<String> {
        let mut lines = page.lines().map(cells).skip_while(|cells| !cells.contains(&self.from));
        let is_it = |cell: &&str| cell.strip_prefix(stack).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '));
        let (line, place) = lines.find_map(|cells| cells.iter().position(is_it).map(|place| (cells, place)))?;
        self.at.iter().try_fold(self.words.to_owned(), |words, at| {
            let figure = line.get(place + at)?;
            let number = figure.parse().ok()?;
            let (place, text) = if words.contains("{ns}") { ("{ns}", time(number)) } else { ("{}", grouped(figure)) };
            Some(words.replacen(place, &text, 1))
        })
    }
}

/// The cells of a line: of a table, of text in columns, or its words as a heading.
fn cells(line: &str) -> Vec<&str> {
    let cells = line.trim_start_matches('#').split('|').flat_map(|cell| cell.split("  ")).map(str::trim);
    cells.filter(|cell| !cell.is_empty()).collect()
}

/// A time with its unit, as exactly as another run gives it again.
fn time(ns: f64) -> String {
    let (value, unit) = match ns {
        ..1e3 => (ns, "ns"),
        1e3..1e6 => (ns / 1e3, "us"),
        _ => (ns / 1e6, "ms"),
    };
    if value < 10.0 { format!("{value:.1} {unit}") } else { format!("{value:.0} {unit}") }
}

/// Thousands apart.
fn grouped(figure: &str) -> String {
    let (whole, rest) = figure.split_at(figure.find('.').unwrap_or(figure.len()));
    let groups: Vec<&str> = whole.as_bytes().rchunks(3).rev().filter_map(|group| str::from_utf8(group).ok()).collect();
    groups.join(",") + rest
}

fn read(root: &Path, page: &str) -> Result<String, String> {
    fs::read_to_string(root.join(page)).map_err(|error| format!("{page}: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_comparison_is_what_the_pages_say() {
        let root = crate::workspace::root();
        let (_, kept, _) = parts(&root).unwrap();
        assert_eq!(kept, table(&root).unwrap(), "cargo xtask bench compared");
    }
}
