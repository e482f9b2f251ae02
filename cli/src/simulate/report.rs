//! What happens to a simulated device, on stdout: in words, or as JSON.

use std::io::{self, Write};

use lexican_eds::model::Device;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Frame, Instant, NodeId};
use serde_json::{Map, Value as Json, json};

use crate::decode::{Decoded, Decoder, Detail, Sdo, Side};
use crate::output;
use crate::values::told::Told;

/// What has happened so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub(super) received: u64,
    pub(super) sent: u64,
    pub(super) writes: u64,
    pub(super) refusals: u64,
}

/// Tells of the device, and counts.
pub(super) struct Report<'a> {
    decoder: Decoder<'a>,
    device: &'a Device,
    node: Option<NodeId>,
    state: Option<NmtState>,
    json: bool,
    /// Whether reads and PDOs are told, too.
    all: bool,
    pub(super) counts: Counts,
    /// Whether somebody else was heard with the same node-ID.
    twin: bool,
}

impl<'a> Report<'a> {
    pub(super) fn new(device: &'a Device, json: bool, all: bool) -> Self {
        let counts = Counts::default();
        Report { decoder: Decoder::new(), device, node: None, state: None, json, all, counts, twin: false }
    }

    /// The device has heard a frame.
    pub(super) fn received(&mut self, at: Instant, frame: &Frame) -> io::Result<()> {
        let decoded = self.decoder.decode(frame);
        if !self.concerns(&decoded) {
            return Ok(());
        }
        self.counts.received += 1;
        if !decoded.is_from_node() || frame.is_remote() {
            return self.tell(at, &decoded);
        }
        // Once is enough: the other one goes on.
        if std::mem::replace(&mut self.twin, true) {
            return Ok(());
        }
        let node = self.node.map_or_else(String::new, |node| format!(" {node}"));
        let text =
            format!("there is another node{node} on the bus: somebody else sent {} {}", frame.id(), decoded.name);
        self.event(at, "two-nodes", &text, json!({}))
    }

    /// The device has sent a frame.
    pub(super) fn sent(&mut self, at: Instant, frame: &Frame) -> io::Result<()> {
        let decoded = self.decoder.decode(frame);
        self.counts.sent += 1;
        self.tell(at, &decoded)
    }

    /// The device is what it is now.
    pub(super) fn follow(&mut self, at: Instant, node: Option<NodeId>, state: Option<NmtState>) -> io::Result<()> {
        if let Some(node) = node.filter(|node| self.node != Some(*node)) {
            self.decoder.introduce(node, self.device);
            if self.node.is_some() {
                self.event(at, "node-id", &format!("it is node {node} now"), json!({}))?;
            }
            self.node = Some(node);
        }
        if std::mem::replace(&mut self.state, state) == state {
            return Ok(());
        }
        let name = state.map(|state| state.to_string());
        let text = name.clone().unwrap_or_else(|| "not on the bus".to_owned());
        self.event(at, "state", &text, json!({ "state": name }))
    }

    /// Something happened that no frame tells.
    pub(super) fn event(&self, at: Instant, event: &str, text: &str, fields: Json) -> io::Result<()> {
        self.say(at, event, text, output::fields(fields))
    }

    fn concerns(&self, decoded: &Decoded) -> bool {
        decoded.node.is_none() || decoded.node == self.node
    }

    fn tell(&mut self, at: Instant, decoded: &Decoded) -> io::Result<()> {
        match &decoded.detail {
            Detail::Sdo(sdo) => self.transfer(at, sdo),
            Detail::Nmt(command) => {
                let fields = json!({ "command": command.to_string() });
                self.event(at, "nmt", &format!("NMT: {}", decoded.text), fields)
            }
            Detail::Emcy(_) => {
                let fields = decoded.detail.json().map(|(_, fields)| fields).unwrap_or_default();
                self.event(at, "emcy", &format!("EMCY {}", decoded.text), fields)
            }
            Detail::ErrorControl { state: NmtState::Initialising, .. } => {
                self.event(at, "boot-up", "boot-up", json!({}))
            }
            Detail::Pdo(_) if self.all => {
                let fields = decoded.detail.json().map(|(_, fields)| fields).unwrap_or_default();
                self.event(at, "pdo", &format!("{} {}", decoded.name, decoded.text), fields)
            }
            Detail::LssRequest(_) | Detail::LssResponse(_) => {
                let fields = decoded.detail.json().map(|(_, fields)| fields).unwrap_or_default();
                self.event(at, "lss", &format!("{}: {}", decoded.name, decoded.text), fields)
            }
            _ => Ok(()),
        }
    }

    /// A transfer that is over.
    fn transfer(&mut self, at: Instant, sdo: &Sdo) -> io::Result<()> {
        let Some(told) = sdo.told.as_ref().filter(|_| sdo.complete) else { return Ok(()) };
        if let Some(code) = sdo.abort {
            self.counts.refusals += 1;
            let (event, who) = match sdo.side {
                Side::Server => ("refused", "refused"),
                Side::Client => ("aborted", "given up"),
            };
            let what = if sdo.writes == Some(true) { "write" } else { "read" };
            let mut fields = told.refusal(code);
            fields.insert("access".to_owned(), json!(what));
            return self.say(at, event, &format!("{who} to {what} {}: {code}", told.title()), fields);
        }
        if sdo.writes == Some(true) {
            self.counts.writes += 1;
            return self.say(at, "written", &equation("written", told), told.json());
        }
        if self.all { self.say(at, "read", &equation("read", told), told.json()) } else { Ok(()) }
    }

    fn say(&self, at: Instant, event: &str, text: &str, mut fields: Map<String, Json>) -> io::Result<()> {
        let mut stdout = anstream::stdout().lock();
        if self.json {
            // A value has words of its own under this name.
            fields.entry("text").or_insert_with(|| json!(text));
            fields.insert("time".to_owned(), json!(at.since(Instant::ZERO).as_secs_f64()));
            fields.insert("event".to_owned(), json!(event));
            fields.insert("node".to_owned(), json!(self.node.map(NodeId::get)));
            writeln!(stdout, "{}", Json::Object(fields))?;
        } else {
            // What has several lines is a table.
            let gap = if text.contains('\n') { "\n" } else { "  " };
            writeln!(stdout, "{:>12}{gap}{text}", at.to_string())?;
        }
        stdout.flush()
    }
}

fn equation(verb: &str, told: &Told) -> String {
    format!("{verb} {} = {}", told.title(), told.words())
}
