//! Statistics of a bus: load, rates and jitter by COB-ID, silent nodes, response times.

use std::borrow::Cow;
use std::collections::BTreeMap;

use lexican_runtime::host::{BusState, wire_bits};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use serde::Serialize;

use crate::decode::{Decoded, Detail, Side};

/// Current load and rate are counted over this span.
const WINDOW: Duration = Duration::from_secs(1);

/// Counts the frames of a bus. Memory is bounded by the number of COB-IDs.
#[derive(Debug, Default)]
pub struct Statistics {
    /// In bits per second; `None` if unknown.
    bit_rate: Option<u32>,
    began: Option<Instant>,
    last: Instant,
    frames: u64,
    bits: u64,
    window: Window,
    ids: BTreeMap<CobId, Id>,
    nodes: BTreeMap<NodeId, Node>,
    missing: u64,
    states: Vec<(Instant, BusState)>,
}

/// The most changes of the bus's state that are kept.
const MAX_STATES: usize = 64;

/// The frames of the current second, of the one before, and the most in any second.
#[derive(Debug, Default)]
struct Window {
    began: Instant,
    now: Count,
    before: Count,
    peak: Count,
}

#[derive(Clone, Copy, Debug, Default)]
struct Count {
    frames: u32,
    bits: u32,
}

impl Window {
    fn advance(&mut self, now: Instant) {
        let whole = now.since(self.began).as_micros() / WINDOW.as_micros();
        if whole > 0 {
            self.before = if whole == 1 { self.now } else { Count::default() };
            if self.now.bits > self.peak.bits {
                self.peak = self.now;
            }
            self.now = Count::default();
            self.began += Duration::from_micros(whole * WINDOW.as_micros());
        }
    }
}

#[derive(Debug)]
struct Id {
    name: Cow<'static, str>,
    node: Option<NodeId>,
    frames: u64,
    last: Instant,
    gaps: Gaps,
}

#[derive(Debug, Default)]
struct Node {
    state: Option<NmtState>,
    last: Instant,
    beat: Option<Instant>,
    beats: Gaps,
    boots: u32,
    emergencies: u32,
    emergency: Option<String>,
    aborts: u32,
    asked: Option<Instant>,
    answers: Gaps,
}

/// The shortest, longest and mean interval, and its deviation.
#[derive(Clone, Copy, Debug, Default)]
struct Gaps {
    count: u64,
    shortest: Duration,
    longest: Duration,
    /// In seconds: the mean, and the sum of squared deviations, by Welford's method.
    mean: f64,
    squares: f64,
}

impl Gaps {
    fn add(&mut self, gap: Duration) {
        self.shortest = if self.count == 0 { gap } else { self.shortest.min(gap) };
        self.longest = self.longest.max(gap);
        self.count += 1;
        let seconds = gap.as_secs_f64();
        let distance = seconds - self.mean;
        self.mean += distance / self.count as f64;
        self.squares += distance * (seconds - self.mean);
    }

    fn summary(&self) -> Option<Spans> {
        (self.count > 0).then(|| Spans {
            count: self.count,
            shortest_ms: self.shortest.as_secs_f64() * 1e3,
            mean_ms: self.mean * 1e3,
            longest_ms: self.longest.as_secs_f64() * 1e3,
            deviation_ms: (self.squares / self.count as f64).sqrt() * 1e3,
        })
    }
}

impl Statistics {
    /// Statistics of a bus; `bit_rate` is in bits per second. The load is unknown without it.
    #[must_use]
    pub fn new(bit_rate: Option<u32>) -> Self {
        Statistics { bit_rate, ..Statistics::default() }
    }

    /// Handles a frame.
    pub fn observe(&mut self, at: Instant, frame: &Frame, decoded: &Decoded) {
        if self.began.is_none() {
            self.window.began = at;
        }
        self.began.get_or_insert(at);
        self.last = at;
        let bits = wire_bits(frame);
        self.window.advance(at);
        self.window.now.frames += 1;
        self.window.now.bits = self.window.now.bits.saturating_add(bits);
        self.frames += 1;
        self.bits += u64::from(bits);
        let id = self.ids.entry(frame.id()).or_insert_with(|| {
            let (name, node) = (decoded.name.clone(), decoded.node);
            Id { name, node, frames: 0, last: at, gaps: Gaps::default() }
        });
        if id.frames > 0 {
            id.gaps.add(at.since(id.last));
        }
        id.name.clone_from(&decoded.name);
        (id.frames, id.last, id.node) = (id.frames + 1, at, decoded.node);
        self.observe_node(at, decoded);
    }

    fn observe_node(&mut self, at: Instant, decoded: &Decoded) {
        let Some(node) = decoded.node else { return };
        if !decoded.is_from_node() {
            // A request to a node does not show that the node is alive.
            if let (Detail::Sdo(sdo), Some(node)) = (&decoded.detail, self.nodes.get_mut(&node)) {
                node.asked = Some(at);
                node.aborts += u32::from(sdo.abort.is_some());
            }
            return;
        }
        let node = self.nodes.entry(node).or_default();
        node.last = at;
        match &decoded.detail {
            Detail::ErrorControl { state: NmtState::Initialising, .. } => {
                node.boots += 1;
                (node.state, node.beat) = (Some(NmtState::PreOperational), None);
            }
            Detail::ErrorControl { state, .. } => {
                if let Some(before) = node.beat.replace(at) {
                    node.beats.add(at.since(before));
                }
                node.state = Some(*state);
            }
            Detail::Emcy(emcy) if emcy.code >> 8 != 0 => {
                node.emergencies += 1;
                node.emergency = Some(decoded.text.clone());
            }
            Detail::Sdo(sdo) if sdo.side == Side::Server => {
                if let Some(asked) = node.asked.take() {
                    node.answers.add(at.since(asked));
                }
                node.aborts += u32::from(sdo.abort.is_some());
            }
            _ => {}
        }
    }

    /// Counts frames that the machine received but we lost.
    pub fn miss(&mut self, frames: u32) {
        self.missing += u64::from(frames);
    }

    /// Notes a change of the bus's state.
    pub fn change_state(&mut self, at: Instant, state: BusState) {
        if self.states.len() < MAX_STATES {
            self.states.push((at, state));
        }
    }

    /// The numbers as of `now`.
    #[must_use]
    pub fn report(&mut self, now: Instant) -> Report {
        let now = now.max(self.last);
        self.window.advance(now);
        let began = self.began.unwrap_or(now);
        let span = now.since(began).as_secs_f64();
        let load = |bits: f64, seconds: f64| {
            self.bit_rate.filter(|rate| *rate > 0 && seconds > 0.0).map(|rate| bits / seconds / f64::from(rate) * 100.0)
        };
        let second = WINDOW.as_secs_f64();
        let is_short = now.since(began) < WINDOW;
        let peak = self.window.peak.bits.max(self.window.now.bits);
        Report {
            seconds: span,
            frames: self.frames,
            frames_per_second: if span > 0.0 { self.frames as f64 / span } else { 0.0 },
            frames_last_second: if is_short { self.window.now.frames } else { self.window.before.frames },
            load_percent: load(self.bits as f64, span),
            load_percent_last_second: load(self.window.before.bits.into(), second).filter(|_| !is_short),
            load_percent_peak: load(peak.into(), second).filter(|_| !is_short),
            missing_frames: self.missing,
            states: self.states.iter().map(|(at, state)| (at.since(began).as_secs_f64(), state.to_string())).collect(),
            ids: self.ids.iter().map(|(cob_id, id)| id.report(*cob_id, span)).collect(),
            nodes: self.nodes.iter().map(|(id, node)| node.report(*id, now)).collect(),
        }
    }
}

impl Id {
    fn report(&self, cob_id: CobId, span: f64) -> IdReport {
        IdReport {
            id: cob_id.to_string(),
            name: self.name.to_string(),
            node: self.node.map(NodeId::get),
            frames: self.frames,
            frames_per_second: if span > 0.0 { self.frames as f64 / span } else { 0.0 },
            gaps: self.gaps.summary(),
        }
    }
}

impl Node {
    fn report(&self, id: NodeId, now: Instant) -> NodeReport {
        let is_silent = self.beat.is_some_and(|beat| {
            // Two heartbeats are missing. After a single heartbeat the period is unknown.
            self.beats.count > 0 && now.since(beat).as_secs_f64() > self.beats.mean * 2.5
        });
        NodeReport {
            node: id.get(),
            state: self.state.map(|state| state.to_string()),
            silent_seconds: is_silent.then(|| now.since(self.last).as_secs_f64()),
            heartbeat: self.beats.summary(),
            boot_ups: self.boots,
            emergencies: self.emergencies,
            last_emergency: self.emergency.clone(),
            sdo_aborts: self.aborts,
            sdo_response: self.answers.summary(),
        }
    }
}

/// The numbers of a bus.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Since the first frame.
    pub seconds: f64,
    /// All of them.
    pub frames: u64,
    /// The mean since the first frame.
    pub frames_per_second: f64,
    /// In the last complete second; at first, in the current one.
    pub frames_last_second: u32,
    /// The mean share of time in which the bus carries bits; `None` without a bit rate.
    pub load_percent: Option<f64>,
    /// In the last complete second.
    pub load_percent_last_second: Option<f64>,
    /// In the second with the most bits.
    pub load_percent_peak: Option<f64>,
    /// Frames that were lost because they came faster than they were read.
    pub missing_frames: u64,
    /// Changes of the bus's state, with their times in seconds.
    pub states: Vec<(f64, String)>,
    /// Ascending by COB-ID.
    pub ids: Vec<IdReport>,
    /// The nodes that were heard, ascending.
    pub nodes: Vec<NodeReport>,
}

/// The frames of a COB-ID.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdReport {
    /// `185`.
    pub id: String,
    /// `TPDO1`.
    pub name: String,
    /// `None` for broadcasts.
    pub node: Option<u8>,
    /// Their number.
    pub frames: u64,
    /// The mean.
    pub frames_per_second: f64,
    /// Intervals between frames.
    pub gaps: Option<Spans>,
}

/// A node that was heard.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NodeReport {
    /// Its node-ID.
    pub node: u8,
    /// The NMT state by its error control.
    pub state: Option<String>,
    /// How long a node that misses two heartbeats has been silent; `None` for others.
    pub silent_seconds: Option<f64>,
    /// Intervals between heartbeats.
    pub heartbeat: Option<Spans>,
    /// The number of boot-up messages.
    pub boot_ups: u32,
    /// The number of emergency messages, except those for "no error" (0000h).
    pub emergencies: u32,
    /// The last one as text.
    pub last_emergency: Option<String>,
    /// Aborts by client or server.
    pub sdo_aborts: u32,
    /// Intervals from a request to its response.
    pub sdo_response: Option<Spans>,
}

/// Intervals, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the names say what it is")]
pub struct Spans {
    /// The number of intervals.
    pub count: u64,
    pub shortest_ms: f64,
    pub mean_ms: f64,
    pub longest_ms: f64,
    /// The standard deviation: the jitter.
    pub deviation_ms: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::Decoder;
    use lexican_runtime::host::candump::Line;

    /// The report at `now_ms` of frames with their times in milliseconds.
    fn report(bit_rate: Option<u32>, frames: &[(u64, &str)], now_ms: u64) -> Report {
        let (mut decoder, mut statistics) = (Decoder::new(), Statistics::new(bit_rate));
        for (at, text) in frames {
            let frame = format!("(0.000000) can0 {text}").parse::<Line>().unwrap().frame;
            statistics.observe(Instant::from_micros(at * 1000), &frame, &decoder.decode(&frame));
        }
        statistics.report(Instant::from_micros(now_ms * 1000))
    }

    #[test]
    fn load_is_bits_by_time() {
        // 53 bits each, and 100 of them in a second at 125 kbit/s.
        let frames: Vec<_> = (0..200).map(|number| (number * 10, "000#")).collect();
        let report = report(Some(125_000), &frames, 2000);
        let percent = 100.0 * 53.0 * 100.0 / 125_000.0;
        for load in [report.load_percent, report.load_percent_last_second, report.load_percent_peak] {
            assert!((load.unwrap() - percent).abs() < 1e-9, "{load:?}");
        }
        assert_eq!((report.frames, report.frames_last_second), (200, 100));
        let idle = super::tests::report(Some(125_000), &frames, 60_000);
        assert_eq!((idle.load_percent_last_second, idle.frames_last_second), (Some(0.0), 0));
        assert_eq!(idle.load_percent_peak, report.load_percent_peak);
        assert_eq!(super::tests::report(None, &frames, 2000).load_percent, None);
    }

    #[test]
    fn jitter_is_how_the_gaps_spread() {
        let report = report(None, &[(0, "185#00"), (9, "185#00"), (20, "185#00"), (30, "185#00")], 30);
        let gaps = report.ids[0].gaps.unwrap();
        assert_eq!((gaps.count, gaps.shortest_ms, gaps.longest_ms), (3, 9.0, 11.0));
        assert!((gaps.mean_ms - 10.0).abs() < 1e-9 && (gaps.deviation_ms - (2.0_f64 / 3.0).sqrt()).abs() < 1e-9);
        assert_eq!((report.ids[0].name.as_str(), report.ids[0].node), ("TPDO1", Some(5)));
        assert!((report.ids[0].frames_per_second - 4.0 / 0.03).abs() < 1e-9);
    }

    #[test]
    fn a_node_is_silent_when_two_heartbeats_are_missing() {
        let beats = [(0, "705#00"), (100, "705#7F"), (200, "705#05"), (300, "705#05"), (350, "706#05")];
        let node = |now| report(None, &beats, now).nodes[0].clone();
        assert_eq!((node(500).silent_seconds, node(500).boot_ups), (None, 1));
        assert_eq!(node(600).silent_seconds, Some(0.3));
        assert_eq!(node(600).state.as_deref(), Some("OPERATIONAL"));
        assert_eq!(node(600).heartbeat.unwrap().mean_ms, 100.0);
        // A single heartbeat does not tell the period.
        assert_eq!(report(None, &beats, 9000).nodes[1].silent_seconds, None);
    }

    #[test]
    fn errors_and_response_times_are_those_of_their_node() {
        let frames = [
            (0, "705#05"),
            (10, "605#4000100000000000"),
            (12, "585#4300100092010000"),
            (20, "605#40FF2F0000000000"),
            (24, "585#80FF2F0000000206"),
            (30, "606#4000100000000000"),
            (40, "085#2031050000000000"),
            (50, "085#0000000000000000"),
        ];
        let nodes = report(None, &frames, 60).nodes;
        assert_eq!(nodes.len(), 1, "a node that does not answer is not one that was heard");
        let answers = nodes[0].sdo_response.unwrap();
        assert_eq!((answers.count, answers.shortest_ms, answers.longest_ms), (2, 2.0, 4.0));
        assert_eq!((nodes[0].sdo_aborts, nodes[0].emergencies), (1, 1));
        assert!(nodes[0].last_emergency.as_ref().unwrap().contains("3120"));
    }
}
