//! The state machine of CiA 402: states, commands, and numbered state changes, by bringing the drive into each state.

use std::collections::BTreeSet;

use lexican_runtime::profile::cia402::{Cause, Command, State};

use crate::bench::{Bench, Simulator, once};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::Row;

/// The states as manuals write them.
pub(crate) const STATES: &[(State, &str)] = &[
    (State::NotReadyToSwitchOn, "Not Ready to Switch On"),
    (State::SwitchOnDisabled, "Switch On Disabled"),
    (State::ReadyToSwitchOn, "Ready to Switch On"),
    (State::SwitchedOn, "Switched On"),
    (State::OperationEnabled, "Operation Enabled"),
    (State::QuickStopActive, "Quick Stop Active"),
    (State::Fault, "Fault"),
];

pub(crate) fn name_of(state: State) -> &'static str {
    STATES.iter().find(|(known, _)| *known == state).map_or("", |(_, name)| name)
}

/// A drive in a state; `None` for the state that it has left when it is heard first.
pub(crate) fn bring_to<S: Simulator>(state: State) -> Option<Bench<S>> {
    let words: &[u16] = match state {
        State::SwitchOnDisabled => &[],
        State::ReadyToSwitchOn | State::Fault => &[0x0106],
        State::SwitchedOn => &[0x0106, 0x0107],
        State::OperationEnabled => &[0x0106, 0x0107, 0x010F],
        State::QuickStopActive => &[0x0106, 0x0107, 0x010F, 0x0102],
        _ => return None,
    };
    let mut bench = Bench::operational();
    bench.controls(words);
    if state == State::Fault {
        fail(&mut bench);
    }
    Some(bench)
}

fn fail<S: Simulator>(bench: &mut Bench<S>) {
    bench.see(S::fail);
    bench.hear(0);
}

/// Whether a word is as in `x01x0111`, from the highest bit down.
fn is_as(word: u16, pattern: &str) -> bool {
    let bits: Vec<char> = pattern.chars().rev().collect();
    bits.len() == 8
        && (0..).zip(&bits).all(|(bit, digit)| match digit {
            'x' => true,
            '0' => word >> bit & 1 == 0,
            '1' => word >> bit & 1 == 1,
            _ => false,
        })
}

/// Whether exactly the words of a pattern are so: a bit that is given is not free.
fn is_least(is_so: impl Fn(u16) -> bool, pattern: &str) -> bool {
    (0..256).all(|word| is_so(word) == is_as(word, pattern))
}

/// Whether a bit of the status word distinguishes states, and does so in the drive.
pub(crate) fn distinguishes_states<S: Simulator>(bit: u16) -> bool {
    let of = |state: State| state.status_bits() >> bit & 1;
    let values: BTreeSet<u16> = STATES.iter().map(|(state, _)| of(*state)).collect();
    let brought = STATES.iter().filter_map(|(state, _)| Some((*state, bring_to::<S>(*state)?)));
    values.len() == 2 && brought.into_iter().all(|(state, bench)| bench.status() >> bit & 1 == of(state))
}

/// Compares `states.csv`: the bits of the status word. `beyond` compares the drive's own columns, with the drive in the
/// state if it can be brought there.
pub(crate) fn states<S: Simulator>(
    checker: &mut Checker<'_>,
    beyond: fn(&mut Checker<'_>, &Row, State, Option<Bench<S>>),
) {
    for (state, name) in STATES {
        let Some(row) = checker.row("states.csv", name) else { continue };
        let pattern = row.get("bits_7_0");
        let decoded = is_least(|word| State::from_status_word(word) == Some(*state), pattern);
        checker.that(row, "bits_7_0", Against::Code, decoded, "decoded otherwise");
        let bench = bring_to::<S>(*state);
        if let Some(bench) = &bench {
            let status = bench.status();
            checker.that(row, "bits_7_0", Against::Drive, is_as(status, pattern), format!("{status:016b}"));
        }
        beyond(checker, row, *state, bench);
    }
}

/// Compares `commands.csv`.
pub(crate) fn commands<S: Simulator>(checker: &mut Checker<'_>) {
    // Disable Operation has the bits of Switch On: the state decides.
    let all = [
        ("Shutdown", Command::Shutdown, State::SwitchOnDisabled),
        ("Switch On", Command::SwitchOn, State::ReadyToSwitchOn),
        ("Disable Voltage", Command::DisableVoltage, State::OperationEnabled),
        ("Quick Stop", Command::QuickStop, State::OperationEnabled),
        ("Disable Operation", Command::SwitchOn, State::OperationEnabled),
        ("Enable Operation", Command::EnableOperation, State::SwitchedOn),
        ("Fault Reset", Command::FaultReset, State::Fault),
    ];
    for (name, command, from) in all {
        let Some(row) = checker.row("commands.csv", name) else { continue };
        let pattern = row.get("bits_7_0");
        let is_edge = command == Command::FaultReset;
        let parsed = |word: u16| Command::parse(0, word) == command && (is_edge || word & 0x80 == 0);
        checker.that(row, "bits_7_0", Against::Code, is_least(parsed, pattern), "parsed otherwise");
        checker.cell(row, "edge_bit", Against::Code, if is_edge { "7" } else { "" });
        let to = S::TRANSITIONS.follow(from, command).map(|change| change.to);
        let mut words = (0..256).filter(|word| is_as(*word, pattern));
        let followed = words.all(|word| {
            let reached = once::<S, _>((name_of(from), word), || Some(after(bring_to::<S>(from)?, word)));
            reached.is_some() && reached == to
        });
        checker.that(row, "bits_7_0", Against::Drive, followed, "the drive does otherwise");
    }
}

/// The state that a controlword leads to, with an edge of bit 7 if it is set.
fn after<S: Simulator>(mut bench: Bench<S>, word: u16) -> State {
    if word & 0x80 != 0 {
        bench.control(word & !0x80);
    }
    bench.control(word);
    bench.state()
}

/// Compares `transitions.csv`.
pub(crate) fn transitions<S: Simulator>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for number in 0..=14 {
        let Some(row) = checker.row("transitions.csv", &number.to_string()) else { continue };
        let listed: Vec<_> = S::TRANSITIONS.0.iter().filter(|change| change.number == number).collect();
        let (by, word) = match listed.first().map(|change| change.cause) {
            None => ("power on or software reset", None),
            Some(Cause::Internal) if number == 1 => ("initialisation and self-test completed", None),
            Some(Cause::Internal) => ("fault", None),
            // The bits of Switch On are called Disable Operation where they lead down.
            Some(Cause::Command(Command::SwitchOn)) if number == 5 => ("Disable Operation", Some(0x0107)),
            Some(Cause::Command(command)) => (called(command), Some(command.apply(0x0100))),
        };
        checker.cell(row, "by", Against::Code, by);
        let named = case.manual.row("commands.csv", by).is_some();
        checker.that(row, "by", Against::Manual, named == word.is_some(), "no command of the table of commands");
        let (from, to) = match listed.as_slice() {
            [] => ("Start", "Not Ready to Switch On"),
            [one] => (name_of(one.from), name_of(one.to)),
            [first, ..] => ("any", name_of(first.to)),
        };
        checker.cell(row, "from", Against::Code, from);
        checker.cell(row, "to", Against::Code, to);
        let found = asked::<S>(row, word);
        checker.that(row, "to", Against::Drive, found == row.get("to"), found);
    }
}

fn called(command: Command) -> &'static str {
    match command {
        Command::Shutdown => "Shutdown",
        Command::SwitchOn => "Switch On",
        Command::DisableVoltage => "Disable Voltage",
        Command::QuickStop => "Quick Stop",
        Command::EnableOperation => "Enable Operation",
        Command::FaultReset => "Fault Reset",
    }
}

/// Where the drive goes from the state of a row.
fn asked<S: Simulator>(row: &Row, word: Option<u16>) -> String {
    let from = STATES.iter().find(|(_, name)| *name == row.get("from")).map(|(state, _)| *state);
    match (row.get("from"), word) {
        // Power on leads through 0 and 1 before the drive is heard.
        ("Start" | "Not Ready to Switch On", _) => {
            let arrived = Bench::<S>::new().state() == State::SwitchOnDisabled;
            let passed =
                ["Not Ready to Switch On", "Switch On Disabled"].into_iter().find(|name| *name == row.get("to"));
            passed.filter(|_| arrived).unwrap_or_default().to_owned()
        }
        ("any", _) => {
            let faulty = STATES.iter().filter_map(|(state, _)| bring_to::<S>(*state)).map(|mut bench| {
                fail(&mut bench);
                name_of(bench.state())
            });
            faulty.collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>().join(" or ")
        }
        (_, Some(word)) => from.and_then(bring_to).map_or("", |bench| name_of(after::<S>(bench, word))).to_owned(),
        _ => String::new(),
    }
}
