//! The state machine of CiA 402: states, commands, and numbered transitions, with the drive brought into each state.

use std::collections::BTreeSet;

use lexican_eds::model::Meaning;
use lexican_runtime::profile::cia402::{Cause, Command, Mode, Modes, State, Transition};

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::prose::said;
use crate::manual::Row;
use crate::rig::{Rig, Simulator, once};
use crate::script::Clauses;
use crate::states::{STATES, state_name};

/// A drive in a state; `None` for the state that it has left before it is heard.
pub(crate) fn bring_to<S: Simulator>(state: State) -> Option<Rig<S>> {
    let words: &[u16] = match state {
        State::SwitchOnDisabled => &[],
        State::ReadyToSwitchOn | State::Fault => &[0x0106],
        State::SwitchedOn => &[0x0106, 0x0107],
        State::OperationEnabled => &[0x0106, 0x0107, 0x010F],
        State::QuickStopActive => &[0x0106, 0x0107, 0x010F, 0x0102],
        _ => return None,
    };
    let mut rig = Rig::operational();
    rig.controls(words);
    if state == State::Fault {
        fail(&mut rig);
    }
    Some(rig)
}

fn fail<S: Simulator>(rig: &mut Rig<S>) {
    rig.see(S::fail);
    rig.hear(0);
}

/// Whether a word matches a pattern such as `x01x0111`, from the highest bit down, of eight or seven bits.
fn is_as(word: u16, pattern: &str) -> bool {
    let bits: Vec<char> = pattern.chars().rev().collect();
    matches!(bits.len(), 7 | 8)
        && (0..).zip(&bits).all(|(bit, digit)| match digit {
            'x' => true,
            '0' => word >> bit & 1 == 0,
            '1' => word >> bit & 1 == 1,
            _ => false,
        })
}

/// Whether `is_so` holds exactly for the words that match a pattern, so that no bit given in it is free.
fn is_least(is_so: impl Fn(u16) -> bool, pattern: &str) -> bool {
    (0..256).all(|word| is_so(word) == is_as(word, pattern))
}

/// Whether a bit of the status word distinguishes states, and the drive shows it in each state that does not leave it
/// open.
pub(crate) fn distinguishes_states<S: Simulator>(bit: u16) -> bool {
    let of = |state: State| state.status_bits() >> bit & 1;
    let values: BTreeSet<u16> = STATES.iter().map(|(state, _)| of(*state)).collect();
    let brought = STATES.iter().filter_map(|(state, _)| Some((*state, bring_to::<S>(*state)?)));
    let is_open = |state, word: u16| State::from_status_word(word ^ 1 << bit) == Some(state);
    let shows = |state, word: u16| word >> bit & 1 == of(state) || is_open(state, word);
    values.len() == 2 && brought.into_iter().all(|(state, rig)| shows(state, rig.status()))
}

/// Compares `states.csv`: the bits of the status word, eight or seven of them. `beyond` compares the drive's own
/// columns, with the drive in the state if it can be brought there.
/// state if it can be brought there.
pub(crate) fn states<S: Simulator>(
    checker: &mut Checker<'_>,
    beyond: fn(&mut Checker<'_>, &Row, State, Option<Rig<S>>),
) {
    let reached = |state: State| S::transitions().0.iter().any(|change| [change.from, change.to].contains(&state));
    for (state, name) in STATES.iter().filter(|(state, _)| reached(*state)) {
        let Some(row) = checker.row_called("states.csv", name) else { continue };
        let column = if row.has("bits_6_0") { "bits_6_0" } else { "bits_7_0" };
        let pattern = row.get(column);
        let decoded = is_least(|word| State::from_status_word(word) == Some(*state), pattern);
        checker.that(row, column, Against::Code, decoded, "decoded otherwise");
        let rig = bring_to::<S>(*state);
        if let Some(rig) = &rig {
            let status = rig.status();
            checker.that(row, column, Against::Drive, is_as(status, pattern), format!("{status:016b}"));
        }
        beyond(checker, row, *state, rig);
    }
}

/// The commands as manuals call them, and a state in which each has an effect. Disable Operation has the same bits as
/// Switch On; the state decides which it is.
const COMMANDS: &[(&str, Command, State)] = &[
    ("Shutdown", Command::Shutdown, State::SwitchOnDisabled),
    ("Switch On", Command::SwitchOn, State::ReadyToSwitchOn),
    ("Disable Voltage", Command::DisableVoltage, State::OperationEnabled),
    ("Quick Stop", Command::QuickStop, State::OperationEnabled),
    ("Disable Operation", Command::SwitchOn, State::OperationEnabled),
    ("Enable Operation", Command::EnableOperation, State::SwitchedOn),
    ("Fault Reset", Command::FaultReset, State::Fault),
];

/// Compares `commands.csv`. Unless a column `edge_bit` says otherwise, bits 3 and 7 are 0 where a pattern leaves them
/// free: manuals leave them out because they name the more special commands first.
pub(crate) fn commands<S: Simulator>(checker: &mut Checker<'_>) {
    for &(name, command, from) in COMMANDS {
        let Some(row) = checker.row_called("commands.csv", name) else { continue };
        let pattern = row.get("bits_7_0");
        let is_edge = command == Command::FaultReset;
        let parsed = |word: u16| Command::parse(0, word) == command && (is_edge || word & 0x80 == 0);
        let words: Vec<u16> = if row.has("edge_bit") {
            checker.that(row, "bits_7_0", Against::Code, is_least(parsed, pattern), "parsed otherwise");
            checker.cell(row, "edge_bit", Against::Code, if is_edge { "7" } else { "" });
            (0..256).filter(|word| is_as(*word, pattern)).collect()
        } else {
            let free = |bit: usize| pattern.as_bytes().get(7 - bit) == Some(&b'x');
            let more = [3, 7].into_iter().filter(|bit| free(*bit)).fold(0, |bits, bit| bits | 1 << bit);
            let words: Vec<u16> = (0..256).filter(|word| is_as(*word, pattern) && word & more == 0).collect();
            // Another word that is parsed as this command differs in those bits.
            let others = (0..256).filter(|word| parsed(*word) && word & more == 0);
            let agrees =
                !words.is_empty() && words.iter().all(|word| parsed(*word)) && others.eq(words.iter().copied());
            checker.that(row, "bits_7_0", Against::Code, agrees, "parsed otherwise");
            words
        };
        let to = S::transitions().follow(from, command).map(|change| change.to);
        let followed = words.iter().all(|word| {
            let reached = once::<S, _>((state_name(from), word), || Some(after(bring_to::<S>(from)?, *word)));
            reached.is_some() && reached == to
        });
        checker.that(row, "bits_7_0", Against::Drive, followed, "the drive does otherwise");
        if row.has("transitions") {
            let made: BTreeSet<String> = numbers::<S>(name).into_iter().map(|number| number.to_string()).collect();
            let printed = row.get("transitions").split("; ").map(str::to_owned).collect();
            checker.that(row, "transitions", Against::Code, made == printed, format!("{made:?}"));
        }
    }
}

/// The transitions that a command causes, by its name.
fn numbers<S: Simulator>(name: &str) -> BTreeSet<u8> {
    let causes = |change: &&Transition| match change.cause {
        Cause::Command(command) => called(command, change.from) == name,
        Cause::Internal => false,
    };
    S::transitions().0.iter().filter(causes).map(|change| change.number).collect()
}

/// Compares `transitions.csv` if it has no states: what causes a transition, and what the drive does then, for which
/// `action` gives clauses.
pub(crate) fn events<S: Simulator>(checker: &mut Checker<'_>, action: fn(u8) -> Clauses) {
    for number in 0..=16 {
        let Some(row) = checker.row("transitions.csv", &number.to_string()) else { continue };
        let of = S::transitions().0.iter().filter(|change| change.number == number);
        let made: BTreeSet<&str> = of
            .map(|change| match change.cause {
                Cause::Command(command) => called(command, change.from),
                Cause::Internal if change.from == State::NotReadyToSwitchOn => "initialisation completed",
                Cause::Internal if change.from == State::FaultReactionActive => "fault reaction completed",
                Cause::Internal => "fault",
            })
            .collect();
        let printed: BTreeSet<String> = row.get("event").split("; ").map(str::to_ascii_lowercase).collect();
        let agrees = match row.get("event") {
            "reset" => made.is_empty(),
            "bit 2 set" => made.contains("Enable Operation") && Command::EnableOperation.apply(0) & 1 << 2 != 0,
            _ => made.iter().map(|name| name.to_ascii_lowercase()).collect::<BTreeSet<_>>() == printed,
        };
        checker.that(row, "event", Against::Code, agrees, format!("{made:?}"));
        checker.cell(row, "action", Against::Drive, once::<S, _>(number, || said(&action(number))));
    }
}

/// The state to which a control word leads, with an edge of bit 7 if that is set.
fn after<S: Simulator>(mut rig: Rig<S>, word: u16) -> State {
    if word & 0x80 != 0 {
        rig.control(word & !0x80);
    }
    rig.control(word);
    rig.state()
}

/// Compares `transitions.csv`.
pub(crate) fn transitions<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for number in 0..=14 {
        let Some(row) = checker.row("transitions.csv", &number.to_string()) else { continue };
        let listed: Vec<_> = S::transitions().0.iter().filter(|change| change.number == number).collect();
        let (by, word) = match listed.first().map(|change| change.cause) {
            None => ("power on or software reset", None),
            Some(Cause::Internal) if number == 1 => ("initialisation and self-test completed", None),
            Some(Cause::Internal) => ("fault", None),
            Some(Cause::Command(command)) => (called(command, listed[0].from), Some(command.apply(0x0100))),
        };
        checker.cell(row, "by", Against::Code, by);
        let named = case.manual.row("commands.csv", by).is_some();
        checker.that(row, "by", Against::Manual, named == word.is_some(), "no command of the table of commands");
        let (from, to) = match listed.as_slice() {
            [] => ("Start", "Not Ready to Switch On"),
            [one] => (state_name(one.from), state_name(one.to)),
            [first, ..] => ("any", state_name(first.to)),
        };
        checker.cell(row, "from", Against::Code, from);
        checker.cell(row, "to", Against::Code, to);
        let found = asked::<S>(row, word);
        checker.that(row, "to", Against::Drive, found == row.get("to"), found);
    }
}

/// The modes by their abbreviations in manuals.
const MODES: &[(Mode, &str)] = &[
    (Mode::ProfilePosition, "pp"),
    (Mode::ProfileVelocity, "pv"),
    (Mode::ProfileTorque, "tq"),
    (Mode::Homing, "hm"),
    (Mode::InterpolatedPosition, "ip"),
    (Mode::CyclicPosition, "csp"),
];

/// Compares `mode_bits.csv`: bits of 6040h and 6041h by mode. `meaning` says what a bit does in a mode, or `reserved`.
/// The description of a bit names exactly the modes in which it has a meaning.
pub(crate) fn mode_bits<S: Simulator>(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    modes: Modes,
    meaning: fn(u16, u8, Mode) -> &'static str,
) {
    let device = &case.sheet.device;
    for row in case.manual.rows("mode_bits.csv") {
        let mode = MODES.iter().find(|(_, name)| *name == row.get("mode")).map(|(mode, _)| *mode);
        let (Some(mode), Some(bit)) = (mode, row.number::<u8>("bit")) else { continue };
        let Some(object) = u16::from_str_radix(row.get("object"), 16).ok() else { continue };
        checker.key(row);
        let number = modes.code(mode).map_or(String::new(), |number| number.to_string());
        checker.cell(row, "number", Against::Code, number);
        let general = case.manual.cell("formats.csv", &format!("{object:04X}:00:{bit}"), "meaning");
        let depends = general.starts_with("Operation mode specific");
        checker.that(row, "bit", Against::Manual, depends, format!("{general} in every mode"));
        let named = device.enumerations.get("OperatingMode").map_or(&[][..], |modes| &modes.values);
        let named = named.iter().find(|named| row.number("number") == Some(named.value));
        let Some(Meaning::BitField(field)) = device.entry(object, 0).map(|entry| &entry.meaning) else { continue };
        let field = device.bit_fields.get(field).into_iter().flat_map(|field| &field.fields);
        let description = field.filter(|field| field.value.low == bit).find_map(|field| field.description.as_deref());
        let description = description.unwrap_or_default().to_lowercase();
        let says = named.is_some_and(|mode| description.contains(&format!("{}:", mode.name)));
        checker.that(row, "meaning", Against::Sheet, says != (row.get("meaning") == "reserved"), &description);
        checker.cell(row, "meaning", Against::Drive, once::<S, _>((object, bit, mode), || meaning(object, bit, mode)));
    }
}

/// A command by its name. The bits of Switch On are called Disable Operation where they lead down.
fn called(command: Command, from: State) -> &'static str {
    let leads_down = from == State::OperationEnabled && command == Command::SwitchOn;
    let named = COMMANDS.iter().find(|(name, of, _)| *of == command && (*name == "Disable Operation") == leads_down);
    named.map_or("", |(name, ..)| name)
}

/// The state to which the drive goes from the state of a row.
fn asked<S: Simulator>(row: &Row, word: Option<u16>) -> String {
    let from = STATES.iter().find(|(_, name)| *name == row.get("from")).map(|(state, _)| *state);
    match (row.get("from"), word) {
        // At power-on, transitions 0 and 1 are over before the drive is heard.
        ("Start" | "Not Ready to Switch On", _) => {
            let arrived = Rig::<S>::new().state() == State::SwitchOnDisabled;
            let passed =
                ["Not Ready to Switch On", "Switch On Disabled"].into_iter().find(|name| *name == row.get("to"));
            passed.filter(|_| arrived).unwrap_or_default().to_owned()
        }
        ("any", _) => {
            let faulty = STATES.iter().filter_map(|(state, _)| bring_to::<S>(*state)).map(|mut rig| {
                fail(&mut rig);
                state_name(rig.state())
            });
            faulty.collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>().join(" or ")
        }
        (_, Some(word)) => from.and_then(bring_to).map_or("", |rig| state_name(after::<S>(rig, word))).to_owned(),
        _ => String::new(),
    }
}
