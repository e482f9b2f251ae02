//! What tables 1, 21 and 23 say in words about a bit, clause by clause: each clause is there only when the drive, asked
//! for it, does what it says. So the words in the tables are compared like numbers.

use std::collections::BTreeMap;

use super::states::{held, in_velocity_mode, moving_to, running_at, with_inputs};
use super::words::{beyond, in_loop, overcurrent};
use crate::bench::{Bench, Memory, once};
use crate::exempt;

/// Clauses, and whether the drive is so.
pub(super) type Clauses = Vec<(&'static str, bool)>;

/// A clause that no drive can be asked for: it is listed in the report.
fn prose(clause: &'static str) -> (&'static str, bool) {
    (clause, exempt::CLAUSES.iter().any(|(known, _)| *known == clause))
}

/// The clauses that hold, one after another; the others are told as such, which no table has.
pub(super) fn said(clauses: Clauses, between: &str) -> String {
    let told = clauses.into_iter().map(|(text, holds)| if holds { text.to_owned() } else { format!("not so: {text}") });
    told.collect::<Vec<_>>().join(between)
}

type Answers = Memory<(String, String, String), Option<String>>;

/// Of a bit of the system status word.
pub(super) fn system(bit: &str, value: &str, mode: &str) -> Option<String> {
    static ANSWERS: Answers = Answers::new(BTreeMap::new());
    once(&ANSWERS, (bit.into(), value.into(), mode.into()), || {
        let bit = (bit.parse().ok()?, value.parse().ok()?);
        let text = match (bit, mode) {
            ((4 | 8 | 10.., _), "") => said(of_system_status(bit)?, "; "),
            // "in position: …", "ready to travel: …" and the like say what is in front of the colon by what is behind it.
            _ => said(of_system_status_by_mode(bit, mode)?, "; "),
        };
        Some(text.replacen(":; ", ": ", 1))
    })
}

/// Bits that mean the same in both modes.
fn of_system_status(bit: (u16, u16)) -> Option<Clauses> {
    let is = |bench: &Bench| bench.system() >> bit.0 & 1 == bit.1;
    Some(match bit {
        (4, 1) => vec![("drive travels", is(&moving_to(5000, 1000)) && is(&running_at(30, 1000)))],
        (4, 0) => vec![(
            "drive stands still: velocity < 2 rev/min",
            is(&Bench::enabled()) && is(&running_at(1, 5000)) && !is(&running_at(2, 5000)),
        )],
        (8, 1) => {
            vec![
                ("fault", is(&faulty())),
                ("acknowledge by an edge of CW.7", super::words::acknowledged_by_edge_only()),
            ]
        }
        (8, 0) => vec![("no fault", is(&Bench::enabled()))],
        (10, 1) => {
            vec![("output stage supply not applied", is(&unsupplied())), ("travel disabled", !travels(unsupplied()))]
        }
        (10, 0) => vec![("output stage supply applied", is(&Bench::new()))],
        (11, 1) => vec![("not ready to travel", is(&faulty()) && is(&moving_to(5000, 1000)) && is(&unsupplied()))],
        (11, 0) => vec![
            ("ready to travel:", is(&Bench::enabled())),
            ("no fault", !is(&faulty())),
            ("no active positioning", !is(&moving_to(5000, 1000))),
            ("output stage supply applied", !is(&unsupplied())),
        ],
        (12, 1) => {
            let low = with_inputs(|inputs| inputs.battery_10mv = 250);
            vec![("battery too low", is(&low) && travels(low)), prose("replace within half a year")]
        }
        (12, 0) => vec![("battery ok", is(&Bench::new()))],
        (13, 1) => {
            let mut bench = overcurrent();
            let beyond = is(&bench) && !is(&with(moving_to(5000, 500), |inputs| inputs.load_ma = 2400));
            bench.hear(3900);
            let not_yet = bench.status() & 0x4F != 0x08;
            bench.hear(200);
            vec![("motor current beyond range", beyond), ("fault after 4 s", not_yet && bench.status() & 0x4F == 0x08)]
        }
        (13, 0) => {
            vec![("motor current within range", is(&with(moving_to(5000, 500), |inputs| inputs.load_ma = 2400)))]
        }
        (15, 1) => vec![("lag error", is(&held()))],
        (15, 0) => vec![("no lag error", is(&moving_to(5000, 500)))],
        _ => return None,
    })
}

/// Bits whose meaning depends on the mode, or that have none, or that say who moves the motor.
fn of_system_status_by_mode(bit: (u16, u16), mode: &str) -> Option<Clauses> {
    let is = |bench: &Bench| bench.system() >> bit.0 & 1 == bit.1;
    Some(match (bit, mode) {
        ((0..=2, 0), "") => vec![("no meaning", is(&Bench::new()) && is(&moving_to(5000, 500)) && is(&faulty()))],
        ((3, 1), "positioning") => {
            vec![("in position:", is(&moving_to(100, 10_000))), ("actual position within window", in_window(10))]
        }
        ((3, 0), "positioning") => {
            vec![("actual position outside window", is(&moving_to(5000, 1000)) && !in_window(11))]
        }
        ((3, 1), "velocity") => {
            vec![
                ("in position:", is(&running_at(30, 10_000))),
                ("actual velocity within window", !is(&running_at(68, 100))),
            ]
        }
        ((3, 0), "velocity") => vec![("actual velocity outside window", is(&running_at(68, 100)))],
        ((5, 1), "positioning") => vec![
            ("upper limit:", is(&beyond(true, Bench::new()))),
            ("position above higher of limits 1+2", !is(&beyond(false, Bench::new()))),
            ("inching negative only", inches(true) == (false, true)),
        ],
        ((6, 1), "positioning") => vec![
            ("lower limit:", is(&beyond(false, Bench::new()))),
            ("position below lower of limits 1+2", !is(&beyond(true, Bench::new()))),
            ("inching positive only", inches(false) == (true, false)),
        ],
        ((5, 0), "positioning") => vec![("position below limit", is(&Bench::new()))],
        ((6, 0), "positioning") => vec![("position above limit", is(&Bench::new()))],
        ((5 | 6, 0), "velocity") => {
            let none = [true, false].into_iter().all(|above| is(&beyond(above, in_velocity_mode())));
            vec![("no meaning", none)]
        }
        ((7, 1), "") => vec![("motor released", is(&Bench::new()) && turns(Bench::new()))],
        ((7, 0), "") => vec![("motor in control", is(&Bench::enabled()) && !turns(Bench::enabled()))],
        ((9, 1), "positioning") => vec![
            ("loop travel:", is(&in_loop(1000))),
            ("direction unequal start direction", in_loop(1000).see(|drive, now| drive.velocity(now)) < 0),
        ],
        ((9, 0), "positioning") => {
            let mut back = in_loop(1000);
            // Travels are about 7 s to the turn, and a second back.
            let forth = (0..100).find(|_| {
                back.hear(100);
                back.see(|drive, now| drive.velocity(now)) > 0
            });
            vec![("direction equal start direction", forth.is_some() && is(&back))]
        }
        ((9 | 14, 0), "velocity") => vec![("no meaning", is(&running_at(30, 1000)))],
        ((11, 0), "positioning") => vec![("and position within limits", !is(&beyond(true, Bench::enabled())))],
        ((14, 1), "positioning") => vec![("positioning active", is(&moving_to(5000, 1000)))],
        ((14, 0), "positioning") => {
            vec![("positioning inactive", is(&Bench::enabled()) && is(&moving_to(100, 10_000)))]
        }
        _ => return None,
    })
}

/// Of a bit of the status word that is 1.
pub(super) fn status(bit: &str, mode: &str) -> Option<String> {
    static ANSWERS: Answers = Answers::new(BTreeMap::new());
    once(&ANSWERS, (bit.into(), mode.into(), String::new()), || {
        let clauses = of_status(bit.parse().ok()?, mode)?;
        Some(said(clauses, "; "))
    })
}

fn of_status(bit: u16, mode: &str) -> Option<Clauses> {
    let is = |bench: &Bench| bench.status() >> bit & 1 == 1;
    let switched_on = || {
        let mut bench = Bench::operational();
        [0x0106, 0x0107].into_iter().for_each(|word| bench.control(word));
        bench
    };
    Some(match (bit, mode) {
        // Which bits table 22 is about, it says itself: it is compared in whole.
        (0..=3 | 6, "") => vec![("table 22", super::states::in_table_22(bit))],
        (4, "") => {
            let at = |volts: u16| is(&with_inputs(|inputs| inputs.output_stage_supply_100mv = volts * 10));
            vec![("supply voltage within tolerance", at(18) && at(24) && at(35) && !at(17) && !at(36))]
        }
        (5, "") => {
            let mut stopped = Bench::enabled();
            stopped.control(0x0102);
            vec![("not in QUICK STOP ACTIVE", is(&Bench::enabled()) && is(&Bench::new()) && !is(&stopped))]
        }
        (7, "") => {
            let all = [with_inputs(|inputs| inputs.battery_10mv = 250), overcurrent(), held()];
            vec![("warning active", all.iter().all(is) && !is(&moving_to(5000, 500)))]
        }
        (8, "positioning") => vec![
            ("OPERATION ENABLED", is(&Bench::enabled()) && !is(&switched_on())),
            ("no fault", !is(&faulty())),
            ("output stage supply applied", !is(&unsupplied())),
            ("no limit exceeded", !is(&beyond(true, Bench::enabled())) && !is(&beyond(false, Bench::enabled()))),
            ("no active travel job", !is(&moving_to(5000, 1000))),
        ],
        (8, "velocity") => vec![
            ("OPERATION ENABLED", is(&in_velocity_mode())),
            ("no fault", !is(&with(in_velocity_mode(), |inputs| inputs.internal_error = true))),
            ("no active travel job", !is(&running_at(30, 1000))),
            (
                "output stage supply applied",
                !is(&with(in_velocity_mode(), |inputs| inputs.output_stage_supply_100mv = 0)),
            ),
        ],
        (9, "") => {
            let mut stopped = Bench::operational();
            stopped.nmt(0x02);
            stopped.hear(0);
            vec![("NMT OPERATIONAL or STOPPED", is(&Bench::operational()) && is(&stopped) && !is(&Bench::new()))]
        }
        (10, "positioning") => vec![(
            "stopped within the window after a positioning command",
            is(&moving_to(1000, 20_000)) && !is(&moving_to(1000, 1000)) && !is(&Bench::enabled()),
        )],
        (10, "velocity") => {
            vec![("actual speed within the window", is(&running_at(30, 10_000)) && !is(&running_at(68, 100)))]
        }
        (11, "") => {
            let both = [true, false].into_iter().all(|above| is(&beyond(above, Bench::enabled())));
            vec![("upper or lower limit exceeded", both && !is(&Bench::enabled()))]
        }
        (12, "positioning") => {
            let mut bench = moving_to(1000, 20_000);
            let kept = is(&bench);
            bench.control(0x000F);
            vec![
                ("travel command started", is(&moving_to(5000, 100)) && !is(&Bench::enabled())),
                ("cleared when controlword bit 4 is 0 after the job", kept && !is(&bench)),
            ]
        }
        (12, "velocity") => vec![("drive stands still", is(&in_velocity_mode()) && !is(&running_at(30, 1000)))],
        (13, "") => vec![("statically 0", !is(&moving_to(5000, 1000)) && !is(&running_at(30, 1000)))],
        (14, "positioning") => vec![
            ("positioning job active", is(&moving_to(5000, 1000)) && !is(&Bench::enabled())),
            ("no new setpoint", ends_at(|bench| bench.command(0x405, 0x001F, -5000)) == 5000),
            ("no inching", ends_at(|bench| bench.control(0x200F)) == 5000),
        ],
        (14 | 15, "velocity") => vec![("statically 0", !is(&running_at(30, 1000)))],
        (15, "positioning") => vec![("shaft moving", is(&moving_to(5000, 1000)) && !is(&Bench::enabled()))],
        _ => return None,
    })
}

/// Of a bit of the control word.
pub(super) fn control(bit: &str, mode: &str) -> Option<String> {
    static ANSWERS: Answers = Answers::new(BTreeMap::new());
    once(&ANSWERS, (bit.into(), mode.into(), String::new()), || {
        let effect = super::words::effect(bit, mode);
        Some(match (effect, bit, mode) {
            ("commands", ..) => "table 24".into(),
            ("none", _, "velocity") => "no meaning".into(),
            ("none", ..) => String::new(),
            ("travels", ..) => {
                let mut bench = moving_to(100, 100);
                let acknowledged = bench.status() >> 12 & 1 == 1;
                bench.control(0x0107);
                bench.command(0x405, 0x0017, 3000);
                bench.hear(10_000);
                let only_enabled = bench.see(|drive, now| drive.position(now)) < 200;
                let clauses = vec![
                    ("0 to 1 starts positioning in OPERATION ENABLED", only_enabled && at_an_edge(0x0010)),
                    ("acknowledged by statusword bit 12", acknowledged),
                ];
                said(clauses, "; ")
            }
            ("resets", ..) => {
                let mut bench = faulty();
                bench.control(0x0080);
                let stays = bench.status() & 0x4F == 0x08;
                said(vec![("0 to 1 in FAULT to SWITCH ON DISABLED when the cause is resolved", stays)], "; ")
            }
            ("interrupts and resumes", ..) => {
                let clauses = vec![
                    ("1 interrupts with programmed deceleration, in control", interrupts_as_programmed()),
                    ("1 to 0 resumes", true),
                ];
                said(clauses, "; ")
            }
            ("runs", ..) => {
                let mut disabled = in_velocity_mode();
                disabled.control(0x0107);
                disabled.command(0x505, 0x0007, 30);
                disabled.hear(1000);
                let stands = disabled.see(|drive, now| drive.velocity(now)) == 0;
                said(vec![("1 to 0 starts moving in OPERATION ENABLED", stands)], "; ")
            }
            ("steps", ..) => said(vec![("0 to 1 starts inching 1", at_an_edge(0x2000))], "; "),
            ("inches", ..) => {
                let mask = if bit == "14" { 0x4000 } else { 0x8000 };
                said(vec![("0 to 1 starts", at_an_edge(mask)), ("travels until 0", inches_until(mask))], "; ")
            }
            (other, ..) => other.into(),
        })
    })
}

pub(super) fn with(mut bench: Bench, change: impl FnOnce(&mut siko_ag03_1::sim::inputs::Inputs)) -> Bench {
    bench.world(change);
    bench.hear(0);
    bench
}

fn faulty() -> Bench {
    with_inputs(|inputs| inputs.internal_error = true)
}

fn unsupplied() -> Bench {
    with_inputs(|inputs| inputs.output_stage_supply_100mv = 0)
}

/// Whether a travel begins.
fn travels(mut bench: Bench) -> bool {
    bench.command(0x405, 0x001F, 1000);
    bench.hear(500);
    bench.see(|drive, now| drive.position(now)) != 0
}

/// Whether the shaft lets itself be turned by hand.
fn turns(bench: Bench) -> bool {
    bench.see(|drive, now| drive.turn_shaft(now, 1))
}

/// Whether 1002h says "in position" so far from where the drive has travelled to.
fn in_window(distance: i32) -> bool {
    let mut bench = Bench::new();
    // Position control is off at the target, so that the shaft can be turned (parameter 26).
    let _ = bench.write(0x2417, 0, 2, 1);
    bench.nmt(0x01);
    bench.enable();
    bench.command(0x405, 0x001F, 1000);
    bench.hear(20_000);
    let turned = bench.see(|drive, now| drive.turn_shaft(now, distance));
    turned && bench.system() >> 3 & 1 == 1
}

/// Whether inching 2 moves a drive beyond a limit in positive and in negative direction.
fn inches(above: bool) -> (bool, bool) {
    let moves = |word| {
        let mut bench = beyond(above, Bench::enabled());
        bench.control(0x000F);
        bench.control(word);
        bench.hear(500);
        bench.see(|drive, now| drive.position(now)) != 0
    };
    (moves(0x400F), moves(0x800F))
}

/// Where a travel to 5000 ends when something is commanded on the way.
fn ends_at(command: impl FnOnce(&mut Bench)) -> i32 {
    let mut bench = moving_to(5000, 1000);
    bench.control(0x000F);
    command(&mut bench);
    bench.hear(60_000);
    bench.see(|drive, now| drive.position(now))
}

/// Whether a bit moves the drive when it becomes 1, and not while it stays 1.
fn at_an_edge(mask: u16) -> bool {
    let mut bench = Bench::operational();
    let _ = bench.write(0x607A, 0, 3000, 4);
    // Set before the drive is enabled, and kept set.
    for word in [0x0106, 0x0107, 0x000F] {
        bench.control(word | mask);
    }
    bench.hear(1000);
    let stays = bench.see(|drive, now| drive.position(now)) == 0;
    bench.control(0x000F);
    bench.control(0x000F | mask);
    bench.hear(1000);
    stays && bench.see(|drive, now| drive.position(now)) != 0
}

fn inches_until(mask: u16) -> bool {
    let mut bench = Bench::enabled();
    bench.control(0x000F);
    bench.control(0x000F | mask);
    bench.hear(20_000);
    let moves = bench.see(|drive, now| drive.velocity(now)) != 0;
    bench.control(0x000F);
    bench.hear(1000);
    moves && bench.see(|drive, now| drive.velocity(now)) == 0
}

/// Whether the way to a stop depends on d-Pos, and the motor stays in control.
fn interrupts_as_programmed() -> bool {
    let stop = |d_pos: i64| {
        let mut bench = Bench::operational();
        let _ = bench.write(0x2410, 0x0A, d_pos, 1);
        bench.enable();
        bench.command(0x405, 0x001F, 9000);
        bench.hear(2000);
        let before = bench.see(|drive, now| drive.position(now));
        bench.control(0x011F);
        bench.hear(20_000);
        let in_control = bench.system() >> 7 & 1 == 0;
        let way = bench.see(|drive, now| drive.position(now)) - before;
        if in_control { way } else { 0 }
    };
    // 800 increments/s; 100 % are 6400/s2.
    (stop(100), stop(25)) == (50, 200)
}
