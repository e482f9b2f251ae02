//! Tracks which fields of the view have changed.

use serde_json::Value as Json;

use crate::View;

/// The fields of a view in JSON, each with the number of the view that changed it last. They are serialised once for
/// all clients.
#[derive(Clone, Debug, Default)]
pub(super) struct Fields {
    /// The number of the last view, from 1.
    number: u64,
    fields: Vec<Field>,
}

#[derive(Clone, Debug)]
struct Field {
    name: String,
    since: u64,
    json: String,
}

impl Fields {
    /// Updates the fields from the next view.
    pub(super) fn update(&mut self, view: &View) {
        self.number += 1;
        let Ok(Json::Object(fields)) = serde_json::to_value(view) else { return };
        for (name, value) in fields {
            let json = value.to_string();
            match self.fields.iter_mut().find(|field| field.name == name) {
                Some(field) if field.json == json => {}
                Some(field) => (field.since, field.json) = (self.number, json),
                None => self.fields.push(Field { name, since: self.number, json }),
            }
        }
    }

    /// The number of the last view.
    pub(super) const fn number(&self) -> u64 {
        self.number
    }

    /// Whether any field has changed since a view.
    pub(super) fn have_changed_since(&self, number: u64) -> bool {
        self.fields.iter().any(|field| field.since > number)
    }

    /// The message with the fields that have changed since a view.
    pub(super) fn message_since(&self, number: u64) -> String {
        let changed = self.fields.iter().filter(|field| field.since > number);
        let fields: Vec<String> = changed.map(|field| format!("\"{}\":{}", field.name, field.json)).collect();
        format!("{{\"view\":{{{}}}}}", fields.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(message: &str) -> Vec<String> {
        let message: Json = serde_json::from_str(message).unwrap();
        message["view"].as_object().unwrap().keys().cloned().collect()
    }

    #[test]
    fn a_client_gets_what_has_changed_since_its_last_view() {
        let mut fields = Fields::default();
        let mut view = View::default();
        fields.update(&view);
        let (first, all) = (fields.number(), names(&fields.message_since(0)));
        assert!(
            ["time", "bus", "nodes", "drives", "control"].iter().all(|name| all.iter().any(|it| it == name)),
            "{all:?}"
        );
        assert_eq!(fields.message_since(first), r#"{"view":{}}"#);
        view.time = 0.1;
        fields.update(&view);
        view.control.clients = 1;
        fields.update(&view);
        assert_eq!(names(&fields.message_since(first)), ["control", "time"]);
        assert_eq!(fields.message_since(first + 1), r#"{"view":{"control":{"clients":1,"holder":null}}}"#);
    }
}
