//! The result of the comparison, and `VERIFICATION.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::checker::{Against, Checker};
use crate::drive::{Drive, Interface};
use crate::manual::{Manual, Row};
use crate::sheet::PROSE;

/// The result of the comparison.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The report of each table of the manual, by file name.
    pub tables: Vec<TableReport>,
    /// The places where the manual contradicts itself or CiA.
    pub errata: Vec<Erratum>,
    /// What the simulated drive does not do: the reason, and places such as `2026h` or `20A4h, bits 8..12`.
    pub not_simulated: Vec<(String, Vec<String>)>,
    /// All mistakes; empty if everything is verified.
    pub findings: Vec<String>,
}

/// How many rows of a table agree.
#[derive(Clone, Debug)]
pub struct TableReport {
    /// The file.
    pub file: &'static str,
    /// The number of all rows.
    pub rows: usize,
    /// The number of rows compared with anything but the manual itself.
    pub checked: usize,
    /// The number of rows whose compared cells all agree.
    pub agreeing: usize,
    /// The rows checked, by depth: compared with what the simulated drive does; at most with what its entries hold;
    /// with neither.
    /// neither.
    pub depth: [usize; 3],
    /// Numbers of rows compared and of rows agreeing, by what they were compared with.
    pub against: BTreeMap<Against, (usize, usize)>,
}

/// A row of `errata.csv`.
#[derive(Clone, Debug)]
pub struct Erratum {
    /// `E01`.
    pub id: String,
    /// The columns `place`, `reading_a`, `reading_b`, `chosen`, `why`.
    pub cells: [String; 5],
    /// The cells of the manual that cannot agree because of it, and what was found in their places.
    pub disagreeing: Vec<(String, String)>,
}

impl Report {
    /// Rows of all tables, rows checked, rows agreeing.
    #[must_use]
    pub fn totals(&self) -> (usize, usize, usize) {
        self.tables.iter().fold((0, 0, 0), |(rows, checked, agreeing), table| {
            (rows + table.rows, checked + table.checked, agreeing + table.agreeing)
        })
    }

    /// The text of `VERIFICATION.md`.
    #[must_use]
    pub fn to_markdown(&self, drive: &Drive) -> String {
        let (rows, checked, agreeing) = self.totals();
        let mut out = format!("# The {} against its manual\n\n", drive.title);
        out += &match drive.interface {
            Interface::CanOpen => HEAD.to_owned(),
            Interface::Other { code, over, .. } => HEAD_OF_OTHERS.replace("CODE", code).replace("OVER", over),
        }
        .replace("FOLDER", drive.folder);
        let _ = writeln!(out, "{rows} rows: {checked} checked, {agreeing} agree in every cell.\n");
        self.write_tables(&mut out);
        self.write_errata(&mut out);
        write_exempt(&mut out, drive);
        self.write_not_simulated(&mut out);
        out
    }

    fn write_tables(&self, out: &mut String) {
        out.push_str(
            "| Table | Rows | Checked | Agree | Behaviour | Value | Name only | Sheet | Code | Entry | Drive | Manual |\n\
             |---|---|---|---|---|---|---|---|---|---|---|---|\n",
        );
        for table in &self.tables {
            let TableReport { file, rows, checked, agreeing, depth: [behaviour, value, name], .. } = table;
            let _ = write!(out, "| `{file}` | {rows} | {checked} | {agreeing} | {behaviour} | {value} | {name} |");
            for against in Against::ALL {
                match table.against.get(&against) {
                    Some((checked, agreeing)) => write!(out, " {agreeing}/{checked} |"),
                    None => write!(out, " |"),
                }
                .unwrap_or_default();
            }
            out.push('\n');
        }
    }

    fn write_errata(&self, out: &mut String) {
        out.push_str(ERRATA);
        for Erratum { id, cells: [place, a, b, chosen, why], disagreeing } in &self.errata {
            let cells = if disagreeing.is_empty() { String::new() } else { disagreeing.len().to_string() };
            let _ = writeln!(out, "| {id} | {place} | {a} | {b} | {chosen} | {why} | {cells} |");
        }
        out.push_str("\n### The cells\n\nAs printed in the manual, and what stands in its place:\n\n");
        for erratum in &self.errata {
            for (cell, found) in &erratum.disagreeing {
                let _ = writeln!(out, "- {}: `{cell}`: {found}", erratum.id);
            }
        }
    }

    fn write_not_simulated(&self, out: &mut String) {
        if !self.not_simulated.is_empty() {
            out.push_str(NOT_SIMULATED);
        }
        for (why, places) in &self.not_simulated {
            let _ = writeln!(out, "- {}: {why}", places.join(", "));
        }
    }
}

const NOT_SIMULATED: &str = "
## What the simulated drive does not do

Each of these holds what is written to it, or 0, and nothing follows (`simulated = false` in the overlay). Every other entry
from 2000h on is one that the simulated drive looks at or sets by itself, or a constant:

";

fn write_exempt(out: &mut String, drive: &Drive) {
    out.push_str("\n## What is not compared\n\n");
    for (file, key, why) in drive.exempt.rows {
        let _ = writeln!(out, "- the row `{file}/{key}`: {why}");
    }
    for (column, files, why) in drive.exempt.columns {
        let _ = writeln!(out, "- the column `{column}` of `{}`: {why}", files.join("`, `"));
    }
    for (clause, why) in drive.exempt.clauses {
        let _ = writeln!(out, "- the clause \"{clause}\": {why}");
    }
    if drive.interface != Interface::CanOpen {
        return;
    }
    out.push_str("\nKeys of the data sheet and of the overlay that are prose or history:\n\n");
    for (key, why) in PROSE {
        let _ = writeln!(out, "- `{key}`: {why}");
    }
}

const HEAD: &str =
    "Written by `cargo xtask verify`; `cargo xtask verify --check` fails when it is stale. Every row of the tables in
`FOLDER` is compared with the data sheet and its overlay (Sheet), with the generated code and the tables
of the driver, compiled in (Code), with what can be read and written of the simulated drive (Entry), and with what it does on
a virtual bus (Drive); some cells also with another place of the manual (Manual). The columns below give rows agreeing of
rows compared. Of the rows checked, those under Behaviour were compared with what the simulated drive does, those under Value
with its entries at most, and those under Name only with neither: a name, a number or a place that is the same. Altering any
single cell of the data sheet, of the overlay or of the tables makes the verification fail: a test alters some
hundreds of them, and all of them when `LEXICAN_VERIFY_ALL` is set. Another test, `tests/mutants`, alters the simulated
drive in the same way: its own tests or the verification find each mutant of the files that `simulator/build.rs` names.

";

const HEAD_OF_OTHERS: &str =
    "Written by `cargo xtask verify`; `cargo xtask verify --check` fails when it is stale. Every row of the tables in
`FOLDER` is compared with CODE (Code),
with what can be read and written of the simulated drive (Entry), and with what it does OVER (Drive); rows about parameters also with the data
sheet and the overlay, which has a section for this interface (Sheet). The columns below give rows agreeing of rows
compared. Of the rows checked, those under Behaviour were compared with what the simulated drive does, those under Value with
its entries at most, and those under Name only with neither. Altering any single cell of the tables, or a number, an object or a range in that section, makes the
verification fail: a test alters some hundreds of them, and all of them when `LEXICAN_VERIFY_ALL` is set. Another test,
`tests/mutants`, alters the simulated drive, and, of this interface, the files that `interfaces.rs` there does not leave out.

";

const ERRATA: &str = "
## Where the manual contradicts itself or CiA

Both readings, the one chosen (`A` as at the place, `B` the other, `both`, `none`), why, and how many cells of the
tables cannot agree because of it.

| Id | Place | Reading A | Reading B | Chosen | Why | Cells |
|---|---|---|---|---|---|---|
";

pub(crate) fn report(manual: &Manual, checker: Checker<'_>) -> Report {
    let Checker { disagreements, rows, mut findings, not_simulated, .. } = checker;
    let mut explained = BTreeSet::new();
    let mut errata = Vec::new();
    for row in manual.rows("errata.csv") {
        let mut disagreeing = Vec::new();
        for cell in row.get("cells").split(';').filter(|cell| !cell.is_empty()) {
            match disagreements.get(cell) {
                Some(found) => disagreeing.push((cell.to_owned(), found.join("; "))),
                None => findings.push(format!("{}: no erratum is needed for {cell}", row.key)),
            }
            if !explained.insert(cell.to_owned()) {
                findings.push(format!("{}: {cell} has an erratum already", row.key));
            }
        }
        errata.push(erratum(row, disagreeing, &mut findings));
    }
    for (cell, found) in disagreements.iter().filter(|(cell, _)| !explained.contains(*cell)) {
        findings.push(format!("{cell}: {}", found.join("; ")));
    }
    // A table without rows belongs to other manuals of the maker.
    let tables = manual.tables().filter(|(file, rows)| *file != "errata.csv" && !rows.is_empty());
    let tables = tables.map(|(file, all)| table(file, all, &rows, &disagreements)).collect();
    Report { tables, errata, not_simulated, findings }
}

fn erratum(row: &Row, disagreeing: Vec<(String, String)>, findings: &mut Vec<String>) -> Erratum {
    let cells = ["place", "reading_a", "reading_b", "chosen", "why"].map(|column| row.get(column).to_owned());
    if !matches!(row.get("chosen"), "A" | "B" | "both" | "none") {
        findings.push(format!("errata.csv/{}/chosen: {:?} is no choice", row.key, row.get("chosen")));
    }
    Erratum { id: row.key.clone(), cells, disagreeing }
}

fn table(
    file: &'static str,
    all: &[Row],
    rows: &BTreeMap<(&'static str, String), BTreeMap<Against, bool>>,
    disagreements: &BTreeMap<String, Vec<String>>,
) -> TableReport {
    let mut report =
        TableReport { file, rows: all.len(), checked: 0, agreeing: 0, depth: [0; 3], against: BTreeMap::new() };
    for row in all {
        let Some(by) = rows.get(&(file, row.key.clone())) else { continue };
        if by.keys().all(|against| *against == Against::Manual) {
            continue;
        }
        report.checked += 1;
        let depth = [Against::Drive, Against::Entry].iter().position(|against| by.contains_key(against));
        report.depth[depth.unwrap_or(2)] += 1;
        let prefix = format!("{file}/{}/", row.key);
        report.agreeing += usize::from(!disagreements.keys().any(|cell| cell.starts_with(&prefix)));
        for (against, agrees) in by {
            let count = report.against.entry(*against).or_default();
            *count = (count.0 + 1, count.1 + usize::from(*agrees));
        }
    }
    report
}
