//! Bits: the system status word (table 1), the status word (table 21), the control word (table 23), and what must hold
//! before anything moves (chapter 2.2). Of each bit, the words of its row are clauses that the drive is asked for; the
//! first of them is about the bit itself.

use lexican_eds::model::Device;

use super::bench::{
    Bench, Siko, beyond, faulty, held, hindered, in_loop, in_velocity_mode, moving_to, one, overcurrent, running_at,
    with_inputs,
};
use crate::bench::once;
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::cia402::distinguishes_states;
use crate::kinds::prose::{Clauses, said};
use crate::manual::Row;

/// A clause that no drive can be asked for.
pub(super) const BATTERY_LIFE: &str = "replace within half a year";

pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for row in case.manual.rows("system_status.csv") {
        system_status::<D>(checker, case, row);
    }
    for row in case.manual.rows("statusword.csv") {
        status_word::<D>(checker, case, row);
    }
    for row in case.manual.rows("controlword.csv") {
        control_word::<D>(checker, case, row);
    }
    for row in case.manual.rows("start_conditions.csv") {
        start_condition::<D>(checker, case, row);
    }
}

/// The overlay's name of a bit.
fn name_of<'d>(device: &'d Device, field: &str, bit: &str) -> Option<&'d str> {
    let fields = &device.bit_fields.get(field)?.fields;
    fields.iter().find(|named| named.value.low.to_string() == bit).map(|named| named.name.as_str())
}

fn system_status<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row) {
    let (bit, value, mode) = (row.get("bit"), row.get("value"), row.get("mode"));
    let named = name_of(&case.sheet.device, "SystemStatus", bit);
    let has_name = D::MODEL.switches || !matches!(bit, "0" | "1" | "2");
    checker.that(row, "bit", Against::Sheet, named.is_some() == has_name, named.unwrap_or("no name"));
    let Some(at) = row.number("bit").zip(row.number("value")) else { return };
    let Some(clauses) = once::<D, _>((at, mode), || of_system_status::<D>(at, mode)) else { return };
    checker.key(row);
    let shown = clauses.first().is_some_and(|(_, holds)| *holds);
    checker.that(row, "value", Against::Drive, shown, format!("not {value}"));
    checker.cell(row, "meaning", Against::Drive, said(&clauses).replacen(":; ", ": ", 1));
    let term = case.manual.cell("terms.csv", &format!("SystemStatus:{bit}"), "printed");
    checker.cell(row, "name", Against::Manual, term);
}

/// What holds where a bit of the system status word has a value. What ends with a colon is said by what follows.
fn of_system_status<D: Siko>(bit: (u16, u16), mode: &str) -> Option<Clauses> {
    let is = |bench: &Bench<D>| bench.system() >> bit.0 & 1 == bit.1;
    Some(match (bit, mode) {
        ((switch @ 0..=1, 1), "positioning") => limit_switch::<D>(switch),
        ((0, 0), "positioning") => vec![("limit switch 1 inactive", is(&Bench::<D>::new()))],
        ((1, 0), "positioning") => vec![("limit switch 2 inactive", is(&Bench::<D>::new()))],
        ((0..=1, 0), "velocity") => {
            vec![("no meaning", is(&in_velocity_mode::<D>().after(|inputs| inputs.limit_switches = [true; 2])))]
        }
        ((2, value), "") if D::MODEL.switches => {
            let shown = [false, true].map(|on| is(&with_inputs::<D>(|inputs| inputs.calibration_switch = on)));
            let word = if value == 1 { "calibration switch active" } else { "calibration switch inactive" };
            vec![(word, shown == [value == 0, value == 1])]
        }
        ((0..=2, 0), "") => {
            vec![("no meaning", is(&Bench::<D>::new()) && is(&moving_to::<D>(5000, 500)) && is(&faulty::<D>()))]
        }
        ((3, 1), "positioning") => {
            vec![
                ("in position:", is(&moving_to::<D>(100, 10_000))),
                ("actual position within window", in_window::<D>(10)),
            ]
        }
        ((3, 0), "positioning") => {
            vec![("actual position outside window", is(&moving_to::<D>(5000, 1000)) && !in_window::<D>(11))]
        }
        ((3, 1), "velocity") => vec![
            ("in position:", is(&running_at::<D>(30, 10_000))),
            ("actual velocity within window", !is(&running_at::<D>(68, 100))),
        ],
        ((3, 0), "velocity") => {
            vec![("actual velocity outside window", is(&running_at::<D>(68, 100)) && !is(&running_at::<D>(30, 10_000)))]
        }
        ((4, 1), "") => vec![("drive travels", is(&moving_to::<D>(5000, 1000)) && is(&running_at::<D>(30, 1000)))],
        ((4, 0), "") => vec![(
            "drive stands still: velocity < 2 rev/min",
            is(&Bench::<D>::enabled()) && is(&running_at::<D>(1, 5000)) && !is(&running_at::<D>(2, 5000)),
        )],
        ((5, 1), "positioning") => vec![
            ("upper limit:", is(&beyond(true, Bench::<D>::new()))),
            (D::LIMITS[0], !is(&beyond(false, Bench::<D>::new()))),
            ("inching negative only", inches::<D>(true) == (false, true)),
        ],
        ((6, 1), "positioning") => vec![
            ("lower limit:", is(&beyond(false, Bench::<D>::new()))),
            (D::LIMITS[1], !is(&beyond(true, Bench::<D>::new()))),
            ("inching positive only", inches::<D>(false) == (true, false)),
        ],
        ((5, 0), "positioning") => vec![("position below limit", is(&Bench::<D>::new()))],
        ((6, 0), "positioning") => vec![("position above limit", is(&Bench::<D>::new()))],
        ((5 | 6, 0), "velocity") => {
            let none = [true, false].into_iter().all(|above| is(&beyond(above, in_velocity_mode::<D>())));
            vec![("no meaning", none)]
        }
        ((7, 1), "") => vec![("motor released", is(&Bench::<D>::new()) && Bench::<D>::new().turn(1))],
        ((7, 0), "") => vec![("motor in control", is(&Bench::<D>::enabled()) && !Bench::<D>::enabled().turn(1))],
        ((8, 1), "") => {
            vec![("fault", is(&faulty::<D>())), (D::ACKNOWLEDGE, acknowledged_by_edge_only::<D>())]
        }
        ((8, 0), "") => vec![("no fault", is(&Bench::<D>::enabled()))],
        ((9, 1), "positioning") => vec![
            ("loop travel:", is(&in_loop::<D>(1000))),
            ("direction unequal start direction", in_loop::<D>(1000).velocity() < 0),
        ],
        ((9, 0), "positioning") => {
            let mut back = in_loop::<D>(1000);
            // Travels are about 7 s to the turn, and a second back.
            let forth = (0..100).find(|_| {
                back.hear(100);
                back.velocity() > 0
            });
            vec![("direction equal start direction", forth.is_some() && is(&back) && is(&Bench::<D>::new()))]
        }
        ((9 | 14, 0), "velocity") => vec![("no meaning", is(&running_at::<D>(30, 1000)))],
        ((10, 1), "") => {
            vec![(D::READY[1], is(&hindered::<D>())), ("travel disabled", !travels(hindered::<D>()))]
        }
        ((10, 0), "") => vec![(D::READY[0], is(&Bench::<D>::new()))],
        ((11, 1), "") => {
            vec![("not ready to travel", is(&faulty::<D>()) && is(&moving_to::<D>(5000, 1000)) && is(&hindered::<D>()))]
        }
        ((11, 0), "") => vec![
            ("ready to travel:", is(&Bench::<D>::enabled())),
            ("no fault", !is(&faulty::<D>())),
            ("no active positioning", !is(&moving_to::<D>(5000, 1000))),
            (D::READY[0], !is(&hindered::<D>())),
        ],
        ((11, 0), "positioning") => {
            let beyond = [true, false].map(|above| beyond(above, Bench::<D>::enabled()));
            let within = is(&Bench::<D>::enabled()) && !beyond.iter().any(is);
            match D::MODEL.switches {
                true => {
                    vec![("and no limit switch active", !is(&on_switches::<D>())), ("position within limits", within)]
                }
                false => vec![("and position within limits", within)],
            }
        }
        ((12, 1), "") => {
            let low = with_inputs::<D>(|inputs| inputs.battery_10mv = 250);
            vec![("battery too low", is(&low) && travels(low)), (BATTERY_LIFE, true)]
        }
        ((12, 0), "") => vec![("battery ok", is(&Bench::<D>::new()))],
        ((13, 1), "") => {
            let mut bench = overcurrent::<D>();
            let beyond = is(&bench) && !is(&moving_to::<D>(5000, 500).after(|inputs| inputs.load_ma = 2400));
            let seconds = D::MODEL.overcurrent_for.as_micros() / 1_000_000;
            bench.hear(seconds * 1000 - 100);
            let not_yet = !bench.is_fault();
            bench.hear(200);
            let after = if seconds == 4 { "fault after 4 s" } else { "fault after 10 s" };
            vec![("motor current beyond range", beyond), (after, not_yet && bench.is_fault())]
        }
        ((13, 0), "") => {
            vec![("motor current within range", is(&moving_to::<D>(5000, 500).after(|inputs| inputs.load_ma = 2400)))]
        }
        ((14, 1), "positioning") => vec![("positioning active", is(&moving_to::<D>(5000, 1000)))],
        ((14, 0), "positioning") => {
            vec![("positioning inactive", is(&Bench::<D>::enabled()) && is(&moving_to::<D>(100, 10_000)))]
        }
        ((15, 1), "") => vec![("lag error", is(&held::<D>()))],
        ((15, 0), "") => vec![("no lag error", is(&moving_to::<D>(5000, 500)))],
        _ => return None,
    })
}

fn status_word<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row) {
    let (bit, mode) = (row.get("bit"), row.get("mode"));
    let Some(clauses) = row.number("bit").and_then(|bit| once::<D, _>((bit, mode), || of_status_word::<D>(bit, mode)))
    else {
        return;
    };
    checker.key(row);
    let shown = clauses.first().is_some_and(|(_, holds)| *holds);
    checker.that(row, "bit", Against::Drive, shown, "another bit");
    checker.cell(row, "meaning_of_1", Against::Drive, said(&clauses));
    let term = case.manual.cell("terms.csv", &format!("Statusword:{bit}"), "printed");
    let name = row.get("name");
    let printed = match name {
        name if name == D::RESERVED => term.is_empty(),
        "" => said(&clauses) == "statically 0",
        name => term.split(" / ").any(|part| part == name),
    };
    checker.that(row, "name", Against::Manual, printed, term);
    let named = name_of(&case.sheet.device, "Statusword", bit).is_some();
    checker.that(row, "name", Against::Sheet, named == (name != D::RESERVED), "the overlay has another name");
}

/// What holds where a bit of the status word is 1.
fn of_status_word<D: Siko>(bit: u16, mode: &str) -> Option<Clauses> {
    let is = |bench: &Bench<D>| bench.status() >> bit & 1 == 1;
    let after = |words: &[u16]| {
        let mut bench = Bench::<D>::operational();
        bench.controls(words);
        bench
    };
    Some(match (bit, mode) {
        // Which bits table 22 is about, it says itself: it is compared in whole.
        (0..=3 | 6, "") => vec![("table 22", distinguishes_states::<D>(bit))],
        (4, "") => {
            let at = |volts: u16| is(&with_inputs::<D>(|inputs| inputs.output_stage_supply_100mv = volts * 10));
            vec![("supply voltage within tolerance", at(18) && at(24) && at(35) && !at(17) && !at(36))]
        }
        (5, "") => {
            let stopped = after(&[0x0106, 0x0107, 0x010F, 0x0102]);
            vec![("not in QUICK STOP ACTIVE", is(&Bench::<D>::enabled()) && is(&Bench::<D>::new()) && !is(&stopped))]
        }
        (7, "") => {
            let all = [with_inputs::<D>(|inputs| inputs.battery_10mv = 250), overcurrent::<D>(), held::<D>()];
            let none = [moving_to::<D>(5000, 500), Bench::<D>::enabled()];
            vec![("warning active", all.iter().all(is) && !none.iter().any(is))]
        }
        (8, "positioning") => {
            let mut clauses = vec![
                ("OPERATION ENABLED", is(&Bench::<D>::enabled()) && !is(&after(&[0x0106, 0x0107]))),
                ("no fault", !is(&faulty::<D>())),
                (D::READY[0], !is(&hindered::<D>())),
                (
                    "no limit exceeded",
                    [true, false].into_iter().all(|above| !is(&beyond(above, Bench::<D>::enabled()))),
                ),
                ("no active travel job", !is(&moving_to::<D>(5000, 1000))),
            ];
            if D::MODEL.switches {
                clauses.insert(2, ("no limit switch active", !is(&on_switches::<D>())));
            }
            clauses
        }
        (8, "velocity") => {
            let hindered = in_velocity_mode::<D>().after(D::hinder);
            vec![
                ("OPERATION ENABLED", is(&in_velocity_mode::<D>())),
                ("no fault", !is(&in_velocity_mode::<D>().after(|inputs| inputs.sensor_fails = true))),
                ("no active travel job", !is(&running_at::<D>(30, 1000))),
                (D::READY[0], !is(&hindered)),
            ]
        }
        (9, "") => {
            let mut stopped = Bench::<D>::operational();
            stopped.nmt(0x02);
            stopped.hear(0);
            vec![(
                "NMT OPERATIONAL or STOPPED",
                is(&Bench::<D>::operational()) && is(&stopped) && !is(&Bench::<D>::new()),
            )]
        }
        (10, "positioning") => vec![(
            "stopped within the window after a positioning command",
            is(&moving_to::<D>(1000, 20_000)) && !is(&moving_to::<D>(1000, 1000)) && !is(&Bench::<D>::enabled()),
        )],
        (10, "velocity") => {
            vec![("actual speed within the window", is(&running_at::<D>(30, 10_000)) && !is(&running_at::<D>(68, 100)))]
        }
        (11, "") => {
            let both = [true, false].into_iter().all(|above| is(&beyond(above, Bench::<D>::enabled())));
            vec![("upper or lower limit exceeded", both && !is(&Bench::<D>::enabled()))]
        }
        (12, "positioning") => {
            let mut bench = moving_to::<D>(1000, 20_000);
            let kept = is(&bench);
            bench.control(0x000F);
            vec![
                ("travel command started", is(&moving_to::<D>(5000, 100)) && !is(&Bench::<D>::enabled())),
                ("cleared when controlword bit 4 is 0 after the job", kept && !is(&bench)),
            ]
        }
        (12, "velocity") => {
            vec![("drive stands still", is(&in_velocity_mode::<D>()) && !is(&running_at::<D>(30, 1000)))]
        }
        (13, "") => vec![("statically 0", !is(&moving_to::<D>(5000, 1000)) && !is(&running_at::<D>(30, 1000)))],
        (14, "positioning") => vec![
            ("positioning job active", is(&moving_to::<D>(5000, 1000)) && !is(&Bench::<D>::enabled())),
            ("no new setpoint", ends_at::<D>(|bench| bench.travel(-5000)) == 5000),
            ("no inching", ends_at::<D>(|bench| bench.control(0x200F)) == 5000),
        ],
        (14 | 15, "velocity") => vec![("statically 0", !is(&running_at::<D>(30, 1000)))],
        (15, "positioning") => vec![("shaft moving", is(&moving_to::<D>(5000, 1000)) && !is(&Bench::<D>::enabled()))],
        _ => return None,
    })
}

fn control_word<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row) {
    let (bit, mode) = (row.get("bit"), row.get("mode"));
    // Of some bits each mode has a row of its own.
    let has_modes = matches!(bit, "4" | "8" | "13" | "14" | "15");
    if has_modes == mode.is_empty() || !matches!(mode, "" | "positioning" | "velocity") {
        return;
    }
    let Some(at) = row.number::<u16>("bit").filter(|bit| *bit < 16) else { return };
    checker.key(row);
    let (effect, action) = once::<D, _>((at, mode), || {
        let effect = effect::<D>(at, mode);
        (effect, action::<D>(effect, at, mode))
    });
    checker.cell(row, "action", Against::Drive, action);
    let plain = |name: &str| name.to_ascii_lowercase().replace(" operation", "");
    let overlay = name_of(&case.sheet.device, "Controlword", bit);
    let term = case.manual.cell("terms.csv", &format!("Controlword:{bit}"), "printed");
    let agrees = match row.get("name") {
        name if name == D::RESERVED => overlay.is_none() && effect == "none",
        name if D::IS_TRANSLATED && !name.is_empty() => overlay.is_some() && term.split(" / ").any(|part| part == name),
        "" => overlay.is_some() && effect == "none",
        name => overlay.is_some_and(|overlay| plain(overlay) == plain(name)),
    };
    checker.that(row, "name", Against::Sheet, agrees, overlay.unwrap_or("no name"));
}

/// The words for an effect, as far as the rest of it holds.
fn action<D: Siko>(effect: &str, bit: u16, mode: &str) -> String {
    let clauses = match (effect, mode) {
        ("commands", _) => vec![("table 24", true)],
        ("none", "velocity") => vec![("no meaning", true)],
        ("none", _) => vec![],
        ("travels", _) => {
            let mut bench = moving_to::<D>(100, 100);
            let acknowledged = bench.status() >> 12 & 1 == 1;
            bench.control(0x0107);
            bench.command(0x405, 0x0017, 3000);
            bench.hear(10_000);
            let only_enabled = bench.position() < 200;
            vec![
                ("0 to 1 starts positioning in OPERATION ENABLED", only_enabled && at_an_edge::<D>(0x0010)),
                ("acknowledged by statusword bit 12", acknowledged),
            ]
        }
        ("resets", _) => {
            let mut bench = faulty::<D>();
            bench.control(0x0080);
            vec![("0 to 1 in FAULT to SWITCH ON DISABLED when the cause is resolved", bench.is_fault())]
        }
        ("interrupts and resumes", _) => vec![
            ("1 interrupts with programmed deceleration, in control", interrupts_as_programmed::<D>()),
            ("1 to 0 resumes", true),
        ],
        ("runs", _) => {
            let mut disabled = in_velocity_mode::<D>();
            disabled.control(0x0107);
            disabled.command(0x505, 0x0007, 30);
            disabled.hear(1000);
            vec![("1 to 0 starts moving in OPERATION ENABLED", disabled.velocity() == 0)]
        }
        ("steps", _) => vec![("0 to 1 starts inching 1", at_an_edge::<D>(1 << bit))],
        ("inches", _) => {
            vec![("0 to 1 starts", at_an_edge::<D>(1 << bit)), ("travels until 0", inches_until::<D>(1 << bit))]
        }
        (other, _) => return other.to_owned(),
    };
    said(&clauses)
}

/// What a bit of the control word does to a drive in OPERATION ENABLED.
fn effect<D: Siko>(bit: u16, mode: &str) -> &'static str {
    let (mask, is_velocity) = (1 << bit, mode == "velocity");
    let mut bench = if is_velocity { in_velocity_mode::<D>() } else { Bench::<D>::enabled() };
    match bit {
        0..=3 => {
            bench.control(0x010F & !mask);
            return if bench.status() & 0x6F == 0x27 { "none" } else { "commands" };
        }
        7 => {
            bench.world(|inputs| inputs.sensor_fails = true);
            bench.world(|inputs| inputs.sensor_fails = false);
            bench.control(mask);
            return if bench.is_disabled() { "resets" } else { "none" };
        }
        8 if !is_velocity => {
            bench.travel(5000);
            bench.hear(500);
            bench.control(0x011F);
            bench.hear(3000);
            let stopped = bench.speed() == 0.0 && bench.position() < 5000;
            bench.control(0x001F);
            bench.hear(20_000);
            return if stopped && bench.position() == 5000 { "interrupts and resumes" } else { "none" };
        }
        8 => {
            bench.run(30);
            bench.hear(1000);
            return if bench.velocity() > 0 { "runs" } else { "none" };
        }
        _ => {}
    }
    // One that is written for a while.
    bench.set(&[if is_velocity { (0x60FF, 0, 30, 4) } else { (0x607A, 0, 3000, 4) }]);
    bench.control(if is_velocity { 0x010F | mask } else { 0x000F | mask });
    bench.hear(500);
    let moves = bench.speed() != 0.0;
    bench.hear(20_000);
    match (bench.position(), bench.speed() != 0.0) {
        _ if !moves => "none",
        (3000, false) => "travels",
        (1600, false) => "steps",
        (position, true) if (position > 0) == (bit == 14) => "inches",
        _ => "otherwise",
    }
}

/// Whether a fault stays while CW.7 is 1 all the time, and goes with its next edge.
fn acknowledged_by_edge_only<D: Siko>() -> bool {
    let mut bench = Bench::<D>::enabled();
    bench.control(0x0080);
    bench.world(|inputs| inputs.sensor_fails = true);
    bench.world(|inputs| inputs.sensor_fails = false);
    bench.control(0x0080);
    let stays = bench.is_fault();
    bench.controls(&[0x0000, 0x0080]);
    stays && !bench.is_fault()
}

/// A limit switch, and which way the drive moves with it: switch 1 is where positions are high.
fn limit_switch<D: Siko>(switch: u16) -> Clauses {
    let at = usize::from(switch.min(1));
    let moves = |order: fn(&mut Bench<D>)| {
        let mut bench = with_inputs::<D>(|inputs| inputs.limit_switches[at] = true);
        bench.control(0x000F);
        order(&mut bench);
        bench.hear(500);
        (bench.system() & 3, bench.position().signum())
    };
    let orders: [fn(&mut Bench<D>); 4] = [
        |bench| bench.control(0x400F),
        |bench| bench.control(0x800F),
        |bench| bench.travel(1000),
        |bench| bench.travel(-1000),
    ];
    let moved = orders.map(moves);
    let shown = moved.iter().all(|(bits, _)| *bits == 1 << switch);
    let moved = moved.map(|(_, way)| way);
    match switch {
        0 => vec![("limit switch 1 active", shown), ("inching towards switch 2 only", moved == [0, -1, 0, 0])],
        _ => vec![("limit switch 2 active", shown), ("inching towards switch 1 only", moved == [1, 0, 0, 0])],
    }
}

/// With both limit switches active.
fn on_switches<D: Siko>() -> Bench<D> {
    with_inputs::<D>(|inputs| inputs.limit_switches = [true; 2])
}

/// Whether a travel begins.
fn travels<D: Siko>(mut bench: Bench<D>) -> bool {
    bench.travel(1000);
    bench.hear(500);
    bench.position() != 0
}

/// Whether 1002h says "in position" so far from where the drive has travelled to.
fn in_window<D: Siko>(distance: i32) -> bool {
    let mut bench = moving_to::<D>(1000, 20_000);
    // So that the shaft can be turned.
    bench.control(0x0000);
    bench.turn(distance) && bench.system() >> 3 & 1 == 1
}

/// Whether inching 2 moves a drive beyond a limit in positive and in negative direction.
fn inches<D: Siko>(above: bool) -> (bool, bool) {
    let moves = |word| {
        let mut bench = beyond(above, Bench::<D>::enabled());
        bench.controls(&[0x000F, word]);
        bench.hear(500);
        bench.position() != 0
    };
    (moves(0x400F), moves(0x800F))
}

/// Where a travel to 5000 ends when something is commanded on the way.
fn ends_at<D: Siko>(command: impl FnOnce(&mut Bench<D>)) -> i32 {
    let mut bench = moving_to::<D>(5000, 1000);
    bench.control(0x000F);
    command(&mut bench);
    bench.hear(60_000);
    bench.position()
}

/// Whether a bit moves the drive when it becomes 1, and not while it stays 1.
fn at_an_edge<D: Siko>(mask: u16) -> bool {
    let mut bench = Bench::<D>::operational();
    bench.set(&[(0x607A, 0, 3000, 4)]);
    // Set before the drive is enabled, and kept set.
    bench.controls(&[0x0106, 0x0107, 0x000F].map(|word| word | mask));
    bench.hear(1000);
    let stays = bench.position() == 0;
    bench.controls(&[0x000F, 0x000F | mask]);
    bench.hear(1000);
    stays && bench.position() != 0
}

fn inches_until<D: Siko>(mask: u16) -> bool {
    let mut bench = Bench::<D>::enabled();
    bench.controls(&[0x000F, 0x000F | mask]);
    bench.hear(20_000);
    let moves = bench.velocity() != 0;
    bench.control(0x000F);
    bench.hear(1000);
    moves && bench.velocity() == 0
}

/// Whether the way to a stop depends on the deceleration that is set, and the motor stays in control.
fn interrupts_as_programmed<D: Siko>() -> bool {
    let stop = |percent: i64| {
        let mut bench = super::bench::enabled_with::<D>(&[one(D::deceleration(), percent)]);
        bench.travel(9000);
        bench.hear(2000);
        bench.control(0x011F);
        let way = bench.way_to_rest();
        if bench.is_released() { 0 } else { way }
    };
    // 800 increments/s; 100 % are 6400/s2.
    (stop(100), stop(25)) == (50, 200)
}

fn start_condition<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row) {
    let (operation, bit, meaning) = (row.get("operation"), row.get("bit"), row.get("meaning"));
    if let Some(operation) = operation.strip_suffix(" ready") {
        return ready::<D>(checker, row, operation == "velocity");
    }
    let Some(violation) = once::<D, _>((operation, meaning), || violation::<D>(operation, meaning)) else { return };
    checker.key(row);
    let at = row.number::<u16>("bit").unwrap_or(0);
    let [clear, set] = [violation.met, violation.unmet].map(|word| word.checked_shr(at.into()).unwrap_or(0) & 1);
    checker.cell(row, "value", Against::Drive, clear);
    checker.that(row, "bit", Against::Drive, set != clear, format!("{clear}, else {set}"));
    let named = name_of(&case.sheet.device, "SystemStatus", bit).unwrap_or_default();
    checker.that(row, "bit", Against::Sheet, is_about(meaning).contains(&named), named);
    checker.that(row, "meaning", Against::Drive, violation.refused, "starts nevertheless");
    checker.cell(row, "word", Against::Drive, "1002");
}

/// What the overlay calls the bits that a start condition is about.
fn is_about(meaning: &str) -> &'static [&'static str] {
    match meaning {
        "no fault" => &["fault"],
        "output stage supplied" => &["output stage without supply"],
        "enable input active" => &["enable input inactive"],
        "not above upper limit" => &["above upper limit"],
        "not below lower limit" => &["below lower limit"],
        "no active travel job" => &["positioning active"],
        "no limit switch active" => &["limit switch 1", "limit switch 2"],
        _ => &[],
    }
}

/// A start although a condition is not met.
#[derive(Clone)]
struct Violation {
    /// The system status word while the condition is met, and while it is not.
    met: u16,
    unmet: u16,
    /// The drive does what it would do without the start.
    refused: bool,
}

fn violation<D: Siko>(operation: &str, meaning: &str) -> Option<Violation> {
    let start: fn(&mut Bench<D>) = match operation {
        "positioning" => |bench| bench.travel(100),
        "inching" => |bench| bench.control(0x200F),
        "velocity" => |bench| bench.run(60),
        _ => return None,
    };
    let make = || if operation == "velocity" { in_velocity_mode::<D>() } else { Bench::<D>::enabled() };
    // What the meaning rules out; the bit is compared with what it shows then.
    let situation = || {
        Some(match meaning {
            "no fault" => make().after(|inputs| inputs.sensor_fails = true),
            "output stage supplied" | "enable input active" => make().after(D::hinder),
            "no limit switch active" => make().after(|inputs| inputs.limit_switches = [true; 2]),
            "not above upper limit" => beyond(true, make()),
            "not below lower limit" => beyond(false, make()),
            "no active travel job" if operation == "velocity" => running_at::<D>(30, 1000),
            "no active travel job" => moving_to::<D>(5000, 1000),
            _ => return None,
        })
    };
    let mut bench = situation()?;
    let (met, unmet) = (make().system(), bench.system());
    let ends = |bench: &mut Bench<D>| {
        bench.hear(20_000);
        (bench.position(), bench.velocity())
    };
    let undisturbed = ends(&mut bench);
    let mut bench = situation()?;
    start(&mut bench);
    Some(Violation { met, unmet, refused: ends(&mut bench) == undisturbed })
}

fn ready<D: Siko>(checker: &mut Checker<'_>, row: &Row, in_velocity: bool) {
    let (value, all) = once::<D, _>(in_velocity, || readiness::<D>(in_velocity));
    checker.cell(row, "bit", Against::Drive, "11");
    checker.key(row);
    // ZSW is a word that the drive does not have.
    if in_velocity || row.get("word") == "1002" {
        checker.cell(row, "value", Against::Drive, value);
        checker.cell(row, "word", Against::Drive, "1002");
    } else {
        checker.cell(row, "word", Against::Manual, "ZSW");
        checker.cell(row, "value", Against::Manual, 1);
    }
    checker.cell(row, "meaning", Against::Drive, if all { "all conditions met" } else { "some conditions met" });
}

/// Bit 11 of a drive that is ready, where 0 says that nothing is missing; and whether it says so only when all
/// conditions are met, which are those of the rows above.
fn readiness<D: Siko>(in_velocity: bool) -> (u16, bool) {
    let make = || if in_velocity { in_velocity_mode::<D>() } else { Bench::<D>::enabled() };
    let bit = |bench: &Bench<D>| bench.system() >> 11 & 1;
    let unmet = [
        make().after(|inputs| inputs.sensor_fails = true),
        make().after(D::hinder),
        if in_velocity { running_at::<D>(30, 1000) } else { moving_to::<D>(5000, 1000) },
    ];
    let value = bit(&make());
    (value, value == 0 && unmet.iter().all(|bench| bit(bench) == 1))
}

/// The bits of the system status word that are 1 in all of some situations and in none of others.
fn bits<D: Siko>(are: &[Bench<D>], are_not: &[Bench<D>]) -> u16 {
    let ones = are.iter().fold(u16::MAX, |bits, bench| bits & bench.system());
    ones & !are_not.iter().fold(0, |bits, bench| bits | bench.system())
}

/// The word of the example in chapter 2.1: in position, below the lower limit, fault, not ready to travel, overcurrent.
pub(super) fn example_word<D: Siko>() -> u16 {
    let travel = || moving_to::<D>(5000, 1000);
    let position =
        bits(&[moving_to::<D>(100, 10_000), running_at::<D>(30, 10_000)], &[travel(), running_at::<D>(68, 100)]);
    let limit = bits(
        &[beyond(false, Bench::<D>::new()), beyond(false, Bench::<D>::enabled())],
        &[Bench::<D>::new(), beyond(true, Bench::<D>::new()), beyond(true, Bench::<D>::enabled())],
    );
    let fault = bits(&[faulty::<D>()], &[Bench::<D>::new(), hindered::<D>()]);
    let not_ready = bits(&[faulty::<D>(), travel(), hindered::<D>()], &[Bench::<D>::enabled()]);
    let current = bits(&[overcurrent::<D>()], &[moving_to::<D>(5000, 500)]);
    position | limit | fault | not_ready | current
}
