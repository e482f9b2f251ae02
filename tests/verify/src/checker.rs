//! Records which cell was compared with what, and which cells disagree.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;

use crate::exempt::Exempt;
use crate::manual::{Manual, Row};

/// What a cell is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Against {
    /// The data sheet and its overlay.
    Sheet,
    /// The generated code and the tables of the drive's crate, compiled in.
    Code,
    /// Entries of the simulated drive: what can be read and written over the virtual bus.
    Entry,
    /// What the simulated drive does on the virtual bus.
    Drive,
    /// Another place of the manual.
    Manual,
}

impl Against {
    /// All, in the order of the report.
    pub const ALL: [Against; 5] = [Against::Sheet, Against::Code, Against::Entry, Against::Drive, Against::Manual];

    fn name(self) -> &'static str {
        match self {
            Against::Sheet => "data sheet and overlay",
            Against::Code => "code",
            Against::Entry => "entry of the simulated drive",
            Against::Drive => "simulated drive",
            Against::Manual => "another place of the manual",
        }
    }
}

pub(crate) struct Checker<'m> {
    exempt: &'m Exempt,
    manual: &'m Manual,
    /// Cells that were compared.
    compared: BTreeSet<String>,
    /// What was found in place of cells that disagree, or of missing rows.
    pub(crate) disagreements: BTreeMap<String, Vec<String>>,
    /// For each row, whether it agrees with each thing it was compared with.
    pub(crate) rows: BTreeMap<(&'static str, String), BTreeMap<Against, bool>>,
    /// Things that the simulated drive does not do: the reason, and what they are for.
    pub(crate) not_simulated: Vec<(String, Vec<String>)>,
    /// Mistakes that concern no cell.
    pub(crate) findings: Vec<String>,
}

impl<'m> Checker<'m> {
    pub(crate) fn new(exempt: &'m Exempt, manual: &'m Manual) -> Self {
        let findings = manual.findings.clone();
        let (disagreements, rows) = (BTreeMap::new(), BTreeMap::new());
        let not_simulated = Vec::new();
        Checker { exempt, manual, compared: BTreeSet::new(), disagreements, rows, not_simulated, findings }
    }

    /// Whether there is already a mistake that no erratum explains.
    pub(crate) fn has_finding(&self) -> bool {
        !self.findings.is_empty() || self.disagreements.keys().any(|cell| !self.manual.explains(cell))
    }

    /// The row that must be there: a finding if it is not. This compares its key.
    pub(crate) fn row(&mut self, file: &'static str, key: &str) -> Option<&'m Row> {
        let row = self.manual.row(file, key);
        match row {
            Some(row) => self.key(row),
            None => {
                self.disagreements.entry(format!("{file}/{key}")).or_default().push("the row is missing".into());
            }
        }
        row
    }

    /// The row whose key differs at most in upper and lower case.
    pub(crate) fn row_called(&mut self, file: &'static str, name: &str) -> Option<&'m Row> {
        let key = self.manual.rows(file).iter().find(|row| row.key.eq_ignore_ascii_case(name)).map(|row| &row.key);
        self.row(file, key.map_or(name, String::as_str))
    }

    /// Counts a row's key as compared.
    pub(crate) fn key(&mut self, row: &Row) {
        for column in self.manual.key_columns(row.file) {
            self.compared.insert(cell(row, column));
        }
    }

    /// Compares a cell with what was found in its place.
    pub(crate) fn cell(&mut self, row: &Row, column: &str, against: Against, found: impl Display) {
        let found = found.to_string();
        self.that(row, column, against, row.get(column) == found, found);
    }

    /// Compares a cell that is more than text: it agrees if `agrees`.
    pub(crate) fn that(&mut self, row: &Row, column: &str, against: Against, agrees: bool, found: impl Display) {
        self.compared.insert(cell(row, column));
        if !row.has(column) {
            self.finding(format!("{}: no column {column}", row.file));
        }
        if !agrees {
            let found = format!("{}: {found} instead of {:?}", against.name(), row.get(column));
            self.disagreements.entry(cell(row, column)).or_default().push(found);
        }
        *self.rows.entry((row.file, row.key.clone())).or_default().entry(against).or_insert(true) &= agrees;
    }

    /// Adds a mistake that concerns no cell.
    pub(crate) fn finding(&mut self, finding: String) {
        if !self.findings.contains(&finding) {
            self.findings.push(finding);
        }
    }

    /// Adds a place that is not simulated, under its reason.
    pub(crate) fn not_simulated(&mut self, why: &str, place: String) {
        let at = self.not_simulated.iter().position(|(known, _)| known == why).unwrap_or(self.not_simulated.len());
        if at == self.not_simulated.len() {
            self.not_simulated.push((why.to_owned(), Vec::new()));
        }
        if !self.not_simulated[at].1.contains(&place) {
            self.not_simulated[at].1.push(place);
        }
    }

    /// Adds a finding unless `agrees`.
    pub(crate) fn require(&mut self, agrees: bool, finding: impl FnOnce() -> String) {
        if !agrees {
            self.finding(finding());
        }
    }

    /// Adds findings for what was not compared although it could have been.
    pub(crate) fn finish(&mut self) {
        for (file, rows) in self.manual.tables().filter(|(file, _)| *file != "errata.csv") {
            for row in rows {
                let checked = self.rows.get(&(file, row.key.clone()));
                let by_us = checked.is_some_and(|by| by.keys().any(|against| *against != Against::Manual));
                if self.exempt.row(file, &row.key) {
                    continue;
                }
                if !by_us {
                    self.finding(format!("{file}/{}: the row is unchecked", row.key));
                }
                for (column, _) in &row.cells {
                    if !self.compared.contains(&cell(row, column)) && !self.exempt.column(file, column) {
                        self.finding(format!("{}: the cell is unchecked", cell(row, column)));
                    }
                }
            }
        }
    }
}

/// What was found in cells before a checker takes it, so that it can be remembered.
#[derive(Clone, Default)]
pub(crate) struct Answers {
    /// Key of the row, column, whether it agrees, and what was found.
    cells: Vec<(String, &'static str, bool, String)>,
    findings: Vec<String>,
}

impl Answers {
    /// As [`Checker::that`].
    pub(crate) fn that(&mut self, row: &Row, column: &'static str, agrees: bool, found: impl Display) {
        self.cells.push((row.key.clone(), column, agrees, found.to_string()));
    }

    pub(crate) fn has_disagreement(&self) -> bool {
        self.cells.iter().any(|(_, _, agrees, _)| !agrees)
    }

    /// As [`Checker::require`].
    pub(crate) fn require(&mut self, agrees: bool, finding: impl FnOnce() -> String) {
        if !agrees {
            self.findings.push(finding());
        }
    }

    /// Hands a checker what the drive has answered about these rows.
    pub(crate) fn give(self, checker: &mut Checker<'_>, rows: &[Row]) {
        let rows: BTreeMap<&str, &Row> = rows.iter().map(|row| (row.key.as_str(), row)).collect();
        for (key, column, agrees, found) in self.cells {
            checker.that(rows[key.as_str()], column, Against::Entry, agrees, found);
        }
        self.findings.into_iter().for_each(|finding| checker.finding(finding));
    }
}

fn cell(row: &Row, column: &str) -> String {
    format!("{}/{}/{column}", row.file, row.key)
}
