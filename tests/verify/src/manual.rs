//! The manual's tables as rows and cells, each with the key that `tests/manual/ag03-1/README.md` gives it.

use std::collections::BTreeMap;

/// The columns whose cells, joined with `:`, are a row's key; empty ones are left out.
const KEYS: &[(&str, &[&str])] = &[
    ("baud_rates.csv", &["value"]),
    ("bus_termination.csv", &["sw9", "sw10"]),
    ("commands.csv", &["command"]),
    ("controlword.csv", &["bit", "mode"]),
    ("emergency.csv", &["code"]),
    ("errata.csv", &["id"]),
    ("example_position.csv", &["step"]),
    ("example_velocity.csv", &["step"]),
    ("facts.csv", &["chapter", "fact"]),
    ("faults.csv", &["letter"]),
    ("formats.csv", &["address", "bits", "value"]),
    ("gears.csv", &["value"]),
    ("identifiers.csv", &["name"]),
    ("leds.csv", &["led", "state"]),
    ("names.csv", &["index", "subindex"]),
    ("nmt.csv", &["command"]),
    ("nmt_states.csv", &["state"]),
    ("node_address.csv", &["sw1", "sw2", "sw3", "sw4", "sw5", "sw6", "sw7"]),
    ("objects.csv", &["index", "subindex"]),
    ("overview.csv", &["index"]),
    ("parameters.csv", &["number"]),
    ("pdo_layouts.csv", &["pdo", "byte"]),
    ("pdo_mappings.csv", &["index", "position"]),
    ("sdo_aborts.csv", &["code"]),
    ("sdo_commands.csv", &["hex"]),
    ("sdo_examples.csv", &["row"]),
    ("start_conditions.csv", &["chapter", "operation", "bit"]),
    ("statements.csv", &["chapter", "subject"]),
    ("states.csv", &["state"]),
    ("statusword.csv", &["bit", "mode"]),
    ("system_status.csv", &["bit", "value", "mode"]),
    ("terms.csv", &["type", "value"]),
    ("transitions.csv", &["number"]),
    ("transmission_types.csv", &["chapter", "index", "from"]),
    ("values.csv", &["address", "value"]),
];

/// All tables, by file name.
pub(crate) struct Manual {
    tables: BTreeMap<&'static str, Vec<Row>>,
    /// What is wrong with the files themselves.
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
    pub(crate) fn parse(texts: &BTreeMap<String, String>) -> Self {
        let mut manual = Manual { tables: BTreeMap::new(), findings: Vec::new() };
        for (file, keys) in KEYS.iter().copied() {
            let text = texts.get(file).map_or("", String::as_str);
            match rows(file, keys, text) {
                Ok(rows) => manual.take(file, rows),
                Err(error) => manual.findings.push(format!("{file}: {error}")),
            }
        }
        for file in texts.keys().filter(|file| KEYS.iter().all(|(known, _)| known != file)) {
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

    /// The rows of a table, in its order.
    pub(crate) fn rows(&self, file: &str) -> &[Row] {
        self.tables.get(file).map_or(&[], Vec::as_slice)
    }

    /// The row with this key.
    pub(crate) fn row(&self, file: &str, key: &str) -> Option<&Row> {
        self.rows(file).iter().find(|row| row.key == key)
    }

    /// All tables, by name.
    pub(crate) fn tables(&self) -> impl Iterator<Item = (&'static str, &[Row])> {
        self.tables.iter().map(|(file, rows)| (*file, rows.as_slice()))
    }
}

impl Row {
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

/// What rows hold, as a key to what is found for them.
pub(crate) fn cells(rows: &[Row]) -> Cells {
    rows.iter().map(|row| row.cells.clone()).collect()
}

/// The columns that make a row's key.
pub(crate) fn key_columns(file: &str) -> &'static [&'static str] {
    KEYS.iter().find(|(known, _)| *known == file).map_or(&[], |(_, keys)| keys)
}
