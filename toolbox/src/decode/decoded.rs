//! A decoded frame, as text and as JSON fields.

use std::borrow::Cow;

use lexican_runtime::wire::lss::{LssRequest, LssResponse};
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{AbortCode, Frame, NodeId};
use serde::{Serialize, Serializer};
use serde_json::Value as Json;

use super::lss;
use crate::text::json::{abort, access, bytes, digits, fields_of};
use crate::values::hex;
use crate::values::report::ValueReport;

/// A decoded frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// The protocol.
    pub service: Service,
    /// `RPDO3`, `SDO request`.
    pub name: Cow<'static, str>,
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
    /// Any other frame.
    Unknown,
}

impl Decoded {
    /// Whether only the node itself sends such frames.
    pub fn is_from_node(&self) -> bool {
        match &self.detail {
            Detail::Sdo(sdo) => sdo.side == Side::Server,
            Detail::Pdo(pdo) => !pdo.received,
            Detail::Emcy(_) | Detail::ErrorControl { .. } => true,
            _ => false,
        }
    }

    /// `TPDO1: Statusword = OPERATION ENABLED`.
    #[must_use]
    pub fn words(&self) -> String {
        let separator = if self.text.is_empty() { "" } else { ": " };
        format!("{}{separator}{}", self.name, self.text)
    }

    pub(super) fn new(service: Service, name: impl Into<Cow<'static, str>>, node: Option<NodeId>) -> Self {
        Decoded { service, name: name.into(), node, text: String::new(), alarming: false, detail: Detail::None }
    }

    pub(super) fn with(self, text: impl Into<String>, detail: Detail) -> Self {
        Decoded { text: text.into(), detail, ..self }
    }

    /// A frame that violates the protocol of its service.
    pub(super) fn unreadable(self, frame: &Frame) -> Self {
        let text = format!("not readable: {} bytes {}", frame.dlc(), hex(frame.data()));
        Decoded { text, alarming: true, ..self }
    }
}

/// The content of a frame. In JSON it is an object with the service as key: `{"sync": {"counter": 7}}`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Detail {
    /// Unknown content.
    None,
    /// A command to nodes.
    #[serde(serialize_with = "nmt")]
    Nmt(NmtCommand),
    /// A SYNC message.
    Sync {
        /// The counter, if 1019h is used.
        counter: Option<u8>,
    },
    /// A TIME message.
    #[serde(rename = "time_of_day")]
    Time {
        /// Since 1984-01-01.
        days: u16,
        /// Since midnight.
        ms: u32,
    },
    /// An emergency message.
    Emcy(Emcy),
    /// Boot-up, heartbeat, or the answer to guarding.
    #[serde(serialize_with = "error_control")]
    ErrorControl {
        /// INITIALISING for boot-up.
        state: NmtState,
        /// The toggle bit of guarding.
        toggle: bool,
    },
    /// The remote frame of node guarding.
    #[serde(rename = "error_control", serialize_with = "guarding")]
    Guarding,
    /// Process data.
    Pdo(Pdo),
    /// A frame of an SDO transfer.
    Sdo(Box<Sdo>),
    /// A request of the LSS manager.
    #[serde(rename = "lss", serialize_with = "lss_request")]
    LssRequest(LssRequest),
    /// The answer of a device.
    #[serde(rename = "lss", serialize_with = "lss_response")]
    LssResponse(LssResponse),
}

/// An emergency message (CiA 301, 7.2.7).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Emcy {
    /// The error code.
    #[serde(serialize_with = "digits")]
    pub code: u16,
    /// From the data sheet, else from CiA 301.
    pub meaning: Option<String>,
    /// The error register (1001h).
    #[serde(serialize_with = "digits")]
    pub register: u8,
    /// The names of the register's set bits.
    pub register_text: String,
    /// The manufacturer-specific bytes.
    #[serde(rename = "msef", serialize_with = "bytes")]
    pub vendor: [u8; 5],
}

/// A process data object.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pdo {
    /// From 1.
    pub number: u16,
    /// Whether it is an RPDO of the device.
    #[serde(rename = "direction", serialize_with = "direction")]
    pub received: bool,
    /// The mapped entries, in order; empty if the device is unknown, and for a remote frame.
    pub fields: Vec<ValueReport>,
}

/// A frame of an SDO transfer.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Sdo {
    /// Who sends the frame.
    #[serde(rename = "from")]
    pub side: Side,
    /// Its step in the protocol.
    #[serde(rename = "command")]
    pub step: Step,
    /// Whether the transfer is a download, if that is known.
    #[serde(rename = "access", serialize_with = "access", skip_serializing_if = "Option::is_none")]
    pub writes: Option<bool>,
    /// `expedited`, `segmented` or `block`, if that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transfer: Option<&'static str>,
    /// The entry, with the value if the transfer has carried all of it.
    #[serde(flatten)]
    pub report: Option<ValueReport>,
    /// The announced number of bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<u32>,
    /// The toggle bit of a segment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub toggle: Option<bool>,
    /// Whether no segment follows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last: Option<bool>,
    /// The number of a segment within a block, or of the last confirmed one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sequence: Option<u8>,
    /// The number of segments of a block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block_size: Option<u8>,
    /// Why the transfer ends.
    #[serde(flatten, serialize_with = "abort")]
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
}

impl Detail {
    /// The fields in JSON, without the name of the service; null if nothing is known of the frame.
    pub fn fields(&self) -> Json {
        fields_of(self).into_iter().next().map(|(_, fields)| fields).unwrap_or_default()
    }
}

fn nmt<S: Serializer>(command: &NmtCommand, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Fields {
        #[serde(serialize_with = "digits")]
        code: u8,
        command: String,
        state: String,
    }
    let state = command.target().to_string();
    Fields { code: command.code(), command: command.to_string(), state }.serialize(serializer)
}

#[derive(Serialize)]
struct ErrorControl {
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    toggle: Option<bool>,
}

fn error_control<S: Serializer>(state: &NmtState, toggle: &bool, serializer: S) -> Result<S::Ok, S::Error> {
    let (kind, toggle) = match state {
        NmtState::Initialising => ("boot-up", None),
        _ => ("heartbeat", Some(*toggle)),
    };
    ErrorControl { kind, state: Some(state.to_string()), toggle }.serialize(serializer)
}

fn guarding<S: Serializer>(serializer: S) -> Result<S::Ok, S::Error> {
    ErrorControl { kind: "guarding", state: None, toggle: None }.serialize(serializer)
}

fn lss_request<S: Serializer>(request: &LssRequest, serializer: S) -> Result<S::Ok, S::Error> {
    lss::request_json(*request).serialize(serializer)
}

fn lss_response<S: Serializer>(response: &LssResponse, serializer: S) -> Result<S::Ok, S::Error> {
    lss::response_json(*response).serialize(serializer)
}

fn direction<S: Serializer>(received: &bool, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(if *received { "receive" } else { "transmit" })
}
