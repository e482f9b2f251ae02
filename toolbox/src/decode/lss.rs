//! LSS frames as text and JSON (CiA 305).

use lexican_runtime::NodeId;
use lexican_runtime::wire::lss::{BIT_TIMING_TABLE, Bound, LssRequest, LssResponse, LssState, Part};
use serde_json::{Value as Json, json};

/// The bit rate table's entry for automatic detection.
pub const AUTOMATIC: u8 = 9;

/// `select by product = 1402h`.
pub(super) fn request_text(request: LssRequest) -> String {
    match request {
        LssRequest::SwitchGlobal(state) => format!("all devices enter LSS {}", state_name(state)),
        LssRequest::SwitchSelective(part, value) => format!("select by {} = {value:X}h", part_name(part)),
        LssRequest::ConfigureNode(node) => format!("take node-ID {}", node_name(node)),
        LssRequest::ConfigureBitTiming { table, index } => format!("take bit rate {}", bit_rate(table, index)),
        LssRequest::ActivateBitTiming { delay_ms } => format!("change the bit rate after {delay_ms} ms"),
        LssRequest::Store => "store the configuration".to_owned(),
        LssRequest::Identify(bound, value) => {
            let (part, relation, _) = bound_parts(bound);
            format!("who has {} {relation} {value:X}h?", part_name(part))
        }
        LssRequest::IdentifyUnconfigured => "who has no node-ID?".to_owned(),
        LssRequest::Fastscan { bits_left: 0x80, .. } => "fastscan: who has no node-ID?".to_owned(),
        LssRequest::Fastscan { value, bits_left, part, next } => {
            let bits = 32_u8.saturating_sub(bits_left);
            let then = if next == part { String::new() } else { format!(" Then {}", part_name(next)) };
            format!("fastscan: whose {} has the upper {bits} bits of {value:08X}h?{then}", part_name(part))
        }
        LssRequest::Inquire(part) => format!("what is your {}?", part_name(part)),
        LssRequest::InquireNode => "what is your node-ID?".to_owned(),
    }
}

/// `selected`, `node-ID taken`.
pub fn response_text(response: LssResponse) -> String {
    match response {
        LssResponse::Selected => "selected".to_owned(),
        LssResponse::ConfigureNode { error, specific } => {
            result("node-ID taken", "node-ID out of range", error, specific)
        }
        LssResponse::ConfigureBitTiming { error, specific } => {
            result("bit rate taken", "bit rate not supported", error, specific)
        }
        LssResponse::Store { error: 2, .. } => "refused: the storage failed".to_owned(),
        LssResponse::Store { error, specific } => result("stored", "storing is not supported", error, specific),
        LssResponse::Identified => "me".to_owned(),
        LssResponse::Unconfigured => "I have no node-ID".to_owned(),
        LssResponse::Inquired(part, value) => format!("{} = {value:X}h", part_name(part)),
        LssResponse::InquiredNode(node) => format!("node-ID {}", node_name(node)),
    }
}

/// Whether a response is a refusal.
pub fn refuses(response: LssResponse) -> bool {
    match response {
        LssResponse::ConfigureNode { error, .. }
        | LssResponse::ConfigureBitTiming { error, .. }
        | LssResponse::Store { error, .. } => error != 0,
        _ => false,
    }
}

fn result(done: &str, refusal: &str, error: u8, specific: u8) -> String {
    match error {
        0 => done.to_owned(),
        1 => format!("refused: {refusal}"),
        0xFF => format!("refused: error {specific:02X}h of the device"),
        other => format!("refused: error {other}"),
    }
}

pub(super) fn request_json(request: LssRequest) -> Json {
    let (command, fields) = match request {
        LssRequest::SwitchGlobal(state) => ("switch-global", json!({ "state": state_name(state) })),
        LssRequest::SwitchSelective(part, value) => {
            ("switch-selective", json!({ "part": part_name(part), "value": value }))
        }
        LssRequest::ConfigureNode(node) => ("configure-node-id", json!({ "node_id": node.map(NodeId::get) })),
        LssRequest::ConfigureBitTiming { table, index } => {
            let rate = standard_rate(table, index);
            ("configure-bit-timing", json!({ "table": table, "entry": index, "kbit_per_s": rate }))
        }
        LssRequest::ActivateBitTiming { delay_ms } => ("activate-bit-timing", json!({ "delay_ms": delay_ms })),
        LssRequest::Store => ("store", json!({})),
        LssRequest::Identify(bound, value) => {
            let part = format!("{}{}", part_name(bound_parts(bound).0), bound_parts(bound).2);
            ("identify", json!({ "part": part, "value": value }))
        }
        LssRequest::IdentifyUnconfigured => ("identify-unconfigured", json!({})),
        LssRequest::Fastscan { value, bits_left, part, next } => (
            "fastscan",
            json!({ "value": value, "bit_checked": bits_left, "part": part_name(part), "next": part_name(next) }),
        ),
        LssRequest::Inquire(part) => ("inquire", json!({ "part": part_name(part) })),
        LssRequest::InquireNode => ("inquire-node-id", json!({})),
    };
    command_json("manager", command, request.emit()[0], fields)
}

/// The fields of a response in JSON.
pub fn response_json(response: LssResponse) -> Json {
    let result = |error: u8, specific: u8| json!({ "error": error, "specific": specific });
    let (command, fields) = match response {
        LssResponse::Selected => ("switch-selective", json!({})),
        LssResponse::ConfigureNode { error, specific } => ("configure-node-id", result(error, specific)),
        LssResponse::ConfigureBitTiming { error, specific } => ("configure-bit-timing", result(error, specific)),
        LssResponse::Store { error, specific } => ("store", result(error, specific)),
        LssResponse::Identified => ("identify", json!({})),
        LssResponse::Unconfigured => ("identify-unconfigured", json!({})),
        LssResponse::Inquired(part, value) => ("inquire", json!({ "part": part_name(part), "value": value })),
        LssResponse::InquiredNode(node) => ("inquire-node-id", json!({ "node_id": node.map(NodeId::get) })),
    };
    command_json("device", command, response.emit()[0], fields)
}

fn command_json(from: &str, command: &str, code: u8, mut fields: Json) -> Json {
    fields["from"] = json!(from);
    fields["command"] = json!(command);
    fields["code"] = json!(format!("{code:02X}"));
    fields
}

fn state_name(state: LssState) -> &'static str {
    match state {
        LssState::Waiting => "waiting",
        LssState::Configuration => "configuration",
    }
}

fn part_name(part: Part) -> &'static str {
    match part {
        Part::Vendor => "vendor",
        Part::Product => "product",
        Part::Revision => "revision",
        Part::Serial => "serial",
    }
}

/// The number that a bound of a range limits, the relation, and the suffix in JSON.
fn bound_parts(bound: Bound) -> (Part, &'static str, &'static str) {
    match bound {
        Bound::Vendor => (Part::Vendor, "=", ""),
        Bound::Product => (Part::Product, "=", ""),
        Bound::RevisionLow => (Part::Revision, ">=", "-low"),
        Bound::RevisionHigh => (Part::Revision, "<=", "-high"),
        Bound::SerialLow => (Part::Serial, ">=", "-low"),
        Bound::SerialHigh => (Part::Serial, "<=", "-high"),
    }
}

fn node_name(node: Option<NodeId>) -> String {
    node.map_or_else(|| "none".to_owned(), |node| node.to_string())
}

fn standard_rate(table: u8, index: u8) -> Option<u16> {
    if table == 0 { BIT_TIMING_TABLE.get(usize::from(index)).copied().flatten() } else { None }
}

fn bit_rate(table: u8, index: u8) -> String {
    match standard_rate(table, index) {
        Some(rate) => format!("{rate} kbit/s"),
        None if table == 0 && index == AUTOMATIC => "by itself".to_owned(),
        None => format!("{index} of table {table}"),
    }
}
