//! The model of the bus, without I/O, threads or clock: frames with their times go in, a [`View`] comes out.

mod age;
mod drive;
mod node;
mod objects;
mod own;
mod plot;
mod rates;
mod standstill;
mod trace;
mod trouble;

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};

use lexican_runtime::host::BusState;
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{Duration, Frame, Instant, Measured, NodeId};
use lexican_toolbox::bus::statistics::Statistics;
use lexican_toolbox::bus::transfers::{End, Transfer, Transfers};
use lexican_toolbox::decode::duplicates::DuplicateNodes;
use lexican_toolbox::decode::{Decoded, Decoder, Detail};
use lexican_toolbox::drive::Look;
use lexican_toolbox::node::identity::{PRODUCT, recognise};
use lexican_toolbox::trace::sampler::Signal;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::report::ValueReport;

use crate::sheet::Sheet;
use crate::view::{self, View};
use node::{Node, Once};
use own::Own;
use plot::{Plot, Watched};
use rates::Rates;
use trace::{Trace, is_part};
use trouble::{Kind, Troubles};

pub(crate) use age::DRIVE;
use age::seconds;
pub(crate) use drive::{Drive, watched};
pub(crate) use node::{DEVICE_NAME, value};
pub(crate) use standstill::Braking;
pub use trace::{Page, Which};

/// The most rows of the trace that are kept.
const ROWS: usize = 1_000_000;

/// The most ended jobs that are shown.
const ENDED_JOBS: usize = 8;

/// Name and properties of a bus.
#[derive(Clone, Debug, Default)]
pub struct BusInfo {
    /// `can0`, `demo`, `bus.log`.
    pub name: String,
    /// Whether frames can be sent.
    pub is_writable: bool,
    /// In bit/s; `None` if unknown.
    pub bit_rate: Option<u32>,
}

/// The model of a bus, made from its frames.
pub struct Model {
    info: BusInfo,
    began: Instant,
    now: Instant,
    /// See [`Link::latency`](lexican_runtime::host::Link::latency).
    latency: Duration,
    state: Option<BusState>,
    /// Why the bus was lost.
    lost: Option<String>,
    decoder: Decoder<'static>,
    transfers: Transfers,
    /// The trace's row with the last SDO frame of each node.
    last_sdo: BTreeMap<NodeId, u64>,
    duplicates: DuplicateNodes,
    statistics: Statistics,
    rates: Rates,
    troubles: Troubles,
    own: Own,
    trace: Trace,
    nodes: BTreeMap<NodeId, Node>,
    watched: BTreeMap<(NodeId, Address), Watched>,
    plot: Plot,
    drives: BTreeMap<NodeId, Drive>,
    jobs: VecDeque<view::Job>,
    /// Simulated devices and their inputs.
    pub devices: Vec<view::Simulated>,
    /// Which client has control.
    pub control: view::Control,
    /// The position in a recorded log.
    pub log: Option<view::Log>,
    /// What the file of the machine keeps for the bench.
    pub kept: view::Kept,
}

impl Model {
    /// A bus without any frame yet, beginning at `now`.
    #[must_use]
    pub fn new(now: Instant, info: BusInfo) -> Self {
        Model {
            statistics: Statistics::new(info.bit_rate),
            info,
            began: now,
            now,
            latency: Duration::ZERO,
            state: None,
            lost: None,
            decoder: Decoder::new(),
            transfers: Transfers::default(),
            last_sdo: BTreeMap::new(),
            duplicates: DuplicateNodes::default(),
            rates: Rates::default(),
            troubles: Troubles::default(),
            own: Own::default(),
            trace: Trace::new(ROWS),
            nodes: BTreeMap::new(),
            watched: BTreeMap::new(),
            plot: Plot::default(),
            drives: BTreeMap::new(),
            jobs: VecDeque::new(),
            devices: Vec::new(),
            control: view::Control::default(),
            log: None,
            kept: view::Kept::default(),
        }
    }

    /// Handles a frame that the bench has not sent.
    pub fn observe(&mut self, now: Instant, frame: &Frame) {
        self.take(now, frame, false);
    }

    /// Handles a frame that the bench has sent. Trouble with it is not blamed on other nodes.
    pub fn observe_own(&mut self, now: Instant, frame: &Frame) {
        self.take(now, frame, true);
    }

    fn take(&mut self, now: Instant, frame: &Frame, is_own: bool) {
        self.pass(now);
        // From here on, times count from the beginning.
        let at = Instant::ZERO + now.since(self.began);
        let decoded = self.decoder.decode(frame);
        let row = self.trace.push(at, frame, &decoded);
        self.statistics.observe(at, frame, &decoded);
        self.rates.observe(at, frame);
        if let Some((node, evidence)) = self.duplicates.observe(at, &decoded) {
            self.troubles.suspect(seconds(at), row, node, evidence);
        }
        self.own.observe(is_own, &decoded);
        if is_part(&decoded)
            && let Some(transfer) = self.transfers.observe(at, &decoded)
        {
            self.transferred(at, row, &transfer);
        }
        // The bench is no node of the bus, even if it sends heartbeats.
        if !(is_own && decoded.is_from_node()) {
            self.follow(at, row, decoded);
        }
    }

    /// Lets time pass.
    pub fn pass(&mut self, now: Instant) {
        self.now = self.now.max(now);
        let at = Instant::ZERO + self.now.since(self.began);
        self.rates.advance(at);
        while let Some(transfer) = self.transfers.forget(at) {
            let row = self.last_sdo.get(&transfer.node).copied().unwrap_or_default();
            self.transferred(at, row, &transfer);
        }
    }

    /// Sets by how much later nodes respond than on CAN.
    pub const fn set_latency(&mut self, latency: Duration) {
        self.latency = latency;
    }

    /// Notes a new state of the CAN controller.
    pub fn set_state(&mut self, now: Instant, state: BusState) {
        self.pass(now);
        self.state = Some(state);
        self.statistics.change_state(Instant::ZERO + now.since(self.began), state);
    }

    /// Notes frames that were lost between the controller and the bench.
    pub fn miss(&mut self, frames: u32) {
        self.statistics.miss(frames);
        self.troubles.see(Kind::Missing, None, self.trace.end().saturating_sub(1));
    }

    /// Notes that the bus is lost.
    pub fn lose(&mut self, why: String) {
        self.lost = Some(why);
    }

    /// Updates the state of a node from a frame.
    fn follow(&mut self, at: Instant, row: u64, decoded: Decoded) {
        if let Detail::Nmt(command) = decoded.detail {
            let meant = self.nodes.iter_mut().filter(|(id, _)| decoded.node.is_none_or(|node| node == **id));
            for (_, node) in meant {
                node.was_stopped = command == NmtCommand::Stop;
                node.was_reset = matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication);
            }
        }
        let Some(id) = decoded.node else { return };
        if let Detail::Sdo(_) = &decoded.detail {
            self.last_sdo.insert(id, row);
        }
        if decoded.is_from_node() {
            self.nodes.entry(id).or_default();
        }
        let Some(node) = self.nodes.get_mut(&id) else { return };
        match decoded.detail {
            Detail::ErrorControl { state, .. } => {
                self.troubles.see(Kind::Silent, Some(id), row);
                if let Some(event) = node.beat(at, state) {
                    self.troubles.remember(seconds(at), row, id, event);
                }
                if state == NmtState::Initialising {
                    node.boot(at);
                    // The node's loss of power has undone the last order.
                    if let Some(drive) = self.drives.get_mut(&id) {
                        drive.ending.take_if(|ending| ending.is_success);
                        drive.target = None;
                    }
                } else {
                    node.set_state(at, state);
                }
            }
            Detail::Emcy(emcy) => {
                let text = emcy.meaning.clone().unwrap_or_else(|| decoded.text.clone());
                let code = format!("{:04X}", emcy.code);
                node.add_fault(emcy.code, view::Fault { at: seconds(at), code, text, row });
            }
            Detail::Pdo(pdo) => {
                for report in &pdo.fields {
                    let value = node.see(at, report, false);
                    if let Some(watched) = self.watched.get_mut(&(id, report.address)) {
                        watched.take(report, value);
                    }
                }
                let signal = Signal::Pdo { received: pdo.received, number: pdo.number };
                self.plot.take_pdo(at, id, signal, &pdo.fields);
            }
            _ => {}
        }
    }

    /// Handles the end of an SDO transfer.
    fn transferred(&mut self, at: Instant, row: u64, transfer: &Transfer) {
        // A transfer that another request ended belongs to the row of its own last frame.
        let row = if transfer.ended < at { self.last_sdo.get(&transfer.node).copied().unwrap_or(row) } else { row };
        self.trace.fold(row, transfer.to_string(), transfer.end != End::Done);
        if matches!(transfer.end, End::Aborted { .. }) {
            self.troubles.see(Kind::Aborts, Some(transfer.node), row);
            self.own.aborted(transfer.node);
        }
        if let (Some(report), Some(node)) = (&transfer.report, self.nodes.get_mut(&transfer.node)) {
            // A device without product code has answered that, too.
            node.has_said_product |= report.address == PRODUCT && transfer.end != End::Unanswered;
        }
        if transfer.end == End::Done
            && let Some(report) = &transfer.report
        {
            self.transferred_value(at, transfer, report);
        }
        self.identify(transfer.node);
    }

    fn transferred_value(&mut self, at: Instant, transfer: &Transfer, report: &ValueReport) {
        let node = self.nodes.entry(transfer.node).or_default();
        let value = node.see(at, report, transfer.writes == Some(true));
        if let Some(watched) = self.watched.get_mut(&(transfer.node, report.address)) {
            watched.take(report, value);
        }
        self.plot.take(at, transfer.node, report);
    }

    /// Gives a node the data sheet from the library that matches its identity.
    fn identify(&mut self, id: NodeId) {
        let is_due = |node: &&Node| node.sheet.is_none() && node.has_said_product;
        let Some(node) = self.nodes.get(&id).filter(is_due) else { return };
        let [Some(vendor), product, ..] = node.identity else { return };
        let Some(shipped) = recognise(vendor, product) else { return };
        self.introduce(id, Sheet::of_library(shipped));
    }

    /// Acknowledges troubles that are over: they are no longer shown.
    pub fn acknowledge(&mut self) {
        self.troubles.acknowledge();
    }

    /// Sets the data sheet of a node.
    pub fn introduce(&mut self, id: NodeId, sheet: Sheet) {
        self.decoder.introduce(id, sheet.device);
        let node = self.nodes.entry(id).or_default();
        (node.sheet, node.pdos_read) = (Some(sheet), Once::default());
        if sheet.drive.is_some() {
            self.drives.entry(id).or_default();
        }
    }

    /// Sets the name of a node in the plant.
    pub fn name(&mut self, id: NodeId, name: String) {
        self.nodes.entry(id).or_default().given_name = Some(name);
    }

    /// The nodes that were heard.
    pub fn nodes(&self) -> impl Iterator<Item = NodeId> {
        self.nodes.keys().copied()
    }

    /// The data sheet of a node.
    #[must_use]
    pub fn sheet(&self, id: NodeId) -> Option<Sheet> {
        self.nodes.get(&id)?.sheet
    }

    pub(crate) fn drive(&mut self, id: NodeId) -> &mut Drive {
        self.drives.entry(id).or_default()
    }

    /// One sentence for each drive whose standstill is wanted and not confirmed.
    pub(crate) fn unconfirmed(&self) -> Vec<String> {
        let wanted = self.drives.iter().filter_map(|(id, drive)| Some((id, drive.standstill.unconfirmed()?)));
        let words = wanted.map(|(id, unconfirmed)| {
            let name = self.nodes.get(id).map(Node::name).unwrap_or_default();
            let why = unconfirmed.why.or_else(|| self.lost.clone());
            format!("drive {id} {name}: {}", why.as_deref().unwrap_or("it has not answered in time"))
        });
        words.collect()
    }

    /// The remedy for a node that does not respond to an SDO request.
    pub(crate) fn no_answer(&self, id: NodeId) -> &'static str {
        let is_stopped =
            |node: &Node| node.was_stopped || node.state.is_some_and(|state| state.value == NmtState::Stopped);
        if self.nodes.get(&id).is_some_and(is_stopped) {
            "it is STOPPED (NMT), and takes no SDO: start it, or set it PRE-OPERATIONAL"
        } else {
            "is the node on the bus, with power?"
        }
    }

    pub(crate) fn drive_if_known(&mut self, id: NodeId) -> Option<&mut Drive> {
        self.drives.get_mut(&id)
    }

    /// Updates what the current order of a drive has seen.
    pub(crate) fn look(&mut self, id: NodeId, look: Look) {
        let at = Instant::ZERO + look.at.since(self.began);
        self.drive(id).look = Some(Measured::new(look, at));
    }

    /// The values seen of a node, which decide about units and limits.
    #[must_use]
    pub fn values(&self, id: NodeId) -> Option<&DeviceValues<'static>> {
        self.decoder.values(id)
    }

    /// The entries in a node's data sheet.
    #[must_use]
    pub fn objects(&self, id: NodeId) -> Option<Vec<view::Object>> {
        Some(objects::list(id, self.nodes.get(&id)?, self.decoder.values(id)?))
    }

    /// How many frames with this COB-ID came in the last second.
    #[must_use]
    pub fn per_second(&self, id: lexican_runtime::CobId) -> f64 {
        self.rates.of(id).frames.into()
    }

    /// The last value of an entry.
    #[must_use]
    pub fn value(&self, id: NodeId, address: Address) -> Option<&view::Value> {
        self.nodes.get(&id)?.values.get(&address).map(|seen| &seen.value)
    }

    /// The entries of a node with known values.
    pub(crate) fn seen(&self, id: NodeId) -> Vec<Address> {
        self.nodes.get(&id).map(|node| node.values.keys().copied().collect()).unwrap_or_default()
    }

    /// Adds an entry to the watched ones; returns the interval at which it was read before.
    pub fn watch(&mut self, id: NodeId, address: Address, every_ms: u32) -> Option<u32> {
        match self.watched.entry((id, address)) {
            Entry::Occupied(mut known) => Some(std::mem::replace(&mut known.get_mut().every_ms, every_ms)),
            Entry::Vacant(new) => {
                new.insert(Watched::new(every_ms));
                None
            }
        }
    }

    /// Removes an entry from the watched ones; returns its interval.
    pub fn unwatch(&mut self, id: NodeId, address: Address) -> Option<u32> {
        self.watched.remove(&(id, address)).map(|watched| watched.every_ms)
    }

    /// Whether to read a node's identity, because it is new or has booted. It counts as read from then on. A node that
    /// boots again and again is read at growing intervals.
    pub fn is_stranger(&mut self, now: Instant, id: NodeId) -> bool {
        let at = Instant::ZERO + now.since(self.began);
        self.nodes.get_mut(&id).is_some_and(|node| node.identity_asked.begins(at))
    }

    /// Whether to read a node's PDO configuration, because it got a data sheet or has booted. It counts as read from
    /// then on. A node that boots again and again is read at growing intervals.
    pub fn lacks_pdos(&mut self, now: Instant, id: NodeId) -> bool {
        let at = Instant::ZERO + now.since(self.began);
        let known = self.nodes.get_mut(&id).filter(|node| node.sheet.is_some());
        known.is_some_and(|node| node.pdos_read.begins(at))
    }

    /// Adds curves; returns the signals that are new.
    pub fn plot(&mut self, id: NodeId, signals: impl IntoIterator<Item = Signal>, every_ms: u32) -> Vec<Signal> {
        self.plot.add(id, signals, every_ms)
    }

    /// Removes the curves of a node, or all; returns their objects with the intervals of reading.
    pub fn clear_plot(&mut self, id: Option<NodeId>) -> Vec<(NodeId, Address, u32)> {
        self.plot.clear(id)
    }

    /// Removes the curves of a signal; returns its interval.
    pub fn unplot(&mut self, id: NodeId, signal: Signal) -> Option<u32> {
        self.plot.remove(id, signal)
    }

    /// The points of all curves after a time.
    #[must_use]
    pub fn curves(&self, since: f64) -> Vec<view::Curve> {
        self.plot.since(since, Instant::ZERO + self.now.since(self.began), self.latency)
    }

    /// A function that makes the present curves a `csv` or `svg` file without locking the model.
    pub fn plot_file(&self, format: &str) -> impl FnOnce() -> Result<Vec<u8>, String> + use<> {
        let (plot, name, format) = (self.plot.clone(), self.info.name.clone(), format.to_owned());
        move || match &*format {
            "csv" => Ok(plot.csv().into_bytes()),
            "svg" => Ok(plot.svg(&name).into_bytes()),
            other => Err(format!("a plot is a file of csv or svg, not {other:?}")),
        }
    }

    /// Searches some more rows for matches; returns whether there were any left to search. The model can be unlocked
    /// between two steps.
    pub fn search(&mut self, which: &Which) -> bool {
        self.trace.search(which)
    }

    /// Rows of the trace that match: from a position on, which counts from the row with number `at`, if that is given.
    /// Only rows found by [`search`](Self::search) so far, and by one more step.
    pub fn rows(&mut self, which: &Which, at: Option<u64>, from: i64, count: usize) -> view::Frames {
        let Page { matching, from, rows } = self.trace.page(which, at, from, count);
        view::Frames { matching, from, rows }
    }

    /// Adds the next matching frames, from a row number on; returns the row number to continue with, unless all are
    /// done.
    pub fn frames(&self, which: &Which, from: u64, into: &mut Vec<(Instant, Frame)>) -> Option<u64> {
        self.trace.frames(which, from, into)
    }

    /// Updates a job.
    pub fn set_job(&mut self, job: view::Job) {
        match self.jobs.iter_mut().find(|known| known.number == job.number) {
            Some(known) => *known = job,
            None => self.jobs.push_back(job),
        }
        let ended = self.jobs.iter().filter(|job| job.is_success.is_some()).count();
        if ended > ENDED_JOBS
            && let Some(oldest) = self.jobs.iter().position(|job| job.is_success.is_some())
        {
            self.jobs.remove(oldest);
        }
    }

    /// Whether frames can be sent now.
    #[must_use]
    pub fn is_writable(&self) -> bool {
        self.info.is_writable && self.lost.is_none()
    }

    /// Why the bus was lost; `None` if it was not.
    #[must_use]
    pub fn lost(&self) -> Option<&str> {
        self.lost.as_deref()
    }

    /// Whether sending is impossible in principle, as with a log.
    #[must_use]
    pub fn listens_only(&self) -> bool {
        !self.info.is_writable
    }

    /// Forgets all frames, as if none was received. Data sheets, watched entries and curves stay.
    pub fn rewind(&mut self) {
        let mut anew = Model::new(self.began, self.info.clone());
        for (id, node) in std::mem::take(&mut self.nodes) {
            if let Some(sheet) = node.sheet {
                anew.introduce(id, sheet);
            }
            if let Some(name) = node.given_name {
                anew.name(id, name);
            }
        }
        for ((id, address), watched) in &self.watched {
            anew.watch(*id, *address, watched.every_ms);
        }
        anew.plot = std::mem::take(&mut self.plot).rewound();
        anew.devices = std::mem::take(&mut self.devices);
        anew.jobs = std::mem::take(&mut self.jobs);
        anew.control = self.control.clone();
        anew.log = self.log.clone();
        *self = anew;
    }

    /// Seconds since the beginning.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.now.since(self.began).as_secs_f64()
    }

    /// A snapshot for clients.
    pub fn view(&mut self) -> View {
        let now = Instant::ZERO + self.now.since(self.began);
        let limit = age::old_after(DRIVE, self.latency);
        let report = self.own.removed_from(self.statistics.report(now));
        let bits = self.rates.bits().max(1) as f64;
        let rates: Vec<view::Rate> = report
            .ids
            .iter()
            .zip(self.rates.ids())
            .map(|(id, cob_id)| {
                let last = self.rates.of(cob_id);
                view::Rate {
                    id: id.id.clone(),
                    name: id.name.clone(),
                    node: id.node,
                    frames: id.frames,
                    per_second: last.frames.into(),
                    jitter_ms: id.gaps.as_ref().map(|gaps| gaps.deviation_ms),
                    share_percent: f64::from(last.bits) / bits * 100.0,
                }
            })
            .collect();
        let troubles = self.troubles.view(self.seconds(), self.state, &report, &rates);
        let nodes = self.nodes.iter().map(|(id, node)| {
            let mut view = node.view(id.get());
            view.lacks.extend(self.drives.get(id).into_iter().flat_map(|drive| drive.lacks.iter().cloned()));
            // Without heartbeats, it is unknown when the state should be seen again.
            view.seen = node.state.map(|state| age::shown(&state, now, limit));
            if let Some(of_node) = report.nodes.iter().find(|of_node| of_node.node == id.get()) {
                view.heartbeat_ms = of_node.heartbeat.as_ref().map(|spans| spans.mean_ms);
                view.silent_seconds = of_node.silent_seconds;
                if let Some(seen) = view.seen.as_mut().filter(|_| view.heartbeat_ms.is_some()) {
                    seen.is_old = of_node.silent_seconds.is_some();
                }
                view.sdo_ms = of_node.sdo_response.as_ref().map(|spans| spans.mean_ms);
                view.aborts = of_node.sdo_aborts;
                view.boots = of_node.boot_ups;
            }
            view
        });
        let drives = self.drives.iter().filter_map(|(id, drive)| {
            let node = self.nodes.get(id)?;
            let unconfirmed = drive.standstill.unconfirmed().map(|unconfirmed| view::Unconfirmed {
                since: unconfirmed.since.since(self.began).as_secs_f64(),
                why: unconfirmed.why,
            });
            let shown = drive.view(now, limit, *id, node, self.decoder.values(*id)?, node.sheet?.drive?);
            Some(view::Drive { unconfirmed, ..shown })
        });
        let watched = self.watched.iter().map(|((id, address), watched)| {
            let report = ValueReport::without_value(self.decoder.values(*id), *address);
            let name = report.name.map_or_else(|| address.to_string(), |name| name.to_string());
            watched.view(now, self.latency, *id, *address, name)
        });
        View {
            time: self.seconds(),
            nodes: nodes.collect(),
            drives: drives.collect(),
            devices: self.devices.clone(),
            jobs: self.jobs.iter().cloned().collect(),
            watched: watched.collect(),
            trace: view::Trace { first: self.trace.first(), end: self.trace.end() },
            control: self.control.clone(),
            log: self.log.clone(),
            kept: self.kept.clone(),
            bus: view::Bus {
                name: self.info.name.clone(),
                is_writable: self.is_writable(),
                bit_rate: self.info.bit_rate,
                state: self.lost.clone().unwrap_or_else(|| self.state.unwrap_or_default().to_string()),
                frames: report.frames,
                frames_per_second: report.frames_last_second,
                load_percent: report.load_percent_last_second,
                load_percent_peak: report.load_percent_peak,
                missing_frames: report.missing_frames,
                ids: rates,
                troubles,
            },
        }
    }
}
