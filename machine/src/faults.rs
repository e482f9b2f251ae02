//! The simulation of nodes, and faults between them.

use std::fmt::{self, Display};
use std::num::NonZeroU32;
use std::path::PathBuf;

use lexican_eds::Source;
use lexican_runtime::CobId;
use lexican_runtime::host::Fate;

use crate::at::At;
use crate::file;
use crate::files::Files;
use crate::model::{Node, Setting};
use crate::nodes::{place, settings};
use crate::read::{Named, Out};

/// How a node is simulated.
#[derive(Clone, Debug, Default)]
pub struct Simulated {
    /// Initial values in wire form, also of objects that are read-only.
    pub settings: Vec<Setting>,
    /// Inputs of a drive's simulation: `blocked = true`.
    pub inputs: Vec<At<String>>,
    /// The file that keeps what the node stores.
    pub eeprom: Option<PathBuf>,
    /// A script of events: the file with its text.
    pub script: Option<Source>,
    /// The steps of a script, given in the machine's file.
    pub steps: Vec<At<toml::Table>>,
    /// Whether it is switched off at the beginning.
    pub is_off: bool,
}

/// A fault that affects some frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The sender, as a position among the nodes; `None` for all nodes and the world outside.
    pub sender: Option<usize>,
    /// `None` for all frames.
    pub id: Option<CobId>,
    /// Which of these frames: 1 for each one, 2 for every second one, and so on.
    pub every: u32,
    /// The number of frames affected in a row, the last of which is the one that `every` counts.
    pub in_a_row: u32,
    /// What happens to the frames.
    pub fate: Fate,
}

/// `4 of 20 frames with COB-ID 707h are lost`.
impl Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.in_a_row, self.every) {
            (some, all) if some == all => write!(f, "all frames")?,
            (some, all) => write!(f, "{some} of {all} frames")?,
        }
        if let Some(id) = self.id {
            write!(f, " with COB-ID {id}h")?;
        }
        match self.fate {
            Fate::Deliver => write!(f, " come as they are"),
            Fate::Lose => write!(f, " are lost"),
            Fate::Repeat => write!(f, " come twice"),
            Fate::Replace(other) => write!(f, " come as {other}"),
            Fate::Delay(span) => write!(f, " are {} ms late", span.as_micros() / 1000),
        }
    }
}

/// Gives the nodes their simulation as in the file.
pub(crate) fn simulate(nodes: &mut [Node], given: Vec<Named<file::Simulated>>, files: Files<'_>, out: &mut Out) {
    for Named { name, table: it, .. } in given {
        let Some(at) = place(nodes, &name.value, &name.span, out) else { continue };
        let node = &mut nodes[at];
        if let (Some(script), false) = (&it.script, it.step.is_empty()) {
            out.wrong("machine::script", &script.span, "a node has either a script or steps", None);
        }
        let script = it.script.and_then(|path| {
            let read = files.read(&path.value);
            read.map_err(|error| out.wrong("machine::script", &path.span, error.to_string(), None)).ok()
        });
        let settings = node.device().map_or_else(Vec::new, |device| settings(device, None, &it.settings, out));
        node.simulated = Simulated {
            settings,
            inputs: it.inputs,
            eeprom: it.eeprom.map(|path| files.path(&path)),
            script,
            steps: it.step,
            is_off: it.power == file::Power::Off,
        };
    }
}

/// The faults in the file.
pub(crate) fn of(faults: Vec<file::Fault>, nodes: &[Node], out: &mut Out) -> Vec<Fault> {
    faults.into_iter().filter_map(|fault| one(&fault, nodes, out)).collect()
}

fn one(fault: &file::Fault, nodes: &[Node], out: &mut Out) -> Option<Fault> {
    let sender = match &fault.from {
        Some(name) => Some(place(nodes, &name.value, &name.span, out)?),
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
        (file::Action::Lose, None) => Fate::Lose,
        (file::Action::Repeat, None) => Fate::Repeat,
        (action, _) => {
            wrong(match action {
                file::Action::Delay => "a delay needs its time: delay = \"20 ms\"",
                _ => "the time of a delay belongs to action = \"delay\"",
            });
            return None;
        }
    };
    let [every, in_a_row] = [fault.every, fault.in_a_row].map(|number| number.map_or(1, NonZeroU32::get));
    if in_a_row > every {
        wrong("there cannot be more in a row than there are frames: in-a-row is at most every");
        return None;
    }
    Some(Fault { sender, id, every, in_a_row, fate })
}
