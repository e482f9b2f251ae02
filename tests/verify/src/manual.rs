//! The manual's tables as rows and cells. Each row has the key that its folder's README defines.

use std::collections::BTreeMap;

/// Each table's file, and the columns that form its key.
pub(crate) type Keys = &'static [(&'static str, &'static [&'static str])];

/// All tables, by file name.
pub(crate) struct Manual {
    keys: Keys,
    tables: BTreeMap<&'static str, Vec<Row>>,
    /// Mistakes in the files themselves.
    pub(crate) findings: Vec<String>,
}

/// One row of a table.
pub(crate) struct Row {
    pub(crate) file: &'static str,
    pub(crate) key: String,
    /// Column and cell, in the order of the file.
    pub(crate) cells: Vec<(String, String)>,
}

impl Manual {
    pub(crate) fn parse(keys: Keys, texts: &BTreeMap<String, String>) -> Self {
        let mut manual = Manual { keys, tables: BTreeMap::new(), findings: Vec::new() };
        for (file, columns) in keys.iter().copied() {
            let text = texts.get(file).map_or("", String::as_str);
            match rows(file, columns, text) {
                Ok(rows) => manual.take(file, rows),
                Err(error) => manual.findings.push(format!("{file}: {error}")),
            }
        }
        for file in texts.keys().filter(|file| keys.iter().all(|(known, _)| known != file)) {
            manual.findings.push(format!("{file}: no table of this name is verified"));
        }
        manual
    }

    fn take(&mut self, file: &'static str, rows: Vec<Row>) {
        for (at, row) in rows.iter().enumerate() {
            if rows.iter().take(at).any(|other| other.key == row.key) {
                self.findings.push(format!("{file}/{}: two rows with this key", row.key));
            }
        }
        self.tables.insert(file, rows);
    }

    /// The columns that make a row's key.
    pub(crate) fn key_columns(&self, file: &str) -> &'static [&'static str] {
        self.keys.iter().find(|(known, _)| *known == file).map_or(&[], |(_, keys)| keys)
    }

    /// A cell; empty if there is no such row.
    pub(crate) fn cell(&self, file: &str, key: &str, column: &str) -> &str {
        self.row(file, key).map_or("", |row| row.get(column))
    }

    /// The rows of a table, in its order.
    pub(crate) fn rows(&self, file: &str) -> &[Row] {
        self.tables.get(file).map_or(&[], Vec::as_slice)
    }

    /// The row with this key.
    pub(crate) fn row(&self, file: &str, key: &str) -> Option<&Row> {
        self.rows(file).iter().find(|row| row.key == key)
    }

    /// Whether an erratum lists a cell as one that disagrees.
    pub(crate) fn explains(&self, cell: &str) -> bool {
        self.rows("errata.csv").iter().any(|row| row.get("cells").split(';').any(|named| named == cell))
    }

    /// All tables, by name.
    pub(crate) fn tables(&self) -> impl Iterator<Item = (&'static str, &[Row])> {
        self.tables.iter().map(|(file, rows)| (*file, rows.as_slice()))
    }
}

impl Row {
    pub(crate) fn has(&self, column: &str) -> bool {
        self.cells.iter().any(|(name, _)| name == column)
    }

    /// A cell; empty when there is no such column.
    pub(crate) fn get(&self, column: &str) -> &str {
        self.cells.iter().find(|(name, _)| name == column).map_or("", |(_, cell)| cell)
    }

    /// A cell that holds a decimal number.
    pub(crate) fn number<T: std::str::FromStr>(&self, column: &str) -> Option<T> {
        self.get(column).parse().ok()
    }
}

fn rows(file: &'static str, keys: &[&str], text: &str) -> Result<Vec<Row>, csv::Error> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let columns: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
    let row = |record: csv::StringRecord| {
        let cells: Vec<_> = columns.iter().cloned().zip(record.iter().map(str::to_owned)).collect();
        let mut row = Row { file, key: String::new(), cells };
        let parts: Vec<&str> = keys.iter().map(|column| row.get(column)).filter(|part| !part.is_empty()).collect();
        row.key = parts.join(":");
        row
    };
    reader.records().map(|record| record.map(row)).collect()
}

/// Columns and cells of some rows.
pub(crate) type Cells = Vec<Vec<(String, String)>>;

/// The content of rows, as a key for remembered results.
pub(crate) fn cells(rows: &[Row]) -> Cells {
    rows.iter().map(|row| row.cells.clone()).collect()
}
