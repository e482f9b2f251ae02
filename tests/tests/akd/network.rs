//! The tables of the protocols and of the state machine against the data sheet and the runtime.

use lexican_eds::model::{Device, Value};
use lexican_runtime::AbortCode;
use lexican_runtime::object::Value as _;
use lexican_runtime::profile::cia402::{Cause, Command, State, Transitions};
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::wire::sdo::{ClientRequest, Content, ServerResponse};

use crate::manual::{Judge, Row, rows};
use crate::sheet::number;

pub fn judge(device: &Device, judge: &mut Judge) {
    identifiers(device, judge);
    states(judge);
    transitions(judge);
    sdo(judge);
    for row in rows("nmt") {
        let command = row.get("command").parse().ok().and_then(NmtCommand::from_code);
        judge.that(&row, "command", command.is_some(), "no such command");
    }
    for row in rows("encodings") {
        let value = number(row.get("value")).unwrap();
        let bytes = match row.get("data_type") {
            "UNSIGNED16" => u16::try_from(value).unwrap().to_bytes()[..2].to_vec(),
            "INTEGER16" => i16::try_from(value).unwrap().to_bytes()[..2].to_vec(),
            _ => u32::try_from(value).unwrap().to_bytes()[..4].to_vec(),
        };
        let found = bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ");
        judge.that(&row, "bytes", row.get("bytes") == found, found);
    }
}

/// The predefined connection set of 5.2.
fn identifiers(device: &Device, judge: &mut Judge) {
    for row in rows("identifiers") {
        let range = |column: &str, radix| {
            let text = row.get(column);
            let (low, high) = text.split_once("..").unwrap_or((text, text));
            (u32::from_str_radix(low, radix).unwrap(), u32::from_str_radix(high, radix).unwrap())
        };
        let (low, high) = range("hex", 16);
        judge.that(&row, "decimal", range("decimal", 10) == (low, high), format!("{low}..{high}"));
        let is_of_a_node = low != high;
        let base = if is_of_a_node { low - 1 } else { low };
        judge.that(&row, "hex", high == base + if is_of_a_node { 127 } else { 0 }, format!("{base:X}"));
        let function = format!("{:04b}", base >> 7);
        judge.that(&row, "function_code", row.get("function_code") == function, function);
        let index = row.get("index").trim_matches(['(', ')']);
        if !index.is_empty() {
            let object = device.object(u16::from_str_radix(index, 16).unwrap());
            let entry = object.and_then(|object| object.entry(u8::from(object.kind.has_subs())));
            let expected =
                if is_of_a_node { Value::NodeIdPlus(i64::from(base)) } else { Value::Integer(i128::from(base)) };
            let default = entry.and_then(|entry| entry.default.clone());
            judge.that(&row, "index", default.as_ref() == Some(&expected), format!("{default:?}"));
        }
    }
}

/// The bits of states and commands.
fn states(judge: &mut Judge) {
    for row in rows("states") {
        let name = row.get("state").to_uppercase();
        let found = words(row.get("bits_6_0")).map(|word| State::from_status_word(word).map(|state| state.to_string()));
        let others: Vec<_> = found.filter(|state| state.as_ref() != Some(&name)).collect();
        judge.that(&row, "bits_6_0", others.is_empty(), format!("{others:?}"));
    }
    for row in rows("commands") {
        let command = command(row.get("command")).expect("a command of CiA 402");
        let word = command.apply(0);
        judge.that(&row, "bits_7_0", words(row.get("bits_7_0")).any(|other| other == word), format!("{word:04X}"));
        let numbers = row.get("transitions").split("; ").map(|number| number.parse::<u8>().unwrap());
        let others: Vec<u8> = numbers.filter(|number| !has(*number, command)).collect();
        judge.that(&row, "transitions", others.is_empty(), format!("{others:?}"));
    }
}

/// What makes a transition; its states are in a figure that the text lacks.
fn transitions(judge: &mut Judge) {
    for row in rows("transitions") {
        let number: u8 = row.get("number").parse().unwrap();
        let commands: Vec<Command> = row.get("event").split("; ").filter_map(command).collect();
        let agrees = match number {
            // Power comes on: no transition between states.
            0 => commands.is_empty(),
            // A bit is named instead of the command.
            16 => has(number, Command::EnableOperation),
            _ if commands.is_empty() => {
                let mut of = Transitions::CIA_402.0.iter().filter(|transition| transition.number == number);
                of.next().is_some_and(|first| first.cause == Cause::Internal)
            }
            _ => commands.iter().all(|&command| has(number, command)),
        };
        judge.that(&row, "event", agrees, "another cause in CiA 402");
    }
}

fn has(number: u8, command: Command) -> bool {
    let mut all = Transitions::CIA_402.0.iter();
    all.any(|transition| transition.number == number && transition.cause == Cause::Command(command))
}

fn command(name: &str) -> Option<Command> {
    Some(match name {
        "Shutdown" => Command::Shutdown,
        // Without bit 3 it is the same word: the state decides.
        "Switch on" | "Disable Operation" => Command::SwitchOn,
        "Disable Voltage" => Command::DisableVoltage,
        "Quick Stop" => Command::QuickStop,
        "Enable Operation" => Command::EnableOperation,
        "Fault Reset" => Command::FaultReset,
        _ => return None,
    })
}

/// All words of a pattern such as `x01x0001`.
fn words(pattern: &str) -> impl Iterator<Item = u16> {
    (0..1_u16 << pattern.len()).filter(move |word| {
        let bits = pattern.bytes().rev().enumerate();
        bits.into_iter().all(|(bit, wanted)| wanted == b'x' || (wanted == b'1') == (word >> bit & 1 == 1))
    })
}

fn sdo(judge: &mut Judge) {
    for row in rows("sdo_aborts") {
        let code = AbortCode(u32::from_str_radix(row.get("code"), 16).unwrap());
        judge.that(&row, "code", AbortCode::ALL.contains(&code), code);
    }
    for row in rows("sdo_commands") {
        let found = data_bytes(&row);
        let expected = Some(row.get("data_bytes").parse().unwrap_or(0));
        judge.that(&row, "data_bytes", found == expected, format!("{found:?}"));
    }
}

/// How many bytes of data a command specifier announces, if the runtime reads it as the row calls it.
fn data_bytes(row: &Row) -> Option<usize> {
    let bytes = [u8::from_str_radix(row.get("hex"), 16).unwrap(), 0x41, 0x60, 0, 0, 0, 0, 0];
    match (row.get("command"), ClientRequest::parse(&bytes), ServerResponse::parse(&bytes)) {
        ("upload request", Some(ClientRequest::InitiateUpload { .. }), _)
        | ("download response", _, Some(ServerResponse::InitiateDownload { .. })) => Some(0),
        ("download request", Some(ClientRequest::InitiateDownload { content: Content::Expedited(data), .. }), _)
        | ("upload response", _, Some(ServerResponse::InitiateUpload { content: Content::Expedited(data), .. })) => {
            data.len()
        }
        ("abort", _, Some(ServerResponse::Abort(_))) => Some(4),
        _ => None,
    }
}
