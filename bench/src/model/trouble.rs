//! Finds what is wrong on the bus, and which node causes it.

use std::collections::BTreeMap;

use lexican_runtime::NodeId;
use lexican_runtime::host::BusState;
use lexican_toolbox::bus::statistics::Report;
use lexican_toolbox::decode::duplicates::Evidence;

use super::node::Event;
use crate::view;

/// The load from which on a bus counts as full: frames of low priority then wait for long.
const FULL_PERCENT: f64 = 70.0;

/// A COB-ID with more than this share of all bits is named as the cause.
const SHARE_PERCENT: f64 = 40.0;

/// More aborted transfers of a node than this are a trouble.
const ABORTS: u32 = 20;

/// The troubles, with the times since when they exist.
#[derive(Default)]
pub(crate) struct Troubles {
    duplicates: BTreeMap<(NodeId, Evidence), (f64, u64)>,
    /// The last row of the trace that shows a kind of trouble, by its node if it has one.
    rows: BTreeMap<(Kind, Option<u8>), u64>,
    since: BTreeMap<(Kind, Option<u8>), f64>,
    /// Past troubles by node: how often, and when last.
    past: BTreeMap<(Kind, NodeId), Past>,
}

struct Past {
    count: u32,
    last: view::Trouble,
}

/// The kind of a trouble.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// The CAN controller is not error active.
    State,
    /// Frames were lost between the controller and the bench.
    Missing,
    /// A node is silent; the row is its last sign of life.
    Silent,
    /// A node boots again and again.
    Boots,
    /// A node refuses many transfers.
    Aborts,
    /// The bus is full.
    Load,
}

/// A trouble found: kind, node and text.
struct Found {
    kind: Kind,
    node: Option<u8>,
    text: String,
}

impl Found {
    /// Identifies a trouble over time: a full bus is the same trouble whichever node fills it.
    fn key(&self) -> (Kind, Option<u8>) {
        (self.kind, self.node.filter(|_| self.kind != Kind::Load))
    }
}

impl Troubles {
    /// Notes a suspicion that two nodes have the same node-ID.
    pub(crate) fn suspect(&mut self, seconds: f64, row: u64, node: NodeId, evidence: Evidence) {
        self.duplicates.entry((node, evidence)).or_insert((seconds, row));
    }

    /// Notes a row that shows a possible trouble.
    pub(crate) fn see(&mut self, kind: Kind, node: Option<NodeId>, row: u64) {
        self.rows.insert((kind, node.map(NodeId::get)), row);
    }

    /// Notes a past event, which stays until it is acknowledged.
    pub(crate) fn remember(&mut self, seconds: f64, row: u64, node: NodeId, event: Event) {
        let kind = match event {
            Event::Silent(_) => Kind::Silent,
            Event::Booted => Kind::Boots,
        };
        let count = self.past.get(&(kind, node)).map_or(0, |past| past.count) + 1;
        let (since, text) = match event {
            Event::Silent(gap) => {
                let again = if count > 1 { format!(", the last of {count} times") } else { String::new() };
                let text = format!("node {node} was silent for {:.1} s, and is heard again{again}", gap.as_secs_f64());
                (seconds - gap.as_secs_f64(), text)
            }
            Event::Booted if count > 1 => {
                (seconds, format!("node {node} has booted {count} times without a command: its supply may fail"))
            }
            Event::Booted => {
                let text = "has booted without a command: its power was cut, or it has restarted by itself";
                (seconds, format!("node {node} {text}"))
            }
        };
        let last = view::Trouble { since, node: Some(node.get()), text, row: Some(row), is_over: true };
        self.past.insert((kind, node), Past { count, last });
    }

    /// Acknowledges past troubles.
    pub(crate) fn acknowledge(&mut self) {
        self.past.clear();
    }

    /// The present troubles, and past ones that are not acknowledged.
    pub(crate) fn view(
        &mut self,
        now: f64,
        state: Option<BusState>,
        report: &Report,
        rates: &[view::Rate],
    ) -> Vec<view::Trouble> {
        let found = find(state, report, rates);
        self.since.retain(|key, _| found.iter().any(|found| found.key() == *key));
        let mut troubles: Vec<_> = found
            .into_iter()
            .map(|found| view::Trouble {
                since: *self.since.entry(found.key()).or_insert(now),
                row: self.rows.get(&found.key()).copied(),
                node: found.node,
                text: found.text,
                is_over: false,
            })
            .collect();
        troubles.extend(self.duplicates.iter().map(|((node, evidence), (since, row))| view::Trouble {
            since: *since,
            node: Some(node.get()),
            text: format!("there may be two nodes {node}: {evidence}"),
            row: Some(*row),
            is_over: false,
        }));
        // A trouble that continues is shown as present only.
        let is_present = |key: &(Kind, NodeId)| self.since.contains_key(&(key.0, Some(key.1.get())));
        let past = self.past.iter().filter(|(key, _)| !is_present(key)).map(|(_, past)| past);
        troubles.extend(past.map(|past| past.last.clone()));
        troubles
    }
}

fn find(state: Option<BusState>, report: &Report, rates: &[view::Rate]) -> Vec<Found> {
    let mut found = Vec::new();
    let mut add = |kind, node, text| found.push(Found { kind, node, text });
    if let Some(state) = state.filter(|state| *state != BusState::Active) {
        let why = if state.carries_frames() {
            "look at the bit rate, the cable and its two resistors"
        } else {
            "nothing gets through"
        };
        add(Kind::State, None, format!("the bus is {state}: {why}"));
    }
    if report.missing_frames > 0 {
        let text = format!(
            "{} frames were lost on the way from the controller: this machine is too busy",
            report.missing_frames
        );
        add(Kind::Missing, None, text);
    }
    for node in &report.nodes {
        let id = node.node;
        if let Some(seconds) = node.silent_seconds {
            let text =
                format!("node {id} is silent for {seconds:.1} s: it has lost its power or its cable, or has restarted");
            add(Kind::Silent, Some(id), text);
        }
        if node.sdo_aborts > ABORTS {
            let text = format!(
                "node {id} has {} refused SDO transfers: somebody asks for what it does not have",
                node.sdo_aborts
            );
            add(Kind::Aborts, Some(id), text);
        }
    }
    if let Some(load) = report.load_percent_last_second.filter(|load| *load > FULL_PERCENT) {
        let loudest = rates.iter().max_by(|one, two| one.share_percent.total_cmp(&two.share_percent));
        let loudest = loudest.filter(|rate| rate.share_percent > SHARE_PERCENT);
        let who = loudest.map_or_else(String::new, |rate| {
            format!(
                ": {} ({}h) has {:.0} % of it, {:.0} frames in a second",
                rate.name, rate.id, rate.share_percent, rate.per_second
            )
        });
        add(Kind::Load, loudest.and_then(|rate| rate.node), format!("the load is {load:.0} %{who}"));
    }
    found
}
