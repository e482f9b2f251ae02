//! Reports an order: one changing line on a terminal, lines or JSON objects elsewhere.

use std::io::{IsTerminal, Write};

use indicatif::ProgressBar;
use lexican_runtime::{Duration, Instant, NodeId};
use lexican_toolbox::drive::{Look, SafeEnd, Scales};
use serde_json::{Value as Json, json};

use crate::output::{Failure, note, progress, stdout, warn};

/// Values no older than this count as current: reading state, position and velocity takes no longer on a slow bus.
const FRESH: Duration = Duration::from_millis(500);

pub(super) struct Report<'a> {
    node: NodeId,
    scales: &'a Scales<'a>,
    json: bool,
    bar: Option<ProgressBar>,
    every: Duration,
    begun: Option<Instant>,
    next: Option<Instant>,
    last: Option<Look>,
    ends: Option<Instant>,
    /// The error of writing to stdout.
    broken: Option<Failure>,
}

impl<'a> Report<'a> {
    /// Reports a look every `every`; on a terminal by a line that changes.
    pub(super) fn new(node: NodeId, scales: &'a Scales<'a>, json: bool, every: Duration) -> Self {
        let shows = !json && std::io::stderr().is_terminal();
        let bar = shows.then(|| progress("{spinner} {msg}", 0));
        Report { node, scales, json, bar, every, begun: None, next: None, last: None, ends: None, broken: None }
    }

    /// Announces what is about to be done.
    pub(super) fn order(&mut self, order: &str, value: Option<i32>, text: &str) -> Result<(), Failure> {
        let fields = json!({ "event": "order", "node": self.node.get(), "order": order, "value": value, "text": text });
        self.print(fields, &format!("node {}: {text}", self.node))
    }

    /// Takes a look, and reports it when the interval is over.
    pub(super) fn look(&mut self, look: Look) {
        if look.state.is_none() || look.position.is_none() {
            return;
        }
        self.last = Some(look);
        self.begun.get_or_insert(look.at);
        if let Some(bar) = &self.bar {
            bar.set_message(self.words(look));
            bar.tick();
        } else if self.next.is_none_or(|next| look.at >= next) {
            self.next = Some(look.at + self.every);
            if let Err(error) = self.print_look(look) {
                self.broken.get_or_insert(error);
            }
        }
    }

    fn print_look(&self, look: Look) -> Result<(), Failure> {
        self.print(self.fields("progress", look), &format!("{:>10.3}  {}", self.elapsed(look), self.words(look)))
    }

    /// Sets the time of the end, from which the age of the last values is computed.
    pub(super) fn ends_at(&mut self, now: Instant) {
        self.ends = Some(now);
    }

    /// Reports how the order has ended, and what to do about it.
    pub(super) fn close(&mut self, end: &SafeEnd, remedy: Option<String>) -> Result<(), Failure> {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        let mut fields = self.last.map_or_else(|| json!({ "event": "end" }), |look| self.fields("end", look));
        fields["node"] = json!(self.node.get());
        fields["outcome"] = json!(end.word);
        fields["text"] = json!(end.text);
        fields["remedy"] = json!(remedy);
        if let (Some(look), Some(now)) = (self.last, self.ends) {
            fields["age"] = json!(now.since(look.at).as_secs_f64());
        }
        let seen = self.last.map(|look| format!("{}{}", self.words(look), self.age(look)));
        match (remedy, self.json) {
            (Some(remedy), false) => {
                warn(format_args!("node {}: {}", self.node, end.text));
                if let Some(seen) = seen {
                    note(format_args!("node {} is in {seen}", self.node));
                }
                note(remedy);
            }
            _ => {
                let place = seen.map_or_else(String::new, |seen| format!("; {seen}"));
                self.print(fields, &format!("node {}: {}{place}", self.node, end.text))?;
            }
        }
        self.broken.take().map_or(Ok(()), Err)
    }

    /// The age of the last values as text; empty if they are current.
    fn age(&self, look: Look) -> String {
        match self.ends.map(|now| now.since(look.at)) {
            Some(age) if age > FRESH => format!(", {:.1} s ago", age.as_secs_f64()),
            _ => String::new(),
        }
    }

    fn print(&self, fields: Json, text: &str) -> Result<(), Failure> {
        let mut stdout = stdout();
        if self.json {
            writeln!(stdout, "{fields}")?;
        } else {
            writeln!(stdout, "{text}")?;
        }
        Ok(stdout.flush()?)
    }

    fn elapsed(&self, look: Look) -> f64 {
        look.at.since(self.begun.unwrap_or(look.at)).as_secs_f64()
    }

    fn fields(&self, event: &str, look: Look) -> Json {
        let mut fields = json!({
            "event": event,
            "time": self.elapsed(look),
            "state": look.state.map(|state| state.to_string()),
        });
        if let Some(position) = look.position {
            fields["position"] = json!(position);
            fields["position_text"] = json!(self.scales.position(position));
        }
        if let Some(velocity) = look.velocity {
            fields["velocity"] = json!(velocity);
            fields["velocity_text"] = json!(self.scales.velocity(velocity));
        }
        fields
    }

    /// `OPERATION ENABLED, at +5000 increments, velocity +60 rpm`.
    fn words(&self, look: Look) -> String {
        let state = look.state.map_or_else(|| "an unknown state".to_owned(), |state| state.to_string());
        let position =
            look.position.map_or_else(String::new, |position| format!(", at {}", self.scales.position(position)));
        let velocity =
            look.velocity.map_or_else(String::new, |velocity| format!(", velocity {}", self.scales.velocity(velocity)));
        format!("{state}{position}{velocity}")
    }
}
