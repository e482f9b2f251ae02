//! Decodes NMT, SYNC, TIME, EMCY, error control and LSS.

use lexican_eds::model::Value;
use lexican_runtime::object::Address;
use lexican_runtime::wire::emcy::{CodeOrder, Emergency, ErrorCode};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::lss::{LssRequest, LssResponse};
use lexican_runtime::wire::nmt::{NmtMessage, NmtState};
use lexican_runtime::wire::sync::Sync;
use lexican_runtime::{Frame, NodeId, cia301};

use super::{Decoded, Detail, Emcy, Service, lss};
use crate::values::{DeviceValues, hex};

pub(super) fn nmt(frame: &Frame) -> Decoded {
    let Some(message) = NmtMessage::parse(frame.data()) else {
        return Decoded::new(Service::Nmt, "NMT", None).unreadable(frame);
    };
    let all = if message.node.is_none() { ", all nodes" } else { "" };
    let text = match message.command.target() {
        NmtState::Initialising => message.command.to_string(),
        state => format!("enter {state}"),
    };
    Decoded::new(Service::Nmt, "NMT", message.node).with(text + all, Detail::Nmt(message.command))
}

pub(super) fn sync(frame: &Frame) -> Decoded {
    let decoded = Decoded::new(Service::Sync, "SYNC", None);
    let Some(Sync { counter }) = Sync::parse(frame.data()) else { return decoded.unreadable(frame) };
    let text = counter.map(|counter| format!("counter {counter}")).unwrap_or_default();
    decoded.with(text, Detail::Sync { counter })
}

pub(super) fn time(frame: &Frame) -> Decoded {
    let decoded = Decoded::new(Service::Time, "TIME", None);
    let Some(time) = lexican_runtime::wire::time::parse(frame.data()) else { return decoded.unreadable(frame) };
    let text = format!("day {} since 1 January 1984, {} ms after midnight", time.days, time.ms);
    decoded.with(text, Detail::Time { days: time.days, ms: time.ms })
}

pub(super) fn error_control(node: NodeId, frame: &Frame) -> Decoded {
    let decoded = |name: &'static str| Decoded::new(Service::ErrorControl, name, Some(node));
    if frame.is_remote() {
        return decoded("guarding").with("state asked for", Detail::Guarding);
    }
    let Some(ErrorControl { state, toggle }) = ErrorControl::parse(frame.data()) else {
        return decoded("heartbeat").unreadable(frame);
    };
    let (name, text) = match (state, toggle) {
        (NmtState::Initialising, false) => ("boot-up", String::new()),
        (_, false) => ("heartbeat", state.to_string()),
        (_, true) => ("heartbeat", format!("{state}, toggle bit set")),
    };
    decoded(name).with(text, Detail::ErrorControl { state, toggle })
}

pub(super) fn emergency(node: NodeId, device: Option<&DeviceValues<'_>>, frame: &Frame) -> Decoded {
    let decoded = Decoded::new(Service::Emcy, "EMCY", Some(node));
    let Some(emergency) = Emergency::parse(frame.data(), CodeOrder::LowByteFirst) else {
        return Decoded { text: format!("{} bytes: an EMCY has 8", frame.data().len()), ..decoded };
    };
    let code = emergency.code.0;
    let entry = |index, sub| device.and_then(|device| Some((device, device.entry(Address::new(index, sub))?)));
    // Overlays name EMCY codes at 1003h:01, the first entry of the error history.
    let named = entry(cia301::PREDEFINED_ERROR_FIELD, 1).and_then(|(device, entry)| device.name_of(entry, code.into()));
    let group = || emergency.code.group().and_then(ErrorCode::text);
    let meaning = named.or(emergency.code.text()).or_else(group);
    let register = Value::Integer(emergency.register.0.into());
    let register_text = entry(cia301::ERROR_REGISTER, 0).map(|(device, entry)| device.describe(entry, &register));
    let register_text = register_text.unwrap_or_else(|| format!("{:02X}h", emergency.register.0));
    let mut text = named.map_or_else(|| emergency.code.to_string(), |name| format!("{code:04X}h: {name}"));
    text += &format!(", error register = {register_text}");
    if emergency.vendor != [0; 5] {
        text += &format!(", {}", hex(&emergency.vendor));
    }
    let (register, vendor) = (emergency.register.0, emergency.vendor);
    let emcy = Emcy { code, meaning: meaning.map(str::to_owned), register, register_text, vendor };
    Decoded { alarming: code != 0, ..decoded.with(text, Detail::Emcy(emcy)) }
}

pub(super) fn lss_request(frame: &Frame) -> Decoded {
    let decoded = Decoded::new(Service::Lss, "LSS request", None);
    let Some(request) = LssRequest::parse(frame.data()) else { return decoded.unreadable(frame) };
    decoded.with(lss::request_text(request), Detail::LssRequest(request))
}

pub(super) fn lss_response(frame: &Frame) -> Decoded {
    let decoded = Decoded::new(Service::Lss, "LSS response", None);
    let Some(response) = LssResponse::parse(frame.data()) else { return decoded.unreadable(frame) };
    let decoded = decoded.with(lss::response_text(response), Detail::LssResponse(response));
    Decoded { alarming: lss::refuses(response), ..decoded }
}
