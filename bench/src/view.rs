//! What clients show. Times are in seconds since the bench was opened, or since the first frame of a log.

#![allow(missing_docs, reason = "a field has a comment where its name does not say all")]

use std::borrow::Cow;

use lexican_toolbox::drive::Verb;
use serde::{Deserialize, Serialize};

/// A snapshot of the bus. Clients are sent the fields that have changed.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct View {
    pub time: f64,
    pub bus: Bus,
    /// The nodes heard, found or named, ascending.
    pub nodes: Vec<Node>,
    /// The nodes that are drives.
    pub drives: Vec<Drive>,
    pub devices: Vec<Simulated>,
    /// Running jobs, and those that ended last.
    pub jobs: Vec<Job>,
    /// Watched values.
    pub watched: Vec<Watched>,
    pub trace: Trace,
    pub control: Control,
    /// The recorded log, if the bus is one.
    pub log: Option<Log>,
    pub kept: Kept,
}

/// What the file of a machine keeps for the bench, besides watched values.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Kept {
    /// The sequences that the file lists.
    pub sequences: Vec<String>,
    /// The messages that the file lists: sequences of one line, after which drives are not stopped.
    pub messages: Vec<String>,
    /// The filters of the trace that the file lists, by name.
    pub filters: Vec<(String, TraceFilter)>,
    /// While recording: the number of lines so far.
    pub recorded: Option<u32>,
}

/// Selects frames of the trace, in the notation of `lexican monitor`'s options.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(default)]
pub struct TraceFilter {
    /// `5`, `3,5-9`.
    pub nodes: String,
    /// `sdo,emcy`.
    pub services: String,
    /// `sync,heartbeat`.
    pub without: String,
    /// `Statusword`, `6041`.
    pub object: String,
    /// `180-1FF`.
    pub ids: String,
    /// A part of the text.
    pub text: String,
    /// Whether to select only frames that report an error.
    pub alarming: bool,
    /// Whether to show SDO transfers as one row each.
    pub transfers: bool,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Bus {
    /// `can0`, `demo`, `bus.log`.
    pub name: String,
    pub is_writable: bool,
    /// In bit/s; `None` if unknown.
    pub bit_rate: Option<u32>,
    /// The controller's state, `active` or `off`; or why the bus is lost.
    pub state: String,
    pub frames: u64,
    /// In the last second.
    pub frames_per_second: u32,
    /// In the last second; `None` without a bit rate.
    pub load_percent: Option<f64>,
    /// In the second with the most bits.
    pub load_percent_peak: Option<f64>,
    /// Frames lost between the controller and the bench.
    pub missing_frames: u64,
    /// The rates by COB-ID.
    pub ids: Vec<Rate>,
    /// What is wrong on the bus, which node causes it, and what to do.
    pub troubles: Vec<Trouble>,
}

/// The frames with one COB-ID.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Rate {
    /// `185`.
    pub id: String,
    /// `TPDO1`.
    pub name: String,
    /// `None` for broadcasts.
    pub node: Option<u8>,
    pub frames: u64,
    /// In the last second.
    pub per_second: f64,
    /// The standard deviation of the intervals between frames, in ms.
    pub jitter_ms: Option<f64>,
    /// The share of all bits in the last second.
    pub share_percent: f64,
}

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Trouble {
    pub since: f64,
    /// The node that causes it, if it is one.
    pub node: Option<u8>,
    /// `node 7 is silent for 2.3 s`.
    pub text: String,
    /// The row number in the trace that shows it.
    pub row: Option<u64>,
    /// Whether it is past, and shown until it is acknowledged.
    pub is_over: bool,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Node {
    pub id: u8,
    /// The name in the plant, else 1008h, else that of its data sheet.
    pub name: String,
    /// The name of the data sheet: `siko/ag03-1`.
    pub sheet: Option<String>,
    /// Whether it stores a data sheet (1021h) that is not used.
    pub stores_sheet: bool,
    /// 1018h as far as known: vendor-ID, product code, revision number, serial number.
    pub identity: [Option<u32>; 4],
    /// `OPERATIONAL`; `None` if unknown.
    pub state: Option<String>,
    /// When the state was seen.
    pub seen: Option<Seen>,
    /// The mean interval of its heartbeats, in ms.
    pub heartbeat_ms: Option<f64>,
    /// How long it has been silent; `None` unless it should have been heard.
    pub silent_seconds: Option<f64>,
    /// The present faults.
    pub faults: Vec<Fault>,
    /// Past faults, newest first.
    pub history: Vec<Fault>,
    /// The median SDO response time, in ms.
    pub sdo_ms: Option<f64>,
    pub aborts: u32,
    pub boots: u32,
    /// What the drive or its data sheet lacks for moving it, and what is used instead.
    pub lacks: Vec<Lack>,
    /// Changes since the bench was opened: `the state: PRE-OPERATIONAL, now OPERATIONAL`.
    pub changes: Vec<String>,
}

/// Something that a drive or its data sheet lacks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Lack {
    /// Whether the drive cannot be moved without it.
    pub is_needed: bool,
    /// What is missing or used instead, with the remedy.
    pub text: Cow<'static, str>,
}

/// An emergency.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Fault {
    /// When it came.
    pub at: f64,
    /// `3210`.
    pub code: String,
    /// The meaning of the code: `DC link over-voltage; the brake resistor is too small`.
    pub text: String,
    pub row: u64,
}

/// An entry of a data sheet.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Object {
    /// `6081:00`.
    pub address: String,
    /// The name of its object.
    pub object: String,
    /// Its own name, or that of the object for a single value.
    pub name: String,
    /// The area of the dictionary: `Communication`, `Manufacturer`, `Drive`.
    pub group: String,
    /// `UNSIGNED32`.
    pub data_type: String,
    /// The size in a PDO; `None` if it is not fixed.
    pub bits: Option<u8>,
    /// `rw`, `ro`, `wo`, `const`.
    pub access: String,
    /// `tpdo`, `rpdo`, `both`; `None` if it cannot be mapped.
    pub mappable: Option<String>,
    /// The default as text.
    pub default: Option<String>,
    pub low: Option<String>,
    pub high: Option<String>,
    /// The names that can be written: of its enumeration or bits.
    pub choices: Vec<String>,
    pub unit: Option<String>,
    /// The description from the overlay.
    pub help: Option<String>,
    /// The last known value.
    pub value: Option<Value>,
}

/// A value of an entry.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Value {
    /// `6064:00`.
    pub address: String,
    /// With its unit, or as names; or why it could not be read.
    pub text: String,
    /// The number in its unit; `None` if it is none.
    pub number: Option<f64>,
    /// The bytes on the wire, in hexadecimal.
    pub raw: String,
    pub at: f64,
    pub is_error: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Watched {
    pub node: u8,
    /// `6064:00`.
    pub address: String,
    pub name: String,
    /// The interval of reading, in ms.
    pub every_ms: u32,
    pub value: Option<Value>,
    pub seen: Option<Seen>,
    /// The lowest and the highest number so far.
    pub bounds: Option<(f64, f64)>,
    /// The number of changes.
    pub changes: u64,
}

/// A parameter that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Difference {
    /// `6081:00`.
    pub address: String,
    pub name: String,
    /// The value in the node, as text.
    pub here: String,
    /// The value on the other side, as text.
    pub there: String,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Pdo {
    /// `TPDO1`.
    pub name: String,
    /// `185`.
    pub id: String,
    pub is_on: bool,
    /// `event-driven`, `every 2nd SYNC`.
    pub transmission: String,
    /// In ms; `None` if the device lacks it.
    pub event_timer_ms: Option<u16>,
    /// The minimum interval of frames; `None` if the device lacks it.
    pub inhibit_ms: Option<f64>,
    /// The mapped objects, from bit 0 on.
    pub fields: Vec<PdoField>,
    /// Frames in the last second.
    pub per_second: f64,
    pub conflict: Option<String>,
    /// Entries that may be mapped into it: address and name.
    pub mappable: Vec<(String, String)>,
}

/// An object in a PDO.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct PdoField {
    /// `6041:00`.
    pub address: String,
    pub name: String,
    /// The first bit.
    pub first_bit: u8,
    pub bits: u8,
    /// The last value as text.
    pub text: Option<String>,
    /// When the value was seen, in seconds as [`View::time`].
    pub at: Option<f64>,
}

/// The range of the trace.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Trace {
    /// The number of the oldest row kept.
    pub first: u64,
    /// The number after that of the newest row.
    pub end: u64,
}

/// Rows of the trace that match a filter.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Frames {
    /// The number of matching rows that are kept.
    pub matching: u64,
    /// The position of the first of these rows among them.
    pub from: u64,
    pub rows: Vec<Row>,
}

/// A frame or an SDO transfer as text.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Row {
    /// The row number, from 0; for a transfer, that of its last frame.
    pub number: u64,
    pub time: f64,
    /// `185`.
    pub id: String,
    /// `06 02 00 00`.
    pub data: String,
    /// `None` for broadcasts.
    pub node: Option<u8>,
    /// `TPDO1`.
    pub service: String,
    pub text: String,
    /// Whether it is or reports an error.
    pub alarming: bool,
}

/// A curve of the plot.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Curve {
    pub node: u8,
    /// `6064:00`.
    pub address: String,
    pub name: String,
    pub unit: Option<String>,
    /// When its last point was seen.
    pub seen: Option<Seen>,
    /// Time and number, ascending in time.
    pub points: Vec<(f64, f64)>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Drive {
    pub node: u8,
    /// See [`Node::name`].
    pub name: String,
    /// The state of CiA 402: `OPERATION ENABLED`; `None` if unknown.
    pub state: Option<String>,
    /// The states to which it may be ordered now.
    pub allowed: Vec<String>,
    /// When state, position and velocity were seen: the oldest of them.
    pub seen: Option<Seen>,
    /// The mode of operation as text.
    pub mode: Option<String>,
    /// In its unit.
    pub position: Option<f64>,
    /// `deg`; None for increments.
    pub position_unit: Option<String>,
    /// In its unit.
    pub velocity: Option<f64>,
    /// `rpm`.
    pub velocity_unit: Option<String>,
    /// The target of the current motion.
    pub target: Option<f64>,
    /// Why an order would be refused now, in sentences; empty if the drive would move. `None` if not checked yet: that
    /// is done while a client has control.
    pub obstacles: Option<Vec<String>>,
    /// The current order as text.
    pub order: Option<String>,
    /// How the last order ended.
    pub ending: Option<Ending>,
    /// A stop that was ordered, until the drive confirms its standstill.
    pub unconfirmed: Option<Unconfirmed>,
    /// The orders that this drive supports.
    #[cfg_attr(test, ts(type = "Array<Verb>"))]
    pub orders: Vec<Verb>,
    /// The homing methods that it supports.
    pub homing_methods: Vec<i8>,
}

/// When something was seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Seen {
    /// In seconds, as [`View::time`].
    pub at: f64,
    /// Whether it should have been seen again meanwhile, so that its present value is unknown.
    pub is_old: bool,
}

/// A stop that is repeated until the drive confirms its standstill.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Unconfirmed {
    pub since: f64,
    /// Why the last attempt failed; `None` during the first one.
    pub why: Option<String>,
}

/// How an order ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Ending {
    pub is_success: bool,
    /// Whether the drive may still be moving, because it could not be stopped.
    pub may_be_moving: bool,
    pub text: String,
    pub remedy: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Simulated {
    pub node: u8,
    /// The name in the plant.
    pub name: String,
    pub is_on: bool,
    /// The inputs that can be set.
    pub inputs: Vec<Input>,
}

/// An input of a simulated device.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Input {
    /// `shaft`.
    pub name: String,
    /// A description in one sentence.
    pub help: String,
    /// The possible values: `free`, `blocked`; empty for a number.
    pub choices: Vec<String>,
    /// The present value.
    pub value: Option<String>,
}

/// A long-running job.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Job {
    /// From 1.
    pub number: u32,
    /// `restore of node 5`.
    pub name: String,
    /// The progress from 0 to 1; `None` if unknown.
    pub done: Option<f64>,
    /// The present step, `6081:00 Profile velocity`; at the end, the result as text.
    pub text: String,
    /// Whether it has succeeded; `None` while it runs.
    pub is_success: Option<bool>,
}

/// Which client may change something.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Control {
    /// The number of the client that has control.
    pub holder: Option<u32>,
    /// The number of open clients.
    pub clients: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Log {
    pub seconds: f64,
    /// The present position.
    pub position: f64,
    /// 0 while paused.
    pub speed: f64,
}
