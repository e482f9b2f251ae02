//! What cannot be compared: prose. Few, and listed in the report.

/// Columns that nothing can be compared with, the tables that have them, and why.
pub(crate) const COLUMNS: &[(&str, &[&str], &str)] = &[
    ("chapter", STANDS, "where the row stands in the manual"),
    ("table", STANDS, "where the row stands in the manual"),
    ("chapter", &["values.csv", "terms.csv"], "where the row stands in the manual"),
    ("transition", &["nmt.csv"], "the number of an arrow in figure 16"),
    ("reference", &["parameters.csv"], "where the manual goes on"),
    ("unit", &["facts.csv"], "how the value is written"),
];

/// Tables whose rows tell their places by columns that are no keys.
const STANDS: &[&str] = &[
    "baud_rates.csv",
    "bus_termination.csv",
    "commands.csv",
    "controlword.csv",
    "emergency.csv",
    "example_position.csv",
    "example_velocity.csv",
    "faults.csv",
    "gears.csv",
    "identifiers.csv",
    "leds.csv",
    "nmt.csv",
    "nmt_states.csv",
    "node_address.csv",
    "overview.csv",
    "parameters.csv",
    "pdo_layouts.csv",
    "sdo_aborts.csv",
    "sdo_commands.csv",
    "sdo_examples.csv",
    "states.csv",
    "statusword.csv",
    "system_status.csv",
    "transitions.csv",
];

/// Rows about which nothing in data sheet, code and simulator can speak, and why.
pub const ROWS: &[(&str, &str, &str)] = &[
    ("facts.csv", "7.2:communication profile", "the version of a document, which no object has"),
    ("facts.csv", "7.2:device profile", "the version of a document; its number is that of 1000h, which is compared"),
];

/// Clauses within cells that are otherwise compared, and why.
pub(crate) const CLAUSES: &[(&str, &str)] =
    &[("replace within half a year", "how long a battery lasts, no drive can be asked for")];

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

/// Whether nothing can be compared with a column of a table.
#[must_use]
pub fn is_prose(file: &str, column: &str) -> bool {
    COLUMNS.iter().any(|(name, files, _)| *name == column && files.contains(&file))
}

pub(crate) fn row(file: &str, key: &str) -> Option<&'static str> {
    ROWS.iter().find(|(of, name, _)| *of == file && *name == key).map(|(_, _, why)| *why)
}
