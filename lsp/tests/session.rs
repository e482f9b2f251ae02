//! Sessions of an editor with the server, in memory. Each answer is parsed as the type that the protocol's meta model
//! gives it.

use std::thread::{JoinHandle, spawn};

use gen_lsp_types as lsp;
use lexican_eds::fmt::normalise;
use lexican_eds::{Input, Source, load};
use lexican_lsp::{Connection, ProtocolError, serve};
use lsp_server::{Message, Notification, Request, RequestId};
use proptest::prelude::*;
use serde_json::{Value, json};

/// An editor.
struct Editor {
    connection: Connection,
    server: JoinHandle<Result<(), ProtocolError>>,
    requests: i32,
    /// The findings that came last.
    findings: Value,
}

impl Editor {
    fn new(encodings: &[&str]) -> (Self, Value) {
        let (connection, servers) = Connection::memory();
        let server = spawn(move || serve(&servers));
        let mut editor = Self { connection, server, requests: 0, findings: Value::Null };
        let capabilities = json!({ "general": { "positionEncodings": encodings } });
        let result =
            editor.ask("initialize", json!({ "processId": null, "rootUri": null, "capabilities": capabilities }));
        serde_json::from_value::<lsp::InitializeResult>(result.clone()).unwrap();
        editor.tell("initialized", json!({}));
        (editor, result)
    }

    fn tell(&self, method: &str, params: Value) {
        self.connection.sender.send(Notification::new(method.to_owned(), params).into()).unwrap();
    }

    /// The answer, or the reason why there is none.
    fn asked(&mut self, method: &str, params: Value) -> Result<Value, String> {
        self.requests += 1;
        let id = RequestId::from(self.requests);
        self.connection.sender.send(Request::new(id.clone(), method.to_owned(), params).into()).unwrap();
        loop {
            match self.connection.receiver.recv().unwrap() {
                Message::Response(response) => {
                    assert_eq!(response.id, id);
                    return serde_json::to_value(response)
                        .map(|response| match &response["error"] {
                            Value::Null => Ok(response["result"].clone()),
                            error => Err(error["message"].as_str().unwrap().to_owned()),
                        })
                        .unwrap();
                }
                Message::Notification(notification) => self.published(notification),
                Message::Request(_) => panic!("the server asks nothing"),
            }
        }
    }

    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.asked(method, params).unwrap()
    }

    fn published(&mut self, notification: Notification) {
        assert_eq!(notification.method, "textDocument/publishDiagnostics");
        serde_json::from_value::<lsp::PublishDiagnosticsParams>(notification.params.clone()).unwrap();
        self.findings = notification.params;
    }

    /// The answer as the protocol's type.
    fn typed<Q: lsp::Request>(&mut self, params: Value) -> (Q::Result, Value) {
        let value = self.ask(&Q::METHOD.to_string(), params);
        (serde_json::from_value(value.clone()).unwrap(), value)
    }

    fn open(&mut self, uri: &str, text: &str) -> Value {
        let document = json!({ "uri": uri, "languageId": "eds", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
        self.next()
    }

    fn change(&mut self, uri: &str, version: i32, changes: Value) -> Value {
        let document = json!({ "uri": uri, "version": version });
        self.tell("textDocument/didChange", json!({ "textDocument": document, "contentChanges": changes }));
        self.next()
    }

    /// The next findings.
    fn next(&mut self) -> Value {
        let Message::Notification(notification) = self.connection.receiver.recv().unwrap() else {
            panic!("no findings")
        };
        self.published(notification);
        self.findings.clone()
    }

    fn end(mut self) {
        assert_eq!(self.ask("shutdown", Value::Null), Value::Null);
        self.tell("exit", Value::Null);
        self.server.join().unwrap().unwrap();
    }
}

const SENSOR: &str = include_str!("../../cli/tests/sensor.eds");
const URI: &str = "file:///data/sensor%20one.eds";

/// A place by what stands there, and so many characters behind its beginning.
fn at(uri: &str, text: &str, what: &str, behind: usize) -> Value {
    let offset = text.find(what).unwrap_or_else(|| panic!("{what:?}")) + behind;
    let before = &text[..offset];
    let line = before.matches('\n').count();
    let character = before.rsplit('\n').next().unwrap().encode_utf16().count();
    json!({ "textDocument": { "uri": uri }, "position": { "line": line, "character": character } })
}

/// A text with edits, by the rules of the protocol: lines end with LF, CR LF or CR, columns are UTF-16.
fn edited(text: &str, range: &Value, new: &str) -> String {
    let units: Vec<u16> = text.encode_utf16().collect();
    let place = |at: &Value| {
        let (mut line, mut begin) = (0, 0);
        while line < at["line"].as_u64().unwrap() {
            let rest = units[begin..].iter().position(|&unit| unit == 10 || unit == 13);
            let Some(end) = rest.map(|rest| begin + rest) else { return units.len() };
            begin = end + if units[end] == 13 && units.get(end + 1) == Some(&10) { 2 } else { 1 };
            line += 1;
        }
        let length = units[begin..].iter().take_while(|&&unit| unit != 10 && unit != 13).count();
        begin + length.min(at["character"].as_u64().unwrap() as usize)
    };
    let (start, end) = (place(&range["start"]), place(&range["end"]));
    let new: Vec<u16> = new.encode_utf16().collect();
    String::from_utf16(&[&units[..start], &new, &units[end.max(start)..]].concat()).unwrap()
}

/// All edits of a document's `WorkspaceEdit` or `TextEdit`s, of which there is one at most.
fn applied(text: &str, edits: &Value) -> String {
    let edits = edits["changes"][URI].as_array().or(edits.as_array()).unwrap();
    assert!(edits.len() <= 1);
    edits.iter().fold(text.to_owned(), |text, edit| edited(&text, &edit["range"], edit["newText"].as_str().unwrap()))
}

#[test]
fn findings_come_while_typing_and_go_when_the_text_is_closed() {
    let (mut editor, introduction) = Editor::new(&["utf-16"]);
    assert_eq!(introduction["capabilities"]["positionEncoding"], "utf-16");
    let before = editor.open(URI, SENSOR);
    assert_eq!(before["diagnostics"].as_array().unwrap().len(), load(&Input::new(Source::new("x", SENSOR))).1.len());
    // The list says one object more than it has.
    let count = at(URI, SENSOR, "SupportedObjects=4", 17)["position"].clone();
    let end = json!({ "line": count["line"], "character": 4000 });
    let found = editor.change(URI, 7, json!([{ "range": { "start": count, "end": end }, "text": "5" }]));
    assert_eq!(found["version"], 7);
    let finding = found["diagnostics"].as_array().unwrap().iter().find(|it| it["code"] == "eds::list-count").unwrap();
    assert_eq!(finding["range"], json!({ "start": count, "end": { "line": count["line"], "character": 18 } }));
    assert!(finding["codeDescription"]["href"].as_str().unwrap().ends_with("RULES.md#edslist-count-warning"));

    let text = SENSOR.replace("SupportedObjects=4", "SupportedObjects=5");
    let params = json!({ "textDocument": { "uri": URI }, "range": finding["range"], "context": { "diagnostics": [] } });
    let (_, actions) = editor.typed::<lsp::CodeActionRequest>(params);
    assert_eq!(applied(&text, &actions[0]["edit"]), SENSOR);
    let (_, hover) = editor.typed::<lsp::HoverRequest>(at(URI, &text, "SupportedObjects=5", 18));
    assert!(hover["contents"]["value"].as_str().unwrap().contains("`eds::list-count`: **"), "{hover}");

    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": URI } }));
    assert_eq!(editor.next()["diagnostics"], json!([]));
    let refused = editor.asked("textDocument/hover", at(URI, SENSOR, "[1000]", 1)).unwrap_err();
    assert!(refused.contains("is not open"), "{refused}");
    editor.end();
}

#[test]
fn an_object_is_shown_found_and_renamed() {
    let (mut editor, _) = Editor::new(&["utf-16"]);
    let text = SENSOR.replace("ParameterName=Device Type", "ParameterName=Gerätetyp \u{1F50C}");
    editor.open(URI, &text);
    let (_, hover) = editor.typed::<lsp::HoverRequest>(at(URI, &text, "[1800sub1]", 2));
    let said = hover["contents"]["value"].as_str().unwrap();
    assert!(said.contains("1800:01") && said.contains("UNSIGNED32") && said.contains("$NODEID+0x180"), "{said}");
    // What TPDO 1 maps.
    let mapping = text.split("[1A00sub1]").nth(1).unwrap().split("DefaultValue=0x").nth(1).unwrap();
    let index = &mapping[..4];
    let (_, place) = editor.typed::<lsp::DefinitionRequest>(at(URI, &text, &format!("DefaultValue=0x{index}"), 18));
    let section = text.lines().nth(place["range"]["start"]["line"].as_u64().unwrap() as usize).unwrap();
    assert!(section.starts_with(&format!("[{index}")), "{section}");

    let mut params = at(URI, &text, &format!("[{index}]"), 2);
    let (_, prepared) = editor.typed::<lsp::PrepareRenameRequest>(params.clone());
    assert_eq!(prepared["placeholder"], index);
    params["newName"] = json!("2ABC");
    let (_, edit) = editor.typed::<lsp::RenameRequest>(params.clone());
    let renamed = applied(&text, &edit);
    assert_eq!(renamed, text.replace(index, "2ABC"), "in this data sheet nothing else looks like it");
    params["newName"] = json!("1000");
    assert!(editor.asked("textDocument/rename", params).unwrap_err().contains("[1000] is there already"));

    let (_, symbols) = editor.typed::<lsp::DocumentSymbolRequest>(json!({ "textDocument": { "uri": URI } }));
    let identity = symbols.as_array().unwrap().iter().find(|it| it["name"].as_str().unwrap().starts_with("1018 "));
    assert_eq!(identity.unwrap()["children"][1]["name"].as_str().unwrap().split(' ').next(), Some("1018sub1"));
    let (folds, _) = editor.typed::<lsp::FoldingRangeRequest>(json!({ "textDocument": { "uri": URI } }));
    assert_eq!(folds.unwrap().len(), text.matches("\n[").count() + 1);
    editor.end();
}

#[test]
fn what_may_stand_at_a_place_is_offered() {
    let (mut editor, _) = Editor::new(&["utf-16"]);
    let text = format!(
        "{SENSOR}\n[2000]\nDa\nDataType=uns\nAccessType=\n[1A00sub1]\nDefaultValue=\n[ManufacturerObjects]\n9=\n"
    );
    editor.open(URI, &text);
    for (line, behind, label, new) in [
        ("\nDa\n", 3, "DataType", None),
        ("\nDataType=uns", 13, "UNSIGNED8", Some("0x0005")),
        ("\nAccessType=\n", 12, "const", Some("const")),
    ] {
        let (_, list) = editor.typed::<lsp::CompletionRequest>(at(URI, &text, line, behind));
        let item = list["items"].as_array().unwrap().iter().find(|item| item["label"] == label);
        assert_eq!(item.is_some(), label != "DataType", "{line}: a key that is there is not offered: {list}");
        assert_eq!(item.and_then(|item| item["textEdit"]["newText"].as_str()), new.filter(|_| item.is_some()));
    }
    let (_, list) = editor.typed::<lsp::CompletionRequest>(at(URI, &text, "\n[1A00sub1]\nDefaultValue=\n", 25));
    let mappable: Vec<_> = load(&Input::new(Source::new("x", text.as_str())))
        .0
        .entries()
        .filter(|it| it.pdo_mapping)
        .map(|it| it.index)
        .collect();
    assert_eq!(list["items"].as_array().unwrap().len(), mappable.len());
    editor.end();
}

#[test]
fn a_data_sheet_is_formatted_as_the_command_does_it() {
    let (mut editor, _) = Editor::new(&["utf-8", "utf-16"]);
    let text = "; °C\r\n[1000]\r\nparametername = Ger\u{e4}t\r\n  DataType=7\r\n\r\n[1001]\r\n";
    editor.open(URI, text);
    let params = json!({ "textDocument": { "uri": URI }, "options": { "tabSize": 4, "insertSpaces": true } });
    let (_, edits) = editor.typed::<lsp::DocumentFormattingRequest>(params.clone());
    assert_eq!(applied(text, &edits), normalise(&Source::new("x", text)));
    editor.change(URI, 2, json!([{ "text": "[1000]\nParameterName=Ger\u{FFFD}t\n" }]));
    assert!(editor.asked("textDocument/formatting", params).unwrap_err().contains("Windows 1252"));
    editor.end();
}

#[test]
fn overlays_and_machines_lead_to_their_data_sheets() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).unwrap();
        format!("file://{}", folder.path().join(name).display())
    };
    let sheet = file("sensor.eds", SENSOR);
    let text = "[overlay]\nformat = 1\n[object.\"2000\"]\nquantity = \"Speed\"\nlow = 1\nacc\n[object.\"2001\"]\ndata_type = \"UNS\"\n\
                [quantity.Speed]\nunits = [ { symbol = \"mm/s\", method = \"mm_per_s\", scale = \"1\" } ]\n";
    let overlay = file("axis.toml", text);
    let machine_text = "[node.sensor]\nid = 5\nsheet = \"sensor.eds\"\noverlay = [\"axis.toml\"]\nsettings = { 2000 = \"5 \" }\n\
                        [wire]\n\"sensor.2000\" = \"\"\n";
    let machine = file("machine.toml", machine_text);
    let (mut editor, _) = Editor::new(&["utf-16"]);
    editor.open(&overlay, &text.replace("\nacc", ""));
    let found = editor.change(&overlay, 2, json!([{ "text": text }]));
    let codes = |found: &Value| -> Vec<String> {
        let all = found["diagnostics"].as_array().unwrap().iter();
        all.map(|it| it["code"].as_str().unwrap().to_owned()).collect()
    };
    assert!(codes(&found).contains(&"overlay::syntax".to_owned()), "{found}");
    let (_, place) = editor.typed::<lsp::DefinitionRequest>(at(&overlay, text, "\"2000\"", 3));
    assert_eq!(
        (&place["uri"], SENSOR.lines().nth(place["range"]["start"]["line"].as_u64().unwrap() as usize)),
        (&json!(sheet), Some("[2000]"))
    );
    let mut labels = |uri: &str, text: &str, what: &str, behind| -> Vec<String> {
        let (_, list) = editor.typed::<lsp::CompletionRequest>(at(uri, text, what, behind));
        list["items"]
            .as_array()
            .unwrap()
            .iter()
            .map(|it| it["textEdit"]["newText"].as_str().unwrap().to_owned())
            .collect()
    };
    assert_eq!(labels(&overlay, text, "\nacc\n", 4), ["access", "accept"]);
    assert!(labels(&overlay, text, "\"UNS\"", 4).contains(&"UNSIGNED64".to_owned()));
    assert_eq!(labels(&overlay, text, "\"Speed\"", 2), ["Speed"]);

    let mended = text.replace("\nacc", "").replace("\"UNS\"", "\"UNSIGNED8\"").replace("low = 1\n", "");
    let found = editor.change(&overlay, 3, json!([{ "text": mended }]));
    assert_eq!(codes(&found), ["overlay::missing-reason"]);
    std::fs::write(
        folder.path().join("axis.toml"),
        text.replace("\nacc", "").replace("[object.\"2001\"]\ndata_type = \"UNS\"\n", "").replace("low = 1\n", ""),
    )
    .unwrap();

    editor.open(&machine, machine_text);
    let (_, place) = editor.typed::<lsp::DefinitionRequest>(at(&machine, machine_text, "\"sensor.eds\"", 3));
    assert_eq!(place["uri"], json!(sheet));
    let mut labels = |what: &str, behind| -> Vec<String> {
        let (_, list) = editor.typed::<lsp::CompletionRequest>(at(&machine, machine_text, what, behind));
        list["items"]
            .as_array()
            .unwrap()
            .iter()
            .map(|it| it["textEdit"]["newText"].as_str().unwrap().to_owned())
            .collect()
    };
    assert_eq!(labels("\"5 \"", 3), ["5 mm/s"]);
    assert_eq!(labels("= \"\"", 3), ["sensor.", "manager"]);
    assert!(labels("\"sensor.2000\"", 8).contains(&"sensor.2000".to_owned()));
    let (_, hover) = editor.typed::<lsp::HoverRequest>(at(&machine, machine_text, "{ 2000", 3));
    assert!(hover["contents"]["value"].as_str().unwrap().starts_with("**2000:00 "), "{hover}");
    editor.end();
}

#[test]
fn keys_of_a_machine_are_explained_by_its_schema() {
    let uri = "file:///data/machine.toml";
    let text = "[]\n[bus]\nbit-rate = \"\"\non-loss = \"reset-all\"\n[bus.x]\nhea\n[node.a]\nhea\noptional = true\n\
                identity = { v }\n[simulate.a]\npower = \"\"\n[[fault]]\naction = \"\"\n[wire]\n\"a.1000\" = { to = [], e }\n";
    let (mut editor, _) = Editor::new(&["utf-16"]);
    editor.open(uri, text);
    let mut offered = |what: &str, behind| -> Vec<(String, String)> {
        let (_, list) = editor.typed::<lsp::CompletionRequest>(at(uri, text, what, behind));
        let word = |word: &Value| word.as_str().unwrap_or_default().to_owned();
        let items = list["items"].as_array().unwrap().iter();
        items.map(|it| (word(&it["textEdit"]["newText"]), word(&it["documentation"]))).collect()
    };
    let tables: Vec<_> = offered("[]", 1).into_iter().map(|(key, _)| key).collect();
    assert_eq!(tables, ["bench", "bus", "fault", "kind", "machine", "node", "simulate", "wire"]);
    for (what, behind, key, said) in [
        ("[node.a]\nhea", 12, "heartbeat", "Its heartbeat (1017h). It is lost when three in a row are missing."),
        ("[bus.x]\nhea", 11, "heartbeat", "The heartbeat of the manager, which the nodes watch (1016h)."),
        ("identity = { v", 14, "vendor", "The vendor-ID."),
        ("to = [], e", 10, "every", "The most time between two of them."),
        ("bit-rate = \"", 12, "500 kbit/s", ""),
        ("power = \"", 9, "off", "Switched off."),
        ("action = \"", 10, "delay", "They come later."),
    ] {
        let all = offered(what, behind);
        assert!(all.contains(&(key.to_owned(), said.to_owned())), "{what}: {all:?}");
    }
    assert_eq!(offered("power = \"", 9).len(), 2, "what the schema has, and nothing else");
    for (what, behind, said) in [
        ("optional", 2, "The machine runs without it, too."),
        ("[node.a]", 2, "The nodes by their names."),
        ("reset-all", 2, "All nodes are reset and booted again."),
    ] {
        let (_, hover) = editor.typed::<lsp::HoverRequest>(at(uri, text, what, behind));
        assert!(hover["contents"]["value"].as_str().is_some_and(|it| it.starts_with(said)), "{what}: {hover}");
    }
    editor.end();
}

/// Lines of a data sheet, whole and broken, with every kind of end and characters of one and two units.
const PIECES: &str = "(\\[(1018|2000(sub[0-3])?|OptionalObjects)\\]|(DataType|ParameterName|1|SupportedObjects)=(0x[0-9]{1,4}|\u{e4}\u{1F50C}x)?|[=\\[; ]|\r\n|\n|\r){0,6}";

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]
    #[test]
    fn changes_piece_by_piece_give_what_the_whole_text_gives(
        text in PIECES,
        changes in prop::collection::vec(prop::collection::vec((0..8u32, 0..20u32, 0..3u32, 0..20u32, PIECES), 1..4), 1..6),
    ) {
        let (mut editor, _) = Editor::new(&[]);
        let mut text = text;
        let mut last = editor.open(URI, &text);
        for (version, changes) in (2..).zip(changes) {
            let mut parts = Vec::new();
            for (line, column, lines, end, new) in changes {
                let end = if lines == 0 { column + end } else { end };
                // No client cuts a character in two, nor a line's end.
                let range = json!({ "start": { "line": line, "character": column }, "end": { "line": line + lines, "character": end } });
                let whole = std::panic::catch_unwind(|| edited(&text, &range, &new));
                let Ok(next) = whole else { continue };
                text = next;
                parts.push(json!({ "range": range, "text": new }));
            }
            last = editor.change(URI, version, Value::Array(parts));
        }
        let mut whole = editor.open("file:///data/whole.eds", &text);
        // Places in other texts are there, too.
        let whole = whole["diagnostics"].take().to_string().replace("file:///data/whole.eds", URI);
        prop_assert_eq!(last["diagnostics"].to_string(), whole);
        editor.end();
    }
}
