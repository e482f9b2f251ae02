//! The state machine: states (table 22), commands (table 24), state changes 0 to 14, and the words' bits in
//! tables 1, 21 and 23, by bringing the drive into each situation.

use std::collections::BTreeMap;

use lexican_runtime::profile::cia402::{Cause, Command, State};
use siko_ag03_1::od;
use siko_ag03_1::sim::inputs::{Inputs, Shaft};
use siko_ag03_1::state::{TRANSITIONS, has_torque};

use super::sheet::Sheet;
use super::{claims, observed};
use crate::bench::{Bench, Memory, once};
use crate::checker::{Against, Checker};
use crate::manual::{Manual, Row};

pub(crate) fn check(checker: &mut Checker<'_>, manual: &Manual, _: &Sheet) {
    states(checker);
    commands(checker);
    transitions(checker, manual);
}

const STATES: &[(State, &str)] = &[
    (State::NotReadyToSwitchOn, "Not Ready to Switch On"),
    (State::SwitchOnDisabled, "Switch On Disabled"),
    (State::ReadyToSwitchOn, "Ready to Switch On"),
    (State::SwitchedOn, "Switched On"),
    (State::OperationEnabled, "Operation Enabled"),
    (State::QuickStopActive, "Quick Stop Active"),
    (State::Fault, "Fault"),
];

pub(super) fn name_of(state: State) -> &'static str {
    STATES.iter().find(|(known, _)| *known == state).map_or("", |(_, name)| name)
}

/// A drive in a state; `None` for the state that it has left when it is heard first.
fn bring_to(state: State) -> Option<Bench> {
    let words: &[u16] = match state {
        State::SwitchOnDisabled => &[],
        State::ReadyToSwitchOn => &[0x0106],
        State::SwitchedOn => &[0x0106, 0x0107],
        State::OperationEnabled => &[0x0106, 0x0107, 0x010F],
        State::QuickStopActive => &[0x0106, 0x0107, 0x010F, 0x0102],
        State::Fault => &[0x0106],
        _ => return None,
    };
    let mut bench = Bench::operational();
    words.iter().for_each(|word| bench.control(*word));
    if state == State::Fault {
        fail(&mut bench);
    }
    Some(bench)
}

/// A fault that is over at once.
fn fail(bench: &mut Bench) {
    bench.world(|inputs| inputs.internal_error = true);
    bench.world(|inputs| inputs.internal_error = false);
    bench.hear(0);
}

pub(super) fn state_of(bench: &Bench) -> State {
    bench.see(|drive, _| drive.state())
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

/// The pattern with every x where it must be: a bit that is given is not free.
fn is_least(patterns_word: impl Fn(u16) -> bool, pattern: &str) -> bool {
    (0..256).all(|word| patterns_word(word) == is_as(word, pattern))
}

/// Whether a bit of the status word tells states apart.
pub(super) fn in_table_22(bit: u16) -> bool {
    let words = STATES.iter().map(|(state, _)| state.status_bits() >> bit & 1);
    let [ones, zeros] = [1, 0].map(|value| words.clone().filter(|word| *word == value).count());
    // Bit 5 does so as well, in its own words.
    ones > 0 && zeros > 0 && bit != 5
}

fn states(checker: &mut Checker<'_>) {
    for (state, name) in STATES {
        let Some(row) = checker.row("states.csv", name) else { continue };
        let decoded = |word| State::from_status_word(word) == Some(*state);
        let pattern = row.get("bits_7_0");
        checker.that(row, "bits_7_0", Against::Code, is_least(decoded, pattern), "decoded otherwise");
        // The German manual says "released" where the English one says "enabled".
        if *state == State::QuickStopActive {
            checker.cell(row, "motor", Against::Drive, quick_stop());
        } else {
            let motor = if has_torque(*state) { "in control" } else { "released" };
            checker.cell(row, "motor", Against::Code, motor);
        }
        let Some(mut bench) = bring_to(*state) else {
            // It passes within the boot-up; no command is taken there.
            let none = TRANSITIONS.0.iter().all(|change| change.from != *state || change.cause == Cause::Internal);
            checker.cell(row, "travel_commands", Against::Code, if none { "no" } else { "yes" });
            continue;
        };
        let status = bench.status();
        checker.that(row, "bits_7_0", Against::Drive, is_as(status, pattern), format!("{status:016b}"));
        let released = bench.system() >> 7 & 1 == 1;
        checker.that(row, "motor", Against::Drive, released != has_torque(*state), "bit 7 of 1002h");
        let word = bench.see(|drive, _| drive.storage().get(od::CONTROLWORD)).0;
        bench.command(0x405, word & 0x8F | 0x10, 1000);
        bench.hear(100);
        let moves = bench.status() >> 15 & 1 == 1;
        checker.cell(row, "travel_commands", Against::Drive, if moves { "yes" } else { "no" });
    }
}

/// What the motor does in QUICK STOP ACTIVE.
fn quick_stop() -> String {
    static MEMORY: Memory<(), String> = Memory::new(BTreeMap::new());
    once(&MEMORY, (), || {
        let mut bench = moving_to(100_000, 1000);
        bench.control(0x0002);
        // 4 rev/s2 from 800 increments/s.
        let brakes = observed::way_to_rest(&mut bench) == 50;
        let holds = !bench.see(|drive, now| drive.turn_shaft(now, 10));
        claims::said(vec![("decelerates at maximum", brakes), ("stops with torque", holds)], "; ")
    })
}

fn commands(checker: &mut Checker<'_>) {
    // Disable Operation has the bits of Switch On: the state decides.
    let all = [
        ("Shutdown", Command::Shutdown),
        ("Switch On", Command::SwitchOn),
        ("Disable Voltage", Command::DisableVoltage),
        ("Quick Stop", Command::QuickStop),
        ("Disable Operation", Command::SwitchOn),
        ("Enable Operation", Command::EnableOperation),
        ("Fault Reset", Command::FaultReset),
    ];
    for (name, command) in all {
        let Some(row) = checker.row("commands.csv", name) else { continue };
        let pattern = row.get("bits_7_0");
        let is_edge = command == Command::FaultReset;
        let parsed = |word: u16| Command::parse(0, word) == command && (is_edge || word & 0x80 == 0);
        checker.that(row, "bits_7_0", Against::Code, is_least(parsed, pattern), "parsed otherwise");
        checker.cell(row, "edge_bit", Against::Code, if is_edge { "7" } else { "" });
        let from = match name {
            "Shutdown" => State::SwitchOnDisabled,
            "Switch On" => State::ReadyToSwitchOn,
            "Enable Operation" => State::SwitchedOn,
            "Fault Reset" => State::Fault,
            _ => State::OperationEnabled,
        };
        let to = TRANSITIONS.follow(from, command).map(|change| change.to);
        let mut followed = true;
        for word in (0..256).filter(|word| is_as(*word, pattern)) {
            followed &= after(from, word) == to.map(name_of);
        }
        checker.that(row, "bits_7_0", Against::Drive, followed && to.is_some(), "the drive does otherwise");
    }
}

/// The state that a controlword leads to, with an edge of bit 7 if it is set.
fn after(from: State, word: u16) -> Option<&'static str> {
    static MEMORY: Memory<(&str, u16), Option<&str>> = Memory::new(BTreeMap::new());
    once(&MEMORY, (name_of(from), word), || {
        let mut bench = bring_to(from)?;
        if word & 0x80 != 0 {
            bench.control(0);
        }
        bench.control(word);
        Some(name_of(state_of(&bench)))
    })
}

fn transitions(checker: &mut Checker<'_>, manual: &Manual) {
    for number in 0..=14 {
        let Some(row) = checker.row("transitions.csv", &number.to_string()) else { continue };
        let listed: Vec<_> = TRANSITIONS.0.iter().filter(|change| change.number == number).collect();
        let (by, word) = match listed.first().map(|change| change.cause) {
            None => ("power on or software reset", None),
            Some(Cause::Internal) if number == 1 => ("initialisation and self-test completed", None),
            Some(Cause::Internal) => ("fault", None),
            // The bits of Switch On are called Disable Operation where they lead down.
            Some(Cause::Command(Command::SwitchOn)) if number == 5 => ("Disable Operation", Some(0x0107)),
            Some(Cause::Command(command)) => (called(command), Some(command.apply(0x0100))),
        };
        checker.cell(row, "by", Against::Code, by);
        let named = manual.row("commands.csv", by).is_some();
        checker.that(row, "by", Against::Manual, named == word.is_some(), "no command of table 24");
        let (from, to) = match listed.as_slice() {
            [] => ("Start", "Not Ready to Switch On"),
            [one] => (name_of(one.from), name_of(one.to)),
            [first, ..] => ("any", name_of(first.to)),
        };
        checker.cell(row, "from", Against::Code, from);
        checker.cell(row, "to", Against::Code, to);
        let (found, expected) = asked(row, word);
        checker.that(row, "to", Against::Drive, found == expected, found);
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

/// Where the drive goes, and where the row says it goes.
fn asked(row: &Row, word: Option<u16>) -> (String, String) {
    let from = STATES.iter().find(|(_, name)| *name == row.get("from")).map(|(state, _)| *state);
    let expected = row.get("to").to_owned();
    let from_any = || {
        let states = STATES.iter().filter_map(|(state, _)| bring_to(*state));
        let faulty = states.map(|mut bench| {
            fail(&mut bench);
            name_of(state_of(&bench)).to_owned()
        });
        faulty.collect::<std::collections::BTreeSet<_>>().into_iter().collect::<Vec<_>>().join(" or ")
    };
    match (row.get("from"), word) {
        // Power on leads through 0 and 1 before anybody hears the drive.
        ("Start" | "Not Ready to Switch On", _) => {
            let passed = ["Not Ready to Switch On", "Switch On Disabled"].contains(&expected.as_str());
            let arrived = name_of(state_of(&Bench::new())) == "Switch On Disabled";
            (if passed && arrived { expected.clone() } else { String::new() }, expected)
        }
        ("any", _) => (from_any(), expected),
        (_, Some(word)) => {
            let Some(mut bench) = from.and_then(bring_to) else { return (String::new(), expected) };
            bench.control(word & !0x80);
            if word & 0x80 != 0 {
                bench.control(word);
            }
            (name_of(state_of(&bench)).to_owned(), expected)
        }
        _ => (String::new(), expected),
    }
}

/// A situation that shows a bit of 1002h or of the status word.
pub(super) fn moving_to(target: i32, ms: u64) -> Bench {
    let mut bench = Bench::enabled();
    bench.command(0x405, 0x001F, target);
    bench.hear(ms);
    bench
}

/// In velocity mode, running at a velocity.
pub(super) fn running_at(velocity: i32, ms: u64) -> Bench {
    let mut bench = in_velocity_mode();
    bench.command(0x505, 0x000F, velocity);
    bench.hear(ms);
    bench
}

/// In velocity mode, in OPERATION ENABLED, standing.
pub(super) fn in_velocity_mode() -> Bench {
    let mut bench = Bench::operational();
    // Refused in no state that has no travel job.
    let _ = bench.write(0x6060, 0, 2, 1);
    bench.enable();
    bench
}

/// Something in the world, in OPERATION ENABLED.
pub(super) fn with_inputs(change: impl FnOnce(&mut Inputs)) -> Bench {
    let mut bench = Bench::enabled();
    bench.world(change);
    bench.hear(0);
    bench
}

/// Whose shaft somebody holds, while it should move.
pub(super) fn held() -> Bench {
    let mut bench = moving_to(5000, 500);
    bench.world(|inputs| inputs.shaft = Shaft::Blocked);
    bench.hear(100);
    bench
}
