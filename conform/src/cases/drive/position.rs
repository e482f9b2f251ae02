//! Profile position mode.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::{State, control, status};

use crate::axis::{Axis, ENABLE};
use crate::case::{Case, drive};
use crate::tester::Tester;
use crate::verdict::{Outcome, ensure};

const SET_POINTS: &str = "Bit 5 says whether a new set-point replaces the motion under way or follows it.";

pub(crate) const CASES: &[Case] = &[
    drive("402/607Ah/1", "a set-point is acknowledged, until bit 4 falls", |t| {
        Axis::positioning(t, |axis, start| {
            let target = start + axis.motion.travel;
            axis.begin_set_point(target, 0)?;
            axis.t.hear_ms(50)?;
            ensure(axis.acknowledges()?, || "bit 12 falls while bit 4 is set")?;
            axis.order(ENABLE)?;
            axis.until(Duration::from_secs(1), "the end of the acknowledge", |axis| Ok(!axis.acknowledges()?))?;
            axis.arrives(target)
        })
    })
    .requires("Bit 12 acknowledges a set-point, and falls when bit 4 of the control word has fallen."),
    drive("402/607Ah/2", "the target is reached when bit 10 says so, and not before", |t| {
        Axis::positioning(t, |axis, start| {
            let target = start + axis.motion.travel;
            axis.set_point(target, 0)?;
            axis.moves(1, 0)?;
            axis.arrives(target)?;
            axis.is_near(target, "with bit 10")
        })
    })
    .requires("Bit 10 says that the position is within 6067h of the target."),
    drive("402/607Ah/3", "a relative set-point counts from where the drive is (bit 6)", |t| {
        Axis::positioning(t, |axis, start| {
            let travel = axis.motion.travel;
            axis.goes_to(start + travel / 2)?;
            axis.set_point(travel / 2, control::RELATIVE)?;
            axis.moves(1, 0)?;
            axis.arrives(start + travel)?;
            axis.is_near(start + travel, "after a relative set-point")
        })
    })
    .requires("With bit 6 a target counts from where the drive is, and without it from zero."),
    drive("402/607Ah/4", "a set-point with bit 5 replaces the one under way", |t| {
        Axis::positioning(t, |axis, start| {
            let travel = axis.motion.travel;
            axis.set_point(start + travel, 0)?;
            axis.moves(1, 0)?;
            axis.begin_set_point(start, control::CHANGE_IMMEDIATELY)?;
            axis.order(ENABLE)?;
            let end = axis.t.now() + Duration::from_secs(2);
            let window = axis.window()?;
            while axis.t.now() < end {
                let position = axis.position()?;
                ensure(position < start + travel - window, || "the target before is reached all the same")?;
                axis.t.hear_ms(5)?;
            }
            axis.arrives(start)?;
            axis.comes_to_rest()?;
            axis.is_near(start, "after a set-point with bit 5")
        })
    })
    .requires(SET_POINTS),
    drive("402/607Ah/5", "a set-point without bit 5 is travelled to after the one under way", |t| {
        Axis::positioning(t, |axis, start| {
            let target = start + axis.motion.travel;
            axis.set_point(target, 0)?;
            axis.moves(1, 0)?;
            axis.begin_set_point(start, 0)?;
            axis.order(ENABLE)?;
            let window = axis.window()?;
            axis.until(Duration::from_secs(10), "the first target", |axis| {
                Ok((axis.position()? - target).abs() <= window)
            })?;
            axis.comes_to_rest()?;
            axis.is_near(start, "after both set-points")
        })
    })
    .requires(SET_POINTS),
    drive("402/607Ah/6", "a target without a rising edge of bit 4 moves nothing", |t| {
        Axis::positioning(t, |axis, start| {
            let travel = axis.motion.travel;
            axis.begin_set_point(start + travel / 2, 0)?;
            axis.arrives(start + travel / 2)?;
            axis.comes_to_rest()?;
            axis.set(0x607A, 0, start + travel)?;
            axis.stands("without an edge of bit 4")?;
            axis.order(ENABLE)?;
            axis.stands("with a falling edge of bit 4")?;
            axis.is_near(start + travel / 2, "without a rising edge of bit 4")
        })
    })
    .requires("A set-point is taken with the rising edge of bit 4."),
    drive("402/607Ah/7", "a set-point before OPERATION ENABLED moves nothing, and is not acknowledged", |t| {
        Axis::positioning(t, |axis, start| {
            axis.bring(State::SwitchedOn)?;
            axis.set(0x607A, 0, start + axis.motion.travel)?;
            axis.order(0x07 | control::NEW_SET_POINT)?;
            axis.stands("in SWITCHED ON")?;
            ensure(!axis.acknowledges()?, || "the set-point is acknowledged in SWITCHED ON")?;
            axis.order(0x07)
        })
    })
    .requires("Set-points are taken in OPERATION ENABLED only."),
    drive("402/607Ah/8", "halt interrupts a travel, and its end continues it (bit 8)", |t| {
        Axis::positioning(t, |axis, start| {
            let target = start + axis.motion.travel;
            axis.set_point(target, 0)?;
            axis.moves(1, 0)?;
            axis.order(ENABLE | control::HALT)?;
            axis.comes_to_rest()?;
            let (position, window) = (axis.position()?, axis.window()?);
            ensure(position < target - window, || "the drive goes on to its target while it is halted")?;
            ensure(axis.shows(status::TARGET_REACHED)?, || "bit 10 does not say that the halted drive stands")?;
            axis.order(ENABLE)?;
            axis.until(Duration::from_secs(10), "the target", |axis| Ok((axis.position()? - target).abs() <= window))?;
            axis.arrives(target)
        })
    })
    .requires("Halt interrupts a motion, and without it the motion goes on."),
    drive("402/607Ah/10", "the drive does not run past its target", |t| {
        Axis::positioning(t, |axis, start| {
            let travel = axis.motion.travel;
            axis.set_point(start + travel, 0)?;
            axis.moves(1, 0)?;
            let beyond = axis.travels_to(start + travel)?;
            // A controller may overshoot slightly.
            ensure(beyond <= travel / 4, || format!("in a travel of {travel} the drive is {beyond} beyond its target"))
        })
    })
    .requires("The drive ends a positioning at its target."),
    drive("402/607Dh/1", "a target beyond a limit of 607Dh is not travelled to", |t| {
        t.has(&[0x607D])?;
        Axis::positioning(t, |axis, start| {
            let travel = axis.motion.travel;
            let before = [axis.number(0x607D, 1)?, axis.number(0x607D, 2)?];
            let limits = [start - travel / 2, start + travel / 2];
            axis.bring(State::SwitchOnDisabled)?;
            for (sub, limit) in (1..).zip(limits) {
                axis.set(0x607D, sub, limit)?;
            }
            axis.bring(State::OperationEnabled)?;
            for (target, limit) in [start + travel, start - travel].into_iter().zip([limits[1], limits[0]]) {
                axis.set(0x607A, 0, target)?;
                axis.order(ENABLE)?;
                axis.order(ENABLE | control::NEW_SET_POINT)?;
                axis.t.hear_ms(100)?;
                axis.order(ENABLE)?;
                axis.comes_to_rest()?;
                let (position, window) = (axis.position()?, axis.window()?);
                let kept = (position - start).abs() <= (limit - start).abs() + window;
                ensure(kept, || format!("the drive is at {position}, beyond the limit {limit}"))?;
            }
            axis.bring(State::SwitchOnDisabled)?;
            (1..).zip(before).try_for_each(|(sub, limit)| axis.set(0x607D, sub, limit))
        })
    })
    .requires("Positions beyond the software limits are not travelled to."),
    drive("402/607Eh/1", "bit 7 of 607Eh inverts positions", |t| {
        t.has(&[0x607E])?;
        Axis::positioning(t, |axis, start| {
            let polarity = axis.number(0x607E, 0)?;
            let target = start + axis.motion.travel;
            axis.goes_to(target)?;
            axis.bring(State::SwitchOnDisabled)?;
            axis.set(0x607E, 0, polarity ^ 0x80)?;
            axis.bring(State::OperationEnabled)?;
            let inverted = axis.is_near(-target, "with positions inverted");
            axis.bring(State::SwitchOnDisabled)?;
            axis.set(0x607E, 0, polarity)?;
            inverted
        })
    })
    .requires("Bit 7 of 607Eh multiplies positions by -1."),
    drive("402/6081h/1", "with half of 6081h a travel takes longer", |t| {
        let velocity = t.settings.motion(t.sheet).velocity;
        takes_longer(t, 0x6081, [velocity, velocity / 2])
    })
    .requires("The profile velocity is the velocity of a positioning between its ramps."),
    drive("402/6083h/1", "with a small 6083h a travel takes longer", |t| {
        let [small, large] = Axis::of(t)?.two_ramps(0x6083, 1)?;
        takes_longer(t, 0x6083, [large, small])
    })
    .requires("The profile acceleration is the ramp up of a positioning."),
    drive("402/6084h/1", "with a small 6084h a travel takes longer", |t| {
        let [small, large] = Axis::of(t)?.two_ramps(0x6084, 1)?;
        takes_longer(t, 0x6084, [large, small])
    })
    .requires("The profile deceleration is the ramp down of a positioning."),
    drive("402/6068h/1", "the target is reached no sooner than 6068h after the drive stands", |t| {
        t.has(&[0x6067, 0x6068])?;
        Axis::positioning(t, |axis, start| {
            let target = start + axis.motion.travel;
            axis.set(0x6068, 0, 400)?;
            axis.set_point(target, 0)?;
            axis.moves(1, 0)?;
            let since = axis.comes_to_rest()?;
            axis.arrives(target)?;
            let ms = axis.t.now().since(since).as_micros() / 1000;
            ensure(ms >= 300, || format!("bit 10 comes {ms} ms after the drive stands, and 6068h is 400"))
        })
    })
    .requires("Bit 10 is set once the position has been within the window for the time of 6068h."),
];

/// Checks that a travel takes a third longer with the second value of an object than with the first.
fn takes_longer(t: &mut Tester<'_>, index: u16, values: [i64; 2]) -> Outcome {
    t.has(&[index])?;
    Axis::positioning(t, |axis, start| {
        let before = axis.number(index, 0)?;
        let mut took = [0; 2];
        for ((took, value), to) in took.iter_mut().zip(values).zip([axis.motion.travel, 0]) {
            axis.set(index, 0, value)?;
            let begun = axis.t.now();
            axis.set_point(start + to, 0)?;
            axis.t.hear_ms(50)?;
            axis.arrives(start + to)?;
            *took = axis.t.now().since(begun).as_micros() / 1000;
        }
        axis.set(index, 0, before)?;
        let [fast, slow] = took;
        ensure(3 * slow >= 4 * fast, || {
            format!("{index:04X}h does not matter: {fast} ms with {}, {slow} ms with {}", values[0], values[1])
        })
    })
}
