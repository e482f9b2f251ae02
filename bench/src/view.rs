//! What a client shows. Times are in seconds since the bench was opened, or since the first frame of a log.

#![allow(missing_docs, reason = "a field has a comment where its name does not say all")]

use std::borrow::Cow;

use lexican_toolbox::drive::Verb;
use serde::{Deserialize, Serialize};

/// The bus as of a moment. Its fields change at different rates: a client is sent those that have changed.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct View {
    pub time: f64,
    pub bus: Bus,
    /// The nodes that were heard, found or named; ascending.
    pub nodes: Vec<Node>,
    /// The nodes that are drives.
    pub drives: Vec<Drive>,
    pub devices: Vec<Simulated>,
    /// What is under way, and what ended last.
    pub jobs: Vec<Job>,
    /// Values that are watched.
    pub watched: Vec<Watched>,
    pub trace: Trace,
    pub control: Control,
    /// The recorded log, if it is one.
    pub log: Option<Log>,
    pub kept: Kept,
}

/// What people keep of a machine, besides what they watch.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Kept {
    /// The sequences that its file lists.
    pub sequences: Vec<String>,
    /// The messages that it lists: each is played as a sequence of one line is, without stopping the drives at its end.
    pub messages: Vec<String>,
    /// The filters of the trace that it lists, by name.
    pub filters: Vec<(String, TraceFilter)>,
    /// While what somebody does is recorded: how many lines there are.
    pub recorded: Option<u32>,
}

/// Which frames of the trace, in the words of `lexican monitor`'s options.
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
    /// Only what reports an error.
    pub alarming: bool,
    /// SDO transfers as one row each.
    pub transfers: bool,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Bus {
    /// `can0`, `demo`, `bus.log`.
    pub name: String,
    pub is_writable: bool,
    /// In bits per second, if it is known.
    pub bit_rate: Option<u32>,
    /// `active`, `off`, as the controller has it; why it is lost.
    pub state: String,
    pub frames: u64,
    /// In the last second.
    pub frames_per_second: u32,
    /// In the last second, if the bit rate is known.
    pub load_percent: Option<f64>,
    /// The most in any second.
    pub load_percent_peak: Option<f64>,
    /// Lost between the controller and us.
    pub missing_frames: u64,
    /// By COB-ID.
    pub ids: Vec<Rate>,
    /// What is wrong on the bus, who does it, and what to do, in sentences.
    pub troubles: Vec<Trouble>,
}

/// The frames of a COB-ID.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Rate {
    /// `185`.
    pub id: String,
    /// `TPDO1`.
    pub name: String,
    /// Whose it is.
    pub node: Option<u8>,
    pub frames: u64,
    /// In the last second.
    pub per_second: f64,
    /// How far the time from frame to frame deviates, as its standard deviation in ms.
    pub jitter_ms: Option<f64>,
    /// Its part of all bits of the last second.
    pub share_percent: f64,
}

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Trouble {
    pub since: f64,
    /// Who, if it is one node.
    pub node: Option<u8>,
    /// `node 7 is silent for 2.3 s`.
    pub text: String,
    /// The trace's row from which it follows.
    pub row: Option<u64>,
    /// It was, and is shown until it is acknowledged.
    pub is_over: bool,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Node {
    pub id: u8,
    /// What the plant calls it, else its device's name (1008h), else that of its data sheet.
    pub name: String,
    /// The data sheet: `siko/ag03-1`.
    pub sheet: Option<String>,
    /// Whether it has one in it (1021h) that is not used.
    pub stores_sheet: bool,
    /// 1018h, as far as it was read: vendor, product, revision, serial number.
    pub identity: [Option<u32>; 4],
    /// `OPERATIONAL`; None while unknown.
    pub state: Option<String>,
    /// When it was in this state.
    pub seen: Option<Seen>,
    /// The time between its heartbeats in ms.
    pub heartbeat_ms: Option<f64>,
    /// For how long it has been silent, if it should not be.
    pub silent_seconds: Option<f64>,
    /// Its present faults, in words; empty if it has none.
    pub faults: Vec<Fault>,
    /// Those before, newest first.
    pub history: Vec<Fault>,
    /// The median of the SDO response times in ms.
    pub sdo_ms: Option<f64>,
    pub aborts: u32,
    pub boots: u32,
    /// What its data sheet, and then the drive itself, lacks for moving it, and what is used instead.
    pub lacks: Vec<Lack>,
    /// What has changed since the bench was opened: `the state: PRE-OPERATIONAL, now OPERATIONAL`.
    pub changes: Vec<String>,
}

/// Something that a drive or its data sheet lacks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Lack {
    /// Whether the drive cannot be moved without it.
    pub is_needed: bool,
    /// What is missing, or used instead, with its remedy.
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
    /// `DC link over-voltage; the brake resistor is too small`.
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
    /// Its own name; that of its object if it is the only entry.
    pub name: String,
    /// Where it belongs: `Communication`, `Manufacturer`, `Drive`.
    pub group: String,
    /// `UNSIGNED32`.
    pub data_type: String,
    /// Its size in a frame; `None` if it has none of its own.
    pub bits: Option<u8>,
    /// `rw`, `ro`, `wo`, `const`.
    pub access: String,
    /// `tpdo`, `rpdo`, `both`; None if it cannot be mapped.
    pub mappable: Option<String>,
    /// Its default in words.
    pub default: Option<String>,
    pub low: Option<String>,
    pub high: Option<String>,
    /// The names that it takes, if it is an enumeration or has bits.
    pub choices: Vec<String>,
    pub unit: Option<String>,
    /// What the data sheet says of it.
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
    /// With unit, or names; why it could not be read.
    pub text: String,
    /// As a number in its unit, if it is one.
    pub number: Option<f64>,
    /// As it is on the wire, in hexadecimal digits.
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
    /// How often it is read.
    pub every_ms: u32,
    pub value: Option<Value>,
    pub seen: Option<Seen>,
    /// The lowest and the highest number so far.
    pub bounds: Option<(f64, f64)>,
    /// How often it has changed.
    pub changes: u64,
}

/// A parameter that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Difference {
    /// `6081:00`.
    pub address: String,
    pub name: String,
    /// In the node, in words.
    pub here: String,
    /// In the other one, in words.
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
    /// In ms, if it has one.
    pub event_timer_ms: Option<u16>,
    /// Between frames, if it has one.
    pub inhibit_ms: Option<f64>,
    /// What it carries, from bit 0 on.
    pub fields: Vec<PdoField>,
    /// Frames in the last second.
    pub per_second: f64,
    pub conflict: Option<String>,
    /// The entries that may be mapped into it: address and name.
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
    /// Its last value in words.
    pub text: Option<String>,
    /// When that was seen, in seconds of [`View::time`].
    pub at: Option<f64>,
}

/// The extent of the trace.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Trace {
    /// The number of the oldest frame that is kept.
    pub first: u64,
    /// The number after that of the newest one.
    pub end: u64,
}

/// Rows of the trace that match a filter.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Frames {
    /// How many rows match, of those that are kept.
    pub matching: u64,
    /// The place of the first of these rows among them.
    pub from: u64,
    pub rows: Vec<Row>,
}

/// A frame, or an SDO transfer, in words.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Row {
    /// The frame's number from 0; a transfer has that of its last frame.
    pub number: u64,
    pub time: f64,
    /// `185`.
    pub id: String,
    /// `06 02 00 00`.
    pub data: String,
    /// The node, if it is one.
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
    /// When its last number was seen.
    pub seen: Option<Seen>,
    /// Time and number, ascending in time.
    pub points: Vec<(f64, f64)>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Drive {
    pub node: u8,
    /// Its name, as in [`Node::name`].
    pub name: String,
    /// The state of its state machine (CiA 402): `OPERATION ENABLED`; None while unknown.
    pub state: Option<String>,
    /// The states that it may be ordered to from here.
    pub allowed: Vec<String>,
    /// When its state, position and velocity were as they are shown: the oldest of them.
    pub seen: Option<Seen>,
    /// Its operating mode, in words.
    pub mode: Option<String>,
    /// In its unit.
    pub position: Option<f64>,
    /// `deg`; None for increments.
    pub position_unit: Option<String>,
    /// In its unit.
    pub velocity: Option<f64>,
    /// `rpm`.
    pub velocity_unit: Option<String>,
    /// Where the present travel goes.
    pub target: Option<f64>,
    /// What an order would be refused for now, in sentences; empty if it would move. `None` while nobody has looked: that is done
    /// while a client has control.
    pub obstacles: Option<Vec<String>>,
    /// The order under way, in words.
    pub order: Option<String>,
    /// How the last order ended.
    pub ending: Option<Ending>,
    /// A stop that was ordered, until the drive confirms that it stands.
    pub unconfirmed: Option<Unconfirmed>,
    /// The orders that this drive knows.
    #[cfg_attr(test, ts(type = "Array<Verb>"))]
    pub orders: Vec<Verb>,
    /// The homing methods that it has.
    pub homing_methods: Vec<i8>,
}

/// When something was as it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Seen {
    /// In seconds of [`View::time`].
    pub at: f64,
    /// It should have been seen again since: how it is now is unknown.
    pub is_old: bool,
}

/// A stop that the drive has not confirmed, and that is sent until it has.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Unconfirmed {
    pub since: f64,
    /// Why the last attempt has failed; `None` during the first one.
    pub why: Option<String>,
}

/// How an order has ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Ending {
    pub is_success: bool,
    /// Whether the drive may still be moving: it could not be told to stop.
    pub may_be_moving: bool,
    pub text: String,
    pub remedy: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Simulated {
    pub node: u8,
    /// What the plant calls it.
    pub name: String,
    pub is_on: bool,
    /// What can be done to it.
    pub inputs: Vec<Input>,
}

/// Something that can be done to a simulated device.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Input {
    /// `shaft`.
    pub name: String,
    /// What it is, in a sentence.
    pub help: String,
    /// What it takes: `free`, `blocked`; empty for a number.
    pub choices: Vec<String>,
    /// What it is now.
    pub value: Option<String>,
}

/// Something that takes its time.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Job {
    /// From 1.
    pub number: u32,
    /// `restore of node 5`.
    pub name: String,
    /// 0 to 1, if it is known.
    pub done: Option<f64>,
    /// Where it is: `6081:00 Profile velocity`; its end in words.
    pub text: String,
    /// How it has ended; None while it runs.
    pub is_success: Option<bool>,
}

/// Who may change something.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Control {
    /// The number of the client that has control.
    pub holder: Option<u32>,
    /// How many clients are open.
    pub clients: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Log {
    pub seconds: f64,
    /// Where it stands.
    pub position: f64,
    /// 0 if it stands.
    pub speed: f64,
}
