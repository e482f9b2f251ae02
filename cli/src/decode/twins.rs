//! Two nodes with one node-ID, as far as somebody who only listens can tell.
//!
//! Nothing on a bus says who sent a frame. What gives two nodes away is what one node would not do:
//!
//! - an SDO answer that nobody asked for. A server answers once (CiA 301, 7.2.4.3), except within a block
//!   transfer, and may abort by itself when it waited too long;
//! - a boot-up message of a node that was heard a moment ago and that nobody reset;
//! - a state that changes and changes back without an NMT command;
//! - heartbeats in two rhythms: short, long, short, long; or more of them than the producer time (1017h), where
//!   it was read or written, allows.
//!
//! A listener may have missed a frame, and a node may restart by itself, so each is a suspicion, and says what
//! else it could be. Two nodes that send the very same bits at the same time are one to everybody.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;

use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{AbortCode, Duration, Instant, NodeId};

use super::detail::{Sdo, Side, Step};
use super::{Decoded, Detail};

/// A node that was heard so short a time ago cannot have lost and regained its power since.
const MOMENT: Duration = Duration::from_millis(500);

/// A request that is older will not be answered any more.
const FORGOTTEN: Duration = Duration::from_secs(10);

/// The same suspicion is told again after this time.
const AGAIN: Duration = Duration::from_secs(10);

/// Rhythms that are faster say more of the adapter's buffering than of the nodes.
const SLOW_ENOUGH: Duration = Duration::from_millis(100);

/// How many heartbeats a rhythm is looked for in.
const BEATS: usize = 5;

/// What looks as if two nodes had one node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Evidence {
    SecondAnswer,
    BootUp,
    States,
    Beats,
}

impl Evidence {
    /// The name in JSON.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Evidence::SecondAnswer => "second-answer",
            Evidence::BootUp => "boot-up-while-alive",
            Evidence::States => "changing-states",
            Evidence::Beats => "two-rhythms",
        }
    }
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Evidence::SecondAnswer => "it answers what nobody asked; or a request was missed",
            Evidence::BootUp => {
                "it boots up though it was alive a moment ago and nobody reset it; or it restarts by itself"
            }
            Evidence::States => "its state changes to and fro without a command; or a command was missed",
            Evidence::Beats => "its heartbeats have two rhythms",
        })
    }
}

/// Watches out for nodes that share a node-ID.
#[derive(Default)]
pub(crate) struct Twins {
    nodes: BTreeMap<NodeId, Witness>,
}

impl Twins {
    /// Takes note of a frame; a suspicion is told once in a while only.
    pub(crate) fn notice(&mut self, at: Instant, decoded: &Decoded) -> Option<(NodeId, Evidence)> {
        if let Detail::Nmt(command) = decoded.detail {
            let resets = command.target() == NmtState::Initialising;
            let meant = self.nodes.iter_mut().filter(|(node, _)| decoded.node.is_none_or(|meant| meant == **node));
            meant.for_each(|(_, witness)| witness.commanded(resets));
            return None;
        }
        let node = decoded.node?;
        let witness = self.nodes.entry(node).or_default();
        let evidence = witness.notice(at, &decoded.detail)?;
        let fresh = witness.told.get(&evidence).is_none_or(|told| at.since(*told) >= AGAIN);
        if fresh {
            witness.told.insert(evidence, at);
        }
        fresh.then_some((node, evidence))
    }
}

/// What is known of one node-ID.
#[derive(Default)]
struct Witness {
    /// How many SDO requests are not answered; `None` when nobody can tell.
    asked: Option<u32>,
    asked_at: Instant,
    /// Whether answers to heard requests were heard.
    answers: bool,
    /// When the node was heard last; forgotten when it is reset.
    alive: Option<Instant>,
    state: Option<NmtState>,
    state_before: Option<NmtState>,
    beats: VecDeque<Instant>,
    /// The producer heartbeat time, where it was seen.
    period: Option<Duration>,
    told: BTreeMap<Evidence, Instant>,
}

impl Witness {
    fn commanded(&mut self, resets: bool) {
        (self.state, self.state_before) = (None, None);
        if resets {
            self.alive = None;
            self.beats.clear();
        }
    }

    fn notice(&mut self, at: Instant, detail: &Detail) -> Option<Evidence> {
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
            // Who answers what in a block transfer is not worth counting.
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

    /// 1017h was read, or taken.
    fn learn_period(&mut self, sdo: &Sdo) {
        let told = sdo.told.as_ref().filter(|told| sdo.complete && told.address.index() == 0x1017);
        if let Some([low, high, ..]) = told.and_then(|told| told.raw.as_deref()) {
            let ms = u16::from_le_bytes([*low, *high]);
            self.period = (ms > 0).then(|| Duration::from_millis(ms.into()));
            self.beats.clear();
        }
    }

    fn boot_up(&mut self, at: Instant) -> Option<Evidence> {
        let was_alive = self.alive.is_some_and(|alive| at.since(alive) < MOMENT);
        *self = Witness { told: std::mem::take(&mut self.told), answers: self.answers, ..Witness::default() };
        was_alive.then_some(Evidence::BootUp)
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
        if back { Some(Evidence::States) } else { self.two_rhythms().then_some(Evidence::Beats) }
    }

    fn two_rhythms(&self) -> bool {
        let times: Vec<u64> = self.beats.iter().map(|beat| beat.as_micros()).collect();
        let gaps: Vec<u64> = times.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
        let &[a, b, c, d] = gaps.as_slice() else { return false };
        let enough = |sum: u64| sum >= SLOW_ENOUGH.as_micros();
        // One producer may be late, and in time again with its next; it is not early over three periods.
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

    /// What is suspected while these frames are heard; each behind its time in ms.
    #[track_caller]
    fn check(script: &str, expected: &[(u64, u8, Evidence)]) {
        let (mut decoder, mut twins, mut found) = (Decoder::new(), Twins::default(), Vec::new());
        for word in script.split_whitespace() {
            let (ms, frame) = word.split_once('@').unwrap();
            let ms: u64 = ms.parse().unwrap();
            let line: Line = format!("(0.000000) can0 {frame}").parse().unwrap();
            let suspicion = twins.notice(Instant::from_micros(ms * 1000), &decoder.decode(&line.frame));
            found.extend(suspicion.map(|(node, evidence)| (ms, node.get(), evidence)));
        }
        assert_eq!(found, expected, "{script}");
    }

    const READ: &str = "605#4000100000000000";
    const ANSWER: &str = "585#4300100092010000";

    #[test]
    fn an_answer_that_nobody_asked_for_is_suspicious() {
        check(&format!("0@{READ} 1@{ANSWER} 2@{READ} 3@{ANSWER}"), &[]);
        check(&format!("0@{READ} 1@{ANSWER} 2@{ANSWER}"), &[(2, 5, Evidence::SecondAnswer)]);
        // Told once in ten seconds.
        let twice = format!("0@{READ} 1@{ANSWER} 2@{ANSWER} 3@{ANSWER} 11000@{ANSWER}");
        check(&twice, &[(2, 5, Evidence::SecondAnswer), (11000, 5, Evidence::SecondAnswer)]);
        // One who retries gets two answers; one who hears no requests cannot tell; a server may give up.
        check(&format!("0@{READ} 1@{READ} 2@{ANSWER} 3@{ANSWER}"), &[]);
        check(&format!("0@{ANSWER} 1@{ANSWER} 2@{ANSWER}"), &[]);
        check(&format!("0@{READ} 1@{ANSWER} 2000@585#8000000000000405"), &[]);
        check(&format!("0@{READ} 1@{ANSWER} 2@585#8000100000000206"), &[(2, 5, Evidence::SecondAnswer)]);
    }

    #[test]
    fn blocks_have_many_answers() {
        check(
            "0@605#A0081000FF000000 1@585#C2081000 2@585#C20810000A000000 3@605#A300000000000000 \
             4@585#0164657669636500 5@585#8264657669636500 6@605#A2027F0000000000 7@585#C500000000000000 \
             8@605#A100000000000000",
            &[],
        );
    }

    #[test]
    fn a_boot_up_while_alive_is_suspicious_unless_somebody_reset_the_node() {
        check("0@705#00 100@705#7F 200@705#00", &[(200, 5, Evidence::BootUp)]);
        check("0@705#00 10@705#00", &[(10, 5, Evidence::BootUp)]);
        check("0@705#00 100@705#7F 150@000#8105 200@705#00", &[]);
        check("0@705#00 100@705#7F 150@000#8200 200@705#00", &[]);
        check("0@705#00 100@705#7F 150@000#8106 200@705#00", &[(200, 5, Evidence::BootUp)]);
        check("0@705#00 100@705#7F 2000@705#00", &[]);
        check("0@705#00 100@706#00", &[]);
    }

    #[test]
    fn a_state_that_changes_to_and_fro_is_suspicious() {
        check("0@705#05 40@705#7F 1000@705#05", &[(1000, 5, Evidence::States)]);
        check("0@705#05 40@705#7F 500@000#0105 1000@705#05", &[]);
        check("0@705#05 1000@705#7F 2000@705#7F 3000@705#04", &[]);
    }

    #[test]
    fn heartbeats_in_two_rhythms_are_suspicious() {
        check("0@705#05 300@705#05 1000@705#05 1300@705#05 2000@705#05", &[(2000, 5, Evidence::Beats)]);
        check("0@705#05 1000@705#05 2000@705#05 3000@705#05 4000@705#05", &[]);
        // One beat is late, and the next in time.
        check("0@705#05 1000@705#05 2700@705#05 3000@705#05 4000@705#05 5000@705#05", &[]);
        check("0@705#05 3@705#05 10@705#05 13@705#05 20@705#05", &[]);
        // The producer time is known, and the second node is just half a period later.
        let known = "0@605#2B171000E8030000 1@585#6017100000000000";
        check(
            &format!("{known} 10@705#05 510@705#05 1010@705#05 1510@705#05 2010@705#05"),
            &[(2010, 5, Evidence::Beats)],
        );
        check(&format!("{known} 10@705#05 1010@705#05 2010@705#05 3010@705#05 4010@705#05"), &[]);
    }
}
