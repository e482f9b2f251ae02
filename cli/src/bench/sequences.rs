//! The bench's sequences: understands and runs their lines.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use lexican_bench::engine::{Line, Player};
use lexican_bench::request::{Refused, Request};
use lexican_eds::Source;
use lexican_machine::Node;
use lexican_runtime::NodeId;
use lexican_runtime::host::Link;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::text::files::read;

use crate::bus::{Bus, lend};
use crate::output::{Outcome, kept};
use crate::run::{Context, Lines};

pub(super) struct Sequences {
    pub(super) context: Arc<Context>,
    /// The nodes that the URL of the bus describes.
    pub(super) nodes: Vec<(NodeId, DataSheet)>,
}

impl Player for Sequences {
    fn line(&self, request: &Request) -> Option<String> {
        let json = serde_json::to_value(request).ok()?;
        let word = |field: &str| json[field].as_str().unwrap_or_default().trim().to_owned();
        let id = json["node"].as_u64().map(|id| id.to_string());
        let is_it = |node: &&Node| node.id.is_some_and(|it| Some(it.to_string()) == id);
        let named = self.context.machine.as_ref().and_then(|machine| machine.nodes.iter().find(is_it));
        let who = named.map(|node| node.name.value.clone()).or(id).unwrap_or_else(|| "--all".to_owned());
        let words = match request {
            Request::Drive { .. } => vec!["drive".to_owned(), who, word("order"), word("value")],
            Request::Write { force, .. } => {
                let force = if *force { "--force" } else { "" };
                vec!["write".to_owned(), who, word("address"), word("text"), force.to_owned()]
            }
            Request::Nmt { .. } => vec!["nmt".to_owned(), word("command"), who],
            _ => return None,
        };
        shlex::try_join(words.iter().map(String::as_str).filter(|word| !word.is_empty())).ok()
    }

    fn read(&self, name: &str, text: Option<String>, link: Box<dyn Link + Send>) -> Result<Vec<Line>, Refused> {
        let message = || self.context.machine.as_ref()?.messages.get(name).cloned();
        let source = text.or_else(message).map_or_else(|| read(name.as_ref()), |text| Ok(Source::new(name, text)));
        let lines = Lines::read(&source.map_err(Refused::new)?, &self.context);
        let lines = lines.map_err(|wrong| Refused::new(wrong).with_remedy("nothing was done"))?;
        lend(self.context.bus.url(), Bus::of(link, self.nodes.clone())).map_err(Refused::new)?;
        let line = |line: crate::run::Line| {
            let (text, nodes) = (format!("{}: {}", line.number, line.text), line.step.nodes(self.context.shell));
            let context = Arc::clone(&self.context);
            let run = Box::new(move || {
                let (result, printed) = kept(|| line.step.carry_out(&context, &AtomicBool::new(false)));
                let result = match result {
                    Ok(Outcome::Clean) => Ok(()),
                    Ok(_) => Err(Refused::new(printed.lines().last().unwrap_or("it has found something"))),
                    Err(failure) => {
                        let (why, remedy) = failure.words();
                        Err(Refused { why: why.to_owned(), remedy: remedy.map(str::to_owned) })
                    }
                };
                (printed, result)
            });
            Line { text, nodes, run }
        };
        Ok(lines.steps.into_iter().map(line).collect())
    }
}
