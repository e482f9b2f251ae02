//! What a client asks for, and what it gets back.

pub use lexican_toolbox::drive::Verb;
use serde::{Deserialize, Serialize};

use crate::view::{Curve, Difference, Frames, Object, Pdo, TraceFilter, Value};

/// A request of a client. What changes something on the bus needs control ([`Request::TakeControl`]), but for
/// [`Request::StopAll`].
///
/// In JSON: `{"do": "write", "node": 5, "address": "6081:00", "text": "100 rpm"}`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "do", rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Request {
    /// Asks for control: one client at a time may change something. Refused while another one has it, unless `force` is given.
    TakeControl {
        /// Take it from the client that has it; what it started is stopped.
        #[serde(default)]
        force: bool,
    },
    /// Gives control back; what was started goes on.
    ReleaseControl,
    /// Stops every drive, and cancels what was ordered. Needs no control, and waits for nothing.
    StopAll,

    /// A command of network management to a node, or to all.
    Nmt {
        /// `None` for all.
        node: Option<u8>,
        command: Nmt,
    },
    /// What has happened to nodes and is over was seen by somebody: it is shown no longer.
    Acknowledge,
    /// Looks for nodes, and reads their identities.
    Scan,
    /// Gives a node a data sheet: a device of the library or a file.
    SetSheet {
        node: u8,
        /// `siko/ag03-1`, `drive.eds`.
        sheet: String,
    },
    /// Gives a node the data sheet that it has in it (1021h).
    FetchSheet { node: u8 },
    /// Looks for one device without node-ID by LSS fastscan, and gives it this node-ID.
    Assign { node: u8 },

    /// The entries of a node's data sheet, with the values that are known. [`Answer::Objects`].
    Objects { node: u8 },
    /// Reads entries: [`Answer::Values`] in their order.
    Read {
        node: u8,
        /// `6064:00`; `1018` for all entries of an object.
        addresses: Vec<String>,
    },
    /// The values of entries that were seen last on the bus: nothing is read. [`Answer::Values`] of those that were seen.
    Seen { node: u8, addresses: Vec<String> },
    /// Writes an entry, after the data sheet's limits were checked.
    Write {
        node: u8,
        address: String,
        /// As `lexican write` takes it: `100 rpm`, `profile position`, `0x1F`.
        text: String,
        /// Send what the data sheet does not allow.
        #[serde(default)]
        force: bool,
    },
    /// Reads an entry again and again; its value is among [`View::watched`](crate::View::watched).
    Watch {
        node: u8,
        address: String,
        /// How often, at least every 10 ms.
        every_ms: u32,
    },
    /// Ends that.
    Unwatch { node: u8, address: String },
    /// Compares the parameters of a node: [`Answer::Differences`].
    Compare { node: u8, with: Other },
    /// Reads all parameters of a node: [`Answer::File`], a DCF.
    Backup { node: u8 },
    /// Writes what differs from a DCF into a node.
    Restore { node: u8, dcf: String },

    /// How the PDOs of a node are configured, read from it: [`Answer::Pdos`].
    Pdos { node: u8 },
    /// Configures a PDO by the proper procedure. With `check`, only what speaks against it: [`Answer::Objections`].
    MapPdo {
        node: u8,
        /// `tpdo1`.
        pdo: String,
        objects: Vec<String>,
        /// `event`, `sync`, `sync:4`, `every:10ms`; as it is without it.
        transmission: Option<String>,
        #[serde(default)]
        check: bool,
    },

    /// Rows of the trace: [`Answer::Frames`].
    Trace {
        /// Which frames, in the words of `lexican monitor`; all without it.
        #[serde(default)]
        filter: TraceFilter,
        /// The first row, counted from the oldest one that is kept and matches; from the end backwards if negative.
        from: i64,
        /// Counted from the first row that matches and has this number or a higher one: so rows stay where they are when
        /// older ones are forgotten.
        #[serde(default)]
        #[cfg_attr(test, ts(optional = nullable))]
        at: Option<u64>,
        /// How many, at most 1,000.
        count: u32,
    },
    /// The trace as a log: [`Answer::File`].
    Export {
        /// By its name, as `lexican convert` takes it.
        format: String,
        #[serde(default)]
        filter: TraceFilter,
    },

    /// Adds curves to the plot: objects are read every so often, PDO signals are taken as they come.
    Plot {
        node: u8,
        /// `6064:00`, `tpdo1`.
        signals: Vec<String>,
        /// How often objects are read.
        every_ms: u32,
    },
    /// Removes the curves of a node, or all.
    ClearPlot {
        /// `None` for all.
        node: Option<u8>,
    },
    /// Points of the curves after a time: [`Answer::Curves`].
    Curves {
        /// In seconds of [`View::time`](crate::View::time).
        since: f64,
    },
    /// The number that a text is, such as the level of a trigger: [`Answer::Number`].
    Number {
        /// `12.5`.
        text: String,
    },
    /// The curves as a file: [`Answer::File`].
    ExportPlot {
        /// `csv` or `svg`.
        format: String,
    },

    /// An order to a drive; what becomes of it is in [`view::Drive`](crate::view::Drive).
    Drive {
        node: u8,
        #[cfg_attr(test, ts(type = "Verb"))]
        order: Verb,
        /// A position, a distance or a velocity with or without unit (`90 deg`), or a homing method.
        value: Option<String>,
    },

    /// Records what is ordered, written and commanded as lines of `lexican run`, or ends that: [`Answer::File`].
    Record { on: bool },
    /// Plays a sequence, which a stop ends, and stops all drives at its end: [`Answer::File`] is its report.
    PlaySequence {
        name: String,
        /// Its lines; without them it is one of [`Kept::sequences`](crate::view::Kept::sequences).
        text: Option<String>,
    },

    /// An input of a simulated device, in the words of `lexican simulate`: `blocked = true`.
    Input { node: u8, text: String },
    /// Switches a simulated device on or off.
    Power { node: u8, on: bool },

    /// Goes to a time of a recorded log, and stands there.
    Seek {
        /// In seconds from its first frame.
        seconds: f64,
    },
    /// Plays a recorded log from where it stands.
    Play {
        /// 1 for the speed of its recording; 0 stands.
        speed: f64,
    },
}

impl Request {
    /// Whether it only reads what the bench has, so that its order among others does not matter.
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

    /// Whether it stops something, and waits for nothing.
    #[must_use]
    pub const fn is_stop(&self) -> bool {
        matches!(self, Request::StopAll) || matches!(self, Request::Drive { order, .. } if order.is_stop())
    }
}

/// A command of network management (CiA 301, 7.2.8.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Nmt {
    /// To OPERATIONAL.
    Start,
    /// To STOPPED.
    Stop,
    /// To PRE-OPERATIONAL.
    PreOperational,
    /// Start anew.
    ResetNode,
    /// Start the communication anew.
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

/// What a request brings.
#[allow(missing_docs, reason = "the names say what it is")]
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// It was done, or has begun and is among [`View::jobs`](crate::View::jobs).
    Done,
    Objects(Vec<Object>),
    /// Values, in the order of the request.
    Values(Vec<Value>),
    Differences(Vec<Difference>),
    /// PDOs, receive PDOs first.
    Pdos(Vec<Pdo>),
    /// What speaks against a mapping; nothing if it can be written.
    Objections(Vec<String>),
    Frames(Frames),
    Curves(Vec<Curve>),
    Number(f64),
    /// A file to keep. A page gets its address instead.
    #[cfg_attr(test, ts(skip))]
    File {
        name: String,
        bytes: Vec<u8>,
    },
}

/// Why a request was not carried out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Refused {
    /// What is wrong, with node, index and value.
    pub why: String,
    /// What to do.
    pub remedy: Option<String>,
}

impl Refused {
    /// A refusal without a remedy.
    pub fn new(why: impl std::fmt::Display) -> Self {
        Refused { why: why.to_string(), remedy: None }
    }

    /// What to do about it.
    #[must_use]
    pub fn with_remedy(self, remedy: impl std::fmt::Display) -> Self {
        Refused { remedy: Some(remedy.to_string()), ..self }
    }

    /// A stop came first.
    pub(crate) fn interrupted() -> Self {
        Refused::new("a stop has ended it").with_remedy("ask again")
    }
}
