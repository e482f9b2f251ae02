//! `cargo bench -p lexican-lsp [-- STROKES]`: times a key stroke, from the change to its findings, in a data sheet of
//! 1,200 entries.

use std::fmt::Write as _;
use std::time::Instant;

use lexican_lsp::{Connection, serve};
use lsp_server::{Message, Notification, Request, RequestId};
use serde_json::{Value, json};

const URI: &str = "file:///made.eds";

#[expect(clippy::disallowed_methods, reason = "a benchmark measures real time")]
fn main() {
    let strokes = std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(200);
    let text = data_sheet(1200);
    let (client, server) = Connection::memory();
    let served = std::thread::spawn(move || serve(&server));
    let notify = |method: &str, params: Value| client.sender.send(Notification::new(method.to_owned(), params).into());
    let ask = |id: i32, method: &str| {
        let params = json!({ "capabilities": {} });
        client.sender.send(Request::new(RequestId::from(id), method.to_owned(), params).into())
    };
    ask(0, "initialize").unwrap();
    client.receiver.recv().unwrap();
    notify("initialized", json!({})).unwrap();
    notify("textDocument/didOpen", json!({ "textDocument": { "uri": URI, "version": 0, "text": text } })).unwrap();
    client.receiver.recv().unwrap();
    let at = json!({ "line": text.lines().count() / 2, "character": 1000 });
    let stroke = |version: usize| {
        let change = json!({ "range": { "start": at, "end": at }, "text": "x" });
        let start = Instant::now();
        let document = json!({ "uri": URI, "version": version });
        notify("textDocument/didChange", json!({ "textDocument": document, "contentChanges": [change] })).unwrap();
        let Ok(Message::Notification(findings)) = client.receiver.recv() else { panic!("the server has ended") };
        assert_eq!(findings.params["version"], version);
        start.elapsed()
    };
    let mut times: Vec<_> = (1..=strokes).map(stroke).collect();
    times.sort_unstable();
    println!("{} bytes: {:?} in the middle, {:?} at most", text.len(), times[strokes / 2], times[strokes - 1]);
    ask(1, "shutdown").unwrap();
    client.receiver.recv().unwrap();
    notify("exit", Value::Null).unwrap();
    served.join().unwrap().unwrap();
}

/// A data sheet of single values; every tenth one has a mistake.
fn data_sheet(entries: usize) -> String {
    let mut text =
        format!("[FileInfo]\r\nFileName=made.eds\r\n[ManufacturerObjects]\r\nSupportedObjects={entries}\r\n");
    for number in 1..=entries {
        let _ = writeln!(text, "{number}=0x{:04X}\r", 0x1FFF + number);
    }
    for number in 0..entries {
        let limit = if number % 10 == 0 { 5 } else { 1000 };
        let _ = write!(
            text,
            "\r\n[{:04X}]\r\nParameterName=Parameter {number}\r\nObjectType=0x7\r\nDataType=0x0007\r\nAccessType=rw\r\n\
             DefaultValue=100\r\nLowLimit=0\r\nHighLimit={limit}\r\nPDOMapping=0\r\n",
            0x2000 + number,
        );
    }
    text
}
