//! Findings as JSON: an array of objects, one for each finding.

use serde_json::{Value, json};

use crate::diagnostic::{Diagnostic, Diagnostics, Label};
use crate::text::Input;

impl Diagnostics {
    /// `[{"code", "severity", "message", "file", "line", "column", "labels": […], "help"}]`; lines and columns
    /// from 1, `file`, `line`, `column` and `help` null where there is none.
    #[must_use]
    pub fn to_json(&self, input: &Input) -> Value {
        self.iter().map(|diagnostic| diagnostic.to_json(input)).collect()
    }
}

impl Diagnostic {
    /// See [`Diagnostics::to_json`].
    #[must_use]
    pub fn to_json(&self, input: &Input) -> Value {
        let labels: Vec<Value> = self.labels.iter().map(|label| label_json(label, input)).collect();
        let place = labels.first().cloned().unwrap_or_default();
        json!({
            "code": self.code,
            "severity": self.severity.name(),
            "message": self.message,
            "file": place["file"],
            "line": place["line"],
            "column": place["column"],
            "labels": labels,
            "help": self.help,
        })
    }
}

fn label_json(label: &Label, input: &Input) -> Value {
    let Some(source) = input.source(label.span.source) else { return Value::Null };
    let start = source.position(label.span.start);
    let end = source.position(label.span.end);
    json!({
        "file": source.name(),
        "line": start.line,
        "column": start.column,
        "end_line": end.line,
        "end_column": end.column,
        "primary": label.primary,
        "text": label.text,
    })
}
