//! Prints the events of a simulated device as text or JSON.

use std::io::{self, Write};

use lexican_eds::model::Device;
use lexican_runtime::device::Misconfigured;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Frame, Instant, NodeId};
use serde_json::{Map, Value as Json, json};

use crate::output;
use lexican_toolbox::decode::{Decoded, Decoder, Detail, Sdo, Side};
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub(super) received: u64,
    pub(super) sent: u64,
    pub(super) writes: u64,
    pub(super) refusals: u64,
}

pub(super) struct Report<'a> {
    decoder: Decoder<'a>,
    device: &'a Device,
    /// The name in events of a plant, besides the node-ID; `None` for a single device.
    name: Option<&'a str>,
    is_alone: bool,
    /// The node-ID in the machine's file.
    given: Option<NodeId>,
    node: Option<NodeId>,
    state: Option<NmtState>,
    json: bool,
    /// Whether to print reads and PDOs.
    all: bool,
    pub(super) counts: Counts,
    /// Whether another node with the same node-ID was heard.
    has_duplicate: bool,
}

impl<'a> Report<'a> {
    pub(super) fn new(device: &'a Device, json: bool, all: bool) -> Self {
        Report {
            decoder: Decoder::new(),
            device,
            name: None,
            is_alone: true,
            given: None,
            node: None,
            state: None,
            json,
            all,
            counts: Counts::default(),
            has_duplicate: false,
        }
    }

    /// Makes events name the device, for a plant with several.
    pub(super) fn among_others(self, given: Option<NodeId>, name: Option<&'a str>) -> Self {
        Report { given, name, is_alone: false, ..self }
    }

    pub(super) fn received(&mut self, at: Instant, frame: &Frame) -> io::Result<()> {
        let decoded = self.decoder.decode(frame);
        if !self.concerns(&decoded) {
            return Ok(());
        }
        self.counts.received += 1;
        if !decoded.is_from_node() || frame.is_remote() {
            return self.frame(at, &decoded);
        }
        if std::mem::replace(&mut self.has_duplicate, true) {
            return Ok(());
        }
        let node = self.node.map_or_else(String::new, |node| format!(" {node}"));
        let text = format!("there is another node{node} on the bus: it has sent {} {}", frame.id(), decoded.name);
        self.event(at, "two-nodes", &text, json!({}))
    }

    pub(super) fn sent(&mut self, at: Instant, frame: &Frame) -> io::Result<()> {
        let decoded = self.decoder.decode(frame);
        self.counts.sent += 1;
        self.frame(at, &decoded)
    }

    /// Reports changes of node-ID and state.
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

    pub(super) fn event(&self, at: Instant, event: &str, text: &str, fields: Json) -> io::Result<()> {
        self.print(at, event, text, output::fields(fields))
    }

    /// Reports an entry that the device cannot serve as configured.
    pub(super) fn misconfigured(&self, at: Instant, fault: &Misconfigured) -> io::Result<()> {
        let values = DeviceValues::new(self.device);
        let entry = ValueReport::without_value(Some(&values), fault.address);
        let text = format!("the configuration is inconsistent: {}: {}", entry.title(), fault.reason);
        self.print(at, "misconfigured", &text, entry.refusal(fault.reason))
    }

    fn concerns(&self, decoded: &Decoded) -> bool {
        decoded.node.is_none() || decoded.node == self.node
    }

    fn frame(&mut self, at: Instant, decoded: &Decoded) -> io::Result<()> {
        match &decoded.detail {
            Detail::Sdo(sdo) => self.transfer(at, sdo),
            Detail::Nmt(command) => {
                let fields = json!({ "command": command.to_string() });
                self.event(at, "nmt", &format!("NMT: {}", decoded.text), fields)
            }
            Detail::Emcy(_) => self.event(at, "emcy", &format!("EMCY {}", decoded.text), decoded.detail.fields()),
            Detail::ErrorControl { state: NmtState::Initialising, .. } => {
                self.event(at, "boot-up", "boot-up", json!({}))
            }
            Detail::Pdo(_) if self.all => {
                self.event(at, "pdo", &format!("{} {}", decoded.name, decoded.text), decoded.detail.fields())
            }
            Detail::LssRequest(_) | Detail::LssResponse(_) => {
                self.event(at, "lss", &format!("{}: {}", decoded.name, decoded.text), decoded.detail.fields())
            }
            _ => Ok(()),
        }
    }

    /// Reports a transfer when it ends.
    fn transfer(&mut self, at: Instant, sdo: &Sdo) -> io::Result<()> {
        let Some(report) = sdo.report.as_ref().filter(|_| sdo.complete) else { return Ok(()) };
        if let Some(code) = sdo.abort {
            self.counts.refusals += 1;
            let (event, who) = match sdo.side {
                Side::Server => ("refused", "refused"),
                Side::Client => ("aborted", "aborted by the client"),
            };
            let what = if sdo.writes == Some(true) { "write" } else { "read" };
            let mut fields = report.refusal(code);
            fields.insert("access".to_owned(), json!(what));
            return self.print(at, event, &format!("{who} to {what} {}: {code}", report.title()), fields);
        }
        if sdo.writes == Some(true) {
            self.counts.writes += 1;
            return self.print(at, "written", &format!("written {}", report.equation()), report.json());
        }
        if self.all { self.print(at, "read", &format!("read {}", report.equation()), report.json()) } else { Ok(()) }
    }

    /// The device in events of a plant: `node 5 feeder`.
    pub(super) fn who(&self) -> String {
        let node = self.node.or(self.given).map_or_else(|| "no node-ID".to_owned(), |node| format!("node {node}"));
        self.name.map_or(node.clone(), |name| format!("{node} {name}"))
    }

    fn print(&self, at: Instant, event: &str, text: &str, mut fields: Map<String, Json>) -> io::Result<()> {
        fields.insert("node".to_owned(), json!(self.node.or(self.given).map(NodeId::get)));
        if let Some(name) = self.name {
            fields.insert("device_name".to_owned(), json!(name));
        }
        let who = if self.is_alone { String::new() } else { format!("{}: ", self.who()) };
        print(self.json, at, event, (&who, text), fields)
    }
}

/// Prints an event of a device or of the bus.
pub(super) fn print(
    json: bool,
    at: Instant,
    event: &str,
    (who, text): (&str, &str),
    mut fields: Map<String, Json>,
) -> io::Result<()> {
    let mut stdout = anstream::stdout().lock();
    if json {
        // Entries with a value have a text already.
        fields.entry("text").or_insert_with(|| json!(text));
        fields.entry("node").or_insert(Json::Null);
        fields.insert("time".to_owned(), json!(at.since(Instant::ZERO).as_secs_f64()));
        fields.insert("event".to_owned(), json!(event));
        writeln!(stdout, "{}", Json::Object(fields))?;
    } else {
        // A text of several lines is a table.
        let is_table = text.contains('\n');
        let gap = if is_table && who.is_empty() { "" } else { "  " };
        let end = if is_table { "\n" } else { "" };
        writeln!(stdout, "{:>12}{gap}{who}{end}{text}", at.to_string())?;
    }
    stdout.flush()
}
