//! Detects two nodes with the same node-ID.
//!
//! A frame does not name its sender, but a single node does not send any of these:
//!
//! - an SDO response without a request. A server responds once (CiA 301, 7.2.4.3), except within a block transfer, and
//!   may abort a transfer that has timed out;
//! - a boot-up message shortly after another frame, without a reset;
//! - a state that changes and changes back without an NMT command;
//! - heartbeats in two rhythms (short, long, short, long), or more of them than the producer time (1017h) allows if a
//!   transfer has carried it.
//!
//! A listener may miss frames, and a node may restart by itself, so each of these is only a suspicion, and its text
//! names the other possible cause. Two nodes that always send the same bits at the same time cannot be told apart.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;

use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Duration, Instant, NodeId, cia301};
use serde::Serialize;

use super::decoded::{Sdo, Side, Step};
use super::{Decoded, Detail};
use crate::values::report::ValueReport;

/// A node that was heard this recently cannot have lost and regained its power since.
const MOMENT: Duration = Duration::from_millis(500);

/// A request that is older gets no response.
const FORGOTTEN: Duration = Duration::from_secs(10);

/// The time until a suspicion is reported again.
const AGAIN: Duration = Duration::from_secs(10);

/// Faster rhythms come from the adapter's buffers rather than from the nodes.
const SLOW_ENOUGH: Duration = Duration::from_millis(100);

/// The number of heartbeats that make a rhythm.
const BEATS: usize = 5;

/// What suggests that two nodes have the same node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Evidence {
    /// An SDO response without a request.
    SecondAnswer,
    /// A boot-up message of a node that was just heard, without a reset.
    BootUpWhileAlive,
    /// A state that changes and changes back.
    ChangingStates,
    /// Heartbeats in two rhythms.
    TwoRhythms,
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Evidence::SecondAnswer => "it sent an SDO response without a request; or a request was missed",
            Evidence::BootUpWhileAlive => {
                "it boots up shortly after another frame, without a reset; or it restarts by itself"
            }
            Evidence::ChangingStates => "its state changes and changes back without a command; or a command was missed",
            Evidence::TwoRhythms => "its heartbeats have two rhythms",
        })
    }
}

/// Looks for pairs of nodes with the same node-ID.
#[derive(Default)]
pub struct DuplicateNodes {
    nodes: BTreeMap<NodeId, NodeHistory>,
}

impl DuplicateNodes {
    /// Handles a frame; returns a suspicion, each at most once in ten seconds.
    pub fn observe(&mut self, at: Instant, decoded: &Decoded) -> Option<(NodeId, Evidence)> {
        if let Detail::Nmt(command) = decoded.detail {
            let resets = command.target() == NmtState::Initialising;
            let nodes = self.nodes.iter_mut().filter(|(node, _)| decoded.node.is_none_or(|target| target == **node));
            nodes.for_each(|(_, history)| history.commanded(resets));
            return None;
        }
        let node = decoded.node?;
        let history = self.nodes.entry(node).or_default();
        let evidence = history.observe(at, &decoded.detail)?;
        let is_due = history.reported.get(&evidence).is_none_or(|reported| at.since(*reported) >= AGAIN);
        is_due.then(|| history.reported.insert(evidence, at));
        is_due.then_some((node, evidence))
    }
}

/// What was heard with one node-ID.
#[derive(Default)]
struct NodeHistory {
    /// The number of SDO requests without a response; `None` if it is unknown.
    asked: Option<u32>,
    asked_at: Instant,
    /// Whether responses to requests were heard.
    answers: bool,
    /// The last frame of the node since its reset.
    alive: Option<Instant>,
    state: Option<NmtState>,
    state_before: Option<NmtState>,
    beats: VecDeque<Instant>,
    /// The producer heartbeat time, if a transfer has carried it.
    period: Option<Duration>,
    reported: BTreeMap<Evidence, Instant>,
}

impl NodeHistory {
    fn commanded(&mut self, resets: bool) {
        (self.state, self.state_before) = (None, None);
        if resets {
            self.alive = None;
            self.beats.clear();
        }
    }

    fn observe(&mut self, at: Instant, detail: &Detail) -> Option<Evidence> {
        let evidence = match detail {
            Detail::Sdo(sdo) if sdo.side == Side::Client => {
                self.request(at, sdo);
                return None;
            }
            Detail::Sdo(sdo) => self.answer(sdo),
            Detail::ErrorControl { state: NmtState::Initialising, .. } => self.boot_up(at),
            Detail::ErrorControl { state, toggle } => self.beat(at, *state, *toggle),
            Detail::Guarding => {
                self.beats.clear();
                return None;
            }
            Detail::Pdo(pdo) if pdo.received => return None,
            _ => None,
        };
        self.alive = Some(at);
        evidence
    }

    fn request(&mut self, at: Instant, sdo: &Sdo) {
        let stale = at.since(self.asked_at) >= FORGOTTEN;
        self.asked = match (sdo.step, self.asked) {
            (Step::Abort, asked) => asked,
            (Step::InitiateUpload | Step::InitiateDownload, None) => Some(1),
            (Step::InitiateUpload | Step::InitiateDownload, Some(_)) if stale => Some(1),
            (Step::InitiateUpload | Step::InitiateDownload | Step::UploadSegment | Step::DownloadSegment, asked) => {
                asked.map(|asked| asked.saturating_add(1))
            }
            // Requests of a block transfer are not counted.
            _ => None,
        };
        self.asked_at = at;
    }

    fn answer(&mut self, sdo: &Sdo) -> Option<Evidence> {
        self.learn_period(sdo);
        match self.asked {
            Some(0) if sdo.abort == Some(AbortCode::TIMED_OUT) => None,
            Some(0) => self.answers.then_some(Evidence::SecondAnswer),
            Some(asked) => {
                self.asked = Some(asked - 1);
                self.answers = true;
                None
            }
            None => None,
        }
    }

    /// Learns the producer time from a transfer of 1017h.
    fn learn_period(&mut self, sdo: &Sdo) {
        let is_period = |report: &&ValueReport| report.address.index() == cia301::PRODUCER_HEARTBEAT_TIME;
        let report = sdo.report.as_ref().filter(is_period).filter(|_| sdo.complete);
        if let Some([low, high, ..]) = report.and_then(|report| report.raw.as_deref()) {
            let ms = u16::from_le_bytes([*low, *high]);
            self.period = (ms > 0).then(|| Duration::from_millis(ms.into()));
            self.beats.clear();
        }
    }

    fn boot_up(&mut self, at: Instant) -> Option<Evidence> {
        let was_alive = self.alive.is_some_and(|alive| at.since(alive) < MOMENT);
        *self = NodeHistory {
            reported: std::mem::take(&mut self.reported),
            answers: self.answers,
            ..NodeHistory::default()
        };
        was_alive.then_some(Evidence::BootUpWhileAlive)
    }

    fn beat(&mut self, at: Instant, state: NmtState, toggle: bool) -> Option<Evidence> {
        let changed = self.state.is_some_and(|before| before != state);
        let back = changed && self.state_before == Some(state);
        if changed {
            self.state_before = self.state;
        }
        self.state = Some(state);
        if toggle {
            self.beats.clear();
        } else {
            self.beats.push_back(at);
        }
        if self.beats.len() > BEATS {
            self.beats.pop_front();
        }
        if back { Some(Evidence::ChangingStates) } else { self.two_rhythms().then_some(Evidence::TwoRhythms) }
    }

    fn two_rhythms(&self) -> bool {
        let times: Vec<u64> = self.beats.iter().map(|beat| beat.as_micros()).collect();
        let gaps: Vec<u64> = times.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
        let &[a, b, c, d] = gaps.as_slice() else { return false };
        let enough = |sum: u64| sum >= SLOW_ENOUGH.as_micros();
        // One producer may be late once, but three of its periods never take less than two.
        let crowded = self.period.is_some_and(|period| {
            let period = period.as_micros();
            enough(period) && [a + b + c, b + c + d].iter().all(|sum| *sum < 2 * period)
        });
        let (first, second, third) = (a + b, b + c, c + d);
        let steady = first.abs_diff(second) * 10 <= first && second.abs_diff(third) * 10 <= second;
        crowded || steady && enough(first) && a.abs_diff(b) * 5 >= first && c.abs_diff(d) * 5 >= first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::Decoder;
    use lexican_runtime::host::candump::Line;

    /// Checks the suspicions about these frames; times are in ms.
    #[track_caller]
    fn check(script: &str, expected: &[(u64, u8, Evidence)]) {
        let (mut decoder, mut duplicates, mut found) = (Decoder::new(), DuplicateNodes::default(), Vec::new());
        for word in script.split_whitespace() {
            let (ms, frame) = word.split_once('@').unwrap();
            let ms: u64 = ms.parse().unwrap();
            let line: Line = format!("(0.000000) can0 {frame}").parse().unwrap();
            let suspicion = duplicates.observe(Instant::from_micros(ms * 1000), &decoder.decode(&line.frame));
            found.extend(suspicion.map(|(node, evidence)| (ms, node.get(), evidence)));
        }
        assert_eq!(found, expected, "{script}");
    }

    const READ: &str = "605#4000100000000000";
    const ANSWER: &str = "585#4300100092010000";

    #[test]
    fn a_response_without_a_request_is_suspicious() {
        check(&format!("0@{READ} 1@{ANSWER} 2@{READ} 3@{ANSWER}"), &[]);
        check(&format!("0@{READ} 1@{ANSWER} 2@{ANSWER}"), &[(2, 5, Evidence::SecondAnswer)]);
        // Reported once in ten seconds, not for each response.
        let twice = format!("0@{READ} 1@{ANSWER} 2@{ANSWER} 3@{ANSWER} 11000@{ANSWER}");
        check(&twice, &[(2, 5, Evidence::SecondAnswer), (11000, 5, Evidence::SecondAnswer)]);
        // A retry gets two responses; without requests nothing is known; a server may send an abort on a time-out.
        check(&format!("0@{READ} 1@{READ} 2@{ANSWER} 3@{ANSWER}"), &[]);
        check(&format!("0@{ANSWER} 1@{ANSWER} 2@{ANSWER}"), &[]);
        check(&format!("0@{READ} 1@{ANSWER} 2000@585#8000000000000405"), &[]);
        check(&format!("0@{READ} 1@{ANSWER} 2@585#8000100000000206"), &[(2, 5, Evidence::SecondAnswer)]);
    }

    #[test]
    fn blocks_have_many_responses() {
        check(
            "0@605#A0081000FF000000 1@585#C2081000 2@585#C20810000A000000 3@605#A300000000000000 \
             4@585#0164657669636500 5@585#8264657669636500 6@605#A2027F0000000000 7@585#C500000000000000 \
             8@605#A100000000000000",
            &[],
        );
    }

    #[test]
    fn a_boot_up_while_alive_is_suspicious_without_a_reset() {
        check("0@705#00 100@705#7F 200@705#00", &[(200, 5, Evidence::BootUpWhileAlive)]);
        check("0@705#00 10@705#00", &[(10, 5, Evidence::BootUpWhileAlive)]);
        check("0@705#00 100@705#7F 150@000#8105 200@705#00", &[]);
        check("0@705#00 100@705#7F 150@000#8200 200@705#00", &[]);
        check("0@705#00 100@705#7F 150@000#8106 200@705#00", &[(200, 5, Evidence::BootUpWhileAlive)]);
        check("0@705#00 100@705#7F 2000@705#00", &[]);
        check("0@705#00 100@706#00", &[]);
    }

    #[test]
    fn a_state_that_changes_back_is_suspicious() {
        check("0@705#05 40@705#7F 1000@705#05", &[(1000, 5, Evidence::ChangingStates)]);
        check("0@705#05 40@705#7F 500@000#0105 1000@705#05", &[]);
        check("0@705#05 1000@705#7F 2000@705#7F 3000@705#04", &[]);
    }

    #[test]
    fn heartbeats_in_two_rhythms_are_suspicious() {
        check("0@705#05 300@705#05 1000@705#05 1300@705#05 2000@705#05", &[(2000, 5, Evidence::TwoRhythms)]);
        check("0@705#05 1000@705#05 2000@705#05 3000@705#05 4000@705#05", &[]);
        // One beat is late, and the next in time.
        check("0@705#05 1000@705#05 2700@705#05 3000@705#05 4000@705#05 5000@705#05", &[]);
        check("0@705#05 3@705#05 10@705#05 13@705#05 20@705#05", &[]);
        // The producer time is known, and the second node is just half a period later.
        let known = "0@605#2B171000E8030000 1@585#6017100000000000";
        check(
            &format!("{known} 10@705#05 510@705#05 1010@705#05 1510@705#05 2010@705#05"),
            &[(2010, 5, Evidence::TwoRhythms)],
        );
        check(&format!("{known} 10@705#05 1010@705#05 2010@705#05 3010@705#05 4010@705#05"), &[]);
    }
}
