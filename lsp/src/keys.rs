//! The keys of a machine and their values, from the JSON Schema.

use std::sync::LazyLock;

use serde_json::Value;

use crate::place::{Part, Place};

static SCHEMA: LazyLock<Value> = LazyLock::new(lexican_machine::schema);

/// The keys or values that the schema allows at a place, with their descriptions.
pub(crate) fn known(place: &Place) -> Vec<(&'static str, String)> {
    let shapes = at(&place.path).into_iter();
    if place.part == Part::Value {
        let one = |shape: &'static Value| Some((shape["const"].as_str()?, said(shape)));
        let examples = |shape: &'static Value| shape["examples"].as_array().into_iter().flatten();
        let examples = |shape| examples(shape).filter_map(|example| Some((example.as_str()?, String::new())));
        return shapes.flat_map(|shape| one(shape).into_iter().chain(examples(shape))).collect();
    }
    let keys = shapes.filter_map(|shape| shape["properties"].as_object()).flatten();
    let is_table = |shape: &'static Value| alternatives(shape).iter().any(|shape| shape["type"] == "object");
    let fits = keys.filter(|(_, shape)| place.part != Part::Header || is_table(shape));
    fits.map(|(key, shape)| (key.as_str(), said(shape))).collect()
}

/// The description of the key or value that a word is.
pub(crate) fn description(place: &Place, word: &str) -> Option<String> {
    let shapes = match place.part {
        Part::Value => at(&place.path).into_iter().filter(|shape| shape["const"] == word).collect(),
        Part::Header | Part::Key => at(&[&place.path[..], &[word.to_owned()]].concat()),
    };
    shapes.into_iter().map(said).find(|said| !said.is_empty())
}

/// The schemas at a path, in all alternatives. Elements of arrays have the path of their array.
fn at(path: &[String]) -> Vec<&'static Value> {
    let within = |shape: &'static Value, key: &str| {
        let known = shape["properties"].get(key).or_else(|| shape.get("additionalProperties"));
        known.map_or_else(Vec::new, alternatives)
    };
    path.iter()
        .fold(alternatives(&SCHEMA), |shapes, key| shapes.into_iter().flat_map(|shape| within(shape, key)).collect())
}

/// A schema and all its alternatives.
fn alternatives(shape: &'static Value) -> Vec<&'static Value> {
    let named = shape["$ref"].as_str().and_then(|name| SCHEMA.pointer(name.strip_prefix('#')?));
    let lists = ["anyOf", "oneOf"].into_iter().filter_map(|key| shape[key].as_array()).flatten();
    let others = named.into_iter().chain(lists).chain(shape.get("items"));
    std::iter::once(shape).chain(others.flat_map(alternatives)).collect()
}

fn said(shape: &'static Value) -> String {
    let said = alternatives(shape).into_iter().find_map(|shape| shape["description"].as_str());
    said.unwrap_or_default().replace('\n', " ")
}
