//! Records requests as lines of the command, and plays such lines over the bench's own link.

use std::sync::mpsc::{Sender, channel};

use lexican_runtime::{Duration, Instant, NodeId};
use tokio::sync::oneshot;

use super::bench::{Bench, Player};
use super::jobs::Job;
use super::lock::lock;
use crate::request::{Answer, Refused, Request, Verb};

/// A request that is being recorded.
pub(super) struct Asked {
    text: String,
    at: Instant,
    has_no_end: bool,
}

impl Bench {
    fn player(&self) -> Result<&dyn Player, Refused> {
        self.check_writable()?;
        self.0.player.as_deref().ok_or_else(|| Refused::new("this bench knows no sequences"))
    }

    /// Begins recording, or ends it and returns [`Answer::File`].
    pub(super) fn record(&self, on: bool) -> Result<Answer, Refused> {
        self.player()?;
        let before = std::mem::replace(&mut *lock(&self.0.recorded), on.then(Default::default));
        lock(&self.0.model).kept.recorded = on.then_some(0);
        Ok(match before.filter(|_| !on) {
            Some((text, _)) => Answer::File { name: "recorded.seq".to_owned(), bytes: text.into() },
            None => Answer::Done,
        })
    }

    /// The line for a request, while recording.
    pub(super) fn line(&self, request: &Request) -> Option<Asked> {
        let text = lock(&self.0.recorded).is_some().then(|| self.player().ok()?.line(request))??;
        let has_no_end = matches!(request, Request::Drive { order: Verb::Run, .. });
        Some(Asked { text, at: self.0.ports.now(), has_no_end })
    }

    /// Notes that a recorded request has ended.
    pub(super) fn note(&self, asked: Option<Asked>, was_stopped: bool, result: &Result<Answer, Refused>) {
        let mut recorded = lock(&self.0.recorded);
        let (Some(Asked { text, at, has_no_end }), Some((lines, last))) = (asked, recorded.as_mut()) else { return };
        let now = self.0.ports.now();
        match last.replace(now) {
            Some(last) if at < last => *lines += "# Given before the line above had ended:\n",
            // A shorter pause was not made by a person.
            Some(last) if at.since(last) >= Duration::from_millis(100) => {
                *lines += &format!("wait {:.1}s\n", at.since(last).as_secs_f64());
            }
            _ => {}
        }
        *lines += &match result {
            Ok(_) if has_no_end => format!("{text} --for {:.1}s\n", now.since(at).as_secs_f64()),
            // When played, this line would run to its own end.
            Ok(_) if was_stopped => format!("# {text}: a stop has ended it\n"),
            Ok(_) => text + "\n",
            Err(refused) => format!("# {text}: {}\n", refused.why.replace('\n', " ")),
        };
        let count = &mut lock(&self.0.model).kept.recorded;
        *count = count.map(|count| count + 1);
    }

    /// Ends the sequence that is being played, if any.
    pub(super) fn end_play(&self) {
        if let Some(link) = lock(&self.0.playing).take() {
            self.0.ports.cut(link);
        }
    }

    /// Plays a sequence, and stops all drives at the end, however it comes; [`Answer::File`] holds the output. A
    /// message of the machine is a single line, after which no drive is stopped.
    pub(super) fn play(&self, client: u32, name: &str, text: Option<String>, job: &Job) -> Result<Answer, Refused> {
        let player = self.player()?;
        let kept = lock(&self.0.model).kept.clone();
        let is_in = |names: &[String]| text.is_none() && names.iter().any(|known| known == name);
        let is_message = is_in(&kept.messages);
        if text.is_none() && !is_message && !is_in(&kept.sequences) {
            return Err(Refused::new(format_args!("the machine lists no sequence {name}")));
        }
        let (port, begun) = (self.link_of(client), self.0.ports.now());
        let link = port.number();
        if *lock(&self.0.playing).get_or_insert(link) != link {
            return Err(Refused::new("a sequence is played already").with_remedy("wait for it, or stop it"));
        }
        let lines = player.read(name, text, Box::new(port)).inspect_err(|_| self.end_play())?;
        let (all, mut report) = (lines.len(), String::new());
        let check = || (*lock(&self.0.playing) == Some(link)).then_some(()).ok_or_else(Refused::interrupted);
        let ended = lines.into_iter().enumerate().try_for_each(|(at, line)| {
            job.progress(at as f64 / all as f64, line.text.clone());
            let _held = self.hold(client, line.nodes)?;
            check()?;
            report += &format!("{:>10.3}  {}\n", self.0.ports.now().since(begun).as_secs_f64(), line.text);
            let (printed, result) = (line.run)();
            report += &printed;
            check()?;
            result.map_err(|refused| Refused { why: format!("{}: {}", line.text, refused.why), ..refused })
        });
        if is_message {
            self.end_play();
            return ended.map(|()| Answer::Done);
        }
        let (sender, stand) = oneshot::channel();
        self.stop_all(move |result| drop(sender.send(result)));
        let stand = stand.blocking_recv().unwrap_or_else(|_| Err(Refused::interrupted()));
        ended.and(stand)?;
        job.end(true, format!("{all} lines; the drives stand"));
        let name = name.rsplit(['/', '\\']).next().unwrap_or(name);
        Ok(Answer::File { name: format!("{name}.txt"), bytes: report.into() })
    }

    /// Keeps the bench from talking to these nodes until the result is dropped, because an SDO server has one client.
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
