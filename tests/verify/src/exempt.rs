//! What cannot be compared.

/// What cannot be compared: prose. The report lists it.
pub struct Exempt {
    /// Columns that nothing can be compared with, the tables that have them, and why.
    pub(crate) columns: &'static [(&'static str, &'static [&'static str], &'static str)],
    /// Rows about which neither data sheet nor code nor simulator says anything: table, key, and why.
    pub rows: &'static [(&'static str, &'static str, &'static str)],
    /// Clauses within cells that are otherwise compared, and why.
    pub(crate) clauses: &'static [(&'static str, &'static str)],
}

impl Exempt {
    /// Whether nothing can be compared with a column of a table.
    #[must_use]
    pub fn column(&self, file: &str, column: &str) -> bool {
        self.columns.iter().any(|(name, files, _)| *name == column && files.contains(&file))
    }

    /// Whether nothing can be compared with a row.
    #[must_use]
    pub fn row(&self, file: &str, key: &str) -> bool {
        self.rows.iter().any(|(of, name, _)| *of == file && *name == key)
    }
}
