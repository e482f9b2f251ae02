//! The cyclic modes. Set-points come by SDO between two SYNCs, which every drive can take that has the modes.

use lexican_runtime::profile::cia402::{State, status};

use super::drive;
use crate::axis::{Axis, CYCLIC_POSITION, CYCLIC_VELOCITY};
use crate::case::{Case, Outcome, ensure, not_applicable};
use crate::tester::Tester;

pub(crate) const CASES: &[Case] = &[
    drive("402/607Ah/9", "mode 8: the position follows 607Ah with SYNC", |t| {
        let mut axis = cyclic(t, CYCLIC_POSITION, &[0x607A, 0x6064])?;
        let (start, travel) = (axis.position()?, axis.motion.travel);
        axis.set(0x607A, 0, start)?;
        cycle(&mut axis)?;
        axis.bring(State::OperationEnabled)?;
        cycle(&mut axis)?;
        for way in [1, -1] {
            let from = axis.position()?;
            for step in 1..=50 {
                axis.set(0x607A, 0, from + way * travel * step / 50)?;
                cycle(&mut axis)?;
            }
            ensure(axis.shows(status::SET_POINT_ACKNOWLEDGE)?, || "bit 12 does not say that the drive follows")?;
            for _ in 0..5 {
                cycle(&mut axis)?;
            }
            axis.is_near(from + way * travel, "after 50 cycles")?;
        }
        Ok(())
    }),
    drive("402/60FFh/5", "mode 9: the velocity follows 60FFh with SYNC", |t| {
        let mut axis = cyclic(t, CYCLIC_VELOCITY, &[0x60FF, 0x6064])?;
        let velocity = axis.motion.velocity;
        axis.set(0x60FF, 0, 0)?;
        axis.bring(State::OperationEnabled)?;
        for target in [velocity, 0, -velocity, 0] {
            let before = axis.position()?;
            axis.set(0x60FF, 0, target)?;
            for _ in 0..20 {
                cycle(&mut axis)?;
            }
            let (by, noise) = (axis.position()? - before, axis.noise());
            let right = if target == 0 { by.abs() <= noise } else { by * target.signum() > noise };
            if !right && by == 0 {
                let from = axis.position()?;
                for _ in 0..200 {
                    cycle(&mut axis)?;
                }
                if (axis.position()? - from) * target > 0 {
                    return Err(axis.is_too_slow());
                }
            }
            ensure(right, || format!("with 60FFh = {target} the position changes by {by}"))?;
        }
        Ok(())
    }),
];

/// A cyclic mode with 10 ms from set-point to set-point.
pub(super) fn cyclic<'t, 'a>(t: &'t mut Tester<'a>, mode: i8, objects: &[u16]) -> Outcome<Axis<'t, 'a>> {
    let mut axis = Axis::of(t)?;
    axis.mode(mode, objects)?;
    if axis.t.entry(0x60C2, 1).is_ok_and(|entry| entry.access.writable()) {
        for (sub, value) in [(1, 10), (2, -3_i32)] {
            let answer = axis.t.try_write(0x60C2, sub, value as u32)?;
            answer.map_err(|code| not_applicable(format!("60C2h does not take 10 ms: {code}")))?;
        }
    }
    Ok(axis)
}

pub(super) fn cycle(axis: &mut Axis<'_, '_>) -> Outcome {
    axis.t.sync(None)?;
    axis.t.hear_ms(9).map(|_| ())
}
