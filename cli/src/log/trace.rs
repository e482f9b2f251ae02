//! `lexican convert --to trace`: turns the log of one device into frames to ask a device again.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use lexican_conform::{Row, Trace};
use lexican_eds::model::{AccessType, Device, Value};
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_toolbox::decode::{Decoded, Decoder, Detail, Sdo, Service, Side, Step};
use lexican_toolbox::log::{Reader, Selection};
use serde_json::json;

use super::{frames, is_pipe, remark_on};
use crate::bus::node_id;
use crate::device::load;
use crate::output::{Failure, ForceArgs, Outcome, note, plural, print_result, stdout};
use lexican_toolbox::text::duration::in_milliseconds;

/// Of a trace: which device it is about.
#[derive(clap::Args, Debug)]
pub(super) struct Traced {
    /// Of a trace: the node whose frames are meant; may be left out if only one is asked in the log
    #[arg(long, value_name = "NODE", value_parser = node_id)]
    node: Option<NodeId>,

    /// Of a trace: the data sheet, which says what is measured: an EDS, DCF or XDD file, or a device that lexican knows
    #[arg(long, value_name = "FILE|DEVICE")]
    device: Option<String>,

    /// Of a trace: corrections and meanings in addition to the data sheet (TOML); may be given several times
    #[arg(long, value_name = "FILE", requires = "device")]
    overlay: Vec<PathBuf>,
}

impl Traced {
    /// Refuses options that have no effect when converting to another log.
    pub(super) fn belong_to_a_trace(&self) -> Result<(), Failure> {
        if self.node.is_none() && self.device.is_none() {
            return Ok(());
        }
        Err(Failure::new("--node and --device are for traces")
            .help("`--to trace`, or a file that ends in .csv, makes one"))
    }
}

/// Shorter pauses before a request are due to the computer, and are not kept.
const PAUSE: Duration = Duration::from_millis(5);
/// The pause before a message that is sent in a cycle.
const CYCLE: Duration = Duration::from_millis(1);
/// A value that lasted this long is expected again, whatever the phase.
const HELD: Duration = Duration::from_millis(100);
/// The time that a device may take to boot.
const BOOT: Duration = Duration::from_secs(5);
/// The longest time in a condition.
const LONGEST: Duration = Duration::from_secs(3600);

/// Objects of CiA 301, 401 and 402 that are measured or counted.
const MEASURED: [u16; 30] = [
    0x1002, 0x1013, 0x6000, 0x6020, 0x6043, 0x6044, 0x6053, 0x6054, 0x6062, 0x6063, 0x6064, 0x6069, 0x606B, 0x606C,
    0x6074, 0x6077, 0x6078, 0x6079, 0x60B9, 0x60BA, 0x60BB, 0x60BC, 0x60BD, 0x60F4, 0x60FA, 0x60FC, 0x60FD, 0x6400,
    0x6401, 0x6402,
];

/// Objects that are read-only and mapped, but are states, not measurements.
const STATES: [u16; 4] = [0x1001, 0x603F, 0x6041, 0x6061];

pub(super) fn run(
    args: &Traced,
    mut reader: Reader,
    selection: &Selection,
    output: &Path,
    force: &ForceArgs,
    as_json: bool,
) -> Result<Outcome, Failure> {
    let sheet = args.device.as_deref().map(|name| load(name, &args.overlay)).transpose()?;
    let device = sheet.as_ref().map(|sheet| &sheet.device);
    let (mut log, mut begin, mut number) = (Vec::new(), None, 0_u64);
    while let Some(record) = reader.next() {
        let record = record?;
        number += 1;
        if selection.contains(&record, *begin.get_or_insert(record.at)) {
            let place = reader.line().map_or_else(|| format!("frame {number}"), |line| format!("log line {line}"));
            log.push((place, record.at, record.frame));
        }
    }
    remark_on(reader.skipped());
    let node = args.node.map_or_else(|| only_node(log.iter().map(|(_, _, frame)| frame)), Ok)?;
    let mut recorder = Recorder::new(node, device);
    let first = log.first().map_or(Instant::ZERO, |(_, at, _)| *at);
    for (place, at, frame) in &log {
        let source = format!("{place}, {:.3} s", at.since(first).as_secs_f64());
        recorder.take(&source, *at, frame);
    }
    let (left_out, knows_beginning, is_guessed) = (recorder.left_out, recorder.has_booted, device.is_none());
    let rows = recorder.rows();
    if !rows.iter().any(|row| row.direction == "send") {
        return Err(Failure::new(format_args!(
            "nothing in the log is sent to node {node}: a device cannot be asked by it"
        ))
        .help("--node names another node; `lexican monitor --bus log:FILE` shows what the log has"));
    }
    let text = Trace::csv(&rows).map_err(Failure::new)?;
    if !knows_beginning {
        note("the log does not begin with the boot-up of the node: what was set before it is missing in the trace");
    }
    if is_guessed {
        note("without --device, values are compared as recorded unless CiA 301 or 402 says that they are measured");
    }
    if is_pipe(output) {
        stdout().write_all(text.as_bytes())?;
        return Ok(Outcome::Clean);
    }
    force.write(output, text.as_bytes())?;
    let fields = json!({ "to": "trace", "from": reader.format().to_string(), "node": node.get(),
        "frames": log.len(), "steps": rows.len(), "left_out": left_out, "bytes": text.len() });
    let (steps, of) = (plural(rows.len(), "step"), frames(log.len() as u64));
    let others = if left_out > 0 { format!(", {left_out} of them of others") } else { String::new() };
    print_result(as_json, fields, format!("{}: {steps} with node {node}, of {of}{others}", output.display()))?;
    Ok(Outcome::Clean)
}

/// The only node that is accessed by SDO or commanded; an error if there are several.
fn only_node<'f>(frames: impl Iterator<Item = &'f Frame>) -> Result<NodeId, Failure> {
    let asked = frames.filter(|frame| !frame.is_remote()).filter_map(|frame| match frame.id().raw() {
        0x000 => NodeId::new(*frame.data().get(1)?),
        id @ 0x601..=0x67F if !frame.id().is_extended() => NodeId::new((id & 0x7F) as u8),
        _ => None,
    });
    let asked: BTreeSet<u8> = asked.map(NodeId::get).collect();
    match (asked.len(), asked.first().copied().and_then(NodeId::new)) {
        (1, Some(node)) => Ok(node),
        (0, _) => {
            Err(Failure::new("no node is asked by SDO or commanded by NMT in the log").help("name it with --node"))
        }
        _ => {
            let nodes: Vec<String> = asked.iter().map(u8::to_string).collect();
            Err(Failure::new(format_args!("nodes {} are asked in the log, and a trace is of one", nodes.join(", ")))
                .help("name it with --node"))
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Sent by the manager; it has an effect.
    Command,
    /// Sent by the manager; a request, or the continuation of a transfer.
    Question,
    /// Sent by the device as an answer.
    Answer,
    /// Sent once by the device itself.
    Event,
    /// Sent repeatedly by the device itself.
    Repeated,
}

/// A row of the trace, while the log is read.
struct Entry {
    row: Row,
    kind: Kind,
    at: Instant,
    /// Since when its data has been the same.
    settled: Instant,
    /// Whether earlier answers to the same request had other data.
    varied: bool,
    /// The number of frames that it stands for.
    frames: u32,
    dropped: bool,
}

struct Recorder<'d> {
    node: NodeId,
    device: Option<&'d Device>,
    decoder: Decoder<'d>,
    entries: Vec<Entry>,
    left_out: u64,
    /// Whether the device booted before it was asked anything.
    has_booted: bool,
    /// Whether it was OPERATIONAL before anything was sent.
    was_operational: bool,
    /// Whether its boot-up message is expected.
    is_reset: bool,
    /// Whether its state was requested by a remote frame.
    is_guarded: bool,
    /// Whether the device produces SYNC.
    sends_sync: bool,
    /// The nodes whose heartbeats it consumes.
    consumed: BTreeSet<u8>,
    /// The read without an answer yet, as a position among the entries.
    read: Option<usize>,
    /// Reads since the last command, with their answers: a repeated read becomes a wait.
    reads: BTreeMap<Vec<u8>, (usize, usize)>,
    /// The last repeated entry for each COB-ID.
    last: BTreeMap<CobId, usize>,
}

impl<'d> Recorder<'d> {
    fn new(node: NodeId, device: Option<&'d Device>) -> Self {
        let mut decoder = Decoder::new();
        device.iter().for_each(|device| decoder.introduce(node, device));
        let mut recorder = Recorder {
            node,
            device,
            decoder,
            entries: Vec::new(),
            left_out: 0,
            has_booted: false,
            was_operational: false,
            is_reset: false,
            is_guarded: false,
            sends_sync: false,
            consumed: BTreeSet::new(),
            read: None,
            reads: BTreeMap::new(),
            last: BTreeMap::new(),
        };
        for entry in device.iter().flat_map(|device| device.entries()) {
            if let Some(Value::Integer(number)) = entry.configured.as_ref().or(entry.default.as_ref()) {
                recorder.is_set(Address::new(entry.index, entry.sub), *number as u32);
            }
        }
        recorder
    }

    /// Learns from a written value who sends what.
    fn is_set(&mut self, address: Address, value: u32) {
        match (address.index(), address.sub()) {
            (0x1005, 0) => self.sends_sync = value >> 30 & 1 == 1,
            (0x1016, 1..) if value as u16 != 0 => _ = self.consumed.insert((value >> 16) as u8 & 0x7F),
            _ => {}
        }
    }

    fn take(&mut self, source: &str, at: Instant, frame: &Frame) {
        let open = self.open_in_pdo(frame);
        let decoded = self.decoder.decode(frame);
        let of_node = decoded.node == Some(self.node);
        let (kind, open) = match (decoded.service, &decoded.detail) {
            (Service::Nmt, Detail::Nmt(command)) if of_node || decoded.node.is_none() => {
                self.is_reset = matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication);
                (Kind::Command, 0)
            }
            (Service::Sync, _) if self.sends_sync => (Kind::Repeated, u64::MAX),
            (Service::Sync, _) => (Kind::Question, 0),
            (Service::Time, _) => (Kind::Question, 0),
            (Service::Emcy, _) if of_node => (Kind::Event, !0xFF_FFFF),
            (Service::Sdo, Detail::Sdo(sdo)) if of_node => self.sdo(sdo),
            (Service::Rpdo, _) if of_node && !frame.is_remote() => (Kind::Command, 0),
            (Service::Tpdo, _) if of_node && frame.is_remote() => (Kind::Question, 0),
            (Service::Tpdo, _) if of_node => {
                self.was_operational |= self.entries.is_empty();
                (Kind::Repeated, open)
            }
            (Service::ErrorControl, _) if of_node => self.error_control(frame),
            (Service::ErrorControl, _)
                if !frame.is_remote() && decoded.node.is_some_and(|node| self.consumed.contains(&node.get())) =>
            {
                (Kind::Question, 0)
            }
            (Service::Lss, _) if frame.id().raw() == 0x7E5 => (Kind::Command, 0),
            // Of the serial number.
            (Service::Lss, _) => (Kind::Answer, if frame.data().first() == Some(&0x5D) { !0xFF } else { 0 }),
            _ => {
                self.left_out += 1;
                return;
            }
        };
        let is_sent = matches!(kind, Kind::Command | Kind::Question);
        // Answers before the first request belong to none.
        if is_sent || !self.entries.is_empty() {
            self.add(kind, open, source, at, frame, &decoded);
        }
    }

    fn sdo(&mut self, sdo: &Sdo) -> (Kind, u64) {
        let report = sdo.report.as_ref();
        if let (Some(true), Step::InitiateDownload, Some(report)) = (sdo.writes, sdo.step, report)
            && let Some(raw) = report.raw.as_ref().and_then(|raw| raw.first_chunk::<4>())
        {
            self.is_set(report.address, u32::from_le_bytes(*raw));
        }
        if sdo.side == Side::Client {
            let reads = sdo.writes == Some(false) && sdo.step != Step::Abort;
            return (if reads { Kind::Question } else { Kind::Command }, 0);
        }
        let open = report.map_or(0, |report| self.open(report.address));
        let open = match sdo.step {
            Step::InitiateUpload | Step::InitiateBlockUpload => open << 32,
            Step::UploadSegment | Step::BlockSegment | Step::EndBlockUpload if open != 0 => !0xFF,
            _ => 0,
        };
        (Kind::Answer, open)
    }

    fn error_control(&mut self, frame: &Frame) -> (Kind, u64) {
        if frame.is_remote() {
            self.is_guarded = true;
            return (Kind::Question, 0);
        }
        if frame.data() == [0] {
            self.has_booted |= self.entries.is_empty();
            return (if std::mem::take(&mut self.is_reset) { Kind::Answer } else { Kind::Event }, 0);
        }
        self.was_operational |= self.entries.is_empty() && frame.data() == [5];
        // The toggle bit depends on the number of earlier requests.
        if std::mem::take(&mut self.is_guarded) { (Kind::Answer, 0x80) } else { (Kind::Repeated, 0) }
    }

    /// The bits of a value that may differ the next time.
    fn open(&self, address: Address) -> u64 {
        let (index, sub) = (address.index(), address.sub());
        let entry = self.device.and_then(|device| device.entry(index, sub));
        // Objects of the profile repeat every 800h for up to eight axes.
        let index = if (0x6800..0xA000).contains(&index) { 0x6000 + (index - 0x6000) % 0x800 } else { index };
        let is_input = entry.is_some_and(|entry| {
            let is_read = matches!(entry.access, AccessType::Ro | AccessType::Rwr);
            // For manufacturer objects, mappability is no sign: currents and temperatures are often not mappable.
            let is_number = self.device.is_some_and(|device| device.bits(entry.data_type).is_some());
            is_read && (entry.pdo_mapping || (0x2000..0x6000).contains(&index) && is_number)
        });
        match (index, sub) {
            (0x1003, 1..) => 0xFFFF_0000,
            (0x1003, 0) | (0x1018, 4) => u64::MAX,
            _ if STATES.contains(&index) => 0,
            _ if is_input || MEASURED.contains(&index) => u64::MAX,
            _ => 0,
        }
    }

    /// The bits of a PDO that may differ the next time; all of them if its mapping is unknown.
    fn open_in_pdo(&self, frame: &Frame) -> u64 {
        let mapping = self.decoder.mapping(frame);
        if mapping.is_empty() {
            return u64::MAX;
        }
        let (mut open, mut at) = (0_u64, 0_u32);
        for mapped in mapping {
            let bits = u32::from(mapped.bits.min(64));
            let value =
                self.open(Address::new(mapped.index, mapped.sub)) & u64::MAX.checked_shr(64 - bits).unwrap_or(0);
            open |= value.checked_shl(at).unwrap_or(0);
            at += bits;
        }
        open
    }

    fn add(&mut self, kind: Kind, open: u64, source: &str, at: Instant, frame: &Frame, decoded: &Decoded) {
        let is_sent = matches!(kind, Kind::Command | Kind::Question);
        let mut bytes = frame.data().to_vec();
        if decoded.service == Service::Nmt && decoded.node.is_none() {
            // A command to all nodes becomes one to this node.
            bytes.iter_mut().skip(1).for_each(|node| *node = self.node.get());
        }
        let data = if frame.is_remote() { format!("R{}", frame.dlc()) } else { text(&bytes, open) };
        if kind == Kind::Repeated
            && let Some(entry) = self.last.get(&frame.id()).and_then(|at| self.entries.get_mut(*at))
            && entry.row.data == data
        {
            entry.frames += 1;
            return;
        }
        let separator = if decoded.text.is_empty() { "" } else { ": " };
        let row = Row {
            cob_id: frame.id().to_string(),
            direction: if is_sent { "send" } else { "expect" },
            data,
            condition: String::new(),
            meaning: format!("{}{separator}{}", decoded.name, decoded.text),
            source: source.to_owned(),
        };
        let number = self.entries.len();
        self.entries.push(Entry { row, kind, at, settled: at, varied: false, frames: 1, dropped: false });
        match kind {
            Kind::Command => self.reads.clear(),
            Kind::Question => {
                let is_read = matches!(&decoded.detail, Detail::Sdo(sdo) if sdo.step == Step::InitiateUpload);
                self.read = if is_read { Some(number) } else { self.read.filter(|_| decoded.service != Service::Sdo) };
            }
            Kind::Answer => {
                let is_all = matches!(&decoded.detail, Detail::Sdo(sdo) if sdo.complete);
                if let Some(read) = self.read.take().filter(|_| is_all) {
                    self.is_answered(read, number);
                }
            }
            Kind::Event => {}
            Kind::Repeated => _ = self.last.insert(frame.id(), number),
        }
    }

    /// Merges a repeated read without a command in between: only the final answer matters.
    fn is_answered(&mut self, read: usize, answer: usize) {
        let question = self.entries[read].row.data.clone().into_bytes();
        let Some((last_read, last_answer)) = self.reads.insert(question, (read, answer)) else { return };
        let (asked, since, varied) =
            (self.entries[last_read].at, self.entries[last_answer].settled, self.entries[last_answer].varied);
        let is_same = self.entries[last_answer].row.data == self.entries[answer].row.data;
        (self.entries[last_read].dropped, self.entries[last_answer].dropped) = (true, true);
        self.entries[read].at = asked;
        let entry = &mut self.entries[answer];
        entry.varied = varied || !is_same;
        if is_same {
            entry.settled = since;
        }
    }

    /// The rows with their conditions.
    fn rows(mut self) -> Vec<Row> {
        self.drop_passing();
        let mut rows = Vec::new();
        let Some(first) = self.entries.first().map(|entry| entry.at) else { return rows };
        if self.was_operational {
            let data = text(&[NmtCommand::Start.code(), self.node.get()], 0);
            let meaning = "the log begins in OPERATIONAL".to_owned();
            rows.push(Row { cob_id: "000".into(), direction: "send", data, meaning, ..Row::default() });
        }
        let mut base = first;
        let mut asked = first;
        for entry in self.entries.into_iter().filter(|entry| !entry.dropped) {
            let Entry { mut row, kind, at, settled, varied, .. } = entry;
            let mut conditions = Vec::new();
            match kind {
                Kind::Command | Kind::Question => {
                    let is_cyclic = !row.cob_id.starts_with('6') && row.cob_id != "000";
                    // Rounded to whole milliseconds.
                    let pause = Duration::from_millis((at.since(base).as_micros() + 500) / 1000).min(LONGEST);
                    if pause >= if is_cyclic { CYCLE } else { PAUSE } {
                        conditions.push(format!("after {}ms", in_milliseconds(pause)));
                    }
                    (asked, base) = (at, base.max(at));
                }
                Kind::Answer => {
                    let waits = settled.since(asked);
                    if varied || row.cob_id.starts_with('7') || waits > Duration::from_millis(200) {
                        let most =
                            waits.times(2).max(if row.cob_id.starts_with('7') { BOOT } else { Duration::from_secs(1) });
                        conditions.push(format!("until {}s", most.min(LONGEST).as_micros().div_ceil(1_000_000)));
                    }
                    base = base.max(settled);
                }
                // Long enough for slow heartbeats as well.
                Kind::Event | Kind::Repeated => conditions.extend(["any time".to_owned(), "until 5s".to_owned()]),
            }
            row.condition = conditions.join("; ");
            rows.push(row);
        }
        rows
    }

    /// Drops messages that the device sends by itself and may not send again: values that lasted only for a moment
    /// between two others, and states that a heartbeat may miss.
    fn drop_passing(&mut self) {
        let mut of_id: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (number, entry) in self.entries.iter().enumerate().filter(|(_, entry)| entry.kind == Kind::Repeated) {
            of_id.entry(entry.row.cob_id.clone()).or_default().push(number);
        }
        for numbers in of_id.values() {
            let mut kept: Option<String> = None;
            for (place, number) in numbers.iter().enumerate() {
                let next = numbers.get(place + 1).map(|next| self.entries[*next].at);
                let entry = &mut self.entries[*number];
                let is_phase = entry.row.cob_id.starts_with('7');
                let is_held = next.is_none_or(|next| !is_phase && next.since(entry.at) >= HELD) || entry.frames > 1;
                entry.dropped = !is_held || kept.as_ref() == Some(&entry.row.data);
                if !entry.dropped {
                    kept = Some(entry.row.data.clone());
                }
            }
        }
    }
}

/// Bytes in hexadecimal, with `x` for digits with an open bit.
fn text(data: &[u8], open: u64) -> String {
    let digit = |value: u8, open: u8| if open == 0 { format!("{value:X}") } else { "x".to_owned() };
    let bytes = data.iter().zip(open.to_le_bytes());
    let bytes = bytes.map(|(byte, open)| digit(byte >> 4, open >> 4) + &digit(byte & 0xF, open & 0xF));
    bytes.collect::<Vec<_>>().join(" ")
}
