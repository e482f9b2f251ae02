//! The tables of the protocols and of the state machine against the data sheet and the runtime.

use lexican_eds::model::{Device, Value};
use lexican_runtime::object::Value as _;
use lexican_runtime::profile::cia402::{Cause, Command, Transitions};
use lexican_runtime::wire::nmt::NmtCommand;

use super::tables::rows;
use crate::manual::Judge;
use crate::protocol::{self, command, has, number};

pub fn judge(device: &Device, judge: &mut Judge) {
    identifiers(device, judge);
    protocol::states(judge, &rows("states"), "bits_6_0");
    commands(judge);
    transitions(judge);
    protocol::sdo(judge, &rows("sdo_aborts"), &rows("sdo_commands"));
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

/// The bits of commands, and the transitions that they make.
fn commands(judge: &mut Judge) {
    let table = rows("commands");
    protocol::commands(judge, &table);
    for row in &table {
        let command = command(row.get("command")).expect("a command of CiA 402");
        let numbers = row.get("transitions").split("; ").map(|number| number.parse::<u8>().unwrap());
        let others: Vec<u8> = numbers.filter(|number| !has(*number, command)).collect();
        judge.that(row, "transitions", others.is_empty(), format!("{others:?}"));
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
