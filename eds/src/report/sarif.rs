//! Findings as SARIF 2.1.0, the format that code hosts show beside the lines.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::diagnostic::{Diagnostic, Diagnostics, Label};
use crate::rules;
use crate::text::Input;

/// A SARIF log with one run of this tool over any number of files.
#[must_use]
pub fn sarif<'a>(files: impl IntoIterator<Item = (&'a Input, &'a Diagnostics)>) -> Value {
    let mut codes = BTreeSet::new();
    let mut results = Vec::new();
    for (input, diagnostics) in files {
        for diagnostic in diagnostics.iter() {
            codes.insert(diagnostic.code);
            results.push(result(diagnostic, input));
        }
    }
    let rules: Vec<Value> = codes.into_iter().map(rule).collect();
    json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": { "name": "lexican", "version": env!("CARGO_PKG_VERSION"), "rules": rules } },
            "columnKind": "unicodeCodePoints",
            "results": results,
        }],
    })
}

impl Diagnostics {
    #[must_use]
    /// A SARIF log with the findings of one file.
    pub fn to_sarif(&self, input: &Input) -> Value {
        sarif([(input, self)])
    }
}

fn rule(code: &str) -> Value {
    match rules::rule(code) {
        Some(rule) => json!({
            "id": code,
            "shortDescription": { "text": rule.holds },
            "fullDescription": { "text": rule.why },
            "defaultConfiguration": { "level": rule.severity.name() },
        }),
        None => json!({ "id": code }),
    }
}

fn result(diagnostic: &Diagnostic, input: &Input) -> Value {
    let places = |primary: bool| -> Vec<Value> {
        let labels = diagnostic.labels.iter().filter(|label| label.primary == primary);
        labels.filter_map(|label| location(label, input)).collect()
    };
    let mut message = diagnostic.message.clone();
    if let Some(help) = &diagnostic.help {
        message = format!("{message}\n{help}");
    }
    json!({
        "ruleId": diagnostic.code,
        "level": diagnostic.severity.name(),
        "message": { "text": message },
        "locations": places(true),
        "relatedLocations": places(false),
    })
}

fn location(label: &Label, input: &Input) -> Option<Value> {
    let source = input.source(label.span.source)?;
    let start = source.position(label.span.start);
    let end = source.position(label.span.end);
    Some(json!({
        "physicalLocation": {
            "artifactLocation": { "uri": uri(source.name()) },
            "region": {
                "startLine": start.line,
                "startColumn": start.column,
                "endLine": end.line,
                "endColumn": end.column,
            },
        },
        "message": { "text": label.text },
    }))
}

/// A path as a relative reference (RFC 3986): what is neither letter, digit nor one of `-._~/` is escaped.
#[must_use]
pub fn uri(path: &str) -> String {
    let mut uri = String::with_capacity(path.len());
    for byte in path.bytes() {
        match byte {
            b'\\' if cfg!(windows) => uri.push('/'),
            b'-' | b'.' | b'_' | b'~' | b'/' => uri.push(byte.into()),
            _ if byte.is_ascii_alphanumeric() => uri.push(byte.into()),
            _ => {
                let _ = write!(uri, "%{byte:02X}");
            }
        }
    }
    uri
}
