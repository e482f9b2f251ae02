//! Diagnostics and code actions.

use lexican_eds::rules::{Rule, rule};
use lexican_eds::{Diagnostic, Label, Severity, Span};
use serde_json::{Value, json};

use crate::document::{Document, Kind, uri_of};

/// The `PublishDiagnosticsParams` of a text.
pub(crate) fn published(document: &Document) -> Value {
    let diagnostics: Vec<_> = shown(document).map(|(finding, place)| shape(document, finding, place)).collect();
    let mut params = json!({ "uri": document.uri, "version": document.version });
    params["diagnostics"] = Value::Array(diagnostics);
    params
}

/// The findings about this text with their places; those without a place get its beginning.
pub(crate) fn shown(document: &Document) -> impl Iterator<Item = (&Diagnostic, Span)> {
    let whole = Span { source: document.number, start: 0, end: 0 };
    let places = document.findings.iter().map(move |finding| (finding, finding.span().unwrap_or(whole)));
    places.filter(|(_, place)| place.source == document.number)
}

fn shape(document: &Document, finding: &Diagnostic, place: Span) -> Value {
    let related: Vec<_> = finding.labels.iter().skip(1).filter_map(|label| related(document, label)).collect();
    let message: Vec<_> = std::iter::once(finding.message.as_str()).chain(finding.help.as_deref()).collect();
    // Moved in below, where `json!` would copy it.
    let mut shape = json!({
        "severity": match finding.severity {
            Severity::Error => 1,
            Severity::Warning => 2,
            Severity::Note => 3,
        },
        "code": finding.code,
        "source": "lexican",
        "message": message.join("\n"),
    });
    shape["range"] = document.range(place);
    shape["relatedInformation"] = Value::Array(related);
    // Omit unknown fields: some clients take null for a value.
    if let Some(rule) = rule(finding.code) {
        shape["codeDescription"] = json!({ "href": page(rule) });
    }
    shape
}

/// The link to a rule in the list of all rules.
fn page(rule: &Rule) -> String {
    let list = concat!(env!("CARGO_PKG_REPOSITORY"), "/blob/main/eds/RULES.md");
    format!("{list}#{}-{}", rule.code.replace(':', ""), rule.severity.name())
}

fn related(document: &Document, label: &Label) -> Option<Value> {
    let source = document.input.source(label.span.source)?;
    let is_here = label.span.source == document.number;
    let uri = if is_here { document.uri.clone() } else { uri_of(source.name().as_ref())? };
    let mut related = json!({ "location": { "uri": uri }, "message": label.text });
    related["location"]["range"] = document.range_in(source, label.span);
    Some(related)
}

/// The `CodeAction`s that fix findings in a range.
pub(crate) fn actions(document: &Document, params: &Value) -> Vec<Value> {
    let [from, to] = ["start", "end"].map(|end| document.offset(&params["range"][end]));
    let only = params["context"]["only"].as_array();
    let is_wanted = document.kind == Kind::Sheet && only.is_none_or(|only| only.contains(&json!("quickfix")));
    let here = shown(document).filter(|(_, place)| is_wanted && place.start <= to && from <= place.end);
    let action = |(finding, place): (&Diagnostic, Span)| {
        let (patch, rule) = finding.fix.as_ref().zip(rule(finding.code))?;
        Some(json!({
            "title": finding.help.as_deref().or(rule.fixes).unwrap_or(rule.holds),
            "kind": "quickfix",
            "diagnostics": [shape(document, finding, place)],
            "isPreferred": true,
            "edit": document.workspace_edit(&patch.apply(document.source())),
        }))
    };
    here.filter_map(action).collect()
}
