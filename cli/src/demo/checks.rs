//! The checks of a run against the manual.

use std::io::{self, Write};

use anstyle::{AnsiColor, Style};
use lexican_runtime::wire::nmt::NmtState;
use siko_ag03_1::state::State;
use siko_ag03_1::worked_examples::{Action, Until};

use super::bench::{Recording, Truth};
use super::play::{Played, RPDO1, Step};
use crate::output::{self, styled};

/// A condition that must hold.
pub(crate) struct Check {
    pub(crate) what: String,
    pub(crate) seen: String,
    pub(crate) passed: bool,
}

impl Check {
    fn new(what: impl Into<String>, passed: bool, seen: impl Into<String>) -> Self {
        Check { what: what.into(), seen: seen.into(), passed }
    }
}

pub(crate) fn all(played: &[Played], recording: &Recording) -> Vec<Check> {
    let mut checks = Vec::new();
    for played in played {
        let table = played.example.table;
        let mut check = |what: String, passed, seen: String| {
            checks.push(Check::new(format!("table {table}: {what}"), passed, seen));
        };
        let mode = if played.example.operating_mode == 1 { "profile position" } else { "profile velocity" };
        let read = played.operating_mode.map(|mode| format!("6060h = {mode}"));
        check(
            format!("operating mode is {mode}"),
            played.operating_mode == Some(played.example.operating_mode),
            or_none(read),
        );
        let (sent, of) = frames_in_order(played, recording);
        check("every frame on the bus, byte for byte, in order".to_owned(), sent == of, format!("{sent} of {of}"));
        for (number, step) in played.steps.iter().enumerate() {
            let before = number.checked_sub(1).and_then(|number| played.steps.get(number));
            checks_of(step, before, played.example.operating_mode, &mut check);
        }
        let state = played.final_status.and_then(State::from_status_word);
        check("drive ends in SWITCH ON DISABLED".to_owned(), state == Some(State::SwitchOnDisabled), or_none(state));
        let nmt = played.final_nmt;
        check("node ends in PRE-OPERATIONAL".to_owned(), nmt == Some(NmtState::PreOperational), or_none(nmt));
    }
    let alarms = recording.alarms.first().cloned().unwrap_or_else(|| "none".to_owned());
    checks.push(Check::new("no emergency, no abort, no frame out of place", recording.alarms.is_empty(), alarms));
    checks
}

/// The checks of a row of the tables.
fn checks_of(step: &Step, before: Option<&Step>, mode: u8, check: &mut impl FnMut(String, bool, String)) {
    let took = step.end.since(step.begin).as_secs_f64();
    match step.row.action {
        Action::Send(frame) if frame.id() == RPDO1 && frame.data() == [0x0F, 0x01] => {
            let state = step.status.status_word.and_then(State::from_status_word);
            let what = format!("OPERATION ENABLED after {}", step.row.meaning);
            check(what, state == Some(State::OperationEnabled), or_none(state));
        }
        Action::Send(_) => {}
        Action::Wait(Until::Position(target)) => {
            let position = step.status.position.unwrap_or_default();
            let agrees = (f64::from(position) - step.truth.position_increments).abs() < 1.0;
            let seen = format!("{position:+} increments after {took:.1} s");
            check(format!("position {target:+} increments reached"), step.done && agrees, seen);
        }
        Action::Wait(Until::Velocity(target)) => {
            let velocity = step.status.velocity.unwrap_or_default();
            let agrees = (f64::from(velocity) - step.truth.velocity_rpm).abs() < 1.0;
            let seen = format!("{velocity:+} rev/min after {took:.1} s");
            check(format!("velocity {target:+} rev/min reached"), step.done && agrees, seen);
        }
        Action::Wait(Until::Standstill) => {
            let Truth { position_increments, velocity_rpm, .. } = step.truth;
            let seen = format!("{velocity_rpm:.0} rev/min at {position_increments:+.0} increments");
            check("stop seen".to_owned(), step.done && velocity_rpm == 0.0, seen);
        }
        Action::Wait(Until::Elapsed(_)) => {
            let Some(before) = before.filter(|_| mode == 1) else { return };
            let moved = step.truth.position_increments - before.truth.position_increments;
            let seen = format!("moved by {moved:+.0} increments in {took:.1} s");
            let stopped = matches!(before.row.action, Action::Wait(Until::Standstill));
            let what = if stopped { "stands still until the next command" } else { "under way before the stop" };
            check(what.to_owned(), (moved == 0.0) == stopped, seen);
        }
    }
}

fn or_none(seen: Option<impl ToString>) -> String {
    seen.map_or_else(|| "no answer".to_owned(), |seen| seen.to_string())
}

/// How many of the example's frames were on the bus in the order of its rows, and how many it has.
fn frames_in_order(played: &Played, recording: &Recording) -> (usize, usize) {
    let mut bus = recording.frames.iter().filter(|(at, _)| *at >= played.begin && *at <= played.end);
    let mut rows = played.steps.iter().filter_map(|step| match step.row.action {
        Action::Send(frame) => Some(frame),
        Action::Wait(_) => None,
    });
    let of = rows.clone().count();
    let sent = rows.by_ref().take_while(|row| bus.any(|(_, frame)| frame == row)).count();
    (sent, of)
}

pub(crate) fn print(checks: &[Check]) -> io::Result<()> {
    let mut stdout = output::stdout();
    let width = checks.iter().map(|check| check.what.chars().count()).max().unwrap_or(0);
    writeln!(stdout, "\n{}\n", styled(Style::new().bold().underline(), "Checks"))?;
    for Check { what, seen, passed } in checks {
        let verdict = match passed {
            true => styled(AnsiColor::Green.on_default().bold(), "    ok"),
            false => styled(AnsiColor::Red.on_default().bold(), "FAILED"),
        };
        writeln!(stdout, "{verdict}  {what:<width$}  {seen}")?;
    }
    stdout.flush()
}
