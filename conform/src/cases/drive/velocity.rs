//! Profile velocity mode.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::{State, control, status};

use crate::axis::{Axis, ENABLE, PROFILE_VELOCITY};
use crate::case::{Case, drive};
use crate::tester::Tester;
use crate::verdict::{Outcome, Verdict, ensure};

const VELOCITY: &str =
    "In profile velocity mode the drive turns with 60FFh, in OPERATION ENABLED only, and bit 10 says that it does.";

pub(crate) const CASES: &[Case] = &[
    drive("402/60FFh/1", "the drive turns in the direction of 60FFh, and bit 10 says when at its velocity", |t| {
        running(t, |axis, velocity| {
            for direction in [1, -1] {
                axis.set(0x60FF, 0, direction * velocity)?;
                begins_to_turn(axis, direction)?;
                axis.until(Duration::from_secs(5), "target reached (bit 10)", |axis| {
                    axis.shows(status::TARGET_REACHED)
                })?;
                ensure(
                    turns(axis, direction)?,
                    || "bit 10 says that the velocity is reached, and the drive does not turn so",
                )?;
            }
            Ok(())
        })
    })
    .requires(VELOCITY),
    drive("402/60FFh/2", "60FFh stops the drive when it is 0", |t| {
        running(t, |axis, velocity| {
            axis.set(0x60FF, 0, velocity)?;
            begins_to_turn(axis, 1)?;
            axis.set(0x60FF, 0, 0)?;
            axis.comes_to_rest()?;
            axis.stays(State::OperationEnabled, "a velocity of 0")
        })
    })
    .requires(VELOCITY),
    drive("402/60FFh/3", "nothing turns before OPERATION ENABLED", |t| {
        let mut axis = Axis::of(t)?;
        axis.mode(PROFILE_VELOCITY, &[0x60FF, 0x6064])?;
        axis.bring(State::SwitchedOn)?;
        axis.set(0x60FF, 0, axis.motion.velocity)?;
        axis.stands("in SWITCHED ON")
    })
    .requires(VELOCITY),
    drive("402/606Ch/1", "606Ch is the velocity that 60FFh asks for", |t| {
        t.has(&[0x606C])?;
        running(t, |axis, velocity| {
            axis.set(0x60FF, 0, velocity)?;
            begins_to_turn(axis, 1)?;
            axis.until(Duration::from_secs(5), "target reached (bit 10)", |axis| axis.shows(status::TARGET_REACHED))?;
            let window = if axis.t.has(&[0x606D]).is_ok() { axis.number(0x606D, 0)? } else { 0 };
            let shown = axis.number(0x606C, 0)?;
            let right = (shown - velocity).abs() <= window.max(velocity / 5);
            ensure(right, || format!("606Ch is {shown}, and 60FFh {velocity}"))
        })
    })
    .requires("606Ch has the actual velocity.")
    .recommended(),
    drive("402/606Fh/1", "bit 12 says that the drive stands", |t| {
        running(t, |axis, velocity| {
            axis.until(Duration::from_secs(1), "speed is zero (bit 12)", Axis::acknowledges)?;
            axis.set(0x60FF, 0, velocity)?;
            axis.until(Duration::from_secs(5), "the end of bit 12", |axis| Ok(!axis.acknowledges()?))?;
            axis.set(0x60FF, 0, 0)?;
            axis.until(Duration::from_secs(5), "speed is zero (bit 12)", Axis::acknowledges)
        })
    })
    .requires("Bit 12 of profile velocity mode is set while the drive is slower than 606Fh."),
    drive("402/60FFh/4", "halt stops the drive, and its end lets it turn again (bit 8)", |t| {
        running(t, |axis, velocity| {
            axis.set(0x60FF, 0, velocity)?;
            begins_to_turn(axis, 1)?;
            axis.order(ENABLE | control::HALT)?;
            axis.comes_to_rest()?;
            ensure(axis.shows(status::TARGET_REACHED)?, || "bit 10 does not say that the halted drive stands")?;
            axis.order(ENABLE)?;
            begins_to_turn(axis, 1)
        })
    })
    .requires("Halt interrupts a motion, and without it the motion goes on."),
    drive("402/607Eh/2", "bit 6 of 607Eh inverts velocities", |t| {
        t.has(&[0x607E])?;
        running(t, |axis, velocity| {
            let polarity = axis.number(0x607E, 0)?;
            axis.bring(State::SwitchOnDisabled)?;
            axis.set(0x607E, 0, polarity ^ 0x40)?;
            axis.bring(State::OperationEnabled)?;
            axis.set(0x60FF, 0, velocity)?;
            begins_to_turn(axis, -1)
        })
    })
    .requires("Bit 6 of 607Eh multiplies velocities by -1."),
];

/// Runs `check` in profile velocity mode, and stops the drive.
fn running(t: &mut Tester<'_>, check: impl FnOnce(&mut Axis<'_, '_>, i64) -> Outcome) -> Outcome {
    let mut axis = Axis::of(t)?;
    axis.mode(PROFILE_VELOCITY, &[0x60FF, 0x6064])?;
    axis.bring(State::OperationEnabled)?;
    axis.order(ENABLE)?;
    let velocity = axis.motion.velocity;
    check(&mut axis, velocity)?;
    axis.set(0x60FF, 0, 0)
}

/// Whether the position changes in a direction.
fn turns(axis: &mut Axis<'_, '_>, direction: i64) -> Outcome<bool> {
    let before = axis.position()?;
    axis.t.hear_ms(100)?;
    Ok((axis.position()? - before) * direction > axis.noise())
}

fn begins_to_turn(axis: &mut Axis<'_, '_>, direction: i64) -> Outcome {
    let way = if direction < 0 { "a turn in negative direction" } else { "a turn in positive direction" };
    match axis.until(Duration::from_secs(5), way, |axis| turns(axis, direction)) {
        Err(Verdict::Failed(_)) if axis.creeps(direction)? => Err(axis.is_too_slow()),
        other => other,
    }
}
