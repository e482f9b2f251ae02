//! How nodes are simulated, and what goes wrong between them.

use std::num::NonZeroU32;
use std::ops::Range;
use std::path::PathBuf;

use lexican_eds::Source;
use lexican_runtime::host::Fate;
use lexican_runtime::{CobId, NodeId};

use crate::at::At;
use crate::file;
use crate::files::Files;
use crate::model::{Node, Setting};
use crate::nodes::settings;
use crate::read::{Named, Out, similar};

/// How a node is simulated.
#[derive(Debug, Default)]
pub struct Simulated {
    /// What it has before it boots for the first time, in wire form.
    pub settings: Vec<Setting>,
    /// Inputs of a drive: `blocked = true`.
    pub inputs: Vec<Text>,
    /// The file for what it stores.
    pub eeprom: Option<PathBuf>,
    /// A script of events: a file and its text.
    pub script: Option<Source>,
    /// The steps of a script.
    pub steps: Vec<Step>,
    /// Whether it is switched off at first.
    pub is_off: bool,
}

/// A text, and where the file has it.
#[derive(Clone, Debug)]
pub struct Text {
    /// The text.
    pub text: String,
    /// Its bytes in the file.
    pub span: Range<usize>,
}

/// A step of a script, and where the file has it.
#[derive(Clone, Debug)]
pub struct Step {
    /// Its keys.
    pub keys: toml::Table,
    /// Its bytes in the file.
    pub span: Range<usize>,
}

/// What goes wrong on the bus.
#[derive(Clone, Debug)]
pub struct Fault {
    /// Only frames of this node: its place among the nodes.
    pub sender: Option<usize>,
    /// Only frames with this identifier.
    pub id: Option<CobId>,
    /// Each so manyth of them.
    pub every: u32,
    /// So many one after another.
    pub in_a_row: u32,
    /// What happens to them.
    pub fate: Fate,
}

/// Gives nodes what the file says of their simulation.
pub(crate) fn simulate(nodes: &mut [Node], given: Vec<Named<file::Simulated>>, files: Files<'_>, out: &mut Out) {
    for Named { name, table: it, .. } in given {
        let Some(place) = position(nodes, &name.value, &name.span, out) else { continue };
        let node = &mut nodes[place];
        if let (Some(script), false) = (&it.script, it.step.is_empty()) {
            out.wrong("machine::script", &script.span, "a node has either a script or steps", None);
        }
        let script = it.script.and_then(|path| {
            let read = files.read(&path.value);
            read.map_err(|error| out.wrong("machine::script", &path.span, error.to_string(), None)).ok()
        });
        let id = node.id.unwrap_or(NodeId::literal(1));
        let settings = node.device().map_or_else(Vec::new, |device| settings(device, id, &it.settings, out));
        node.simulated = Simulated {
            settings,
            inputs: it.inputs.into_iter().map(|At { value, span }| Text { text: value, span }).collect(),
            eeprom: it.eeprom.map(|path| files.path(&path)),
            script,
            steps: it.step.into_iter().map(|At { value, span }| Step { keys: value, span }).collect(),
            is_off: it.power == file::Power::Off,
        };
    }
}

/// The faults of the file.
pub(crate) fn of(faults: Vec<file::Fault>, nodes: &[Node], out: &mut Out) -> Vec<Fault> {
    faults.into_iter().filter_map(|fault| one(&fault, nodes, out)).collect()
}

fn one(fault: &file::Fault, nodes: &[Node], out: &mut Out) -> Option<Fault> {
    let sender = match &fault.from {
        Some(name) => Some(position(nodes, &name.value, &name.span, out)?),
        None => None,
    };
    let id = match &fault.cob_id {
        Some(raw) => {
            let id = u16::try_from(raw.value).ok().and_then(CobId::standard).or_else(|| CobId::extended(raw.value));
            if id.is_none() {
                out.wrong("machine::fault", &raw.span, format!("{:X}h is no COB-ID", raw.value), None);
            }
            Some(id?)
        }
        None => None,
    };
    let mut wrong = |what: &str| out.wrong("machine::fault", &fault.action.span, what, None);
    let fate = match (fault.action.value, &fault.delay) {
        (file::Action::Delay, Some(time)) => Fate::Delay(time.value.0),
        (file::Action::Delay, None) => {
            wrong("a delay needs its time: delay = \"20 ms\"");
            return None;
        }
        (_, Some(_)) => {
            wrong("the time of a delay belongs to action = \"delay\"");
            return None;
        }
        (file::Action::Lose, None) => Fate::Lose,
        (file::Action::Repeat, None) => Fate::Repeat,
    };
    let [every, in_a_row] = [fault.every, fault.in_a_row].map(|number| number.map_or(1, NonZeroU32::get));
    if in_a_row > every {
        wrong("there cannot be more in a row than there are frames: in-a-row is at most every");
        return None;
    }
    Some(Fault { sender, id, every, in_a_row, fate })
}

fn position(nodes: &[Node], name: &str, at: &Range<usize>, out: &mut Out) -> Option<usize> {
    let found = nodes.iter().position(|node| node.name.value == name);
    if found.is_none() {
        let help = similar(name, nodes.iter().map(|node| node.name.as_str()));
        out.wrong("machine::name", at, format!("there is no node {name:?}"), help);
    }
    found
}
