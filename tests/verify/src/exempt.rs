//! What cannot be compared.

/// What cannot be compared, mostly prose. The report lists it.
pub struct Exempt {
    /// Columns for which there is nothing to compare, the tables that have them, and why.
    pub(crate) columns: &'static [(&'static str, &'static [&'static str], &'static str)],
    /// Rows about which neither data sheet nor code nor simulator says anything: table, key, and why.
    pub rows: &'static [(&'static str, &'static str, &'static str)],
    /// Clauses that are not compared, in cells whose other clauses are, and why.
    pub(crate) clauses: &'static [(&'static str, &'static str)],
}

impl Exempt {
    /// Whether a column of a table is exempt.
    #[must_use]
    pub fn column(&self, file: &str, column: &str) -> bool {
        self.columns.iter().any(|(name, files, _)| *name == column && files.contains(&file))
    }

    /// Whether a row is exempt.
    #[must_use]
    pub fn row(&self, file: &str, key: &str) -> bool {
        self.rows.iter().any(|(of, name, _)| *of == file && *name == key)
    }
}
