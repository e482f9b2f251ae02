//! The requests of clients, and their answers.

pub use lexican_toolbox::drive::Verb;
use serde::{Deserialize, Serialize};

use crate::view::{Curve, Difference, Frames, Object, Pdo, TraceFilter, Value};

/// A request of a client. Requests that change something on the bus need control ([`Request::TakeControl`]), except
/// stops.
///
/// In JSON: `{"do": "write", "node": 5, "address": "6081:00", "text": "100 rpm"}`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "do", rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Request {
    /// Asks for control: only one client at a time may change something. Refused while another one has it, unless
    /// `force` is set.
    TakeControl {
        /// Take it from the client that has it, and stop what that has started.
        #[serde(default)]
        force: bool,
    },
    /// Gives control back; what was started continues.
    ReleaseControl,
    /// Stops every drive, and cancels orders. Needs no control, and waits for nothing.
    StopAll,

    /// An NMT command to a node or to all.
    Nmt {
        /// `None` for all.
        node: Option<u8>,
        command: Nmt,
    },
    /// Acknowledges troubles that are over: they are no longer shown.
    Acknowledge,
    /// Looks for nodes, and reads their identities.
    Scan,
    /// Sets the data sheet of a node: a device of the library or a file.
    SetSheet {
        node: u8,
        /// `siko/ag03-1`, `drive.eds`.
        sheet: String,
    },
    /// Reads the data sheet that a node stores (1021h), and uses it for the node.
    FetchSheet { node: u8 },
    /// Finds one device without node-ID by LSS fastscan, and gives it this node-ID.
    Assign { node: u8 },

    /// The entries in a node's data sheet, with the values known: [`Answer::Objects`].
    Objects { node: u8 },
    /// Reads entries: [`Answer::Values`], in order.
    Read {
        node: u8,
        /// `6064:00`; or `1018` for all entries of an object.
        addresses: Vec<String>,
    },
    /// The last values of entries on the bus, without reading them: [`Answer::Values`] of those that were seen.
    Seen { node: u8, addresses: Vec<String> },
    /// Writes an entry, after checking the value by the data sheet.
    Write {
        node: u8,
        address: String,
        /// In the notation of `lexican write`: `100 rpm`, `profile position`, `0x1F`.
        text: String,
        /// Write even what the data sheet does not allow.
        #[serde(default)]
        force: bool,
    },
    /// Reads an entry at intervals; its value is in [`View::watched`](crate::View::watched).
    Watch {
        node: u8,
        address: String,
        /// The interval, at least 10 ms.
        every_ms: u32,
    },
    /// Ends watching an entry.
    Unwatch { node: u8, address: String },
    /// Compares the parameters of a node with others: [`Answer::Differences`].
    Compare { node: u8, with: Other },
    /// Reads all parameters of a node: [`Answer::File`], a DCF.
    Backup { node: u8 },
    /// Writes parameters that differ from a DCF into a node.
    Restore { node: u8, dcf: String },

    /// Reads the PDO configuration of a node: [`Answer::Pdos`].
    Pdos { node: u8 },
    /// Configures a PDO as CiA 301 requires. With `check`, only returns [`Answer::Objections`].
    MapPdo {
        node: u8,
        /// `tpdo1`.
        pdo: String,
        objects: Vec<String>,
        /// `event`, `sync`, `sync:4`, `every:10ms`; unchanged if `None`.
        transmission: Option<String>,
        #[serde(default)]
        check: bool,
    },

    /// Rows of the trace: [`Answer::Frames`].
    Trace {
        /// In the notation of `lexican monitor`'s options; all frames by default.
        #[serde(default)]
        filter: TraceFilter,
        /// The first row, counted from the oldest match that is kept; from the end backwards if negative.
        from: i64,
        /// Count from the first match with this row number or a higher one instead, so that rows stay in place when
        /// older ones are dropped.
        #[serde(default)]
        #[cfg_attr(test, ts(optional = nullable))]
        at: Option<u64>,
        /// The number of rows, at most 1,000.
        count: u32,
    },
    /// The trace as a log: [`Answer::File`].
    Export {
        /// The name of a log format, as in `lexican convert`.
        format: String,
        #[serde(default)]
        filter: TraceFilter,
    },

    /// Adds curves to the plot: objects are read at intervals, PDO signals are taken as they come.
    Plot {
        node: u8,
        /// `6064:00`, `tpdo1`.
        signals: Vec<String>,
        /// The interval of reading objects.
        every_ms: u32,
    },
    /// Removes the curves of a node, or all.
    ClearPlot {
        /// `None` for all.
        node: Option<u8>,
    },
    /// The points of the curves after a time: [`Answer::Curves`].
    Curves {
        /// In seconds, as [`View::time`](crate::View::time).
        since: f64,
    },
    /// Parses a number, such as the level of a trigger: [`Answer::Number`].
    Number {
        /// `12.5`.
        text: String,
    },
    /// The curves as a file: [`Answer::File`].
    ExportPlot {
        /// `csv` or `svg`.
        format: String,
    },

    /// An order to a drive; its progress is in [`view::Drive`](crate::view::Drive).
    Drive {
        node: u8,
        #[cfg_attr(test, ts(type = "Verb"))]
        order: Verb,
        /// A position, distance or velocity with or without unit (`90 deg`), or a homing method.
        value: Option<String>,
    },

    /// Begins to record orders, writes and commands as lines of `lexican run`, or ends that: [`Answer::File`].
    Record { on: bool },
    /// Plays a sequence, and stops all drives at the end. A stop ends it. [`Answer::File`] is its output.
    PlaySequence {
        name: String,
        /// Its lines; `None` for one of [`Kept::sequences`](crate::view::Kept::sequences).
        text: Option<String>,
    },

    /// Sets an input of a simulated device, in the notation of `lexican simulate`: `blocked = true`.
    Input { node: u8, text: String },
    /// Switches a simulated device on or off.
    Power { node: u8, on: bool },

    /// Moves to a time in a recorded log, and pauses there.
    Seek {
        /// In seconds from the first frame.
        seconds: f64,
    },
    /// Plays a recorded log from the present position.
    Play {
        /// 1 for the speed of the recording; 0 pauses.
        speed: f64,
    },
}

impl Request {
    /// Whether it only reads what the bench has, so that its order among other requests does not matter.
    #[must_use]
    pub const fn only_asks(&self) -> bool {
        matches!(
            self,
            Request::Objects { .. }
                | Request::Seen { .. }
                | Request::Trace { .. }
                | Request::Export { .. }
                | Request::Curves { .. }
                | Request::ExportPlot { .. }
                | Request::Number { .. }
        )
    }

    /// Whether it stops something, and so waits for nothing.
    #[must_use]
    pub const fn is_stop(&self) -> bool {
        matches!(self, Request::StopAll) || matches!(self, Request::Drive { order, .. } if order.is_stop())
    }
}

/// An NMT command (CiA 301, 7.2.8.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Nmt {
    /// Enter OPERATIONAL.
    Start,
    /// Enter STOPPED.
    Stop,
    /// Enter PRE-OPERATIONAL.
    PreOperational,
    /// Reset the node.
    ResetNode,
    /// Reset its communication.
    ResetCommunication,
}

/// What to compare parameters with.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Other {
    /// The defaults of the data sheet.
    Defaults,
    /// The text of a DCF.
    Dcf(String),
    /// Another node.
    Node(u8),
}

/// The answer to a request.
#[allow(missing_docs, reason = "the names say what it is")]
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// The request was carried out, or has begun and is in [`View::jobs`](crate::View::jobs).
    Done,
    Objects(Vec<Object>),
    /// In the order of the request.
    Values(Vec<Value>),
    Differences(Vec<Difference>),
    /// Receive PDOs first.
    Pdos(Vec<Pdo>),
    /// Objections to a mapping; empty if it can be written.
    Objections(Vec<String>),
    Frames(Frames),
    Curves(Vec<Curve>),
    Number(f64),
    /// A file to save. A page gets its address instead.
    #[cfg_attr(test, ts(skip))]
    File {
        name: String,
        bytes: Vec<u8>,
    },
}

/// Why a request was refused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Refused {
    /// The reason, with node, index and value.
    pub why: String,
    /// What to do about it.
    pub remedy: Option<String>,
}

impl Refused {
    /// A refusal without a remedy.
    pub fn new(why: impl std::fmt::Display) -> Self {
        Refused { why: why.to_string(), remedy: None }
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn with_remedy(self, remedy: impl std::fmt::Display) -> Self {
        Refused { remedy: Some(remedy.to_string()), ..self }
    }

    /// The refusal because a stop came first.
    pub(crate) fn interrupted() -> Self {
        Refused::new("a stop has ended it").with_remedy("ask again")
    }
}
