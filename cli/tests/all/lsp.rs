//! `lexican lsp`, as an editor starts it.

use std::io::Write;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::common::lexican_in;

/// A message as it goes over stdin.
fn message(content: &Value) -> String {
    let mut content = content.clone();
    content["jsonrpc"] = json!("2.0");
    let content = content.to_string();
    format!("Content-Length: {}\r\n\r\n{content}", content.len())
}

/// The messages that came over stdout.
fn messages(mut text: &str) -> Vec<Value> {
    let mut all = Vec::new();
    while let Some((head, rest)) = text.split_once("\r\n\r\n") {
        let length: usize = head.split("Content-Length: ").nth(1).unwrap().lines().next().unwrap().parse().unwrap();
        all.push(serde_json::from_str(&rest[..length]).unwrap());
        text = &rest[length..];
    }
    all
}

#[test]
fn an_editor_hears_what_lint_prints() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    let text = std::fs::read_to_string(format!("{folder}/sensor.eds")).unwrap();
    let uri = format!("file://{folder}/sensor.eds");
    let (document, at) = (json!({ "uri": uri }), json!({ "line": 40, "character": 2 }));
    let session = [
        json!({ "id": 1, "method": "initialize", "params": { "capabilities": {} } }),
        json!({ "method": "initialized", "params": {} }),
        json!({ "method": "textDocument/didOpen", "params": { "textDocument": { "uri": uri, "version": 3, "text": text } } }),
        json!({ "id": 2, "method": "textDocument/hover", "params": { "textDocument": document, "position": at } }),
        json!({ "id": 3, "method": "textDocument/definitelyNot", "params": { "textDocument": document } }),
        json!({ "id": 4, "method": "shutdown" }),
        json!({ "method": "exit" }),
    ];
    let mut server = Command::new(env!("CARGO_BIN_EXE_lexican"));
    server.args(["lsp", "--stdio"]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut server = server.spawn().unwrap();
    let session: String = session.iter().map(message).collect();
    server.stdin.take().unwrap().write_all(session.as_bytes()).unwrap();
    let output = server.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");

    let messages = messages(&String::from_utf8(output.stdout).unwrap());
    let answer = |id: i32| messages.iter().find(|message| message["id"] == id).unwrap();
    assert_eq!(answer(1)["result"]["capabilities"]["textDocumentSync"]["change"], 2);
    let line = text.lines().nth(40).unwrap();
    let said = answer(2)["result"]["contents"]["value"].as_str().unwrap();
    assert!(said.starts_with(&format!("**{}:00 ", line.trim_matches(['[', ']']))), "{line}: {said}");
    assert!(answer(3)["error"]["message"].as_str().unwrap().contains("definitelyNot"));
    let found = messages.iter().find(|message| message["method"] == "textDocument/publishDiagnostics").unwrap();
    assert_eq!(found["params"]["version"], 3);
    let found = found["params"]["diagnostics"].as_array().unwrap().iter();
    let found: Vec<_> =
        found.map(|it| (it["code"].clone(), it["range"]["start"]["line"].as_u64().unwrap() + 1)).collect();
    let lint = lexican_in(folder.as_ref(), &["eds", "lint", "sensor.eds", "--json"]);
    let lint: Value = serde_json::from_str(&lint.stdout).unwrap();
    let lint = lint["files"][0]["findings"].as_array().unwrap().iter();
    assert_eq!(found, lint.map(|it| (it["code"].clone(), it["line"].as_u64().unwrap())).collect::<Vec<_>>());
    assert!(!found.is_empty());
}
