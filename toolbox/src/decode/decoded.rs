//! A frame as text, and as the fields that JSON has of it.

use lexican_runtime::wire::lss::{LssRequest, LssResponse};
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{AbortCode, Frame, NodeId};
use serde::Serialize;
use serde_json::{Value as Json, json};

use super::lss;
use crate::text::json::fields;
use crate::values::hex;
use crate::values::report::ValueReport;

/// A frame, decoded.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// The protocol.
    pub service: Service,
    /// `RPDO3`, `SDO request`.
    pub name: String,
    /// The node that sends or receives it; `None` for broadcasts.
    pub node: Option<NodeId>,
    /// The content; may be empty.
    pub text: String,
    /// Whether it reports or is an error.
    pub alarming: bool,
    /// The content as values.
    pub detail: Detail,
}

/// The protocols of CiA 301 and CiA 305.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Service {
    /// Network management.
    Nmt,
    /// Synchronisation.
    Sync,
    /// Time of day.
    Time,
    /// An emergency.
    Emcy,
    /// A PDO that a device receives.
    Rpdo,
    /// A PDO that a device transmits.
    Tpdo,
    /// A part of an SDO transfer.
    Sdo,
    /// Boot-up, heartbeat or guarding.
    ErrorControl,
    /// Layer setting services.
    Lss,
    /// None that is known.
    Unknown,
}

impl Decoded {
    /// Whether only the node itself sends such a frame.
    pub fn is_from_node(&self) -> bool {
        match &self.detail {
            Detail::Sdo(sdo) => sdo.side == Side::Server,
            Detail::Pdo(pdo) => !pdo.received,
            Detail::Emcy(_) | Detail::ErrorControl { .. } => true,
            _ => false,
        }
    }

    pub(super) fn new(service: Service, name: impl Into<String>, node: Option<NodeId>) -> Self {
        Decoded { service, name: name.into(), node, text: String::new(), alarming: false, detail: Detail::None }
    }

    pub(super) fn with(self, text: impl Into<String>, detail: Detail) -> Self {
        Decoded { text: text.into(), detail, ..self }
    }

    /// A frame that breaks the protocol of its service.
    pub(super) fn unreadable(self, frame: &Frame) -> Self {
        let text = format!("not readable: {} bytes {}", frame.dlc(), hex(frame.data()));
        Decoded { text, alarming: true, ..self }
    }
}

/// The content of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Detail {
    /// Nothing is known of it.
    None,
    /// A command to nodes.
    Nmt(NmtCommand),
    /// The SYNC message.
    Sync {
        /// The counter, if 1019h is used.
        counter: Option<u8>,
    },
    /// The TIME message.
    Time {
        /// Since 1984-01-01.
        days: u16,
        /// Since midnight.
        ms: u32,
    },
    /// An emergency message.
    Emcy(Emcy),
    /// Boot-up, heartbeat, or the answer to guarding.
    ErrorControl {
        /// INITIALISING for boot-up.
        state: NmtState,
        /// The toggle bit of guarding.
        toggle: bool,
    },
    /// The remote frame of node guarding.
    Guarding,
    /// Process data.
    Pdo(Pdo),
    /// A frame of an SDO transfer.
    Sdo(Box<Sdo>),
    /// A request of the LSS manager.
    LssRequest(LssRequest),
    /// The answer of a device.
    LssResponse(LssResponse),
}

/// An emergency message (CiA 301, 7.2.7).
#[derive(Clone, Debug, PartialEq)]
pub struct Emcy {
    /// The error code.
    pub code: u16,
    /// By the data sheet, else by CiA 301.
    pub meaning: Option<String>,
    /// The error register (1001h).
    pub register: u8,
    /// The names of its bits.
    pub register_text: String,
    /// The vendor's bytes.
    pub vendor: [u8; 5],
}

/// A process data object.
#[derive(Clone, Debug, PartialEq)]
pub struct Pdo {
    /// From 1.
    pub number: u16,
    /// Whether the device receives it.
    pub received: bool,
    /// The mapped entries, in order; empty if the device is unknown, and for a remote frame.
    pub fields: Vec<ValueReport>,
}

/// A frame of an SDO transfer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sdo {
    /// Who sends the frame.
    pub side: Side,
    /// What it is in the protocol.
    pub step: Step,
    /// Whether the transfer is a download, if that is known.
    pub writes: Option<bool>,
    /// `expedited`, `segmented` or `block`, if that is known.
    pub transfer: Option<&'static str>,
    /// The entry; with its value when the transfer has carried all of it.
    pub report: Option<ValueReport>,
    /// The announced number of bytes.
    pub size: Option<u32>,
    /// The toggle bit of a segment.
    pub toggle: Option<bool>,
    /// Whether no segment follows.
    pub last: Option<bool>,
    /// The number of a segment of a block, or of the last one that is confirmed.
    pub sequence: Option<u8>,
    /// The number of segments of a block.
    pub block_size: Option<u8>,
    /// Why the transfer ends.
    pub abort: Option<AbortCode>,
    /// Whether the transfer ends with this frame.
    pub complete: bool,
}

/// The two ends of a transfer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// It asks.
    #[default]
    Client,
    /// It answers.
    Server,
}

/// The step of the protocol, from either side (CiA 301, 7.2.4.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "they are called as in CiA 301")]
pub enum Step {
    InitiateUpload,
    UploadSegment,
    InitiateDownload,
    DownloadSegment,
    InitiateBlockUpload,
    StartBlockUpload,
    ConfirmBlockUpload,
    EndBlockUpload,
    InitiateBlockDownload,
    ConfirmBlockDownload,
    EndBlockDownload,
    BlockSegment,
    Abort,
    #[default]
    Unknown,
}

impl Sdo {
    pub(super) fn new(side: Side, step: Step) -> Self {
        Sdo { side, step, ..Sdo::default() }
    }

    fn json(&self) -> Json {
        let mut object = fields(json!({
            "from": self.side,
            "command": self.step,
            "complete": self.complete,
            "access": self.writes.map(|writes| if writes { "write" } else { "read" }),
            "transfer": self.transfer,
            "size": self.size,
            "toggle": self.toggle,
            "last": self.last,
            "sequence": self.sequence,
            "block_size": self.block_size,
            "abort_code": self.abort.map(|code| format!("{:08X}", code.0)),
            "abort": self.abort.and_then(AbortCode::text),
        }));
        object.retain(|_, field| !field.is_null());
        object.extend(self.report.as_ref().map(ValueReport::json).unwrap_or_default());
        Json::Object(object)
    }
}

impl Detail {
    /// The name of the service in JSON, and its fields.
    pub fn json(&self) -> Option<(&'static str, Json)> {
        let state_name = |state: &NmtState| state.to_string();
        Some(match self {
            Detail::None => return None,
            Detail::Nmt(command) => {
                let (code, state) = (format!("{:02X}", command.code()), state_name(&command.target()));
                ("nmt", json!({ "command": command.to_string(), "code": code, "state": state }))
            }
            Detail::Sync { counter } => ("sync", json!({ "counter": counter })),
            Detail::Time { days, ms } => ("time_of_day", json!({ "days": days, "ms": ms })),
            Detail::Emcy(emcy) => {
                let fields = json!({
                    "code": format!("{:04X}", emcy.code),
                    "meaning": emcy.meaning,
                    "register": format!("{:02X}", emcy.register),
                    "register_text": emcy.register_text,
                    "msef": hex(&emcy.vendor),
                });
                ("emcy", fields)
            }
            Detail::ErrorControl { state: state @ NmtState::Initialising, .. } => {
                ("error_control", json!({ "kind": "boot-up", "state": state_name(state) }))
            }
            Detail::ErrorControl { state, toggle } => {
                ("error_control", json!({ "kind": "heartbeat", "state": state_name(state), "toggle": toggle }))
            }
            Detail::Guarding => ("error_control", json!({ "kind": "guarding" })),
            Detail::Pdo(pdo) => {
                let direction = if pdo.received { "receive" } else { "transmit" };
                let fields: Vec<_> = pdo.fields.iter().map(ValueReport::json).collect();
                ("pdo", json!({ "number": pdo.number, "direction": direction, "fields": fields }))
            }
            Detail::Sdo(sdo) => ("sdo", sdo.json()),
            Detail::LssRequest(request) => ("lss", lss::request_json(*request)),
            Detail::LssResponse(response) => ("lss", lss::response_json(*response)),
        })
    }

    /// The fields alone.
    pub fn fields(&self) -> Json {
        self.json().map(|(_, fields)| fields).unwrap_or_default()
    }
}
