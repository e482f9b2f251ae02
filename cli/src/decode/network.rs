//! What concerns the network: NMT, SYNC, TIME, EMCY and error control.

use lexican_eds::model::Value;
use lexican_runtime::wire::emcy::{CodeOrder, Emergency, ErrorCode};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::lss::{LssRequest, LssResponse};
use lexican_runtime::wire::nmt::{NmtMessage, NmtState};
use lexican_runtime::wire::sync::Sync;
use lexican_runtime::{Frame, NodeId};

use super::{Decoded, Detail, Emcy, Service, lss};
use crate::values::{Known, hex};

pub(super) fn nmt(frame: &Frame) -> Decoded {
    let Some(message) = NmtMessage::parse(frame.data()) else {
        return Decoded::unreadable(Service::Nmt, "NMT", None, frame);
    };
    let all = if message.node.is_none() { ", all nodes" } else { "" };
    let text = match message.command.target() {
        NmtState::Initialising => message.command.to_string(),
        state => format!("enter {state}"),
    };
    let detail = Detail::Nmt(message.command);
    Decoded { text: text + all, detail, ..Decoded::new(Service::Nmt, "NMT", message.node) }
}

pub(super) fn sync(frame: &Frame) -> Decoded {
    let Some(sync) = Sync::parse(frame.data()) else {
        return Decoded::unreadable(Service::Sync, "SYNC", None, frame);
    };
    let text = sync.counter.map(|counter| format!("counter {counter}")).unwrap_or_default();
    Decoded { text, detail: Detail::Sync { counter: sync.counter }, ..Decoded::new(Service::Sync, "SYNC", None) }
}

pub(super) fn time(frame: &Frame) -> Decoded {
    let Some(time) = lexican_runtime::wire::time::parse(frame.data()) else {
        return Decoded::unreadable(Service::Time, "TIME", None, frame);
    };
    let text = format!("day {} since 1 January 1984, {} ms after midnight", time.days, time.ms);
    let detail = Detail::Time { days: time.days, ms: time.ms };
    Decoded { text, detail, ..Decoded::new(Service::Time, "TIME", None) }
}

pub(super) fn error_control(node: NodeId, frame: &Frame) -> Decoded {
    let decoded = |name: &str, text: String, detail| Decoded {
        text,
        detail,
        ..Decoded::new(Service::ErrorControl, name, Some(node))
    };
    if frame.is_remote() {
        return decoded("guarding", "state asked for".to_owned(), Detail::Guarding);
    }
    let Some(ErrorControl { state, toggle }) = ErrorControl::parse(frame.data()) else {
        return Decoded::unreadable(Service::ErrorControl, "heartbeat", Some(node), frame);
    };
    let detail = Detail::ErrorControl { state, toggle };
    match (state, toggle) {
        (NmtState::Initialising, false) => decoded("boot-up", String::new(), detail),
        (_, false) => decoded("heartbeat", state.to_string(), detail),
        (_, true) => decoded("heartbeat", format!("{state}, toggle bit set"), detail),
    }
}

pub(super) fn emergency(node: NodeId, known: Option<&Known<'_>>, frame: &Frame) -> Decoded {
    let mut decoded = Decoded::new(Service::Emcy, "EMCY", Some(node));
    let Some(emergency) = Emergency::parse(frame.data(), CodeOrder::LowByteFirst) else {
        decoded.text = format!("{} bytes: an EMCY has 8", frame.data().len());
        return decoded;
    };
    let code = emergency.code.0;
    // The error history has the same codes as the messages, by the names of the device.
    let named = known.and_then(|known| known.name_of(known.device.entry(0x1003, 1)?, code.into()));
    let group = || emergency.code.group().and_then(ErrorCode::text);
    let meaning = named.or(emergency.code.text()).or_else(group);
    let register = known.and_then(|known| {
        let entry = known.device.entry(0x1001, 0)?;
        Some(known.describe(entry, &Value::Integer(emergency.register.0.into())))
    });
    let register = register.unwrap_or_else(|| format!("{:02X}h", emergency.register.0));
    decoded.text = named.map_or_else(|| emergency.code.to_string(), |name| format!("{code:04X}h: {name}"));
    decoded.text += &format!(", error register = {register}");
    if emergency.vendor != [0; 5] {
        decoded.text += &format!(", {}", hex(&emergency.vendor));
    }
    decoded.alarming = code != 0;
    decoded.detail = Detail::Emcy(Emcy {
        code,
        meaning: meaning.map(str::to_owned),
        register: emergency.register.0,
        register_text: register,
        vendor: emergency.vendor,
    });
    decoded
}

pub(super) fn lss_request(frame: &Frame) -> Decoded {
    let Some(request) = LssRequest::parse(frame.data()) else {
        return Decoded::unreadable(Service::Lss, "LSS request", None, frame);
    };
    let (text, detail) = (lss::request_text(request), Detail::LssRequest(request));
    Decoded { text, detail, ..Decoded::new(Service::Lss, "LSS request", None) }
}

pub(super) fn lss_response(frame: &Frame) -> Decoded {
    let Some(response) = LssResponse::parse(frame.data()) else {
        return Decoded::unreadable(Service::Lss, "LSS response", None, frame);
    };
    let (text, detail, alarming) =
        (lss::response_text(response), Detail::LssResponse(response), lss::refuses(response));
    Decoded { text, detail, alarming, ..Decoded::new(Service::Lss, "LSS response", None) }
}
