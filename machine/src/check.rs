//! Checks across lines: what cannot work although each line is valid.

use std::collections::BTreeMap;
use std::ops::Range;

use lexican_eds::Severity;
use lexican_eds::standard::{Role, role};
use lexican_eds::text::Span;
use lexican_runtime::cia301::{self, connection};
use lexican_runtime::object::Direction;
use lexican_runtime::wire::pdo::TransmissionType;
use lexican_runtime::{CobId, Duration};

use crate::at::At;
use crate::model::{Machine, Node};
use crate::read::Out;
use crate::wire::{Sent, active, period};

/// A bus load above this, in percent, is a warning.
const BUSY: f64 = 80.0;
const CONTROL_WORD: u16 = 0x6040;

/// The worst-case load of a bus, with as many stuff bits as possible.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Load {
    /// In percent, by all messages whose period is known.
    pub percent: f64,
    /// The longest time that all answers to one SYNC take.
    pub sync_chain: Duration,
    /// Messages that may come at any time and are not counted: `io.TPDO1`.
    pub unbounded: Vec<String>,
}

impl Machine {
    /// The worst-case load of the bus; `None` if its bit rate is unknown.
    #[must_use]
    pub fn load(&self) -> Option<Load> {
        let bit_rate = f64::from(self.bus.bit_rate?);
        let (mut load, mut per_second, mut chain) = (Load::default(), 0.0, 0);
        let mut add = |bits: u32, period: Duration| per_second += f64::from(bits) / period.as_secs_f64();
        if let Some(sync) = self.bus.sync {
            add(worst_bits(0), sync);
            chain += worst_bits(0);
        }
        let heartbeats = self.nodes.iter().filter_map(|node| node.heartbeat);
        for period in heartbeats.chain(self.bus.heartbeat.as_ref().map(|it| it.value)).filter(|time| !time.is_zero()) {
            add(worst_bits(1), period);
        }
        for period in self.nodes.iter().filter_map(|node| node.guarding).filter(|time| !time.is_zero()) {
            add(worst_bits(1) + worst_bits(0), period);
        }
        for sent in self.sent() {
            let bits = worst_bits(sent.state.bits().div_ceil(8).min(8));
            if sent.state.transmission.is_some_and(TransmissionType::is_synchronous) {
                chain += bits;
            }
            match period(&sent.state, self.bus.sync).filter(|time| !time.is_zero()) {
                Some(period) => add(bits, period),
                None => load.unbounded.push(format!("{}.{}", sent.node.name.value, sent.state.name)),
            }
        }
        load.percent = per_second / bit_rate * 100.0;
        load.sync_chain = Duration::from_micros((f64::from(chain) / bit_rate * 1e6) as u64);
        Some(load)
    }

    /// The PDOs on the bus: those that nodes send, and those that the manager sends by wires.
    pub(crate) fn sent(&self) -> Vec<Sent<'_>> {
        let of_nodes = self.nodes.iter().flat_map(|node| active(node, Direction::Transmit));
        let mut sent: Vec<_> = of_nodes.collect();
        let ids: Vec<_> = sent.iter().map(|it| it.state.cob_id.id()).collect();
        let received = self.nodes.iter().flat_map(|node| active(node, Direction::Receive));
        // An RPDO that the file does not mention is sent by nobody.
        sent.extend(received.filter(|it| it.place.is_some() && !ids.contains(&it.state.cob_id.id())));
        sent
    }
}

/// The most bits of a frame with an 11-bit identifier and this many bytes: one stuff bit after the first five bits,
/// then one after every four (ISO 11898-1).
fn worst_bits(bytes: u32) -> u32 {
    let stuffed = 34 + 8 * bytes;
    stuffed + 13 + (stuffed - 1) / 4
}

pub(crate) fn check(machine: &Machine, out: &mut Out) {
    if machine.nodes.is_empty() && !out.findings.has_errors() {
        let help = Some("each one is a table [node.NAME] with id and sheet".to_owned());
        out.wrong("machine::node-id", &(0..0), "the machine has no nodes", help);
    }
    cob_ids(machine, out);
    error_control(machine, out);
    load(machine, out);
}

/// Reports COB-IDs with several senders, and RPDOs without a sender.
fn cob_ids(machine: &Machine, out: &mut Out) {
    let mut senders: BTreeMap<CobId, Sent<'_>> = BTreeMap::new();
    for node in &machine.nodes {
        for sent in active(node, Direction::Transmit) {
            let id = sent.state.cob_id.id();
            let at = sent.place.map_or_else(|| node.name.span.clone(), range);
            let what = format!("{}.{} is sent with {id}h", node.name.value, sent.state.name);
            let is_emcy = |other: &&Node| other.id.is_some_and(|it| CobId::of_node(connection::EMCY, it) == id);
            if let Some(other) = machine.nodes.iter().find(is_emcy) {
                let help = Some("give it another one: cob-id".to_owned());
                out.wrong("machine::cob-id", &at, format!("{what}, as the EMCY of {}", other.name.value), help);
            }
            match senders.get(&id) {
                Some(other) => {
                    let what = format!("{what}, as {}.{}", other.node.name.value, other.state.name);
                    let help = Some("give one of them another one: tpdo.N = { cob-id = … }".to_owned());
                    out.wrong("machine::cob-id", &at, what, help);
                }
                None => drop(senders.insert(id, sent)),
            }
        }
    }
    // An RPDO that no node sends is never received, unless the manager sends it.
    for node in &machine.nodes {
        for Sent { state, place, .. } in active(node, Direction::Receive) {
            let (id, name) = (state.cob_id.id(), state.name);
            let is_managers = node.id.and_then(|node| name.predefined(node)).is_none_or(|predefined| predefined == id);
            if let (Some(place), false, false) = (place, is_managers, senders.contains_key(&id)) {
                let node = &node.name.value;
                let what = format!("{node}.{name} is received with {id}h, which no node of the machine sends");
                out.push(Severity::Note, "machine::cob-id", &range(place), what, None);
            }
        }
    }
}

/// Reports nodes that are not watched, and drives that would not notice the loss of the manager.
fn error_control(machine: &Machine, out: &mut Out) {
    if let (Some(heartbeat), None) = (&machine.bus.heartbeat, machine.bus.manager) {
        let help = Some("give it one: [bus] manager = 127".to_owned());
        out.wrong("machine::error-control", &heartbeat.span, "a manager without node-ID has no heartbeat", help);
    }
    if let Some(manager) = machine.bus.manager
        && let Some(node) = machine.nodes.iter().find(|node| node.id == Some(manager))
    {
        let what = format!("{} has the node-ID of the manager", node.name.value);
        out.wrong("machine::node-id", &node.name.span, what, None);
    }
    for node in &machine.nodes {
        let Some(device) = node.device() else { continue };
        let At { value: name, span: at } = &node.name;
        if node.heartbeat.is_some() && !node.has(cia301::PRODUCER_HEARTBEAT_TIME, 0) {
            let help = Some("let it be guarded instead: guarding = \"100 ms\"".to_owned());
            let what = format!("the data sheet of {name} has no heartbeat (1017h)");
            out.wrong("machine::error-control", at, what, help);
        }
        let (is_guarded, is_watching) = (node.life_time().is_some(), machine.watches_manager(node).is_some());
        let beat = machine.bus.heartbeat.as_ref().map(|heartbeat| heartbeat.value);
        let is_drive = role(device, CONTROL_WORD, 0) == Some(Role::Command);
        match node.protection {
            Some(Duration::ZERO) => {}
            Some(_) if !is_watching => {
                let what = format!("{name} cannot watch its manager, whose heartbeat it would need (1016h)");
                let help = "[bus] manager = 127, heartbeat = \"200 ms\"; a guarded node notices it by the guard time";
                out.wrong("machine::protection", at, what, Some(help.to_owned()));
            }
            Some(time) if beat.is_some_and(|beat| time <= beat) => {
                let what = format!("the protection of {name} is no longer than the heartbeat of the manager");
                out.wrong("machine::protection", at, what, Some("two heartbeats are the least".to_owned()));
            }
            None if is_drive && !is_guarded && !is_watching => {
                let what = format!("{name} is a drive that does not notice when its manager is gone");
                let help = match node.has(cia301::CONSUMER_HEARTBEAT_TIME, 1) {
                    true => "let it watch the manager: [bus] manager = 127, heartbeat = \"200 ms\"",
                    false => "let it be guarded: guarding = \"100 ms\"",
                };
                let help = format!("{help}; protection = \"none\" if it need not");
                out.push(Severity::Warning, "machine::protection", at, what, Some(help));
            }
            _ => {}
        }
    }
}

/// Reports a bus load that is too high.
fn load(machine: &Machine, out: &mut Out) {
    let Some(load) = machine.load() else { return };
    if load.percent > BUSY {
        let severity = if load.percent > 100.0 { Severity::Error } else { Severity::Warning };
        let help = "a higher bit rate, longer heartbeats, or PDOs that are sent less often".to_owned();
        let what = format!("the bus is busy for {:.0} % of the time in the worst case", load.percent);
        out.push(severity, "machine::load", &(0..0), what, Some(help));
    }
    if let Some(sync) = machine.bus.sync
        && load.sync_chain > sync
    {
        let what = format!("the answers to a SYNC take up to {}, and the next one comes after {sync}", load.sync_chain);
        out.wrong("machine::sync", &(0..0), what, Some("a higher bit rate, or a longer period of SYNC".to_owned()));
    }
}

fn range(span: Span) -> Range<usize> {
    span.start as usize..span.end as usize
}
