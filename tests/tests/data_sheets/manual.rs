//! The manual's tables as rows, and the account of which of their cells agree with what they are compared with.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::PathBuf;

/// The tables of a manual, in `tests/manual/`.
pub struct Manual {
    pub folder: &'static str,
    /// The tables, and the columns whose cells, joined with `:`, are a row's key.
    pub keys: &'static [(&'static str, &'static [&'static str])],
}

/// One row of a table.
pub struct Row {
    file: &'static str,
    pub key: String,
    cells: BTreeMap<String, String>,
}

impl Row {
    /// A cell of this column, which exists.
    pub fn get(&self, column: &str) -> &str {
        self.cells.get(column).unwrap_or_else(|| panic!("{}.csv: no column {column}", self.file))
    }

    /// Index and sub-index; no sub-index in the row of an ARRAY or RECORD.
    pub fn address(&self) -> (u16, Option<u8>) {
        let sub = self.get("subindex");
        let hex = |text| u16::from_str_radix(text, 16).unwrap();
        (hex(self.get("index")), (!sub.is_empty()).then(|| hex(sub) as u8))
    }
}

impl Manual {
    fn path(&self) -> PathBuf {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("manual").join(self.folder)
    }

    /// The rows of a table. No two have the same key.
    pub fn rows(&self, file: &str) -> Vec<Row> {
        let (file, keys) = *self.keys.iter().find(|(known, _)| *known == file).expect("a table that is known");
        let path = self.path().join(format!("{file}.csv"));
        let mut reader = csv::Reader::from_path(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let columns: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
        let row = |record: csv::StringRecord| {
            let cells: BTreeMap<_, _> = columns.iter().cloned().zip(record.iter().map(str::to_owned)).collect();
            let key = keys.iter().map(|column| cells[*column].as_str()).collect::<Vec<_>>().join(":");
            Row { file, key, cells }
        };
        let rows: Vec<Row> = reader.records().map(|record| row(record.unwrap())).collect();
        let keys: BTreeSet<&str> = rows.iter().map(|row| row.key.as_str()).collect();
        assert_eq!(keys.len(), rows.len(), "{file}.csv: two rows with the same key");
        rows
    }

    /// Every table of the folder is one of these.
    pub fn check_folder(&self) {
        let is_table = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "csv");
        let files = std::fs::read_dir(self.path()).unwrap().map(|entry| entry.unwrap().path()).filter(is_table);
        let found: BTreeSet<String> =
            files.map(|path| path.file_stem().unwrap().to_string_lossy().into_owned()).collect();
        assert_eq!(found, self.keys.iter().map(|(file, _)| (*file).to_owned()).collect());
    }
}

/// Which cells disagree, and which rows were compared.
#[derive(Default)]
pub struct Judge {
    disagreements: BTreeMap<String, String>,
    compared: BTreeSet<(&'static str, String)>,
}

impl Judge {
    /// A cell was compared with what was found in its place.
    pub fn that(&mut self, row: &Row, column: &str, agrees: bool, found: impl Display) {
        self.compared.insert((row.file, row.key.clone()));
        if !agrees {
            let cell = format!("{}.csv/{}/{column}", row.file, row.key);
            self.disagreements.insert(cell, format!("{found} instead of {:?}", row.get(column)));
        }
    }

    /// Every cell that disagrees is one that the list of errata names, each of these disagrees, and every row of every
    /// table was compared, except those of `elsewhere`.
    pub fn finish(self, manual: &Manual, elsewhere: &[&str]) {
        let known: BTreeSet<String> = manual
            .rows("errata")
            .iter()
            .flat_map(|row| row.get("cells").split(';').map(str::to_owned).collect::<Vec<_>>())
            .filter(|cell| !cell.is_empty())
            .collect();
        let unknown: Vec<_> = self.disagreements.iter().filter(|(cell, _)| !known.contains(*cell)).collect();
        assert!(unknown.is_empty(), "cells that disagree with the data sheet: {unknown:#?}");
        let needless: Vec<_> = known.iter().filter(|cell| !self.disagreements.contains_key(*cell)).collect();
        assert!(needless.is_empty(), "errata of cells that agree: {needless:#?}");
        for (file, _) in manual.keys.iter().filter(|(file, _)| !elsewhere.contains(file)) {
            let left =
                manual.rows(file).into_iter().filter(|row| !self.compared.contains(&(row.file, row.key.clone())));
            let left: Vec<String> = left.map(|row| row.key).collect();
            assert!(left.is_empty(), "{file}.csv: rows that were not compared: {left:#?}");
        }
    }
}
