//! What becomes of an order: a line that changes on a terminal, lines or JSON objects elsewhere.

use std::io::{IsTerminal, Write};

use indicatif::ProgressBar;
use lexican_runtime::{Duration, Instant, NodeId};
use lexican_toolbox::drive::{Ending, Look, Scales};
use serde_json::{Value as Json, json};

use crate::output::{Failure, note, progress, stdout, warn};

pub(super) struct Report<'a> {
    node: NodeId,
    scales: &'a Scales<'a>,
    json: bool,
    bar: Option<ProgressBar>,
    every: Duration,
    begun: Option<Instant>,
    next: Option<Instant>,
    last: Option<Look>,
    /// Why stdout cannot be written.
    broken: Option<Failure>,
}

impl<'a> Report<'a> {
    /// Reports a look each `every`, by a line that changes if a terminal shows it.
    pub(super) fn new(node: NodeId, scales: &'a Scales<'a>, json: bool, every: Duration) -> Self {
        let shows = !json && std::io::stderr().is_terminal();
        let bar = shows.then(|| progress("{spinner} {msg}", 0));
        Report { node, scales, json, bar, every, begun: None, next: None, last: None, broken: None }
    }

    /// Says what is about to be done, before it is.
    pub(super) fn order(&mut self, order: &str, value: Option<Json>, text: &str) -> Result<(), Failure> {
        let fields = json!({ "event": "order", "node": self.node.get(), "order": order, "value": value, "text": text });
        self.print(fields, &format!("node {}: {text}", self.node))
    }

    /// Takes a look, and reports it if it is time for that.
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

    /// Says how it has ended, and what to do about it.
    pub(super) fn ending(&mut self, ending: &Ending, text: &str) -> Result<(), Failure> {
        self.close(ending.word(), text, ending.remedy())
    }

    /// The same, of an order that was not carried out.
    pub(super) fn close(&mut self, outcome: &str, text: &str, remedy: Option<&str>) -> Result<(), Failure> {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        let mut fields = self.last.map_or_else(|| json!({ "event": "end" }), |look| self.fields("end", look));
        fields["node"] = json!(self.node.get());
        fields["outcome"] = json!(outcome);
        fields["text"] = json!(text);
        fields["remedy"] = json!(remedy);
        let place =
            self.last.filter(|_| remedy.is_none()).map_or_else(String::new, |look| format!("; {}", self.words(look)));
        match remedy {
            Some(_) if !self.json => warn(format_args!("node {}: {text}", self.node)),
            _ => self.print(fields, &format!("node {}: {text}{place}", self.node))?,
        }
        if let Some(remedy) = remedy.filter(|_| !self.json) {
            if let Some(look) = self.last {
                note(format_args!("node {} is in {}", self.node, self.words(look)));
            }
            note(remedy);
        }
        self.broken.take().map_or(Ok(()), Err)
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
