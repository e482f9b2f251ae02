//! What is known of a node.

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

/// How many emergencies are remembered.
const HISTORY: usize = 100;

/// How many changes are remembered.
const CHANGES: usize = 20;

/// The heartbeats of a node since it booted, or was silent.
struct Beats {
    last: Instant,
    /// How many times between two of them were seen.
    gaps: u32,
    longest: Duration,
}

/// What has happened to a node, and is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// It was silent for so long.
    Silent(Duration),
    /// It has booted without a command of network management: its power was cut, or it has restarted by itself.
    Booted,
}

/// From how many times on between two heartbeats it is known how often they come: the first ones after a boot-up, or when the state
/// changes, come at once.
const LEARNT: u32 = 3;

/// What is done once, and again after each boot-up: a storm of boot-ups is no storm of it.
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

    /// Whether it is to be done; it counts as done then.
    pub(crate) fn begins(&mut self, now: Instant) -> bool {
        let begins = !self.is_done && self.pace.attempt(now).is_ok();
        self.is_done |= begins;
        begins
    }
}

/// What is known of a node.
#[derive(Default)]
pub(crate) struct Node {
    /// Its data sheet.
    pub(crate) sheet: Option<Sheet>,
    /// What its plant calls it.
    pub(crate) given_name: Option<String>,
    /// 1008h.
    pub(crate) device_name: Option<String>,
    /// 1018h.
    pub(crate) identity: [Option<u32>; 4],
    /// Whether it has its data sheet in it, as a text (1022h).
    pub(crate) stores_sheet: bool,
    /// Whether it has answered with its product code, or that it has none.
    pub(crate) has_said_product: bool,
    /// By its error control, or the answer of a command.
    pub(crate) state: Option<Measured<NmtState>>,
    /// Whether the last command of network management that it was given is the one to stop: without heartbeats it is not heard
    /// to be STOPPED.
    pub(crate) was_stopped: bool,
    /// Whether that command was to start anew.
    pub(crate) was_reset: bool,
    beats: Option<Beats>,
    /// The state when it was heard first.
    first_state: Option<NmtState>,
    /// The values that were seen last.
    pub(crate) values: BTreeMap<Address, Measured<view::Value>>,
    /// Whether it was asked who it is.
    pub(crate) identity_asked: Once,
    /// Whether it was asked how its PDOs are configured.
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

    /// It has booted: it may be another device, and is without faults until it says otherwise (CiA 301, 7.2.7.1).
    pub(crate) fn boot(&mut self, at: Instant) {
        self.set_state(at, NmtState::PreOperational);
        self.identity_asked.again(at);
        self.pdos_read.again(at);
        self.faults.clear();
    }

    /// A heartbeat, or a boot-up: what has happened to the node since the last one, if it was no order of anybody.
    pub(crate) fn beat(&mut self, at: Instant, state: NmtState) -> Option<Event> {
        let was_reset = std::mem::take(&mut self.was_reset);
        let known = self.beats.replace(Beats { last: at, gaps: 0, longest: Duration::ZERO });
        if state == NmtState::Initialising {
            return known.filter(|_| !was_reset).map(|_| Event::Booted);
        }
        let known = known?;
        let gap = at.since(known.last);
        // As the statistics have it: two heartbeats are missing. What is learnt begins anew then, since the time may have been changed.
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

    /// An emergency; those with codes below 0100h say that errors are gone.
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

    /// A value that was seen; `is_written` if somebody has written it.
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

    /// What 1008h, 1018h and 1022h say.
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

    /// What a client shows of it, but for what the statistics have.
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

/// A value in words.
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
