//! What cannot be compared: prose. Few, and listed in the report.

/// Columns that nothing can be compared with, and why.
pub const COLUMNS: &[(&str, &str, &str)] = &[];

/// Rows about which nothing in data sheet, code and simulator can speak, and why.
pub const ROWS: &[(&str, &str, &str)] = &[];

/// Keys of the data sheet and of the overlay that say nothing about the drive.
pub const KEYS: &[(&str, &str)] = &[
    ("CreationTime", "history of the file"),
    ("CreationDate", "history of the file"),
    ("CreatedBy", "history of the file"),
    ("ModificationTime", "history of the file"),
    ("ModificationDate", "history of the file"),
    ("ModifiedBy", "history of the file"),
    ("Description", "of the file; the version of the firmware is compared"),
    ("Line1 to Line10", "comments"),
    ("description", "prose of the overlay"),
    ("reason", "prose of the overlay"),
];

pub(crate) fn column(file: &str, column: &str) -> bool {
    COLUMNS.iter().any(|(of, name, _)| *of == file && *name == column)
}

pub(crate) fn row(file: &str, key: &str) -> Option<&'static str> {
    ROWS.iter().find(|(of, name, _)| *of == file && *name == key).map(|(_, _, why)| *why)
}
