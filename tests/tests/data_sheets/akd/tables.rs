//! The tables of the manual.

use crate::manual::{Manual, Row};

pub const MANUAL: Manual = Manual {
    folder: "akd",
    keys: &[
        ("baud_rates", &["value"]),
        ("commands", &["command"]),
        ("descriptions", &["index", "subindex"]),
        ("emergency", &["code"]),
        ("encodings", &["data_type", "value"]),
        ("errata", &["id"]),
        ("formats", &["address", "bits", "value"]),
        ("frames", &["frame"]),
        ("homing_methods", &["method"]),
        ("identifiers", &["object"]),
        ("mode_bits", &["object", "bit", "mode"]),
        ("names", &["index", "subindex"]),
        ("nmt", &["command"]),
        ("objects", &["index", "subindex"]),
        ("pdo_mappings", &["index", "position"]),
        ("sdo_aborts", &["code"]),
        ("sdo_commands", &["hex", "command"]),
        ("sections", &["chapter", "index"]),
        ("states", &["state"]),
        ("terms", &["type", "value"]),
        ("transitions", &["number"]),
        ("values", &["address", "value"]),
    ],
};

/// The rows of a table.
pub fn rows(file: &str) -> Vec<Row> {
    MANUAL.rows(file)
}
