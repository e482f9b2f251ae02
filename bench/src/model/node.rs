//! The model of a node.

use std::collections::{BTreeMap, VecDeque};

use lexican_runtime::manager::Pace;
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, Instant, Measured, cia301};
use lexican_toolbox::node::stored;
use lexican_toolbox::values::hex;
use lexican_toolbox::values::report::ValueReport;
use lexican_toolbox::values::wire::encode;

use super::age::seconds;
use crate::sheet::Sheet;
use crate::view;

/// The manufacturer device name (CiA 301, 7.5.2.9).
pub(crate) const DEVICE_NAME: u16 = 0x1008;

/// The most emergencies remembered.
const HISTORY: usize = 100;

/// The most changes remembered.
const CHANGES: usize = 20;

/// The heartbeats of a node since it booted or was silent.
struct Beats {
    last: Instant,
    /// The number of intervals seen.
    gaps: u32,
    longest: Duration,
}

/// Something that has happened to a node and is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// It was silent for this long.
    Silent(Duration),
    /// It has booted without an NMT command: it lost power, or restarted by itself.
    Booted,
}

/// The number of intervals after which the heartbeat period is known. The first heartbeats after a boot-up or a change
/// of state may come early.
const LEARNT: u32 = 3;

/// Something to do once, and again after each boot-up, but at growing intervals if the node boots again and again.
#[derive(Default)]
pub(crate) struct Once {
    is_done: bool,
    pace: Pace,
}

impl Once {
    fn again(&mut self, now: Instant) {
        self.is_done = false;
        self.pace.note(now);
    }

    /// Whether it is to be done now; it counts as done from then on.
    pub(crate) fn begins(&mut self, now: Instant) -> bool {
        let begins = !self.is_done && self.pace.attempt(now).is_ok();
        self.is_done |= begins;
        begins
    }
}

#[derive(Default)]
pub(crate) struct Node {
    pub(crate) sheet: Option<Sheet>,
    /// The name in the plant.
    pub(crate) given_name: Option<String>,
    /// 1008h.
    pub(crate) device_name: Option<String>,
    /// 1018h.
    pub(crate) identity: [Option<u32>; 4],
    /// Whether it stores its data sheet as text (1022h).
    pub(crate) stores_sheet: bool,
    /// Whether it has answered which product code it has, or that it has none.
    pub(crate) has_said_product: bool,
    /// From its error control.
    pub(crate) state: Option<Measured<NmtState>>,
    /// Whether the last NMT command to it was to stop: without heartbeats, its state STOPPED is not reported.
    pub(crate) was_stopped: bool,
    /// Whether the last NMT command to it was a reset.
    pub(crate) was_reset: bool,
    beats: Option<Beats>,
    /// The first state that was heard.
    first_state: Option<NmtState>,
    /// The last values seen.
    pub(crate) values: BTreeMap<Address, Measured<view::Value>>,
    /// When to read the identity.
    pub(crate) identity_asked: Once,
    /// When to read the PDO configuration.
    pub(crate) pdos_read: Once,
    faults: Vec<view::Fault>,
    history: VecDeque<view::Fault>,
    changes: VecDeque<String>,
}

impl Node {
    pub(crate) fn name(&self) -> String {
        let sheet =
            || self.sheet.map(|sheet| sheet.device.info.product_name.clone().unwrap_or_else(|| sheet.name.to_owned()));
        self.given_name.clone().or_else(|| self.device_name.clone()).or_else(sheet).unwrap_or_default()
    }

    /// Handles a boot-up: it may be another device now, and has no fault until it reports one (CiA 301, 7.2.7.1).
    pub(crate) fn boot(&mut self, at: Instant) {
        self.set_state(at, NmtState::PreOperational);
        self.identity_asked.again(at);
        self.pdos_read.again(at);
        self.faults.clear();
    }

    /// Handles a heartbeat or boot-up; returns what has happened since the last one without a command.
    pub(crate) fn beat(&mut self, at: Instant, state: NmtState) -> Option<Event> {
        let was_reset = std::mem::take(&mut self.was_reset);
        let known = self.beats.replace(Beats { last: at, gaps: 0, longest: Duration::ZERO });
        if state == NmtState::Initialising {
            return known.filter(|_| !was_reset).map(|_| Event::Booted);
        }
        let known = known?;
        let gap = at.since(known.last);
        // As in the statistics, this means that two heartbeats are missing. Then the period is learnt again, since it
        // may have changed.
        if known.gaps >= LEARNT && gap.as_micros() * 2 > known.longest.as_micros() * 5 {
            return Some(Event::Silent(gap));
        }
        self.beats = Some(Beats { last: at, gaps: known.gaps.saturating_add(1), longest: known.longest.max(gap) });
        None
    }

    pub(crate) fn set_state(&mut self, at: Instant, state: NmtState) {
        self.was_stopped &= state == NmtState::Stopped;
        self.first_state.get_or_insert(state);
        self.state = Some(Measured::new(state, at));
    }

    /// Adds an emergency; a code below 0100h means that errors are gone.
    pub(crate) fn add_fault(&mut self, code: u16, fault: view::Fault) {
        if code >> 8 == 0 {
            self.faults.clear();
            return;
        }
        self.faults.retain(|known| known.code != fault.code);
        self.faults.push(fault.clone());
        self.history.push_front(fault);
        self.history.truncate(HISTORY);
    }

    /// Takes a value; `is_written` if somebody has written it.
    pub(crate) fn see(&mut self, at: Instant, report: &ValueReport, is_written: bool) -> Measured<view::Value> {
        let seen = Measured::new(value(seconds(at), report), at);
        let value = &seen.value;
        self.learn(report);
        let before = self.values.insert(report.address, seen.clone()).map(|before| before.value);
        let is_process_data = report.address.index() == 0x6040;
        if is_written && !is_process_data && before.as_ref().is_none_or(|before| before.raw != value.raw) {
            let before = before.map_or_else(String::new, |before| format!(", before {}", before.text));
            self.changes.push_front(format!("{}: written{before}", report.equation()));
            self.changes.truncate(CHANGES);
        }
        seen
    }

    /// Learns from 1008h, 1018h and 1022h.
    fn learn(&mut self, report: &ValueReport) {
        let Some(raw) = &report.raw else { return };
        match (report.address.index(), report.address.sub()) {
            (DEVICE_NAME, 0) => {
                let name = String::from_utf8_lossy(raw).trim_matches(['\0', ' ']).to_owned();
                self.device_name = Some(name).filter(|name| !name.is_empty());
            }
            (cia301::IDENTITY, sub @ 1..=4) => {
                let number = raw.iter().take(4).rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte));
                let known = &mut self.identity[usize::from(sub) - 1];
                if let Some(before) = known.replace(number).filter(|before| *before != number) {
                    self.changes
                        .push_front(format!("another device: {} was {before:X}h, now {number:X}h", report.title()));
                    self.changes.truncate(CHANGES);
                }
            }
            _ if report.address == stored::FORM => self.stores_sheet = raw.first() == Some(&stored::TEXT),
            _ => {}
        }
    }

    /// The node in the view, without the fields from the statistics.
    pub(crate) fn view(&self, id: u8) -> view::Node {
        let mut changes: Vec<String> = self.changes.iter().cloned().collect();
        if let (Some(first), Some(state)) = (self.first_state, self.state)
            && first != state.value
        {
            changes.insert(0, format!("state: {first} at first, now {}", state.value));
        }
        view::Node {
            id,
            name: self.name(),
            sheet: self.sheet.map(|sheet| sheet.name.to_owned()),
            stores_sheet: self.stores_sheet && self.sheet.is_none(),
            identity: self.identity,
            state: self.state.map(|state| state.value.to_string()),
            faults: self.faults.clone(),
            history: self.history.iter().cloned().collect(),
            lacks: self.sheet.map(|sheet| sheet.shown_lacks.to_vec()).unwrap_or_default(),
            changes,
            ..view::Node::default()
        }
    }
}

/// A value in the view.
pub(crate) fn value(at: f64, report: &ValueReport) -> view::Value {
    let encoded = || encode(report.data_type?, report.value.as_ref()?);
    view::Value {
        address: report.address.to_string(),
        text: report.text().to_owned(),
        number: lexican_toolbox::trace::series::number(report),
        raw: report.raw.clone().or_else(encoded).map(|raw| hex(&raw)).unwrap_or_default(),
        at,
        is_error: false,
    }
}
