//! The WebSocket of a page: requests, answers and views.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde::Serialize;
use serde_json::Value as Json;
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::task::spawn_blocking;
use tokio::time::{Instant, sleep_until, timeout};

use super::shared::{Shared, ended};
use crate::engine::Reply;
use crate::{Answer, Client, Refused, Request};

/// How long a page may take to receive a view before it counts as lost.
const LOST: Duration = Duration::from_secs(5);
/// A view is sent after this time even without changes, so that a lost page is noticed.
const QUIET: Duration = Duration::from_secs(1);
/// How long a page may take to close its end.
const FAREWELL: Duration = Duration::from_millis(500);
/// The most requests of a page at the same time, and the most answers waiting for it.
const UNDER_WAY: usize = 16;

/// Shared by both directions of a page's connection and its open requests.
struct Line {
    shared: Arc<Shared>,
    /// The number of the client.
    number: u32,
    answers: mpsc::Sender<String>,
    /// Signals that the page has acknowledged the last view.
    seen: Notify,
}

/// A request with its number, and the permit that it holds until it is answered.
type Asked = (u64, Request, OwnedSemaphorePermit);

/// Serves a page until the page or the bench leaves, or the page is lost. Then stops what it has started.
pub(super) async fn serve(socket: WebSocket, shared: Arc<Shared>) {
    let client = Arc::new(shared.bench.open_client());
    let (sink, mut stream) = socket.split();
    let (answers, waiting) = mpsc::channel(UNDER_WAY);
    let line = Arc::new(Line { shared: Arc::clone(&shared), number: client.number(), answers, seen: Notify::new() });
    let (asked, asking) = mpsc::channel(UNDER_WAY);
    let worker = tokio::spawn(ask_in_order(Arc::clone(&client), Arc::clone(&line), asking));
    tokio::select! {
        () = write(sink, waiting, &line) => {}
        () = read(&mut stream, &client, &line, asked) => {}
    }
    worker.abort();
    client.close();
    shared.downloads.forget(line.number);
    // Unread messages would reset the connection, and the page might not see why it was closed.
    let _ = timeout(FAREWELL, async { while let Some(Ok(_)) = stream.next().await {} }).await;
}

/// Passes the requests of a page to the bench, until there are no more. Beginning some of them takes time, such as
/// searching a million frames, so this is done on threads shared by all pages. Requests that change something keep
/// their order; those that only read do not wait for them.
async fn ask_in_order(client: Arc<Client>, line: Arc<Line>, mut asking: mpsc::Receiver<Asked>) {
    while let Some((id, request, place)) = asking.recv().await {
        let only_asks = request.only_asks();
        let (client, line) = (Arc::clone(&client), Arc::clone(&line));
        let given = tokio::spawn(async move {
            if let Ok(reply) = spawn_blocking(move || client.ask(request)).await {
                tokio::spawn(conclude(id, reply, line, place));
            }
        });
        if !only_asks {
            let _ = given.await;
        }
    }
}

/// Sends the answer to a request when it has come.
async fn conclude(id: u64, reply: Reply, line: Arc<Line>, place: OwnedSemaphorePermit) {
    let outcome = reply.await;
    // Ignore an error: the page may be gone.
    let _ = line.answers.send(answer(&line, id, outcome)).await;
    drop(place);
}

/// Sends answers and views, until the page does not accept them.
async fn write(mut sink: SplitSink<WebSocket, Message>, mut answers: mpsc::Receiver<String>, line: &Line) {
    let mut fields = line.shared.fields.subscribe();
    let mut end = line.shared.end.subscribe();
    let mut message = Some(ToPage::Hello { client: line.number, version: env!("CARGO_PKG_VERSION") }.text());
    // The number of the last view sent, when that was, and whether the page still has to acknowledge it.
    let (mut number, mut sent, mut is_open) = (0, Instant::now(), false);
    loop {
        if let Some(text) = message.take() {
            let sending = sink.send(Message::Text(text.into()));
            if !matches!(timeout(LOST, sending).await, Ok(Ok(()))) {
                return;
            }
        }
        tokio::select! {
            biased;
            () = ended(&mut end) => {
                let close = CloseFrame { code: close_code::AWAY, reason: "the bench has ended".into() };
                let _ = timeout(LOST, sink.send(Message::Close(Some(close)))).await;
                return;
            }
            answer = answers.recv() => message = answer,
            () = line.seen.notified(), if is_open => is_open = false,
            () = sleep_until(sent + LOST), if is_open => return,
            changed = fields.changed(), if !is_open => {
                if changed.is_err() {
                    return;
                }
                let fields = fields.borrow_and_update();
                if fields.have_changed_since(number) || sent.elapsed() >= QUIET {
                    message = Some(fields.message_since(number));
                    (number, sent, is_open) = (fields.number(), Instant::now(), true);
                }
            }
        }
    }
}

/// Receives the page's messages, until it is gone or violates the protocol.
async fn read(stream: &mut SplitStream<WebSocket>, client: &Client, line: &Arc<Line>, asked: mpsc::Sender<Asked>) {
    // Stops have permits of their own, so that other requests cannot hold them up.
    let (places, stops) = (Arc::new(Semaphore::new(UNDER_WAY)), Arc::new(Semaphore::new(UNDER_WAY)));
    while let Some(Ok(message)) = stream.next().await {
        let text = match message {
            Message::Text(text) => text,
            Message::Ping(_) | Message::Pong(_) => continue,
            Message::Binary(_) | Message::Close(_) => return,
        };
        let Ok(mut request) = serde_json::from_str::<Json>(&text) else { return };
        if request["seen"] == true {
            line.seen.notify_one();
            continue;
        }
        let Some(id) = request["id"].take().as_u64() else { return };
        let refused = match serde_json::from_value::<Request>(request) {
            Ok(request) => {
                let is_stop = request.is_stop();
                match Arc::clone(if is_stop { &stops } else { &places }).try_acquire_owned() {
                    Ok(place) if is_stop => {
                        tokio::spawn(conclude(id, client.ask(request), Arc::clone(line), place));
                        continue;
                    }
                    // The channel has room for as many requests as there are permits.
                    Ok(place) => match asked.try_send((id, request, place)) {
                        Ok(()) => continue,
                        Err(_) => return,
                    },
                    Err(_) => Refused::new(format_args!("{UNDER_WAY} requests of this page are under way"))
                        .with_remedy("wait until one of them is over"),
                }
            }
            Err(error) => Refused::new(format_args!("this is no request: {error}")),
        };
        // Do not wait for a page that sends requests without end and reads no answers.
        if line.answers.try_send(answer(line, id, Err(refused))).is_err() {
            return;
        }
    }
}

fn answer(line: &Line, id: u64, outcome: Result<Answer, Refused>) -> String {
    let outcome = outcome.and_then(|answer| match answer {
        Answer::File { name, bytes } => {
            let length = bytes.len();
            match line.shared.downloads.offer(line.number, name.clone(), bytes) {
                Ok(url) => Ok(Content::File { name, url, bytes: length }),
                Err(error) => Err(Refused::new(format_args!("this machine has no random numbers: {error}"))),
            }
        }
        answer => Ok(Content::Other(answer)),
    });
    let outcome = match outcome {
        Ok(content) => Outcome::Answer(content),
        Err(refused) => Outcome::Refused(refused),
    };
    ToPage::Outcome { id, outcome }.text()
}

/// A message to a page, other than a view ([`Fields`](super::changes::Fields)).
#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum ToPage {
    /// The first message.
    Hello { client: u32, version: &'static str },
    /// The result of a request.
    #[serde(untagged)]
    Outcome {
        id: u64,
        #[serde(flatten)]
        outcome: Outcome,
    },
}

impl ToPage {
    fn text(&self) -> String {
        serde_json::to_string(self).expect("all of it can be written as JSON")
    }
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum Outcome {
    Answer(Content),
    Refused(Refused),
}

/// The content of an answer. A file has to be fetched from its address.
#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) enum Content {
    File {
        name: String,
        url: String,
        bytes: usize,
    },
    #[serde(untagged)]
    Other(Answer),
}
