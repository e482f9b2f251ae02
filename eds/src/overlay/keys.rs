//! The keys of an overlay's tables.

/// The keys that a table of an overlay may have. `table` is its kind (`object`), or the list that it is in (`units`),
/// or empty for the top level.
#[must_use]
pub fn keys_of(table: &str) -> &'static [&'static str] {
    match table {
        "" => &["overlay", "object", "enumeration", "bit_field", "quantity", "pdo", "interface"],
        "overlay" => &["format", "names", "profile", "sdo_writes_four_bytes"],
        "object" => &[
            "reason",
            "name",
            "description",
            "data_type",
            "access",
            "pdo_mapping",
            "default",
            "low",
            "high",
            "quantity",
            "enumeration",
            "bit_field",
            "ranges",
            "first_character_high",
            "persistent",
            "writable_in",
            "simulated",
            "accept",
        ],
        "ranges" => &["when", "low", "high"],
        "enumeration" => &["description", "values"],
        "values" => &["value", "name", "description"],
        "bit_field" => &["description", "fields"],
        "fields" => &["bits", "name", "description", "simulated", "reason"],
        "quantity" => &["description", "units"],
        "units" => &["symbol", "method", "scale", "when"],
        "pdo" => &["direction", "number", "cob_id", "transmission_type", "mapping"],
        "interface" => &["description", "parameters"],
        // The last four are for parameters without object; others take them from their object.
        "parameters" => &[
            "number",
            "object",
            "name",
            "description",
            "access",
            "data_type",
            "low",
            "high",
            "values",
            "when",
            "quantity",
            "enumeration",
            "bit_field",
            "persistent",
        ],
        _ => &[],
    }
}
