//! Rules of CiA 301 and of device profiles.

use super::context::{BASE_IDENTIFIER, Context, EXTENDED, IDENTIFIER, INVALID, held_by, listed, place, plural};
use super::remedy::{MAX_STEPS, overlays};
use super::rule::{Out, note};
use crate::model::keys::Key;
use crate::model::pdo::held;
use crate::model::types::DataType;
use crate::model::{Entry, ObjectKind, ObjectList, Value};
use crate::standard;
use crate::text::Span;
use lexican_cia::cia301::{self, *};

pub(super) fn missing_object(cx: &Context<'_>, out: &mut Out<'_>) {
    if cx.device.objects.is_empty() {
        return;
    }
    for (index, name) in [(DEVICE_TYPE, "device type"), (ERROR_REGISTER, "error register"), (IDENTITY, "identity")] {
        if cx.device.object(index).is_none() {
            let list = cx.facts.lists.iter().find(|list| list.list == ObjectList::Mandatory);
            let span = list.map_or(Span::eds(0, 0), |list| list.span);
            out.push(note(format!("the {name} ({index:04X}) is missing")).at(span, ""));
        }
    }
}

pub(super) fn object_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for (object, facts) in cx.objects() {
        let Some(standard) = standard::object(object.index, cx.device.profile) else { continue };
        let same = object.kind == standard.kind || facts.declared.is_none();
        // A list of equal values may be an ARRAY or a RECORD.
        let alike = object.kind.has_subs() && standard.kind.has_subs() && standard.loose;
        if !same && !alike {
            let [found, expected] = [object.kind, standard.kind].map(with_article);
            let note = note(format!("{:04X} is {found}, in {} {expected}", object.index, standard.source));
            out.push(note.at(cx.value_span(object.span, Key::ObjectType), ""));
        }
    }
}

/// `an ARRAY`, `a RECORD`.
fn with_article(kind: ObjectKind) -> String {
    let article = if kind == ObjectKind::Array { "an" } else { "a" };
    format!("{article} {}", kind.name())
}

pub(super) fn data_type(cx: &Context<'_>, out: &mut Out<'_>) {
    for object in &cx.device.objects {
        let Some(standard) = standard::object(object.index, cx.device.profile) else { continue };
        let differs = |entry: &Entry| {
            let differs = |expected: &DataType| entry.data_type != *expected && !entry.data_type.is_unknown();
            standard.data_type(entry.sub).filter(differs)
        };
        let different = object.entries.iter().filter_map(|entry| Some((entry, differs(entry)?)));
        let different: Vec<(&Entry, DataType)> = different.collect();
        let Some((&(first, expected), others)) = different.split_first() else { continue };
        let message = format!("{} is {}, in {} {expected}", place(first), first.data_type, standard.source);
        let more = match others.len() {
            0 => String::new(),
            count => format!("and {} more", plural(count, "sub-index")),
        };
        let note = note(message).at(cx.entry_span(first, Key::DataType), more);
        let can = different.len() <= MAX_STEPS && different.iter().all(|(entry, to)| cx.can_become(entry, *to));
        let table = |(entry, to): &(&Entry, DataType)| (cx.address(entry), format!("data_type = \"{to}\""));
        let corrected = || overlays(different.iter().map(table));
        let accepted = cx.accept(first, out.rule.code);
        out.push(note.help(match can {
            true => format!("if the device follows the standard, {}\nelse, {accepted}", corrected()),
            false => format!("where it must be so, {accepted}"),
        }));
    }
}

pub(super) fn reserved_sub_index(cx: &Context<'_>, out: &mut Out<'_>) {
    let parameters = cx.device.objects.iter().filter(|object| cia301::is_pdo_communication(object.index));
    let reserved: Vec<&Entry> = parameters.filter_map(|object| object.entry(4)).collect();
    let finding = match reserved.as_slice() {
        [] => return,
        [only] => note(format!("{} is reserved", place(only))),
        several => note(format!("{} are reserved", listed(several, |entry| place(entry)))),
    };
    let finding = finding.at_each(reserved.iter().map(|entry| entry.span), "shall not be implemented", "nor this");
    out.push(
        finding.help("where the device has no such entry, remove its section; other devices abort with 0609 0011h"),
    );
}

pub(super) fn writable(cx: &Context<'_>, out: &mut Out<'_>) {
    for entry in cx.device.entries() {
        let fixed = match entry.index {
            DEVICE_TYPE..=MANUFACTURER_STATUS_REGISTER | IDENTITY => true,
            MANUFACTURER_DEVICE_NAME..=MANUFACTURER_SOFTWARE_VERSION => true,
            PREDEFINED_ERROR_FIELD => entry.sub > 0,
            _ => false,
        };
        if fixed && entry.access.writable() {
            let note = note(format!("{} is {}", place(entry), entry.access.name()));
            let note = note.at(cx.entry_span(entry, Key::AccessType), "read-only in CiA 301");
            let can = entry.configured.is_none();
            out.push(note.mend(can.then(|| cx.correct(entry, "access = \"ro\""))));
        }
    }
}

pub(super) fn device_type(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(entry) = cx.device.entry(DEVICE_TYPE, 0).filter(|_| cx.changes.profile.is_none()) else { return };
    let value = held(entry).and_then(Value::as_integer).and_then(|value| u32::try_from(value).ok());
    let Some(value) = value else { return };
    let profile = |value: u32| value & 0xFFFF;
    let is_drive = has_on_any_axis(cx, 0x6040) && has_on_any_axis(cx, 0x6041);
    // Fluid power (408) has controlword and statusword as well, and FFFFh is a device of several profiles.
    let is_free = matches!(profile(value), 402 | 408 | 0xFFFF);
    let halves_swapped = (value & 0xFF00_FF00) >> 8 | (value & 0x00FF_00FF) << 8;
    let swapped = [halves_swapped, value.swap_bytes(), value.rotate_left(16)];
    // Profiles have numbers from 301 on. If a number is no profile, but is one with bytes swapped, the byte order is
    // wrong.
    let is_profile = |&value: &u32| (301..500).contains(&profile(value));
    let swapped = swapped.into_iter().find(is_profile).filter(|_| !is_profile(&value));
    // If the low half is 0, only a swap of all four bytes is beyond doubt: the high half may hold anything.
    let swapped = swapped.filter(|&swapped| profile(value) != 0 || swapped == value.swap_bytes());
    let swapped = swapped.filter(|&swapped| profile(swapped) == 402 || !is_drive);
    let (message, text, right) = match swapped {
        Some(swapped) => ("the bytes of the device type are swapped", format!("{swapped:#X} was meant"), swapped),
        None if is_drive && !is_free => {
            let text = format!("says profile {}", profile(value));
            // The high half of another profile has another meaning.
            let kind = if profile(value) == 0 { value & 0xFFFF_0000 } else { 0 };
            ("the device has controlword and statusword, but is no drive of CiA 402", text, kind | 402)
        }
        // If all four bits are 0, the device type says nothing about inputs and outputs.
        None if profile(value) == 401 && value >> 16 & 0xF != 0 && denied(cx, value) != 0 => {
            let (right, words) = (value | denied(cx, value), ["digital inputs", "digital outputs", "analogue inputs"]);
            let words = words.into_iter().chain(["analogue outputs"]).zip(16..);
            let words: Vec<&str> = words.filter(|(_, bit)| denied(cx, value) & 1 << bit != 0).map(|it| it.0).collect();
            let text = format!("bits 16 to 19 deny {}", words.join(", "));
            ("the device type denies inputs or outputs that the device has", text, right)
        }
        None => return,
    };
    let note = note(message).at(cx.entry_span(entry, held_by(entry)), text);
    let can = entry.configured.is_none() && cx.can_default(entry, right.into());
    out.push(note.mend(can.then(|| cx.correct(entry, &format!("default = {right:#X}")))));
}

/// Bits 16 to 19 of a CiA 401 device type that are 0 although the device has such inputs or outputs.
fn denied(cx: &Context<'_>, device_type: u32) -> u32 {
    let any = |indices: &[u16]| indices.iter().any(|&index| cx.device.object(index).is_some());
    let there = [
        any(&[0x6000, 0x6020, 0x6100, 0x6120]),
        any(&[0x6200, 0x6220, 0x6300, 0x6320]),
        any(&[0x6400, 0x6401, 0x6402, 0x6403]),
        any(&[0x6410, 0x6411, 0x6412, 0x6413]),
    ];
    (16..).zip(there).filter(|&(bit, there)| there && device_type & 1 << bit == 0).map(|(bit, _)| 1 << bit).sum()
}

/// Whether the device has an object of the profile on any axis; axes are 800h apart.
fn has_on_any_axis(cx: &Context<'_>, index: u16) -> bool {
    (0..8).any(|axis| cx.device.object(index + axis * 0x800).is_some())
}

pub(super) fn missing_profile_object(cx: &Context<'_>, out: &mut Out<'_>) {
    if cx.device.profile != Some(402) {
        return;
    }
    for (index, name) in [(0x6040, "controlword"), (0x6041, "statusword")] {
        if !has_on_any_axis(cx, index) {
            let device_type = cx.device.object(DEVICE_TYPE).map_or(Span::eds(0, 0), |object| object.span);
            out.push(note(format!("the {name} ({index:04X}) is missing")).at(device_type, "says CiA 402"));
        }
    }
}

pub(super) fn no_error_control(cx: &Context<'_>, out: &mut Out<'_>) {
    let there = |index: u16| cx.device.object(index).is_some();
    let Some(first) = cx.device.objects.first() else { return };
    if !there(PRODUCER_HEARTBEAT_TIME) && !there(GUARD_TIME) {
        let note = note("the device has neither heartbeat (1017) nor node guarding (100C, 100D)");
        out.push(note.at(first.span, ""));
    }
}

pub(super) fn half_guarding(cx: &Context<'_>, out: &mut Out<'_>) {
    for (one, other) in [(GUARD_TIME, LIFE_TIME_FACTOR), (LIFE_TIME_FACTOR, GUARD_TIME)] {
        if let (Some(object), None) = (cx.device.object(one), cx.device.object(other)) {
            out.push(note(format!("there is {one:04X}, but no {other:04X}")).at(object.span, ""));
        }
    }
}

pub(super) fn two_error_controls(cx: &Context<'_>, out: &mut Out<'_>) {
    let active = |index: u16| {
        let entry = cx.device.entry(index, 0)?;
        held(entry).and_then(Value::as_integer).filter(|&time| time > 0).map(|_| entry)
    };
    if let (Some(heartbeat), Some(guarding), Some(_)) =
        (active(PRODUCER_HEARTBEAT_TIME), active(GUARD_TIME), active(LIFE_TIME_FACTOR))
    {
        let note = note("heartbeat and node guarding are both active by default");
        let note = note.at(cx.entry_span(heartbeat, held_by(heartbeat)), "the heartbeat");
        let note = note.and(cx.entry_span(guarding, held_by(guarding)), "the guard time");
        out.push(note.mend(default(cx, guarding, "0")));
    }
}

/// A remedy that sets the default of an entry, unless a DCF configures the entry.
fn default(cx: &Context<'_>, entry: &Entry, value: &str) -> Option<String> {
    entry.configured.is_none().then(|| cx.correct(entry, &format!("default = {value}")))
}

pub(super) fn identity(cx: &Context<'_>, out: &mut Out<'_>) {
    let info = &cx.device.info;
    let numbers = [
        (1, "VendorNumber", info.vendor_number),
        (2, "ProductNumber", info.product_number),
        (3, "RevisionNumber", info.revision_number),
    ];
    for (sub, key, said) in numbers {
        let entry = cx.device.entry(IDENTITY, sub);
        let value = entry.and_then(|entry| entry.default.as_ref()).and_then(Value::as_integer);
        let (Some(entry), Some(value), Some(said)) = (entry, value, said) else { continue };
        // 0 means "not given" in both places.
        if value == i128::from(said) || value == 0 || said == 0 {
            continue;
        }
        let Some(span) = cx.device_info(key) else { continue };
        let note = note(format!("`{key}` is {said:#X}, but {} is {value:#X}", place(entry)));
        let note = note.at(span, "").and(cx.entry_span(entry, Key::DefaultValue), "says otherwise");
        let corrected = cx.can_default(entry, said.into()).then(|| cx.correct(entry, &format!("default = {said:#X}")));
        let other = cx.replace(span, &format!("0x{value:X}")).filter(|_| u32::try_from(value).is_ok());
        let other = other.map(|other| other.to_string());
        let remedies = [(corrected, format!("if `{key}` is right, ")), (other, "if the object is right, ".to_owned())];
        let remedies: Vec<String> = remedies.into_iter().filter_map(|(remedy, when)| Some(when + &remedy?)).collect();
        out.push(note.mend(Some(remedies.join("\n")).filter(|remedy| !remedy.is_empty())));
    }
}

pub(super) fn emcy_cob_id(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(entry) = cx.device.entry(COB_ID_EMCY, 0) else { return };
    let good = match &entry.default {
        None => true,
        Some(Value::NodeIdPlus(id)) => id & i64::from(cia301::IDENTIFIER) == i64::from(connection::EMCY),
        // A number without `$NODEID` fits only one node, the one of a DCF.
        Some(Value::Integer(id)) => id & INVALID != 0 || Some(id & IDENTIFIER) == of_the_node(cx),
        Some(_) => true,
    };
    if !good {
        let note = note("the COB-ID of EMCY is not $NODEID+0x80 by default");
        let note = note.at(cx.entry_span(entry, Key::DefaultValue), "");
        out.push(note.help(cx.correct(entry, "default = \"$NODEID+0x80\"")));
    }
}

/// The COB-ID of EMCY for the node of a DCF.
fn of_the_node(cx: &Context<'_>) -> Option<i128> {
    let node_id = cx.device.commissioning.as_ref()?.node_id?;
    Some(i128::from(connection::EMCY) + i128::from(node_id))
}

pub(super) fn sync_cob_id(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(entry) = cx.device.entry(COB_ID_SYNC, 0) else { return };
    let Some(id) = entry.default.as_ref().and_then(Value::as_integer) else { return };
    let identifier = (id & BASE_IDENTIFIER) as u32;
    if id & EXTENDED == 0 && identifier != 0 && is_restricted(identifier) {
        let note = note(format!("the COB-ID {identifier:03X}h of SYNC is restricted"));
        let note = note.at(cx.entry_span(entry, Key::DefaultValue), "");
        out.push(note.help(cx.correct(entry, "default = 0x80")));
    }
}

pub(super) fn sdo_cob_id(cx: &Context<'_>, out: &mut Out<'_>) {
    for (sub, base) in [(1, connection::SDO_REQUEST), (2, connection::SDO_RESPONSE)] {
        let Some(entry) = cx.device.entry(SDO_SERVER_1, sub) else { continue };
        let good = match &entry.default {
            Some(Value::NodeIdPlus(id)) => *id == i64::from(base),
            Some(Value::Integer(id)) => (0..=127).contains(&(id - i128::from(base))),
            _ => true,
        };
        if !good {
            let note = note(format!("the COB-ID of the default SDO is not $NODEID+{base:#X}"));
            let note = note.at(cx.entry_span(entry, Key::DefaultValue), "");
            out.push(note.help(cx.correct(entry, &format!("default = \"$NODEID+{base:#X}\""))));
        }
    }
}

pub(super) fn sdo_client(cx: &Context<'_>, out: &mut Out<'_>) {
    for object in cx.device.objects.iter().filter(|object| matches!(object.index, SDO_CLIENT_1..=SDO_CLIENT_128)) {
        if object.kind.has_subs() && object.entry(3).is_none() {
            out.push(note(format!("{:04X} has no node-ID of the server (03)", object.index)).at(object.span, ""));
        }
    }
}

pub(super) fn heartbeat_consumer(cx: &Context<'_>, out: &mut Out<'_>) {
    let Some(object) = cx.device.object(CONSUMER_HEARTBEAT_TIME) else { return };
    for entry in object.entries.iter().filter(|entry| entry.sub > 0) {
        let Some(value) = held(entry).and_then(Value::as_integer) else { continue };
        if value >> 16 > 127 {
            let note = note(format!("{} watches a node-ID that does not exist", place(entry)));
            let note = note.at(cx.entry_span(entry, held_by(entry)), "");
            let off = default(cx, entry, "0");
            out.push(note.mend(off.map(|remedy| format!("to watch no node, {remedy}"))));
        }
    }
}
