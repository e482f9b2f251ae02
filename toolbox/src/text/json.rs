//! JSON objects, and the formats of fields.

use std::fmt::UpperHex;

use lexican_runtime::AbortCode;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use serde_json::{Map, Value as Json};

use crate::values::hex;

/// The fields of a JSON object; empty for other values.
#[must_use]
pub fn fields(object: Json) -> Map<String, Json> {
    match object {
        Json::Object(fields) => fields,
        _ => Map::new(),
    }
}

/// The fields of a value that serialises to a JSON object.
#[must_use]
pub fn fields_of(value: &impl Serialize) -> Map<String, Json> {
    fields(serde_json::to_value(value).unwrap_or_default())
}

/// Adds a field if it is not `None`.
pub(crate) fn add_some<M: SerializeMap>(
    map: &mut M,
    name: &str,
    field: Option<impl Serialize>,
) -> Result<(), M::Error> {
    field.map_or(Ok(()), |field| map.serialize_entry(name, &field))
}

/// A number with all its hexadecimal digits: `05`.
pub(crate) fn digits<T: UpperHex, S: Serializer>(number: &T, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{number:0width$X}", width = 2 * size_of::<T>()))
}

/// Bytes in hexadecimal: `06 02 00 00`.
pub(crate) fn bytes<S: Serializer>(data: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&hex(data))
}

/// `read` or `write`.
pub(crate) fn access<S: Serializer>(writes: &Option<bool>, serializer: S) -> Result<S::Ok, S::Error> {
    writes.map(|writes| if writes { "write" } else { "read" }).serialize(serializer)
}

/// Adds the fields of an abort code to those of its struct.
pub(crate) fn abort<S: Serializer>(code: &Option<AbortCode>, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Fields {
        #[serde(skip_serializing_if = "Option::is_none")]
        abort: Option<&'static str>,
        #[serde(serialize_with = "digits")]
        abort_code: u32,
    }
    code.map(|code| Fields { abort: code.text(), abort_code: code.0 }).serialize(serializer)
}
