//! The results of all runs, as tables.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::python::PACKAGES;

/// Who plays what.
pub(super) struct Direction {
    /// What `run.py` calls it.
    pub(super) name: &'static str,
    /// The program of ours that it is given.
    pub(super) program: &'static str,
    /// Who is on the other side.
    pub(super) peer: &'static str,
    /// The head of its columns.
    pub(super) head: &'static str,
}

/// A table: a row for each service, a column for each direction and link.
#[derive(Default)]
pub(super) struct Table {
    pub(super) columns: Vec<Column>,
}

/// The results of one run: verdict and remark by service.
pub(super) struct Column {
    direction: &'static Direction,
    link: &'static str,
    services: Vec<String>,
    results: BTreeMap<String, (String, String)>,
}

impl Column {
    pub(super) fn read(direction: &'static Direction, link: &'static str, path: &Path) -> Result<Self, String> {
        let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let mut column = Column { direction, link, services: Vec::new(), results: BTreeMap::new() };
        text.lines().for_each(|line| column.add(line));
        if column.services.is_empty() { Err(format!("{}: no results", path.display())) } else { Ok(column) }
    }

    /// Service, verdict and remark, between tabs.
    pub(super) fn add(&mut self, line: &str) {
        let mut parts = line.split('\t').map(str::to_owned);
        let (Some(service), Some(verdict)) = (parts.next(), parts.next()) else { return };
        self.services.push(service.clone());
        self.results.insert(service, (verdict, parts.next().unwrap_or_default()));
    }

    fn count(&self, verdict: &str) -> usize {
        self.results.values().filter(|(found, _)| found == verdict).count()
    }

    /// The result of a service that is a run of its own, with other software.
    fn remark(&self, service: &str) -> Option<&str> {
        self.results.get(service).map(|(_, remark)| &**remark)
    }
}

impl Table {
    pub(super) fn count(&self, verdict: &str) -> usize {
        self.columns.iter().map(|column| column.count(verdict)).sum()
    }

    fn write<'a>(&'a self, text: &mut String, notes: &mut Vec<&'a str>) {
        let mut services: Vec<&str> = Vec::new();
        for service in self.columns.iter().flat_map(|column| &column.services) {
            if !services.contains(&service.as_str()) {
                services.push(service);
            }
        }
        text.push_str("| service |");
        for column in &self.columns {
            let _ = write!(text, " {}: {} |", column.direction.head, column.link);
        }
        let _ = writeln!(text, "\n| --- |{}", " --- |".repeat(self.columns.len()));
        for service in services {
            let _ = write!(text, "| {service} |");
            for column in &self.columns {
                let _ = write!(text, " {} |", cell(column.results.get(service), notes));
            }
            text.push('\n');
        }
        text.push('\n');
    }
}

pub(super) fn page(tables: &[Table]) -> String {
    let mut text = format!(
        "# Interoperability\n\nMade by `cargo xtask interop`; python-canopen is {}. A fault is one of python-canopen: the \
         note says which.\n\n",
        PACKAGES.join(", ")
    );
    text.push_str(&summary(tables));
    text.push('\n');
    let mut notes: Vec<&str> = Vec::new();
    for table in tables {
        table.write(&mut text, &mut notes);
    }
    for (number, note) in notes.iter().enumerate() {
        let _ = writeln!(text, "{}. {note}", number + 1);
    }
    text
}

/// Services whose result comes from other software than the peer: its name, and what it does.
const OTHERS: [(&str, &str, &str); 2] = [
    ("same decoding as tshark", "tshark", "decodes what was recorded"),
    ("answers beside a full bus", "can-utils", "cangen fills the bus"),
];

/// A row for each run.
fn summary(tables: &[Table]) -> String {
    let mut text = String::from("| peer | direction | link | services | result |\n| --- | --- | --- | --- | --- |\n");
    let columns = || tables.iter().flat_map(|table| &table.columns);
    for column in columns() {
        let others = OTHERS.iter().filter(|(service, ..)| column.results.contains_key(*service)).count();
        let services = column.services.len() - others;
        let result = match (column.count("failed"), column.count("fault")) {
            (0, 0) => "all well".to_owned(),
            (0, faults) => format!("{} well, {faults} that the peer lacks", services - faults),
            (failed, _) => format!("{failed} failed"),
        };
        let Direction { peer, head, .. } = column.direction;
        let _ = writeln!(text, "| {peer} | {head} | {} | {services} | {result} |", column.link);
    }
    for (service, peer, what) in OTHERS {
        for column in columns() {
            let Some(remark) = column.remark(service) else { continue };
            let _ = writeln!(text, "| {peer} | {what}: {} | {} | | {remark} |", column.direction.head, column.link);
        }
    }
    text
}

/// What a remark contains when it is a measured result.
const FIGURES: [&str; 3] = ["/s, ", " agree", " frames, "];

fn is_measured(remark: &str) -> bool {
    FIGURES.iter().any(|unit| remark.contains(unit))
}

/// The first line in which two pages differ in a verdict, a note or a service; measured figures are ignored.
pub(super) fn difference(written: &str, made: &str) -> Option<String> {
    let (mut written, mut made) = (written.lines(), made.lines());
    loop {
        match (written.next(), made.next()) {
            (None, None) => return None,
            (old, new) if old.map(without_figures) == new.map(without_figures) => {}
            (old, new) => {
                let [old, new] = [old, new].map(|line| line.unwrap_or("(no line)"));
                return Some(format!("\n  written: {old}\n  found:   {new}"));
            }
        }
    }
}

/// A line with `ok` in every cell that was measured.
fn without_figures(line: &str) -> String {
    let cells = line.split('|').map(|cell| if is_measured(cell) { " ok " } else { cell });
    cells.collect::<Vec<_>>().join("|")
}

/// Verdict or figures; a remark on what is not well becomes a note.
fn cell<'a>(result: Option<&'a (String, String)>, notes: &mut Vec<&'a str>) -> String {
    match result.map(|(verdict, remark)| (verdict.as_str(), remark.as_str())) {
        None => "-".to_owned(),
        // Figures are the result.
        Some(("ok", remark)) if is_measured(remark) => remark.to_owned(),
        Some(("ok", _)) => "ok".to_owned(),
        Some((verdict, remark)) => {
            let known = notes.iter().position(|note| *note == remark);
            let number = known.unwrap_or_else(|| {
                notes.push(remark);
                notes.len() - 1
            });
            format!("{verdict} ({})", number + 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_well_becomes_a_note_once() {
        let mut notes = Vec::new();
        let result = |verdict: &str, remark: &str| (verdict.to_owned(), remark.to_owned());
        let (fault, failed) = (result("fault", "no blocks"), result("failed", "no answer"));
        assert_eq!(cell(Some(&fault), &mut notes), "fault (1)");
        assert_eq!(cell(Some(&failed), &mut notes), "failed (2)");
        assert_eq!(cell(Some(&fault), &mut notes), "fault (1)");
        let (well, rate) = (result("ok", "500 bytes"), result("ok", "700/s, 5 us"));
        assert_eq!(cell(Some(&well), &mut notes), "ok");
        assert_eq!(cell(Some(&rate), &mut notes), "700/s, 5 us");
        assert_eq!(cell(None, &mut notes), "-");
        assert_eq!(notes, ["no blocks", "no answer"]);
    }

    #[test]
    fn pages_differ_by_a_verdict_and_not_by_a_figure() {
        let page = |lss: &str, reads: &str, note: &str| {
            format!("| service | ours |\n| --- | --- |\n| LSS | {lss} |\n| reads | {reads} |\n\n1. {note}\n")
        };
        let written = page("fault (1)", "700/s, 5 us", "no LSS");
        assert_eq!(difference(&written, &page("fault (1)", "912/s, 4 us", "no LSS")), None);
        let found = |page: String| difference(&written, &page).unwrap();
        assert_eq!(found(page("ok", "700/s, 5 us", "")), "\n  written: | LSS | fault (1) |\n  found:   | LSS | ok |");
        assert!(found(page("fault (1)", "failed (2)", "no LSS")).contains("found:   | reads | failed (2) |"));
        assert!(found(page("fault (1)", "700/s, 5 us", "slow LSS")).contains("1. slow LSS"));
        assert!(found(written.clone() + "| SYNC | ok |\n").contains("written: (no line)"));
    }
}
