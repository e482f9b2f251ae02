//! The LEDs (7.14), observed at intervals: what blinks is recognised by when it is lit.

use siko::sim::Lights;
use siko::sim::inputs::Inputs;

use super::rig::{Rig, Siko};
use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::rig::once;

/// The time between two observations.
const LOOK_MS: u64 = 50;

pub(crate) fn check<D: Siko>(checker: &mut Checker<'_>, case: &Case<'_>) {
    for row in case.manual.rows("leds.csv") {
        let found = in_words::<D>(row.get("led"), row.get("meaning"));
        checker.key(row);
        checker.cell(row, "state", Against::Drive, &found);
        checker.that(row, "meaning", Against::Drive, found == row.get("state"), found);
    }
}

/// What an LED shows when the drive is as `meaning` says.
fn in_words<D: Siko>(led: &str, meaning: &str) -> String {
    once::<D, _>((led, meaning), || {
        let with = |change: fn(&mut Inputs)| {
            let mut rig = Rig::<D>::new();
            rig.world(change);
            shown(&mut rig, |lights| lights.status)
        };
        let after = |command: u8| {
            let mut rig = Rig::<D>::new();
            rig.nmt(command);
            rig.hear(0);
            shown(&mut rig, |lights| lights.bus)
        };
        match (led, meaning) {
            ("status green", "fault; number of blinks in table 2") => {
                let blinking = with(|inputs| inputs.sensor_fails = true);
                blinking.split(' ').next().unwrap_or_default().to_owned()
            }
            ("status green", "output stage and control supplied") => with(|_| ()),
            ("status green", "output stage and control not supplied") => {
                with(|inputs| (inputs.output_stage_supply_100mv, inputs.control_supply_100mv) = (0, 0))
            }
            ("bus orange", "PRE-OPERATIONAL") => after(0x80),
            ("bus orange", "OPERATIONAL") => after(0x01),
            ("bus orange", "STOPPED") => after(0x02),
            _ => String::new(),
        }
    })
}

/// The periods in which an LED is on and off within some seconds, each in numbers of observations. The first and the
/// last one are left out, because they were not observed as a whole.
fn spans<D: Siko>(rig: &mut Rig<D>, look: fn(Lights) -> bool) -> Vec<(bool, u64)> {
    let mut spans: Vec<(bool, u64)> = Vec::new();
    for _ in 0..240 {
        let lit = rig.see(|drive, now| look(drive.lights(now)));
        match spans.last_mut().filter(|(last, _)| *last == lit) {
            Some((_, looks)) => *looks += 1,
            None => spans.push((lit, 1)),
        }
        rig.hear(LOOK_MS);
    }
    if spans.len() > 2 {
        // Neither the first nor the last one was observed as a whole.
        spans.remove(0);
        spans.pop();
    }
    spans
}

/// `on`, `off`, `blinking 2.5 Hz` if on and off last equally long, or `blinking 1:5`.
pub(super) fn shown<D: Siko>(rig: &mut Rig<D>, look: fn(Lights) -> bool) -> String {
    let spans = spans(rig, look);
    let longest = |of: bool| spans.iter().filter(|(lit, _)| *lit == of).map(|(_, looks)| *looks).max();
    match (longest(true), longest(false)) {
        (Some(_), None) => "on".into(),
        (Some(on), Some(off)) if on == off => {
            format!("blinking {} Hz", 1000.0 / ((on + off) * LOOK_MS) as f64)
        }
        (Some(on), Some(off)) => format!("blinking 1:{}", off / on),
        _ => "off".into(),
    }
}

/// The number of flashes of an LED between two pauses.
pub(super) fn blinks<D: Siko>(rig: &mut Rig<D>, look: fn(Lights) -> bool) -> usize {
    let spans = spans(rig, look);
    let pause = spans.iter().map(|(_, looks)| *looks).max().unwrap_or(0);
    let mut codes = spans.split(|span| *span == (false, pause)).skip(1);
    codes.next().map_or(0, |code| code.iter().filter(|(lit, _)| *lit).count())
}
