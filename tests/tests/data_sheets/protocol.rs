//! What tables of states, commands and SDO have in common, whichever manual prints them.

use lexican_runtime::AbortCode;
use lexican_runtime::profile::cia402::{Cause, Command, State, Transitions};
use lexican_runtime::wire::sdo::{ClientRequest, Content, ServerResponse};

use crate::manual::{Judge, Row};

/// The bits of states in the statusword.
pub fn states(judge: &mut Judge, rows: &[Row], column: &str) {
    for row in rows {
        let name = row.get("state").to_uppercase();
        let found = words(row.get(column)).map(|word| State::from_status_word(word).map(|state| state.to_string()));
        let others: Vec<_> = found.filter(|state| state.as_ref() != Some(&name)).collect();
        judge.that(row, column, others.is_empty(), format!("{others:?}"));
    }
}

/// The bits of commands in the controlword.
pub fn commands(judge: &mut Judge, rows: &[Row]) {
    for row in rows {
        let command = command(row.get("command")).expect("a command of CiA 402");
        let word = command.apply(0);
        judge.that(row, "bits_7_0", words(row.get("bits_7_0")).any(|other| other == word), format!("{word:04X}"));
    }
}

/// Whether a transition has this command as its cause in CiA 402.
pub fn has(number: u8, command: Command) -> bool {
    let mut all = Transitions::CIA_402.0.iter();
    all.any(|transition| transition.number == number && transition.cause == Cause::Command(command))
}

/// A command by its name.
pub fn command(name: &str) -> Option<Command> {
    Some(match name.to_ascii_lowercase().as_str() {
        "shutdown" => Command::Shutdown,
        // Without bit 3 it is the same word: the state decides.
        "switch on" | "disable operation" => Command::SwitchOn,
        "disable voltage" => Command::DisableVoltage,
        "quick stop" => Command::QuickStop,
        "enable operation" => Command::EnableOperation,
        "fault reset" => Command::FaultReset,
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

/// Abort codes, and the command specifiers of expedited transfers.
pub fn sdo(judge: &mut Judge, aborts: &[Row], commands: &[Row]) {
    for row in aborts {
        let code = AbortCode(u32::from_str_radix(row.get("code"), 16).unwrap());
        judge.that(row, "code", AbortCode::ALL.contains(&code), code);
    }
    for row in commands {
        let found = data_bytes(row);
        let expected = Some(row.get("data_bytes").parse().unwrap_or(0));
        judge.that(row, "data_bytes", found == expected, format!("{found:?}"));
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
            Some(data.len().unwrap_or(data.data().len()))
        }
        ("abort", _, Some(ServerResponse::Abort(_))) => Some(4),
        _ => None,
    }
}

/// A number as the manual prints it: `10`, `+1`, `0x65`, `FFh`, `2^20`, `-2^31`, `-(2^31-1)`.
pub fn number(text: &str) -> Option<i128> {
    if let Some(text) = text.strip_prefix('-') {
        return number(text.strip_prefix('(').and_then(|text| text.strip_suffix(')')).unwrap_or(text)).map(|n| -n);
    }
    if let Some((power, one)) = text.split_once('-') {
        return Some(number(power)? - number(one)?);
    }
    if let Some(exponent) = text.strip_prefix("2^") {
        return Some(1 << exponent.parse::<u32>().ok()?);
    }
    match (text.strip_prefix("0x"), text.strip_suffix('h')) {
        (Some(hex), _) => i128::from_str_radix(hex.trim_end_matches('h'), 16).ok(),
        (None, Some(hex)) => i128::from_str_radix(hex, 16).ok(),
        (None, None) => text.parse().ok(),
    }
}
