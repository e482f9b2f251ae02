//! The tables of a SIKO manual, and the parts of them that cannot be compared.

use super::bits::BATTERY_LIFE;
use crate::exempt::Exempt;
use crate::manual::Keys;

/// The tables and their keys.
pub(crate) const TABLES: Keys = &[
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

/// What is not compared: these rows and clauses, and columns that all of the manuals have.
pub(crate) const fn exempt(
    rows: &'static [(&'static str, &'static str, &'static str)],
    clauses: &'static [(&'static str, &'static str)],
) -> Exempt {
    Exempt { columns: COLUMNS, rows, clauses }
}

const COLUMNS: &[(&str, &[&str], &str)] = &[
    ("chapter", STANDS, "where the row stands in the manual"),
    ("table", STANDS, "where the row stands in the manual"),
    ("chapter", &["values.csv", "terms.csv"], "where the row stands in the manual"),
    ("transition", &["nmt.csv"], "the number of an arrow in figure 16"),
    ("reference", &["parameters.csv"], "where the manual goes on"),
    ("unit", &["facts.csv"], "how the value is written"),
];

/// Why rows and clauses are not compared.
pub(crate) const DOCUMENT: &str = "the version of a document, which no object has";
pub(crate) const PROFILE: &str = "the version of a document; its number is that of 1000h, which is compared";
pub(crate) const BATTERY: (&str, &str) = (BATTERY_LIFE, "how long a battery lasts, no drive can be asked for");

/// Tables whose rows say where they are in the manual, in columns that are no keys.
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
