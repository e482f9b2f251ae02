//! The network: NMT commands and states, SDO commands and aborts, default identifiers.

use lexican_eds::model::Value;
use lexican_runtime::AbortCode;
use lexican_runtime::object::Value as _;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::wire::sdo::{ClientRequest, Content, ServerResponse};

use super::pdo::name_of;
use super::prose::said;
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::Row;
use crate::notation::{hex, number, print, yes};
use crate::rig::{Rig, Simulator, once};
use crate::script::Clauses;

/// The states to which a command leads.
const STATES: &[(&str, u8)] = &[("OPERATIONAL", 0x01), ("PRE-OPERATIONAL", 0x80), ("STOPPED", 0x02)];
const INITIALISATION: &str = "INITIALISATION";

fn state_name<S: Simulator>(rig: &Rig<S>) -> &'static str {
    match rig.nmt_state() {
        NmtState::Operational => "OPERATIONAL",
        NmtState::PreOperational => "PRE-OPERATIONAL",
        NmtState::Stopped => "STOPPED",
        NmtState::Initialising => INITIALISATION,
    }
}

/// Whether a command does the same as power-on. That the other reset does so, too, may be an erratum.
pub(crate) type StartsCold = fn(u8) -> bool;

/// Compares `nmt.csv`.
pub(crate) fn commands<S: Simulator>(checker: &mut Checker<'_>, starts_cold: StartsCold) {
    for code in ["01", "02", "80", "81", "82"] {
        let Some(row) = checker.row("nmt.csv", code) else { continue };
        let command = hex(code).unwrap_or(0) as u8;
        let Followed { from, to, nodes } = once::<S, _>(command, || followed::<S>(command));
        checker.cell(row, "to", Against::Drive, to.join("; "));
        checker.cell(row, "from", Against::Drive, from.join("; "));
        checker.cell(row, "data_2", Against::Drive, nodes.join(" or "));
        // The manual says of one of the two resets that it is like power-on.
        let cold = code == "82" && once::<S, _>(command, || starts_cold(command));
        checker.cell(row, "note", Against::Drive, if cold { "cold start" } else { "" });
    }
}

/// The effect of an NMT command on the drive.
#[derive(Clone)]
struct Followed {
    /// The states that it leaves, and those to which it goes.
    from: Vec<&'static str>,
    to: Vec<&'static str>,
    /// The second bytes with which it follows the command.
    nodes: Vec<&'static str>,
}

fn followed<S: Simulator>(command: u8) -> Followed {
    let (mut to, mut from, mut nodes) = (Vec::new(), Vec::new(), Vec::new());
    for (name, enter) in STATES {
        for (node, said) in [(S::NODE.get(), "node"), (0, "0"), (S::NODE.get() + 1, "another node")] {
            let mut rig = Rig::<S>::new();
            rig.nmt(*enter);
            rig.hear(0);
            rig.send(0x000, &[command, node]);
            let reset = rig.hear_from(Rig::<S>::own(0x700), 0) == [[0]];
            let after = if reset { INITIALISATION } else { state_name(&rig) };
            if after != *name {
                to.push(after);
                from.push(*name);
                nodes.push(said);
            }
        }
    }
    to.dedup();
    from.dedup();
    nodes.dedup();
    nodes.truncate(nodes.len() / from.len().max(1));
    Followed { from, to, nodes }
}

/// Compares `nmt_states.csv`: what goes over the bus in each state. `beyond` compares the drive's own columns.
pub(crate) fn states<S: Simulator>(checker: &mut Checker<'_>, beyond: fn(&mut Checker<'_>, &Row, Rig<S>)) {
    if let Some(row) = checker.row("nmt_states.csv", INITIALISATION) {
        initialisation::<S>(checker, row);
    }
    for (name, enter) in STATES {
        let Some(row) = checker.row("nmt_states.csv", name) else { continue };
        state::<S>(checker, row, *enter);
        beyond(checker, row, entered(*enter));
    }
}

/// Initialisation ends with the boot-up message, so what is sent in it comes before that.
fn initialisation<S: Simulator>(checker: &mut Checker<'_>, row: &Row) {
    let boot_up = u32::from(Rig::<S>::own(0x700));
    let mut rig = Rig::<S>::as_delivered();
    let passed = !rig.hear(0).is_empty() && state_name(&rig) != INITIALISATION;
    rig.see(S::fail);
    rig.hear(0);
    rig.send(0x000, &[0x81, S::NODE.get()]);
    rig.send(Rig::<S>::own(0x600), &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
    rig.request(Rig::<S>::own(0x180));
    let frames: Vec<(u32, Vec<u8>)> =
        rig.hear(1000).iter().map(|frame| (frame.id().raw(), frame.data().to_vec())).collect();
    let end = frames.iter().position(|(id, data)| *id == boot_up && *data == [0]).unwrap_or(frames.len());
    let during = &frames[..end];
    let status = frames.get(end).and_then(|(_, data)| data.first().copied()).unwrap_or(255);
    checker.cell(row, "heartbeat_status", Against::Drive, status);
    for (column, base) in [("sdo", 0x580), ("pdo", 0x180), ("emcy", 0x080), ("heartbeat", 0x700)] {
        let sent = during.iter().any(|(id, _)| *id == u32::from(Rig::<S>::own(base)));
        checker.cell(row, column, Against::Drive, yes(sent));
    }
    // It is over before anything else of the drive can be seen.
    for (column, _) in row.cells.iter().filter(|(column, _)| !COMPARED.contains(&column.as_str())) {
        checker.cell(row, column, Against::Drive, if passed { "" } else { INITIALISATION });
    }
}

const COMPARED: &[&str] = &["chapter", "state", "heartbeat_status", "sdo", "pdo", "emcy", "heartbeat"];

/// A drive with heartbeats that was enabled before it entered a state.
fn entered<S: Simulator>(enter: u8) -> Rig<S> {
    let mut rig = Rig::<S>::new();
    rig.hear(0);
    // 1017h is written while it can be.
    if rig.write(0x1017, 0, 100, 2).is_ok() && enter != 0x80 {
        rig.nmt(0x01);
        rig.enable();
        rig.nmt(enter);
    }
    rig.hear(0);
    rig
}

fn state<S: Simulator>(checker: &mut Checker<'_>, row: &Row, enter: u8) {
    use Against::Drive as D;
    let mut rig = entered::<S>(enter);
    let beat = rig.hear_from(Rig::<S>::own(0x700), 100).pop().and_then(|data| data.first().copied());
    checker.cell(row, "heartbeat", D, yes(beat.is_some()));
    checker.cell(row, "heartbeat_status", D, beat.unwrap_or(0));
    checker.cell(row, "sdo", D, yes(rig.read(0x1000, 0).is_ok()));
    let pdo = rig.requested(Rig::<S>::own(0x180), 200);
    checker.cell(row, "pdo", D, yes(!pdo.is_empty()));
    rig.see(S::fail);
    checker.cell(row, "emcy", D, yes(!rig.hear_from(Rig::<S>::own(0x080), 0).is_empty()));
    let before = state_name(&rig);
    rig.nmt(if enter == 0x01 { 0x80 } else { 0x01 });
    rig.hear(0);
    checker.cell(row, "nmt", D, yes(state_name(&rig) != before));
}

/// Compares `sdo_commands.csv`. `objects` can be written with zero, and have size and index; `readable` have each size,
/// too.
pub(crate) fn sdo_commands<S: Simulator>(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    objects: [(u8, u16); 3],
    readable: [(u8, u16); 3],
) {
    let answer = |command: u8, index: u16| {
        let [low, high] = index.to_le_bytes();
        let answer = Rig::<S>::new().sdo(&[command, low, high, 0, 0, 0, 0, 0]);
        answer.map_or(String::new(), |answer| print(&answer[..1]))
    };
    for row in case.manual.rows("sdo_commands.csv") {
        let code = row.key.as_str();
        let number = hex(code).unwrap_or(0) as u8;
        let written: Vec<u8> =
            objects.iter().filter(|(_, index)| answer(number, *index) == "60").map(|(size, _)| *size).collect();
        let answered = readable.into_iter().find(|(_, index)| answer(0x40, *index) == code);
        let (command, data_bytes) = match (written.as_slice(), answered) {
            // The first size, if the command carries four bytes for every size.
            ([size, ..], _) => ("write request", size.to_string()),
            (_, Some((size, _))) => ("read response", size.to_string()),
            _ if answer(0x40, 0x5FFF) == code => ("error response", String::new()),
            _ if !answer(number, 0x1000).starts_with('8') => ("read request", String::new()),
            _ if answer(0x23, objects[0].1) == code => ("write response", String::new()),
            _ => ("", String::new()),
        };
        checker.key(row);
        checker.cell(row, "command", Against::Drive, command);
        if row.has("data_bytes") {
            checker.cell(row, "data_bytes", Against::Drive, data_bytes);
        }
        checker.cell(row, "decimal", Against::Manual, number);
    }
}

/// Compares `sdo_aborts.csv`. `refused` returns the code with which the drive refuses what a row describes; `others`
/// are codes that it does not send.
pub(crate) fn sdo_aborts<S: Simulator>(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    refused: fn(&str) -> Option<u32>,
    others: &[(&str, AbortCode)],
) {
    for row in case.manual.rows("sdo_aborts.csv") {
        checker.key(row);
        let meaning = row.get("meaning");
        let other = others.iter().find(|(of, _)| *of == meaning).map(|(_, code)| code.0);
        let against = if other.is_some() { Against::Code } else { Against::Drive };
        let answer = other.or_else(|| once::<S, _>(meaning, || refused(meaning)));
        let code = answer.unwrap_or(0);
        checker.cell(row, "code", against, format!("{code:08X}"));
        checker.that(row, "meaning", against, answer.is_some(), "nothing that is refused");
        let bytes = ["data_1", "data_2", "data_3", "data_4"].into_iter().zip(code.to_le_bytes());
        for (column, byte) in bytes.filter(|(column, _)| row.has(column)) {
            checker.cell(row, column, against, format!("{byte:02X}"));
        }
    }
}

/// Compares `sdo_commands.csv` if it uses the words of CiA 301: the number of data bytes that the runtime reads for
/// each command.
pub(crate) fn sdo_specifiers(checker: &mut Checker<'_>, case: &Case<'_>) {
    for row in case.manual.rows("sdo_commands.csv") {
        checker.key(row);
        let bytes = hex(row.get("hex")).map(|code| [code as u8, 0x41, 0x60, 0, 0, 0, 0, 0]);
        let read = bytes.map(|bytes| (ClientRequest::parse(&bytes), ServerResponse::parse(&bytes)));
        let found = match (row.get("command"), read) {
            ("upload request", Some((Some(ClientRequest::InitiateUpload { .. }), _)))
            | ("download response", Some((_, Some(ServerResponse::InitiateDownload { .. })))) => Some(String::new()),
            ("download request", Some((Some(ClientRequest::InitiateDownload { content, .. }), _)))
            | ("upload response", Some((_, Some(ServerResponse::InitiateUpload { content, .. })))) => match content {
                Content::Expedited(data) => data.len().map(|len| len.to_string()),
                _ => None,
            },
            ("abort", Some((_, Some(ServerResponse::Abort(_))))) => Some("4".into()),
            _ => None,
        };
        let agrees = found.as_deref() == Some(row.get("data_bytes"));
        checker.that(row, "data_bytes", Against::Code, agrees, format!("{found:?}"));
    }
}

/// Compares `encodings.csv`: numbers and their bytes.
pub(crate) fn encodings(checker: &mut Checker<'_>, case: &Case<'_>) {
    for row in case.manual.rows("encodings.csv") {
        checker.key(row);
        let value = number(row.get("value")).unwrap_or(0);
        let found = match row.get("data_type") {
            "UNSIGNED16" => u16::try_from(value).map(|value| print(&value.to_bytes()[..2])),
            "INTEGER16" => i16::try_from(value).map(|value| print(&value.to_bytes()[..2])),
            "UNSIGNED32" => u32::try_from(value).map(|value| print(&value.to_bytes()[..4])),
            _ => Ok(String::new()),
        };
        checker.cell(row, "bytes", Against::Code, found.unwrap_or_default());
    }
}

/// Compares `nmt.csv` if it has names and effects, for which `effect` gives clauses.
pub(crate) fn effects<S: Simulator>(checker: &mut Checker<'_>, effect: fn(u8) -> Clauses) {
    let all = [
        ("start remote node", NmtCommand::Start),
        ("stop remote node", NmtCommand::Stop),
        ("reset node", NmtCommand::ResetNode),
        ("reset communication node", NmtCommand::ResetCommunication),
    ];
    for (name, command) in all {
        let code = command.code();
        let Some(row) = checker.row("nmt.csv", &code.to_string()) else { continue };
        checker.cell(row, "name", Against::Code, name);
        checker.cell(row, "effect", Against::Drive, once::<S, _>(code, || said(&effect(code))));
    }
}

/// Compares `identifiers.csv` if it has the identifiers of all nodes: function code, range, and the object that holds
/// them, in brackets if it cannot be changed.
pub(crate) fn connection_set<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let ends = |text: &str, radix| {
        let (low, high) = text.split_once("..").unwrap_or((text, text));
        Some((u16::from_str_radix(low, radix).ok()?, u16::from_str_radix(high, radix).ok()?))
    };
    for row in case.manual.rows("identifiers.csv") {
        checker.key(row);
        let printed = ends(row.get("hex"), 16);
        let decimal = ends(row.get("decimal"), 10);
        checker.that(row, "decimal", Against::Manual, decimal == printed, format!("{printed:?}"));
        let (low, high) = printed.unwrap_or_default();
        let is_of_a_node = low != high;
        let base = if is_of_a_node { low.wrapping_sub(1) } else { low };
        let function = format!("{:04b}", base >> 7);
        checker.cell(row, "function_code", Against::Manual, function);
        let whole = base % 0x80 == 0 && high == base + if is_of_a_node { 127 } else { 0 };
        let name = match row.get("object") {
            "EMERGENCY" => "EMCY".to_owned(),
            "Nodeguard" => "Node guard".to_owned(),
            other if other.ends_with(|last: char| last.is_ascii_digit()) => other.replace(' ', ""),
            other => other.to_owned(),
        };
        // A drive sends nothing that shows that it uses TIME.
        let used = if name == "TIME" { base == 0x100 } else { once::<S, _>((&name, base), || used::<S>(&name, base)) };
        checker.that(row, "hex", Against::Drive, whole && used, "the drive does not use it");
        let default = if is_of_a_node { Value::NodeIdPlus(base.into()) } else { Value::Integer(base.into()) };
        let index = row.get("index").trim_matches(['(', ')']);
        let held = u16::from_str_radix(index, 16).ok().and_then(|index| {
            let object = case.sheet.device.object(index)?;
            object.entry(u8::from(object.kind.has_subs()))
        });
        let agrees = held.is_some_and(|entry| entry.default.as_ref() == Some(&default));
        let found = format!("{:?}", held.and_then(|entry| entry.default.as_ref()));
        checker.that(row, "index", Against::Sheet, agrees || index.is_empty(), found);
    }
}

/// Compares `identifiers.csv`.
pub(crate) fn identifiers<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>) {
    let device = &case.sheet.device;
    let pdo = |name: &str| device.pdos.iter().find(|pdo| name_of(pdo) == name)?.cob_id.clone();
    let entry = |index, sub| device.entry(index, sub)?.default.clone();
    for row in case.manual.rows("identifiers.csv") {
        let base = hex(row.get("hex"));
        checker.cell(row, "decimal", Against::Manual, base.map_or(String::new(), |base| base.to_string()));
        let name = row.get("name");
        let default = match name {
            "NMT" => Some(Value::Integer(0)),
            "SYNC" => entry(0x1005, 0),
            "EMCY" => entry(0x1014, 0),
            "SDO tx" => entry(0x1200, 2),
            "SDO rx" => entry(0x1200, 1),
            "Heartbeat" | "Node guard" => Some(Value::NodeIdPlus(0x700)),
            pdo_name => pdo(pdo_name),
        };
        let (found, plus) = match default {
            Some(Value::Integer(id)) => (format!("{id:X}"), "no"),
            Some(Value::NodeIdPlus(base)) => (format!("{base:X}"), "yes"),
            _ => continue,
        };
        checker.key(row);
        let base = base.unwrap_or(0) as u16;
        let heard = once::<S, _>((name, base), || used::<S>(name, base));
        checker.that(row, "hex", Against::Drive, heard, "the drive does not use it");
        if !matches!(name, "NMT" | "Heartbeat" | "Node guard") {
            checker.cell(row, "hex", Against::Sheet, found);
        }
        checker.cell(row, "plus_node_id", Against::Sheet, plus);
    }
}

/// Whether the drive uses an identifier for the service with this name.
fn used<S: Simulator>(name: &str, base: u16) -> bool {
    let (own, sdo) = (base + u16::from(S::NODE.get()), [Rig::<S>::own(0x600), Rig::<S>::own(0x580)]);
    let mut rig = Rig::<S>::as_delivered();
    let boot_up = rig.hear_from(own, 0);
    S::prepare(&mut rig);
    match name {
        "NMT" => {
            rig.send(base, &[0x02, S::NODE.get()]);
            rig.hear(0);
            rig.nmt_state() == NmtState::Stopped
        }
        "SYNC" => {
            let set = rig.write(0x1800, 2, 1, 1).is_ok();
            rig.nmt(0x01);
            rig.send(base, &[]);
            set && !rig.hear_from(Rig::<S>::own(0x180), 0).is_empty()
        }
        "EMCY" => {
            rig.see(S::fail);
            !rig.hear_from(own, 0).is_empty()
        }
        "Heartbeat" => boot_up == [[0]],
        "Node guard" => rig.requested(own, 0) == [[0x7F]],
        "SDO rx" | "SDO tx" => {
            let [request, answer] = if name == "SDO rx" { [own, sdo[1]] } else { [sdo[0], own] };
            rig.send(request, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
            !rig.hear_from(answer, 0).is_empty()
        }
        name if name.starts_with("TPDO") => {
            rig.nmt(0x01);
            !rig.requested(own, 200).is_empty()
        }
        name if name.starts_with("RPDO") => {
            rig.nmt(0x01);
            let data = [0x06, 0x01, 0, 0, 0, 0];
            rig.send(own, if name == "RPDO1" { &data[..2] } else { &data });
            rig.hear(0);
            rig.status() & 0x6F == 0x21
        }
        _ => false,
    }
}
