//! How much memory the firmware takes, against the table in its README.

use std::fs;
use std::path::Path;

use object::{Object as _, ObjectSection as _, ObjectSymbol as _, SectionKind};

use crate::outside;

/// The page, and the heading below which the figures are written. What stands above it is written by hand.
const FIGURES: &str = "examples/firmware/README.md";
const HEADING: &str = "| what | bytes |\n| --- | ---: |\n";

/// By how much a figure may grow and shrink: compilers differ, and shrinking only matters once the page is far off.
const MORE: f64 = 1.03;
const LESS: f64 = 0.8;

/// Writes the figures; with `check` only compares them.
///
/// Of each program: what it is called, its file, and how much of its stack it leaves unused.
pub(super) fn run(root: &Path, programs: &[(&str, &Path, u64)], check: bool) -> Result<(), String> {
    let mut rows = Vec::new();
    for (program, elf, unused_stack) in programs {
        rows.extend(measure(elf, *unused_stack)?.map(|(what, bytes)| (format!("{program}: {what}"), bytes)));
    }
    let table: String = rows.iter().map(|(name, bytes)| format!("| {name} | {bytes} |\n")).collect();
    print!("{table}");
    let path = root.join(FIGURES);
    let text = fs::read_to_string(&path).map_err(|error| format!("{FIGURES}: {error}"))?;
    let (prose, written) = text.split_once(HEADING).ok_or_else(|| format!("{FIGURES} has no table of sizes"))?;
    if check { compare(written, &rows) } else { outside::write(&path, &format!("{prose}{HEADING}{table}")) }
}

fn measure(path: &Path, unused_stack: u64) -> Result<[(&'static str, u64); 4], String> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let bytes = fs::read(path).map_err(|error| failed(&error))?;
    let elf = object::File::parse(&*bytes).map_err(|error| failed(&error))?;
    let sum = |kinds: &[SectionKind]| -> u64 {
        // Those for unwinding and the like take no memory of the controller.
        let sections = elf.sections().filter(|section| kinds.contains(&section.kind()));
        sections
            .filter(|section| section.address() > 0 || section.name() == Ok(".vector_table"))
            .map(|it| it.size())
            .sum()
    };
    let symbol = |name: &str| {
        let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(name));
        symbol.map(|symbol| symbol.address()).ok_or_else(|| failed(&format_args!("no {name}")))
    };
    let stack = symbol("_stack_start")? - symbol("_stack_end")?;
    Ok([
        ("code", sum(&[SectionKind::Text])),
        ("constants", sum(&[SectionKind::ReadOnlyData, SectionKind::ReadOnlyString])),
        ("static memory", sum(&[SectionKind::Data, SectionKind::UninitializedData])),
        ("stack, at its deepest", stack.checked_sub(unused_stack).ok_or("more stack is unused than there is")?),
    ])
}

/// Fails if the figures of the page are not the measured ones.
fn compare(written: &str, rows: &[(String, u64)]) -> Result<(), String> {
    let is_near = |(name, bytes): &(String, u64)| {
        let old = written
            .lines()
            .find_map(|line| line.strip_prefix(&format!("| {name} | "))?.strip_suffix(" |")?.parse().ok());
        old.is_some_and(|old: f64| (old * LESS..=old * MORE).contains(&(*bytes as f64)))
    };
    match rows.iter().find(|row| !is_near(row)) {
        None => Ok(()),
        Some((name, bytes)) => Err(format!(
            "{FIGURES}: {name} takes {bytes} bytes, which is not near what it says\ncargo xtask firmware writes it"
        )),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_figure_that_is_off_by_more_than_the_tolerance_is_found() {
        let written = "| code | 1000 |\n| constants | 500 |\n";
        let compare = |rows: &[(&str, u64)]| {
            let rows: Vec<_> = rows.iter().map(|(name, bytes)| ((*name).to_owned(), *bytes)).collect();
            super::compare(written, &rows)
        };
        assert_eq!(compare(&[("code", 1030), ("constants", 400)]), Ok(()));
        assert!(compare(&[("code", 1031)]).unwrap_err().contains("code takes 1031 bytes"));
        assert!(compare(&[("code", 799)]).is_err());
        assert!(compare(&[("stack", 1)]).is_err());
    }
}
