//! What cannot be compared: prose. Few, and listed in the report.

/// Columns of prose, and what they say. Where a cell of theirs can be compared nevertheless, it is.
pub const COLUMNS: &[(&str, &str, &str)] = &[
    ("faults.csv", "fault", "what a fault is called"),
    ("leds.csv", "meaning", "what a light means"),
    ("nmt.csv", "note", "remark"),
    ("nmt_states.csv", "bus_led", "the simulated drive has no bus LED"),
    ("objects.csv", "description", "what an object without sub-indices is for"),
    ("overview.csv", "note", "remarks and references to chapters; numbers of parameters are compared"),
    ("sdo_aborts.csv", "meaning", "what an abort code means"),
    ("sdo_examples.csv", "meaning", "what a frame does"),
    ("start_conditions.csv", "meaning", "what a condition is"),
    ("controlword.csv", "action", "what a bit does, after the words that are compared with the drive"),
    ("statusword.csv", "meaning_of_1", "what a bit says; that it is statically 0 is compared"),
    ("system_status.csv", "meaning", "what a bit says; errata are compared"),
    ("terms.csv", "printed", "of table 1, where names and meanings are one text"),
];

/// Rows about which nothing in data sheet, code and simulator can speak.
pub const ROWS: &[(&str, &str, &str)] = &[
    ("bus_termination.csv", "OFF:OFF", "a resistor is no data"),
    ("bus_termination.csv", "ON:ON", "a resistor is no data"),
    ("facts.csv", "7.2:communication profile", "the version of a document"),
    ("leds.csv", "bus orange:blinking 1:5", "the simulated drive has no bus LED"),
    ("leds.csv", "bus orange:blinking 2.5 Hz", "the simulated drive has no bus LED"),
    ("leds.csv", "bus orange:on", "the simulated drive has no bus LED"),
];

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
