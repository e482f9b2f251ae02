//! A language server for CANopen: data sheets (EDS, DCF), overlays, and the file of a machine.
//!
//! [`serve`] answers a client over any [`Connection`]. All that it says comes from the rules, the model, the keys of overlays and the
//! schema of a machine, so an editor shows what `lexican eds lint`, `machine check` and `machine schema` print. Texts are those of the
//! client, in Unicode, whatever encoding their files are in.
//!
//! A text is judged when no further change of it waits. Messages are JSON as the protocol has it; where a function returns one of its
//! structures, its documentation names it.

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
/// Errors: if the client breaks the protocol when the session begins or ends.
pub fn serve(connection: &Connection) -> Result<(), ProtocolError> {
    let (id, params) = connection.initialize_start()?;
    let offered = params["capabilities"]["general"]["positionEncodings"].as_array();
    let (encoding, columns): (_, fn(char) -> usize) = match offered.is_some_and(|all| all.contains(&json!("utf-8"))) {
        true => ("utf-8", char::len_utf8),
        false => ("utf-16", char::len_utf16),
    };
    connection.initialize_finish(id, introduction(encoding))?;
    let mut server = Server { documents: BTreeMap::new(), columns };
    // A client that is gone is noticed when nothing comes from it any more.
    let send = |message: Message| drop(connection.sender.send(message));
    loop {
        let next = connection.receiver.try_recv();
        // An answer is about the text as it is now, and so is what is shown while nothing comes.
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
    /// How many columns a character takes.
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

    /// Takes a notification; a text that is closed has no findings any more.
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
    // Its `new` would copy the parameters.
    Notification { method: "textDocument/publishDiagnostics".to_owned(), params }
}

/// The text in its usual form.
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
