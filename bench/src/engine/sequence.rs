//! Sequences: what somebody does becomes lines of the command, and such lines are played over the bench's own link.

use std::sync::mpsc::{Sender, channel};

use lexican_runtime::host::Link;
use lexican_runtime::{Duration, Instant, NodeId};
use tokio::sync::oneshot;

use super::bench::Bench;
use super::jobs::Job;
use super::lock::lock;
use crate::request::{Answer, Refused, Request, Verb};

/// What understands lines: the command whose lines they are.
pub trait Player: Send + Sync {
    /// A request as a line, if there is one that does the same.
    fn line(&self, request: &Request) -> Option<String>;

    /// Understands a sequence before any of its lines runs, over this link. Without its text, it is one of the machine's.
    fn read(&self, name: &str, text: Option<String>, link: Box<dyn Link + Send>) -> Result<Vec<Line>, Refused>;
}

/// A line that can run.
pub struct Line {
    /// `3: drive feeder move-to 50 mm`.
    pub text: String,
    /// The nodes that it talks to; all without them.
    pub nodes: Option<Vec<NodeId>>,
    /// Runs it: what it prints, and whether it is fulfilled.
    pub run: Box<dyn FnOnce() -> (String, Result<(), Refused>) + Send>,
}

/// Something that was asked for while it was recorded.
pub(super) struct Recorded {
    text: String,
    given: Instant,
    ended: Instant,
    has_no_end: bool,
}

impl Bench {
    fn player(&self) -> Result<&dyn Player, Refused> {
        self.check_writable()?;
        self.0.player.as_deref().ok_or_else(|| Refused::new("this bench knows no sequences"))
    }

    /// Begins to record, or ends it: then [`Answer::File`].
    pub(super) fn record(&self, on: bool) -> Result<Answer, Refused> {
        self.player()?;
        let before = std::mem::replace(&mut *lock(&self.0.recorded), on.then(Vec::new));
        lock(&self.0.model).kept.recorded = on.then_some(0);
        Ok(match before.filter(|_| !on) {
            Some(lines) => Answer::File { name: "recorded.seq".to_owned(), bytes: sequence(lines).into() },
            None => Answer::Done,
        })
    }

    /// What is asked for as a line, if it is recorded.
    pub(super) fn line(&self, request: &Request) -> Option<Recorded> {
        let text = lock(&self.0.recorded).is_some().then(|| self.player().ok()?.line(request))??;
        let has_no_end = matches!(request, Request::Drive { order: Verb::Run, .. });
        let given = self.0.ports.now();
        Some(Recorded { text, given, ended: given, has_no_end })
    }

    /// What was asked for has ended.
    pub(super) fn note(&self, line: Option<Recorded>, was_stopped: bool, result: &Result<Answer, Refused>) {
        let mut recorded = lock(&self.0.recorded);
        let (Some(mut line), Some(lines)) = (line, recorded.as_mut()) else { return };
        line.ended = self.0.ports.now();
        line.text = match result {
            Ok(_) if line.has_no_end => {
                format!("{} --for {:.1}s", line.text, line.ended.since(line.given).as_secs_f64())
            }
            // Played, it would go on to its own end.
            Ok(_) if was_stopped => format!("# {}: a stop has ended it", line.text),
            Ok(_) => line.text,
            Err(refused) => format!("# {}: {}", line.text, refused.why.replace('\n', " ")),
        };
        lines.push(line);
        lock(&self.0.model).kept.recorded = u32::try_from(lines.len()).ok();
    }

    /// Ends the sequence that is played, if one is.
    pub(super) fn end_play(&self) {
        if let Some(link) = lock(&self.0.playing).take() {
            self.0.ports.cut(link);
        }
    }

    /// Plays a sequence; [`Answer::File`] says what its lines have printed. However it ends, all drives are told to stop.
    pub(super) fn play(&self, client: u32, name: &str, text: Option<String>, job: &Job) -> Result<Answer, Refused> {
        let player = self.player()?;
        if text.is_none() && !lock(&self.0.model).kept.sequences.iter().any(|known| known == name) {
            return Err(Refused::new(format_args!("the machine lists no sequence {name}")));
        }
        let (port, begun) = (self.link_of(client), self.0.ports.now());
        let link = port.number();
        if *lock(&self.0.playing).get_or_insert(link) != link {
            return Err(Refused::new("a sequence is played already").with_remedy("wait for it, or stop it"));
        }
        let mut report = String::new();
        let ended = player.read(name, text, Box::new(port)).and_then(|lines| {
            let all = lines.len();
            for (at, line) in lines.into_iter().enumerate() {
                job.progress(at as f64 / all as f64, line.text.clone());
                report += &format!("{:>10.3}  {}\n", self.0.ports.now().since(begun).as_secs_f64(), line.text);
                let _held = self.hold(client, line.nodes)?;
                let (printed, result) = (line.run)();
                report += &printed;
                if *lock(&self.0.playing) != Some(link) {
                    return Err(Refused::interrupted());
                }
                result.map_err(|refused| Refused { why: format!("{}: {}", line.text, refused.why), ..refused })?;
            }
            Ok(all)
        });
        let (sender, stand) = oneshot::channel();
        self.stop_all(move |result| drop(sender.send(result)));
        let stand = stand.blocking_recv().unwrap_or_else(|_| Err(Refused::interrupted()));
        let lines = ended.and_then(|lines| stand.map(|_| lines))?;
        job.end(true, format!("{lines} lines; the drives stand"));
        Ok(Answer::File { name: format!("{name}.txt"), bytes: report.into() })
    }

    /// Keeps the bench from talking to nodes, until what is returned is dropped: an SDO server has one client.
    fn hold(&self, client: u32, nodes: Option<Vec<NodeId>>) -> Result<Vec<Sender<()>>, Refused> {
        let nodes = nodes.unwrap_or_else(|| lock(&self.0.model).nodes().collect());
        let hold = |node| {
            let ((release, released), (hold, held)) = (channel::<()>(), channel());
            self.worker(node)?.ask(client, move |_| {
                let _ = hold.send(());
                let _ = released.recv();
            });
            held.recv().map(|()| release).map_err(|_| Refused::interrupted())
        };
        nodes.into_iter().map(hold).collect()
    }
}

/// Lines as a sequence: one after another, with the pauses between them.
fn sequence(mut lines: Vec<Recorded>) -> String {
    lines.sort_by_key(|line| line.given);
    let (mut text, mut last) = (String::new(), None);
    for line in lines {
        match last {
            Some(last) if line.given < last => text += "# Given before the line above had ended:\n",
            // A shorter pause is none of a person's.
            Some(last) if line.given.since(last) >= Duration::from_millis(100) => {
                text += &format!("wait {:.1}s\n", line.given.since(last).as_secs_f64());
            }
            _ => {}
        }
        text += &(line.text + "\n");
        last = last.max(Some(line.ended));
    }
    text
}
