//! JSON objects.

use serde_json::{Map, Value as Json};

/// The fields of a JSON object; none of any other value.
#[must_use]
pub fn fields(object: Json) -> Map<String, Json> {
    match object {
        Json::Object(fields) => fields,
        _ => Map::new(),
    }
}
