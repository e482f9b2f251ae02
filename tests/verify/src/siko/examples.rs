//! The worked examples, tables 25 and 26, replayed from the tables themselves.

use siko::worked_examples::{Action, Example, POSITIONING, VELOCITY};

use super::rig::{Rig, Siko};
use crate::checker::{Against, Answers, Checker};
use crate::drive::Case;
use crate::manual::{Row, cells};
use crate::notation::{bytes, hex, print};
use crate::rig::once;
use crate::states::state_name;

pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    example::<D>(checker, case, "example_position.csv", &POSITIONING);
    example::<D>(checker, case, "example_velocity.csv", &VELOCITY);
}

fn example<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, file: &'static str, example: &Example) {
    let in_code: Vec<_> = example.rows.iter().filter(|row| row.in_table).map(|row| row.action).collect();
    let rows = case.manual.rows(file);
    checker.require(rows.len() == in_code.len(), || format!("{file}: {} rows in the code", in_code.len()));
    for (number, (row, action)) in (1..).zip(rows.iter().zip(in_code)) {
        checker.key(row);
        checker.cell(row, "step", Against::Manual, number);
        let kind = match row.get("cob_id") {
            "000" => "NMT",
            "205" => "RPDO1",
            "405" => "RPDO3",
            "505" => "RPDO4",
            "" => "wait",
            _ => "?",
        };
        checker.cell(row, "kind", Against::Manual, kind);
        let (id, data) = match action {
            Action::Send(frame) => (format!("{:03X}", frame.id().raw()), print(frame.data())),
            Action::Wait(_) => (String::new(), String::new()),
        };
        checker.cell(row, "cob_id", Against::Code, id);
        checker.cell(row, "data", Against::Code, data);
    }
    let mode = example.operating_mode;
    once::<D, _>((mode, cells(rows)), || replay::<D>(mode, rows)).give(checker, rows);
}

/// Replays the rows in order.
fn replay<D: Siko>(operating_mode: u8, rows: &[Row]) -> Answers {
    let mut answers = Answers::default();
    let mut rig = Rig::<D>::new();
    let set = rig.write(0x6060, 0, operating_mode.into(), 1);
    answers.require(set.is_ok(), || format!("6060:00: {set:08X?}"));
    for row in rows {
        let (agrees, found) = step(&mut rig, rows, row);
        answers.that(row, "meaning", agrees, found);
    }
    answers
}

/// Does what a row says. Returns whether the drive does so, too, and what it does.
fn step<D: Siko>(rig: &mut Rig<D>, rows: &[Row], row: &Row) -> (bool, String) {
    let meaning = row.get("meaning");
    let Some(id) = hex(row.get("cob_id")) else {
        rig.hear(30_000);
        let target = rows.iter().take_while(|other| other.key != row.key).filter_map(target).last();
        let (position, velocity) = (rig.position(), rig.velocity());
        let reached = rig.status() >> 10 & 1 == 1;
        let (found, expected) = match meaning {
            "target position reached" => (position, target),
            "target speed reached" => (velocity, target),
            _ => (0, None),
        };
        return (reached && expected == Some(found), found.to_string());
    };
    // The table sends the next command while the drive is still on its way.
    rig.hear(500);
    let was_running = rig.velocity() != 0;
    rig.send(id as u16, &bytes(row.get("data")).unwrap_or_default());
    rig.hear(100);
    let (position, velocity) = (rig.position(), rig.velocity());
    let (state, moving) = (state_name(rig.state()), velocity != 0);
    let expected = match meaning {
        "enter OPERATIONAL" | "enter PRE-OPERATIONAL" | "Disable Voltage" => state == "Switch On Disabled",
        "Shutdown" => state == "Ready to Switch On",
        "Switch On" | "Disable Operation" => state == "Switched On",
        "Enable Operation" | "clear New Setpoint" => state == "Operation Enabled" && !moving,
        "intermediate stop" | "stop" => {
            rig.hear(20_000);
            let stands = rig.velocity() == 0;
            state == "Operation Enabled" && stands && target(row).is_none()
        }
        "continue positioning" => moving,
        _ => match target(row) {
            Some(target) if row.get("kind") == "RPDO3" => {
                moving && (target > position) == (velocity > 0) && meaning == format!("travel to {target:+}")
            }
            Some(target) => {
                let verb = if was_running { "change to" } else { "start at" };
                rig.read(0x60FF, 0) == Ok(target as u32) && meaning == format!("{verb} {target:+} rev/min")
            }
            None => false,
        },
    };
    let remote = rig.nmt_state().code();
    let operational = (remote == 5) == (meaning != "enter PRE-OPERATIONAL");
    (expected && operational, format!("{state}, {velocity} rev/min"))
}

/// The number in `travel to +5000` or `start at -72 rev/min`.
fn target(row: &Row) -> Option<i32> {
    let number = row.get("meaning").split(' ').find(|word| word.starts_with(['+', '-']))?;
    number.parse().ok()
}
