//! A page: its commands, the answers, the views.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value as Json, json};
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::task::spawn_blocking;
use tokio::time::{Instant, sleep_until, timeout};

use super::shared::{Shared, ended};
use crate::engine::Reply;
use crate::{Answer, Command, Face, Refused};

/// How long a page may take for a view; then it is lost.
const LOST: Duration = Duration::from_secs(5);
/// After how long a page is sent a view although nothing has changed, so that a lost one is noticed.
const QUIET: Duration = Duration::from_secs(1);
/// How long a page may take to close its end, too.
const FAREWELL: Duration = Duration::from_millis(500);
/// The most commands of a page that are carried out at once, and as many answers that wait for it.
const UNDER_WAY: usize = 16;

/// What the halves of a page's connection share with the commands that are under way.
struct Line {
    shared: Arc<Shared>,
    /// The number of its face.
    number: u32,
    answers: mpsc::Sender<String>,
    /// The last view was taken.
    seen: Notify,
}

/// A command with its number, and the place that it takes until it is answered.
type Asked = (u64, Command, OwnedSemaphorePermit);

/// Serves a page until it or the bench leaves, or it is lost. What it started is stopped then.
pub(super) async fn serve(socket: WebSocket, shared: Arc<Shared>) {
    let face = Arc::new(shared.bench.open_face());
    let (sink, mut stream) = socket.split();
    let (answers, waiting) = mpsc::channel(UNDER_WAY);
    let line = Arc::new(Line { shared: Arc::clone(&shared), number: face.number(), answers, seen: Notify::new() });
    let (asked, asking) = mpsc::channel(UNDER_WAY);
    let worker = tokio::spawn(ask_in_order(Arc::clone(&face), Arc::clone(&line), asking));
    tokio::select! {
        () = write(sink, waiting, &line) => {}
        () = read(&mut stream, &face, &line, asked) => {}
    }
    worker.abort();
    face.close();
    shared.downloads.forget(line.number);
    // What the page has sent and nobody has read would reset the connection, and the page might not see why it was closed.
    let _ = timeout(FAREWELL, async { while let Some(Ok(_)) = stream.next().await {} }).await;
}

/// Gives the commands of a page to the bench, until there are no more. Some take their time before they are begun, such as to search a
/// million frames: these are given on threads that all pages share. Commands that change something keep their order; those that only read do not wait for them.
async fn ask_in_order(face: Arc<Face>, line: Arc<Line>, mut asking: mpsc::Receiver<Asked>) {
    while let Some((id, command, place)) = asking.recv().await {
        let only_asks = command.only_asks();
        let (face, line) = (Arc::clone(&face), Arc::clone(&line));
        let given = tokio::spawn(async move {
            if let Ok(reply) = spawn_blocking(move || face.ask(command)).await {
                tokio::spawn(conclude(id, reply, line, place));
            }
        });
        if !only_asks {
            let _ = given.await;
        }
    }
}

/// Sends the answer to a command when it is there.
async fn conclude(id: u64, reply: Reply, line: Arc<Line>, place: OwnedSemaphorePermit) {
    let outcome = reply.await;
    // Nobody waits for it when the page is gone.
    let _ = line.answers.send(answer(&line, id, outcome)).await;
    drop(place);
}

/// Sends answers and views, until the page does not take them.
async fn write(mut sink: SplitSink<WebSocket, Message>, mut answers: mpsc::Receiver<String>, line: &Line) {
    let mut fields = line.shared.fields.subscribe();
    let mut end = line.shared.end.subscribe();
    let hello = json!({ "hello": { "face": line.number, "version": env!("CARGO_PKG_VERSION") } });
    let mut message = Some(hello.to_string());
    // The view that was sent last, when that was, and whether the page has still to take it.
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

/// Takes the page's messages, until it is gone or does not keep to the protocol.
async fn read(stream: &mut SplitStream<WebSocket>, face: &Face, line: &Arc<Line>, asked: mpsc::Sender<Asked>) {
    // A stop finds a place, whatever else is under way.
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
        let refused = match serde_json::from_value::<Command>(request) {
            Ok(command) => {
                let is_stop = command.is_stop();
                match Arc::clone(if is_stop { &stops } else { &places }).try_acquire_owned() {
                    Ok(place) if is_stop => {
                        tokio::spawn(conclude(id, face.ask(command), Arc::clone(line), place));
                        continue;
                    }
                    // As many commands may wait as there are places.
                    Ok(place) => match asked.try_send((id, command, place)) {
                        Ok(()) => continue,
                        Err(_) => return,
                    },
                    Err(_) => Refused::new(format_args!("{UNDER_WAY} commands of this page are under way"))
                        .with_remedy("wait until one of them is over"),
                }
            }
            Err(error) => Refused::new(format_args!("this is no command: {error}")),
        };
        // A page that asks without end, and takes no answer, is not waited for.
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
                Ok(url) => Ok(json!({ "file": { "name": name, "url": url, "bytes": length } })),
                Err(error) => Err(Refused::new(format_args!("this machine has no random numbers: {error}"))),
            }
        }
        answer => Ok(json!(answer)),
    });
    match outcome {
        Ok(answer) => json!({ "id": id, "answer": answer }),
        Err(refused) => json!({ "id": id, "refused": refused }),
    }
    .to_string()
}
