//! The house in figures: lines of each room, and files that a usual change touches, as ARCHITECTURE.md records them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const PAGE: &str = "ARCHITECTURE.md";
const BEGIN: &str = "<!-- made by cargo xtask tidy --record -->\n";
const END: &str = "<!-- until here -->";

/// What is added now and then, an example of it by a name that nothing else has, and what is its own: other files that name it
/// are those that the next one changes, too.
const CHANGES: [(&str, &str, &str); 7] = [
    ("a drive: files that name the AKD", "akd", "drives/kollmorgen-akd/"),
    ("a link: files that name slcan", "slcan", "runtime/src/host/slcan"),
    ("a log format: files that name BLF", "blf", "toolbox/src/log/format/blf.rs"),
    ("a drive's order: files that name MoveTo", "moveto", "drives/"),
    ("a mode of CiA 402: files that name the cyclic torque one", "cyclictorque", "drives/kollmorgen-akd/"),
    (
        "a mode with an object of its own: files that name the interpolated one",
        "interpolated",
        "drives/kollmorgen-akd/",
    ),
    ("a trace column: files that name alarming", "alarming", "bench/src/model/trace.rs"),
];

/// Words that have had too many meanings: one type, or few, is to have each as its name.
const WORDS: [&str; 6] = ["Bench", "Command", "Door", "Face", "Order", "Station"];

/// What is counted in each row: product and tests, or files and nothing.
type Figures = BTreeMap<String, [usize; 2]>;

/// Lines of code by room, and below them the changes.
fn measured(sources: &BTreeMap<&str, &str>) -> Vec<(String, [usize; 2])> {
    let mut rooms = Figures::new();
    for (path, text) in sources {
        let lines = text.lines().count();
        let of_tests = if is_test(path) { lines } else { tests_inside(text) };
        let room = rooms.entry(path.split('/').next().unwrap_or_default().to_owned()).or_default();
        *room = [room[0] + lines - of_tests, room[1] + of_tests];
    }
    let sum = rooms.values().fold([0, 0], |sum, room| [sum[0] + room[0], sum[1] + room[1]]);
    let changes = CHANGES.map(|(change, name, own)| {
        let product = sources.iter().filter(|(path, _)| !is_test(path) && !path.starts_with("xtask"));
        let naming = product.filter(|(path, text)| !path.starts_with(own) && names(text, name));
        (change.to_owned(), [naming.count(), 0])
    });
    let words = WORDS.map(|word| {
        let declared =
            |(path, text): (&&str, &&str)| (is_test(path), text.lines().filter(|it| declares(it, word)).count());
        let count = |of_tests| sources.iter().map(declared).filter(|it| it.0 == of_tests).map(|it| it.1).sum();
        (format!("types called {word}"), [count(false), count(true)])
    });
    rooms.into_iter().chain([("all".to_owned(), sum)]).chain(changes).chain(words).collect()
}

/// Whether a line declares a type of this name.
fn declares(line: &str, name: &str) -> bool {
    let is_name = |after: &str| after.split(|c: char| !c.is_alphanumeric()).next() == Some(name);
    ["struct ", "enum ", "trait ", "type "].iter().any(|kind| {
        let declared = line.split_once(kind);
        declared.is_some_and(|(before, after)| {
            is_name(after) && before.split(' ').all(|it| it.trim().is_empty() || it.starts_with("pub"))
        })
    })
}

fn is_test(path: &str) -> bool {
    ["tests", "fuzz"].iter().any(|room| path.starts_with(room))
        || path.contains("/tests/")
        || path.contains("/benches/")
}

/// The lines from the tests of a file to its end.
fn tests_inside(text: &str) -> usize {
    let lines: Vec<&str> = text.lines().collect();
    let is_begin = |pair: &[&str]| pair[0] == "#[cfg(test)]" && pair[1].starts_with("mod ") && pair[1].ends_with('{');
    lines.windows(2).position(is_begin).map_or(0, |begin| lines.len() - begin)
}

/// Whether code, and no comment, test or text in quotes, has the name as a word.
fn names(text: &str, name: &str) -> bool {
    let lines = text.lines().take(text.lines().count() - tests_inside(text));
    let mut code =
        lines.filter(|line| !line.trim_start().starts_with("//")).flat_map(|line| line.split('"').step_by(2));
    code.any(|part| contains_word(part, name))
}

/// Whether a word of the text begins with this one, in any case.
pub(super) fn contains_word(text: &str, word: &str) -> bool {
    text.to_ascii_lowercase().split(|c: char| !c.is_ascii_alphanumeric()).any(|found| found.starts_with(word))
}

fn table(rows: &[(String, [usize; 2])]) -> String {
    let mut table = "| room | product | tests |\n| --- | ---: | ---: |\n".to_owned();
    for (what, [product, tests]) in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(table, "| {what} | {product} | {tests} |");
    }
    table
}

/// The figures of a table.
fn recorded(table: &str) -> Figures {
    let row = |line: &str| {
        let mut cells = line.trim_matches('|').split('|').map(str::trim);
        let (what, product, tests) = (cells.next()?, cells.next()?.parse().ok()?, cells.next()?.parse().ok()?);
        Some((what.to_owned(), [product, tests]))
    };
    table.lines().filter_map(row).collect()
}

/// What is more than it was.
fn grown(rows: &[(String, [usize; 2])], recorded: &Figures) -> Vec<String> {
    let grown = rows.iter().flat_map(|(what, now)| {
        let before = recorded.get(what).copied().unwrap_or_default();
        ["product", "tests"].into_iter().zip(before.into_iter().zip(*now)).filter_map(move |(kind, (before, now))| {
            let what = if what.starts_with("a ") { what.clone() } else { format!("{what}, {kind}") };
            (now > before).then(|| format!("grown: {what}: {before} to {now}"))
        })
    });
    grown.collect()
}

/// Prints what has grown since it was recorded, or records it anew.
pub(super) fn run(root: &Path, sources: &BTreeMap<&str, &str>, record: bool) -> Result<(), String> {
    let path = root.join(PAGE);
    let page = fs::read_to_string(&path).map_err(|error| format!("{PAGE}: {error}"))?;
    let missing = || format!("{PAGE}: no table between {} and {END}", BEGIN.trim());
    let (before, rest) = page.split_once(BEGIN).ok_or_else(missing)?;
    let (old, after) = rest.split_once(END).ok_or_else(missing)?;
    let rows = measured(sources);
    grown(&rows, &recorded(old)).iter().for_each(|line| println!("{line}"));
    if record {
        let page = format!("{before}{BEGIN}\n{}\n{END}{after}", table(&rows));
        fs::write(&path, page).map_err(|error| format!("{PAGE}: {error}"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_grown_is_said_and_nothing_else() {
        let code = "//! The AKD.\nuse akd;\n\n#[cfg(test)]\nmod tests {\n}\n";
        let sources = BTreeMap::from([
            ("cli/src/a.rs", code),
            ("cli/src/b.rs", "//! Not the AKD.\n#[cfg(test)]\nmod tests {\n    use akd;\n}\n"),
            ("cli/tests/c.rs", "use akd;\n"),
            ("drives/kollmorgen-akd/src/lib.rs", "pub struct Face<Akd>;\n"),
        ]);
        let rows = measured(&sources);
        assert!(grown(&rows, &recorded(&table(&rows))).is_empty());
        let mut before = recorded(&table(&rows));
        assert_eq!(
            (before["cli"], before["all"], before["a drive: files that name the AKD"]),
            ([4, 8], [5, 8], [1, 0])
        );
        assert_eq!(before["types called Face"], [1, 0]);
        before.insert("cli".to_owned(), [3, 9]);
        before.insert("a drive: files that name the AKD".to_owned(), [0, 0]);
        let said = ["grown: cli, product: 3 to 4", "grown: a drive: files that name the AKD: 0 to 1"];
        assert_eq!(grown(&rows, &before), said);
    }
}
