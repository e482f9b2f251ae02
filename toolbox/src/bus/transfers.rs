//! SDO transfers, each put together from its frames.

use std::collections::BTreeMap;
use std::fmt;

use lexican_runtime::{AbortCode, Duration, Instant, NodeId};
use serde::{Serialize, Serializer};

use crate::decode::{Decoded, Detail, Sdo, Side, Step};
use crate::text::json::{abort, access};
use crate::values::report::ValueReport;

/// A transfer that is silent for this long is over: no client waits longer.
const FORGOTTEN: Duration = Duration::from_secs(10);

/// Follows the SDO transfers of all nodes.
#[derive(Debug, Default)]
pub struct Transfers {
    open: BTreeMap<NodeId, Transfer>,
}

/// An SDO transfer, from its first frame to its last.
#[derive(Clone, Debug, PartialEq)]
pub struct Transfer {
    /// The server.
    pub node: NodeId,
    /// When it began.
    pub began: Instant,
    /// When its last frame was heard.
    pub ended: Instant,
    /// The number of its frames.
    pub frames: u32,
    /// Whether it is a download; `None` if its beginning was not heard.
    pub writes: Option<bool>,
    /// `expedited`, `segmented` or `block`.
    pub kind: Option<&'static str>,
    /// The entry, with the value if all of it was heard.
    pub report: Option<ValueReport>,
    /// How it ended.
    pub end: End,
}

/// How a transfer ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The value was transferred.
    Done,
    /// One side aborted it.
    Aborted {
        /// The side that aborted.
        by: Side,
        /// The reason.
        code: AbortCode,
    },
    /// Another transfer began, or there was no frame for ten seconds.
    Unanswered,
}

impl Transfers {
    /// Handles a frame; returns the transfer that it ends. A request for a new transfer ends the current one.
    pub fn observe(&mut self, at: Instant, decoded: &Decoded) -> Option<Transfer> {
        let (Detail::Sdo(sdo), Some(node)) = (&decoded.detail, decoded.node) else { return None };
        let unanswered = if begins(sdo) { self.open.remove(&node) } else { None };
        let transfer = self.open.entry(node).or_insert_with(|| Transfer::new(node, at));
        transfer.take(at, sdo);
        if transfer.end == End::Unanswered { unanswered } else { self.open.remove(&node) }
    }

    /// The transfers that have not ended.
    pub fn open(&self) -> impl Iterator<Item = &Transfer> {
        self.open.values()
    }

    /// Ends a transfer without frames for ten seconds; returns it.
    pub fn forget(&mut self, now: Instant) -> Option<Transfer> {
        let (node, _) = self.open.iter().find(|(_, transfer)| now.since(transfer.ended) >= FORGOTTEN)?;
        let node = *node;
        self.open.remove(&node)
    }
}

/// Whether a frame of a client begins a transfer.
fn begins(sdo: &Sdo) -> bool {
    use Step::{InitiateBlockDownload, InitiateBlockUpload, InitiateDownload, InitiateUpload};
    sdo.side == Side::Client
        && matches!(sdo.step, InitiateUpload | InitiateDownload | InitiateBlockUpload | InitiateBlockDownload)
}

impl Transfer {
    fn new(node: NodeId, at: Instant) -> Self {
        let (frames, writes, kind, report) = (0, None, None, None);
        Transfer { node, began: at, ended: at, frames, writes, kind, report, end: End::Unanswered }
    }

    fn take(&mut self, at: Instant, sdo: &Sdo) {
        self.ended = at;
        self.frames += 1;
        self.writes = sdo.writes.or(self.writes);
        self.kind = sdo.transfer.or(self.kind);
        // Keep a report with value if a later frame names only the entry.
        if let Some(report) = sdo.report.as_ref().filter(|it| it.text.is_some() || self.report.is_none()) {
            self.report = Some(report.clone());
        }
        self.end = match sdo.abort {
            Some(code) => End::Aborted { by: sdo.side, code },
            None if sdo.complete => End::Done,
            None => End::Unanswered,
        };
    }

    /// From the first to the last frame.
    #[must_use]
    pub fn duration(&self) -> Duration {
        self.ended.since(self.began)
    }
}

impl Serialize for Transfer {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Fields<'a> {
            #[serde(flatten, serialize_with = "abort")]
            abort: Option<AbortCode>,
            #[serde(skip_serializing_if = "Option::is_none")]
            aborted_by: Option<Side>,
            #[serde(serialize_with = "access", skip_serializing_if = "Option::is_none")]
            access: Option<bool>,
            complete: bool,
            duration: f64,
            frames: u32,
            node: u8,
            #[serde(skip_serializing_if = "Option::is_none")]
            transfer: Option<&'static str>,
            #[serde(flatten)]
            report: &'a Option<ValueReport>,
        }
        let (aborted_by, abort) = match self.end {
            End::Aborted { by, code } => (Some(by), Some(code)),
            _ => (None, None),
        };
        let (complete, duration) = (self.end == End::Done, self.duration().as_secs_f64());
        let Transfer { writes: access, frames, kind: transfer, ref report, .. } = *self;
        Fields { abort, aborted_by, access, complete, duration, frames, node: self.node.get(), transfer, report }
            .serialize(serializer)
    }
}

/// `read 6064:00 Position Actual Value = 0 increments (0.4 ms)`.
impl fmt::Display for Transfer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verb = match self.writes {
            Some(true) => "write ",
            Some(false) => "read ",
            None => "",
        };
        let title = self.report.as_ref().map_or_else(|| "unknown entry".to_owned(), ValueReport::title);
        write!(f, "{verb}{title}")?;
        if let Some(text) = self.report.as_ref().and_then(|report| report.text.as_ref()) {
            write!(f, " = {text}")?;
        }
        match self.end {
            End::Done => {}
            End::Aborted { by, code } => {
                let by = if by == Side::Client { "client" } else { "device" };
                write!(f, ": the {by} aborts: {code}")?;
            }
            End::Unanswered => f.write_str(": no answer")?,
        }
        let frames = if self.frames > 2 { format!("{} frames, ", self.frames) } else { String::new() };
        write!(f, " ({frames}{:.1} ms)", self.duration().as_secs_f64() * 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::Decoder;
    use crate::samples;
    use lexican_runtime::host::candump::Line;

    /// Checks the transfers of a bus with a frame every millisecond, including those that are forgotten at the end.
    #[track_caller]
    fn check(frames: &str, expected: &[&str]) {
        let device = samples::drive();
        let (mut decoder, mut transfers, mut heard) = (Decoder::new(), Transfers::default(), Vec::new());
        decoder.introduce(NodeId::literal(5), &device);
        let mut now = Instant::ZERO;
        for text in frames.split_ascii_whitespace() {
            let frame = format!("(0.000000) can0 {text}").parse::<Line>().unwrap().frame;
            let decoded = decoder.decode(&frame);
            heard.extend(transfers.observe(now, &decoded));
            now += Duration::from_millis(1);
        }
        assert_eq!(transfers.forget(now), None);
        while let Some(transfer) = transfers.forget(now + FORGOTTEN) {
            heard.push(transfer);
        }
        let heard: Vec<_> = heard.iter().map(|it| format!("{}: {it}", it.node)).collect();
        assert_eq!(heard, expected, "{frames}");
    }

    #[test]
    fn what_has_no_answer_ends_by_the_next_request_or_is_forgotten() {
        check(
            "605#4064600000000000 605#4041600000000000 606#4000100000000000 585#4B41600037020000",
            &[
                "5: read 6064:00 Position Actual Value: no answer (0.0 ms)",
                "5: read 6041:00 Statusword = OPERATION ENABLED + voltage enabled + remote (2.0 ms)",
                "6: read 1000:00: no answer (0.0 ms)",
            ],
        );
        // A response to a missed request, and an abort without a transfer.
        check(
            "585#4364600000000000 606#8000100000000405",
            &[
                "5: read 6064:00 Position Actual Value = 0 increments (0.0 ms)",
                "6: 1000:00: the client aborts: 0504 0000: SDO protocol timed out (0.0 ms)",
            ],
        );
    }
}
