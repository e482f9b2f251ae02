//! Events of a machine, with the names of nodes.

use std::collections::BTreeMap;
use std::fmt;

use lexican_eds::model;
use lexican_runtime::host::{BusState, tokio as shell};
use lexican_runtime::manager::{self, NetworkEvent};
use lexican_runtime::object::Direction;
use lexican_runtime::procedure::BootError;
use lexican_runtime::wire::emcy::Emergency;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, NodeId};
use lexican_toolbox::decode::content;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

use crate::model::Machine;
use crate::wire::active;

/// An event of a machine. `Display` is one line.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The name of the node, or its node-ID if the file does not have it. For events of a whole bus, the name of the
    /// bus, if it has one.
    pub node: Option<String>,
    /// What has happened.
    pub what: What,
}

/// The kind of an event.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "`Display` says what it is")]
pub enum What {
    BootedUp,
    Booted,
    Failed(BootError),
    Ready,
    BootTimeElapsed,
    State(NmtState),
    Lost,
    BootLoop,
    Emergency(Emergency),
    /// The node has sent a PDO with these values.
    Pdo(Vec<ValueReport>),
    Bus(BusState),
    /// This many frames or events were lost because the program was too slow.
    Missed(u64),
}

impl What {
    /// One word: `booted-up`, `emergency`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            What::BootedUp => "booted-up",
            What::Booted => "booted",
            What::Failed(_) => "failed",
            What::Ready => "ready",
            What::BootTimeElapsed => "boot-time-elapsed",
            What::State(_) => "state",
            What::Lost => "lost",
            What::BootLoop => "boot-loop",
            What::Emergency(_) => "emergency",
            What::Pdo(_) => "pdo",
            What::Bus(_) => "bus",
            What::Missed(_) => "missed",
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(node) = &self.node {
            write!(f, "{node}: ")?;
        }
        match &self.what {
            What::BootedUp => f.write_str("boot-up"),
            What::Booted => f.write_str("has booted"),
            What::Failed(error) => write!(f, "{error}"),
            What::Ready => f.write_str("the machine is ready"),
            What::BootTimeElapsed => f.write_str("the boot time is over"),
            What::State(state) => write!(f, "{state}"),
            What::Lost => f.write_str("is lost"),
            What::BootLoop => f.write_str("boots again and again, or is lost each time; from now on with a pause"),
            What::Emergency(Emergency { code, register, .. }) => {
                write!(f, "EMCY {code}, error register = {:02X}h", register.0)
            }
            What::Pdo(values) => f.write_str(&values.iter().map(ValueReport::brief).collect::<Vec<_>>().join(", ")),
            What::Bus(state) => write!(f, "the bus is {state}"),
            What::Missed(number) => write!(f, "{number} frames or events are missing"),
        }
    }
}

/// For each COB-ID of a PDO, the position of its sender, and its mapping.
pub(super) type Pdos = BTreeMap<CobId, (usize, Vec<model::Mapped>)>;

impl Machine {
    pub(super) fn pdos(&self) -> Pdos {
        let sent =
            |at: usize| active(&self.nodes[at], Direction::Transmit).into_iter().map(move |sent| (at, sent.state));
        let row = |(at, state): (usize, lexican_toolbox::pdo::PdoState)| {
            let mapped = state.mapping.iter().map(|it| model::Mapped {
                index: it.address.index(),
                sub: it.address.sub(),
                bits: it.bits,
            });
            (state.cob_id.id(), (at, mapped.collect()))
        };
        (0..self.nodes.len()).flat_map(sent).map(row).collect()
    }

    /// The event with names; `None` if users of a machine need not know it.
    pub(super) fn named(&self, pdos: &Pdos, event: shell::Event) -> Option<Event> {
        let of = |node: NodeId, what| Some(Event { node: Some(self.name_of(node)), what });
        let of_all = |what| Some(Event { node: self.bus.name.as_ref().map(|name| name.value.clone()), what });
        match event {
            shell::Event::Bus(state) => of_all(What::Bus(state)),
            shell::Event::Gap(frames) => of_all(What::Missed(frames.into())),
            shell::Event::Manager(event) => match event {
                manager::Event::BootedUp { node } => of(node, What::BootedUp),
                manager::Event::Lost { node } => of(node, What::Lost),
                manager::Event::Emergency { node, emergency } => of(node, What::Emergency(emergency)),
                manager::Event::Pdo { frame, .. } => {
                    let (at, mapping) = pdos.get(&frame.id())?;
                    let node = &self.nodes[*at];
                    let values = content(&mut DeviceValues::new(node.device()?), mapping, frame.data());
                    Some(Event { node: Some(node.name.value.clone()), what: What::Pdo(values) })
                }
                manager::Event::Network(event) => match event {
                    NetworkEvent::Booted(node) => of(node, What::Booted),
                    NetworkEvent::Failed { node, error, .. } => of(node, What::Failed(error)),
                    NetworkEvent::Ready => of_all(What::Ready),
                    NetworkEvent::BootTimeElapsed => of_all(What::BootTimeElapsed),
                    NetworkEvent::StateChanged { node, state } => of(node, What::State(state)),
                    NetworkEvent::Lost { node, .. } => of(node, What::Lost),
                    NetworkEvent::BootLoop(node) => of(node, What::BootLoop),
                    // The manager reports this as an event of its own.
                    NetworkEvent::BootedUp(_) => None,
                },
                _ => None,
            },
        }
    }

    fn name_of(&self, id: NodeId) -> String {
        let node = self.nodes.iter().find(|node| node.id == Some(id));
        node.map_or_else(|| id.to_string(), |node| node.name.value.clone())
    }
}
