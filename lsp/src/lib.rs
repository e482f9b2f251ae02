//! A language server for CANopen: data sheets (EDS, DCF), overlays, and machine files.
//!
//! [`serve`] answers a client over any [`Connection`]. All content comes from the rules, the model, the keys of
//! overlays and the schema of machines, so editors show what `lexican eds lint`, `machine check` and `machine schema`
//! print. Open texts come from the client, in Unicode, whatever the encoding of their files.
//!
//! Findings are sent when no further change is waiting. Messages are built as JSON; the documentation of a function
//! names the structure of the protocol that it returns.

mod completion;
mod document;
mod findings;
mod hover;
mod keys;
mod place;
mod structure;

use std::collections::BTreeMap;

use lexican_eds::fmt::normalise;
pub use lsp_server::{Connection, ProtocolError};
use lsp_server::{ErrorCode, Message, Notification, Request, Response};
use serde_json::{Value, json};

use document::{Document, Kind};

/// Serves a client until it ends the session, or is gone.
///
/// Errors: the client violates the protocol when the session begins or ends.
pub fn serve(connection: &Connection) -> Result<(), ProtocolError> {
    let (id, params) = connection.initialize_start()?;
    let offered = params["capabilities"]["general"]["positionEncodings"].as_array();
    let (encoding, columns): (_, fn(char) -> usize) = match offered.is_some_and(|all| all.contains(&json!("utf-8"))) {
        true => ("utf-8", char::len_utf8),
        false => ("utf-16", char::len_utf16),
    };
    connection.initialize_finish(id, introduction(encoding))?;
    let mut server = Server { documents: BTreeMap::new(), columns };
    // Ignore a failure: if the client is gone, receiving ends the loop.
    let send = |message: Message| drop(connection.sender.send(message));
    loop {
        let next = connection.receiver.try_recv();
        // Read the changed texts before answering a request, and when nothing is waiting.
        if !matches!(next, Ok(Message::Notification(_))) {
            server.published().into_iter().for_each(|findings| send(findings.into()));
        }
        match next.or_else(|_| connection.receiver.recv()) {
            Ok(Message::Request(request)) if connection.handle_shutdown(&request)? => return Ok(()),
            Ok(Message::Request(request)) => send(server.answer(request).into()),
            Ok(Message::Notification(notification)) => {
                server.take(&notification).into_iter().for_each(|closed| send(closed.into()));
            }
            Ok(Message::Response(_)) => {}
            Err(_) => return Ok(()),
        }
    }
}

/// The `InitializeResult`.
fn introduction(encoding: &str) -> Value {
    const INCREMENTAL: u8 = 2;
    json!({
        "serverInfo": { "name": "lexican", "version": env!("CARGO_PKG_VERSION") },
        "capabilities": {
            "positionEncoding": encoding,
            "textDocumentSync": { "openClose": true, "change": INCREMENTAL, "save": true },
            "hoverProvider": true,
            "completionProvider": { "triggerCharacters": ["[", "=", "\"", ".", ":"] },
            "definitionProvider": true,
            "documentSymbolProvider": true,
            "foldingRangeProvider": true,
            "codeActionProvider": { "codeActionKinds": ["quickfix"] },
            "documentFormattingProvider": true,
            "renameProvider": { "prepareProvider": true },
        },
    })
}

/// The open texts.
struct Server {
    documents: BTreeMap<String, Document>,
    /// The number of columns that a character takes in the client's encoding.
    columns: fn(char) -> usize,
}

impl Server {
    /// The findings of all texts that have changed.
    fn published(&mut self) -> Vec<Notification> {
        let changed = self.documents.values_mut().filter(|document| !document.is_published);
        let findings = changed.map(|document| {
            document.read();
            document.is_published = true;
            publication(findings::published(document))
        });
        findings.collect()
    }

    /// Handles a notification. If it closes a text, returns one that clears the findings.
    fn take(&mut self, Notification { method, params }: &Notification) -> Option<Notification> {
        let uri = params["textDocument"]["uri"].as_str()?;
        match method.as_str() {
            "textDocument/didOpen" => {
                self.documents.insert(uri.to_owned(), Document::new(&params["textDocument"], self.columns));
            }
            "textDocument/didChange" => {
                let document = self.documents.get_mut(uri)?;
                document.version = params["textDocument"]["version"].clone();
                document.change(&params["contentChanges"]);
            }
            "textDocument/didSave" => self.documents.values_mut().for_each(Document::settle),
            "textDocument/didClose" => {
                self.documents.remove(uri)?;
                return Some(publication(json!({ "uri": uri, "diagnostics": [] })));
            }
            _ => {}
        }
        None
    }

    fn answer(&mut self, Request { id, method, params }: Request) -> Response {
        let uri = params["textDocument"]["uri"].as_str().unwrap_or_default();
        let Some(document) = self.documents.get_mut(uri) else {
            let is_ours = method.starts_with("textDocument/");
            let code = if is_ours { ErrorCode::RequestFailed } else { ErrorCode::MethodNotFound };
            return Response::new_err(id, code as i32, format!("{method}: {uri:?} is not open"));
        };
        let at = document.offset(&params["position"]);
        let result = match method.as_str() {
            "textDocument/hover" => Ok(json!(hover::hover(document, at))),
            "textDocument/completion" => Ok(completion::completion(document, at)),
            "textDocument/definition" => Ok(json!(structure::definition(document, at))),
            "textDocument/prepareRename" => Ok(json!(structure::prepare_rename(document, at))),
            "textDocument/rename" => structure::rename(document, at, params["newName"].as_str().unwrap_or_default()),
            "textDocument/documentSymbol" => Ok(json!(structure::symbols(document))),
            "textDocument/foldingRange" => Ok(json!(structure::folds(document))),
            "textDocument/codeAction" => Ok(json!(findings::actions(document, &params))),
            "textDocument/formatting" => formatted(document).map(|text| document.edits(&text)),
            _ => return Response::new_err(id, ErrorCode::MethodNotFound as i32, format!("{method} is not known")),
        };
        match result {
            Ok(result) => Response::new_ok(id, result),
            Err(why) => Response::new_err(id, ErrorCode::RequestFailed as i32, why),
        }
    }
}

fn publication(params: Value) -> Notification {
    // `Notification::new` would serialise the parameters again.
    Notification { method: "textDocument/publishDiagnostics".to_owned(), params }
}

/// The formatted text.
fn formatted(document: &Document) -> Result<String, String> {
    let source = document.source();
    match document.kind {
        Kind::Sheet if source.text().contains(char::REPLACEMENT_CHARACTER) => {
            Err("the editor has opened the file in an encoding that it is not in: reopen it as Windows 1252".to_owned())
        }
        Kind::Sheet => Ok(normalise(source)),
        Kind::Machine => lexican_machine::format(source.text()).map_err(|error| error.to_string()),
        Kind::Overlay | Kind::Other => Ok(source.text().to_owned()),
    }
}
