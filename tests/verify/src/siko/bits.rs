//! Bits: the system status word (table 1), the status word (table 21), the control word (table 23), and the start
//! conditions (chapter 2.2). The words of a bit's row are clauses that the drive is asked about; the first clause is
//! about the bit itself.

use lexican_eds::model::Device;

use super::rig::{Rig, Siko, beyond, faulty, hindered, in_velocity_mode, moving_to, one, overcurrent, running_at};
use super::statements::SCRIPT;
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::kinds::cia402::distinguishes_states;
use crate::kinds::prose::said;
use crate::manual::Row;
use crate::rig::once;
use crate::script::Clauses;

/// A clause about which no drive can be asked.
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
    let Some(at) = row.number::<u16>("bit").zip(row.number::<u16>("value")) else { return };
    let Some(clauses) = once::<D, _>((at, mode), || {
        let key = format!("1002.{}={} {mode}", at.0, at.1);
        SCRIPT.clauses::<D>(key.trim_end())
    }) else {
        return;
    };
    checker.key(row);
    let shown = clauses.first().is_some_and(|(_, holds)| *holds);
    checker.that(row, "value", Against::Drive, shown, format!("not {value}"));
    checker.cell(row, "meaning", Against::Drive, said(&clauses).replacen(":; ", ": ", 1));
    let term = case.manual.cell("terms.csv", &format!("SystemStatus:{bit}"), "printed");
    checker.cell(row, "name", Against::Manual, term);
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

/// The clauses that hold if a bit of the status word is 1.
fn of_status_word<D: Siko>(bit: u16, mode: &str) -> Option<Clauses> {
    // Table 22 itself says which bits it is about, and is compared as a whole.
    if matches!((bit, mode), (0..=3 | 6, "")) {
        return Some(vec![("table 22", distinguishes_states::<D>(bit))]);
    }
    SCRIPT.clauses::<D>(format!("6041.{bit} {mode}").trim_end())
}

fn control_word<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>, row: &Row) {
    let (bit, mode) = (row.get("bit"), row.get("mode"));
    // Some bits have a row for each mode.
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

/// The clauses of an effect that hold besides the effect itself.
fn action<D: Siko>(effect: &str, bit: u16, mode: &str) -> String {
    let clauses = match (effect, mode) {
        ("commands", _) => vec![("table 24", true)],
        ("none", "velocity") => vec![("no meaning", true)],
        ("none", _) => vec![],
        ("travels", _) => {
            let mut rig = moving_to::<D>(100, 100);
            let acknowledged = rig.status() >> 12 & 1 == 1;
            rig.control(0x0107);
            rig.command(0x405, 0x0017, 3000);
            rig.hear(10_000);
            let only_enabled = rig.position() < 200;
            vec![
                ("0 to 1 starts positioning in OPERATION ENABLED", only_enabled && at_an_edge::<D>(0x0010)),
                ("acknowledged by statusword bit 12", acknowledged),
            ]
        }
        ("resets", _) => {
            let mut rig = faulty::<D>();
            rig.control(0x0080);
            vec![("0 to 1 in FAULT to SWITCH ON DISABLED when the cause is resolved", rig.is_fault())]
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

/// The effect of a bit of the control word on a drive in OPERATION ENABLED.
fn effect<D: Siko>(bit: u16, mode: &str) -> &'static str {
    let (mask, is_velocity) = (1 << bit, mode == "velocity");
    let mut rig = if is_velocity { in_velocity_mode::<D>() } else { Rig::<D>::enabled() };
    match bit {
        0..=3 => {
            rig.control(0x010F & !mask);
            return if rig.status() & 0x6F == 0x27 { "none" } else { "commands" };
        }
        7 => {
            rig.world(|inputs| inputs.sensor_fails = true);
            rig.world(|inputs| inputs.sensor_fails = false);
            rig.control(mask);
            return if rig.is_disabled() { "resets" } else { "none" };
        }
        8 if !is_velocity => {
            rig.travel(5000);
            rig.hear(500);
            rig.control(0x011F);
            rig.hear(3000);
            let stopped = rig.speed() == 0.0 && rig.position() < 5000;
            rig.control(0x001F);
            rig.hear(20_000);
            return if stopped && rig.position() == 5000 { "interrupts and resumes" } else { "none" };
        }
        8 => {
            rig.run(30);
            rig.hear(1000);
            return if rig.velocity() > 0 { "runs" } else { "none" };
        }
        _ => {}
    }
    // An order that lasts for a while.
    rig.set(&[if is_velocity { (0x60FF, 0, 30, 4) } else { (0x607A, 0, 3000, 4) }]);
    rig.control(if is_velocity { 0x010F | mask } else { 0x000F | mask });
    rig.hear(500);
    let moves = rig.speed() != 0.0;
    rig.hear(20_000);
    match (rig.position(), rig.speed() != 0.0) {
        _ if !moves => "none",
        (3000, false) => "travels",
        (1600, false) => "steps",
        (position, true) if (position > 0) == (bit == 14) => "inches",
        _ => "otherwise",
    }
}

/// Whether a bit moves the drive when it becomes 1, and not while it stays 1.
fn at_an_edge<D: Siko>(mask: u16) -> bool {
    let mut rig = Rig::<D>::operational();
    rig.set(&[(0x607A, 0, 3000, 4)]);
    // Set before the drive is enabled, and kept set.
    rig.controls(&[0x0106, 0x0107, 0x000F].map(|word| word | mask));
    rig.hear(1000);
    let stays = rig.position() == 0;
    rig.controls(&[0x000F, 0x000F | mask]);
    rig.hear(1000);
    stays && rig.position() != 0
}

fn inches_until<D: Siko>(mask: u16) -> bool {
    let mut rig = Rig::<D>::enabled();
    rig.controls(&[0x000F, 0x000F | mask]);
    rig.hear(20_000);
    let moves = rig.velocity() != 0;
    rig.control(0x000F);
    rig.hear(1000);
    moves && rig.velocity() == 0
}

/// Whether the way to a stop depends on the programmed deceleration, and the motor stays in control.
fn interrupts_as_programmed<D: Siko>() -> bool {
    let stop = |percent: i64| {
        let mut rig = super::rig::enabled_with::<D>(&[one(D::deceleration(), percent)]);
        rig.travel(9000);
        rig.hear(2000);
        rig.control(0x011F);
        let way = rig.way_to_rest();
        if rig.is_released() { 0 } else { way }
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

/// The overlay's names of the bits that a start condition is about.
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

/// A start while a condition is not met.
#[derive(Clone)]
struct Violation {
    /// The system status word while the condition is met, and while it is not.
    met: u16,
    unmet: u16,
    /// Whether the drive does the same as without the start.
    refused: bool,
}

fn violation<D: Siko>(operation: &str, meaning: &str) -> Option<Violation> {
    let start: fn(&mut Rig<D>) = match operation {
        "positioning" => |rig| rig.travel(100),
        "inching" => |rig| rig.control(0x200F),
        "velocity" => |rig| rig.run(60),
        _ => return None,
    };
    let make = || if operation == "velocity" { in_velocity_mode::<D>() } else { Rig::<D>::enabled() };
    // Situations that the meaning rules out; the bit is compared with what it shows in them.
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
    let mut rig = situation()?;
    let (met, unmet) = (make().system(), rig.system());
    let ends = |rig: &mut Rig<D>| {
        rig.hear(20_000);
        (rig.position(), rig.velocity())
    };
    let undisturbed = ends(&mut rig);
    let mut rig = situation()?;
    start(&mut rig);
    Some(Violation { met, unmet, refused: ends(&mut rig) == undisturbed })
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

/// Bit 11 of a drive that is ready: 0 means that nothing is missing. And whether it is 0 only if all conditions are
/// met, which are those of the rows above.
fn readiness<D: Siko>(in_velocity: bool) -> (u16, bool) {
    let make = || if in_velocity { in_velocity_mode::<D>() } else { Rig::<D>::enabled() };
    let bit = |rig: &Rig<D>| rig.system() >> 11 & 1;
    let unmet = [
        make().after(|inputs| inputs.sensor_fails = true),
        make().after(D::hinder),
        if in_velocity { running_at::<D>(30, 1000) } else { moving_to::<D>(5000, 1000) },
    ];
    let value = bit(&make());
    (value, value == 0 && unmet.iter().all(|rig| bit(rig) == 1))
}

/// The bits of the system status word that are 1 in all of some situations and in none of others.
fn bits<D: Siko>(are: &[Rig<D>], are_not: &[Rig<D>]) -> u16 {
    let ones = are.iter().fold(u16::MAX, |bits, rig| bits & rig.system());
    ones & !are_not.iter().fold(0, |bits, rig| bits | rig.system())
}

/// The word of the example in chapter 2.1: in position, below the lower limit, fault, not ready to travel, overcurrent.
pub(super) fn example_word<D: Siko>() -> u16 {
    let travel = || moving_to::<D>(5000, 1000);
    let position =
        bits(&[moving_to::<D>(100, 10_000), running_at::<D>(30, 10_000)], &[travel(), running_at::<D>(68, 100)]);
    let limit = bits(
        &[beyond(false, Rig::<D>::new()), beyond(false, Rig::<D>::enabled())],
        &[Rig::<D>::new(), beyond(true, Rig::<D>::new()), beyond(true, Rig::<D>::enabled())],
    );
    let fault = bits(&[faulty::<D>()], &[Rig::<D>::new(), hindered::<D>()]);
    let not_ready = bits(&[faulty::<D>(), travel(), hindered::<D>()], &[Rig::<D>::enabled()]);
    let current = bits(&[overcurrent::<D>()], &[moving_to::<D>(5000, 500)]);
    position | limit | fault | not_ready | current
}
