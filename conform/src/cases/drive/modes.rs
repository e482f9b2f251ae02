//! Modes of operation. Torque modes (4, 10) are tried without torque, since the distance that the drive moves would
//! depend on its load.

use lexican_runtime::profile::cia402::State;

use super::cyclic::cycle;
use crate::axis::Axis;
use crate::case::{Case, drive};
use crate::verdict::{Outcome, Verdict, ensure, not_applicable};

const MODES: &str = "6060h takes the modes that 6502h lists, and 6061h shows the one that is active.";

pub(crate) const CASES: &[Case] = &[
    drive("402/8.3/1", "each mode of 6502h can be chosen, and is shown in 6061h", |t| {
        let mut axis = Axis::of(t)?;
        each(&mut axis, true)?.into_iter().try_for_each(|mode| axis.mode(mode, &[]))
    })
    .requires(MODES),
    drive("402/8.3/2", "a mode that 6502h lacks is refused, or not shown", |t| {
        let mut axis = Axis::of(t)?;
        each(&mut axis, false)?.into_iter().try_for_each(|mode| is_not_taken(&mut axis, mode))
    })
    .requires(MODES)
    .recommended(),
    drive("402/8.3/3", "a mode with a number that is reserved is refused, or not shown", |t| {
        let mut axis = Axis::of(t)?;
        axis.t.has(&[0x6060, 0x6061])?;
        [5, 60, 100].into_iter().try_for_each(|mode| is_not_taken(&mut axis, mode))
    })
    .requires(MODES),
    drive("402/8.3/4", "another mode does not move a drive that stands, nor does it change the state", |t| {
        let mut axis = Axis::of(t)?;
        axis.t.has(&[0x6064])?;
        axis.enable()?;
        for mode in each(&mut axis, true)? {
            // The cyclic modes are left out: they follow their targets at once, which are 0 and not the present
            // position.
            if matches!(mode, 1 | 3 | 6) {
                let before = axis.position()?;
                axis.mode(mode, &[])?;
                axis.stands("with another mode")?;
                axis.is_near(before, "with another mode")?;
                axis.stays(State::OperationEnabled, "another mode")?;
            }
        }
        Ok(())
    })
    .requires("A change of the mode alone moves nothing, and leaves the state as it is."),
    drive("402/6071h/1", "modes 4 and 10: a torque turns nothing before OPERATION ENABLED", |t| {
        let mut axis = Axis::of(t)?;
        let (mut is_tried, mut lacks) = (false, String::new());
        for mode in [4, 10] {
            match axis.mode(mode, &[0x6071, 0x6064]) {
                Err(Verdict::NotApplicable(why)) => {
                    lacks = why;
                    continue;
                }
                other => other?,
            }
            is_tried = true;
            axis.bring(State::SwitchedOn)?;
            // 1/10 of the rated torque.
            axis.set(0x6071, 0, 100)?;
            for _ in 0..20 {
                cycle(&mut axis)?;
            }
            axis.stands("in SWITCHED ON")?;
            axis.set(0x6071, 0, 0)?;
            axis.bring(State::SwitchOnDisabled)?;
        }
        if is_tried { Ok(()) } else { Err(not_applicable(lacks)) }
    })
    .requires("A target torque acts in OPERATION ENABLED only."),
];

/// The modes of the standard that 6502h has, or does not have.
fn each(axis: &mut Axis<'_, '_>, listed: bool) -> Outcome<Vec<i8>> {
    axis.t.has(&[0x6060, 0x6061, 0x6502])?;
    let modes = axis.modes()?.ok_or_else(|| not_applicable("6502h lists no mode"))?;
    Ok((1..=10).filter(|mode| *mode != 5 && (modes >> (mode - 1) & 1 == 1) == listed).collect())
}

fn is_not_taken(axis: &mut Axis<'_, '_>, mode: i8) -> Outcome {
    if axis.set_if_it_can(0x6060, mode.into())? {
        axis.t.hear_ms(50)?;
    }
    let shown = axis.number(0x6061, 0)?;
    ensure(shown != i64::from(mode), || format!("mode {mode} is taken: 6061h shows it"))
}
