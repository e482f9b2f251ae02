//! What a frame says, in parts: one kind for each service, and the fields that JSON has of it.

use lexican_runtime::AbortCode;
use lexican_runtime::wire::lss::{LssRequest, LssResponse};
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use serde_json::{Map, Value as Json, json};

use super::lss;
use crate::values::hex;
use crate::values::told::Told;

/// The parts of what a frame says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Detail {
    /// Nothing that anybody can take apart.
    None,
    Nmt(NmtCommand),
    Sync {
        counter: Option<u8>,
    },
    Time {
        days: u16,
        ms: u32,
    },
    Emcy(Emcy),
    /// Boot-up, heartbeat, and the answer to guarding.
    ErrorControl {
        state: NmtState,
        toggle: bool,
    },
    /// A remote frame that asks for the state.
    Guarding,
    Pdo(Pdo),
    Sdo(Box<Sdo>),
    LssRequest(LssRequest),
    LssResponse(LssResponse),
}

/// An emergency message.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Emcy {
    pub(crate) code: u16,
    /// What the code means, by the device or by CiA 301.
    pub(crate) meaning: Option<String>,
    pub(crate) register: u8,
    /// The bits of the register by name.
    pub(crate) register_text: String,
    pub(crate) vendor: [u8; 5],
}

/// A process data object.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pdo {
    pub(crate) number: u16,
    /// Whether the device receives it.
    pub(crate) received: bool,
    /// What is mapped, in order; empty when nobody knows the device, and for a remote frame.
    pub(crate) fields: Vec<Told>,
}

/// A frame of an SDO transfer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sdo {
    pub(crate) side: Side,
    pub(crate) step: Step,
    /// Whether the transfer reads the server's dictionary or writes it, when that is known.
    pub(crate) writes: Option<bool>,
    /// `expedited`, `segmented` or `block`, when that is known.
    pub(crate) transfer: Option<&'static str>,
    /// The entry; with its value as soon as all of it has been seen.
    pub(crate) told: Option<Told>,
    /// The announced number of bytes.
    pub(crate) size: Option<u32>,
    pub(crate) toggle: Option<bool>,
    pub(crate) last: Option<bool>,
    /// The number of a block's segment, or of the last one that was taken.
    pub(crate) sequence: Option<u8>,
    pub(crate) block_size: Option<u8>,
    pub(crate) abort: Option<AbortCode>,
    /// Whether this frame ends the transfer, well or not.
    pub(crate) complete: bool,
}

/// The two ends of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Client,
    Server,
}

impl Side {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Side::Client => "client",
            Side::Server => "server",
        }
    }
}

/// Which frame of the protocol it is, whichever side sends it (CiA 301, 7.2.4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
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
    Unknown,
}

impl Step {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Step::InitiateUpload => "initiate-upload",
            Step::UploadSegment => "upload-segment",
            Step::InitiateDownload => "initiate-download",
            Step::DownloadSegment => "download-segment",
            Step::InitiateBlockUpload => "initiate-block-upload",
            Step::StartBlockUpload => "start-block-upload",
            Step::ConfirmBlockUpload => "confirm-block-upload",
            Step::EndBlockUpload => "end-block-upload",
            Step::InitiateBlockDownload => "initiate-block-download",
            Step::ConfirmBlockDownload => "confirm-block-download",
            Step::EndBlockDownload => "end-block-download",
            Step::BlockSegment => "block-segment",
            Step::Abort => "abort",
            Step::Unknown => "unknown",
        }
    }
}

impl Sdo {
    /// A frame of which nothing is known yet but who sent it, and which step it is.
    pub(crate) fn new(side: Side, step: Step) -> Self {
        Sdo {
            side,
            step,
            writes: None,
            transfer: None,
            told: None,
            size: None,
            toggle: None,
            last: None,
            sequence: None,
            block_size: None,
            abort: None,
            complete: false,
        }
    }

    fn json(&self) -> Json {
        let mut fields = self.told.as_ref().map(Told::json).unwrap_or_default();
        fields.insert("from".to_owned(), json!(self.side.name()));
        fields.insert("command".to_owned(), json!(self.step.name()));
        fields.insert("complete".to_owned(), json!(self.complete));
        let access = self.writes.map(|writes| if writes { "write" } else { "read" });
        put(&mut fields, "access", access);
        put(&mut fields, "transfer", self.transfer);
        put(&mut fields, "size", self.size);
        put(&mut fields, "toggle", self.toggle);
        put(&mut fields, "last", self.last);
        put(&mut fields, "sequence", self.sequence);
        put(&mut fields, "block_size", self.block_size);
        put(&mut fields, "abort_code", self.abort.map(|code| format!("{:08X}", code.0)));
        put(&mut fields, "abort", self.abort.and_then(AbortCode::text));
        Json::Object(fields)
    }
}

fn put(fields: &mut Map<String, Json>, key: &str, value: Option<impl Into<Json>>) {
    if let Some(value) = value {
        fields.insert(key.to_owned(), value.into());
    }
}

impl Detail {
    /// The name of the service in JSON, and its fields.
    pub(crate) fn json(&self) -> Option<(&'static str, Json)> {
        Some(match self {
            Detail::None => return None,
            Detail::Nmt(command) => {
                let state = command.target();
                (
                    "nmt",
                    json!({ "command": command.to_string(), "code": format!("{:02X}", command.code()), "state": state.to_string() }),
                )
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
            Detail::ErrorControl { state: NmtState::Initialising, .. } => {
                ("error_control", json!({ "kind": "boot-up", "state": NmtState::Initialising.to_string() }))
            }
            Detail::ErrorControl { state, toggle } => {
                ("error_control", json!({ "kind": "heartbeat", "state": state.to_string(), "toggle": toggle }))
            }
            Detail::Guarding => ("error_control", json!({ "kind": "guarding" })),
            Detail::Pdo(pdo) => {
                let direction = if pdo.received { "receive" } else { "transmit" };
                let fields: Vec<_> = pdo.fields.iter().map(|told| Json::Object(told.json())).collect();
                ("pdo", json!({ "number": pdo.number, "direction": direction, "fields": fields }))
            }
            Detail::Sdo(sdo) => ("sdo", sdo.json()),
            Detail::LssRequest(request) => ("lss", lss::request_json(*request)),
            Detail::LssResponse(response) => ("lss", lss::response_json(*response)),
        })
    }
}
