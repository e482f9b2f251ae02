//! Homing mode, as far as it needs no switch of the machine: homing on the present position, and invalid methods.
//! Methods with a switch or an index pulse are not started, since no data sheet says how far the drive would travel.

use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::{State, control, status};

use crate::axis::{Axis, ENABLE, HOMING};
use crate::case::{Case, drive};
use crate::tester::Tester;
use crate::verdict::{Outcome, ensure, not_applicable};

pub(crate) const CASES: &[Case] = &[
    drive("402/6098h/1", "homing at the present position (35, 37) makes it 607Ch, and is attained", |t| {
        let mut axis = homing(t)?;
        axis.set_if_it_can(0x607C, axis.motion.travel / 2)?;
        let home = if axis.t.has(&[0x607C]).is_ok() { axis.number(0x607C, 0)? } else { 0 };
        for method in methods(&mut axis)? {
            axis.bring(State::SwitchOnDisabled)?;
            axis.set(0x6098, 0, method)?;
            axis.bring(State::OperationEnabled)?;
            axis.order(ENABLE | control::HOMING_OPERATION_START)?;
            let ended = status::HOMING_ATTAINED | status::HOMING_ERROR;
            let mut word = 0;
            axis.until(Duration::from_secs(5), "homing attained (bit 12)", |axis| {
                word = axis.status()?;
                Ok(word & ended != 0)
            })?;
            axis.order(ENABLE)?;
            if word & status::HOMING_ERROR != 0 {
                // Without 60E3h, the methods of a drive can only be tried.
                ensure(axis.t.has(&[0x60E3]).is_err(), || {
                    format!("method {method} of 60E3h leads to an error (bit 13)")
                })?;
                continue;
            }
            axis.until(Duration::from_secs(1), "target reached (bit 10)", |axis| axis.shows(status::TARGET_REACHED))?;
            return axis.is_near(home, "after homing");
        }
        Err(not_applicable("neither 35 nor 37 is a method of the drive"))
    })
    .requires("Methods 35 and 37 make the present position the home position, and move nothing."),
    drive("402/6098h/2", "homing is not attained before it was started", |t| {
        let mut axis = homing(t)?;
        axis.bring(State::OperationEnabled)?;
        axis.order(ENABLE)?;
        axis.stands("in homing mode")?;
        ensure(!axis.shows(status::HOMING_ATTAINED)?, || "homing is attained (bit 12) without having been started")
    })
    .requires("Homing begins with bit 4 of the control word, and bit 12 says that it is attained."),
    drive("402/6098h/3", "a reserved homing method is refused, or leads to an error (bit 13)", |t| {
        let mut axis = homing(t)?;
        for method in [15, 31] {
            if !axis.set_if_it_can(0x6098, method)? {
                continue;
            }
            axis.bring(State::OperationEnabled)?;
            axis.order(ENABLE)?;
            axis.order(ENABLE | control::HOMING_OPERATION_START)?;
            axis.until(Duration::from_secs(1), "a homing error (bit 13)", |axis| axis.shows(status::HOMING_ERROR))?;
            ensure(!axis.shows(status::HOMING_ATTAINED)?, || "a reserved method is attained")?;
            axis.order(ENABLE)?;
            axis.bring(State::SwitchOnDisabled)?;
        }
        Ok(())
    })
    .requires("Methods that are reserved do not home the drive."),
    drive("402/60E3h/1", "6098h takes each method of 60E3h", |t| {
        t.has(&[0x60E3])?;
        let mut axis = homing(t)?;
        for sub in 1..=axis.number(0x60E3, 0)? as u8 {
            let method = axis.number(0x60E3, sub)?;
            if method != 0 {
                axis.set(0x6098, 0, method)?;
                ensure(axis.number(0x6098, 0)? == method, || format!("6098h does not keep method {method}"))?;
            }
        }
        Ok(())
    })
    .requires("60E3h lists the homing methods of the drive."),
];

fn homing<'t, 'a>(t: &'t mut Tester<'a>) -> Outcome<Axis<'t, 'a>> {
    let mut axis = Axis::of(t)?;
    axis.mode(HOMING, &[0x6098, 0x6064])?;
    Ok(axis)
}

/// The methods of 60E3h, or else of 6098h, that make the present position home.
fn methods(axis: &mut Axis<'_, '_>) -> Outcome<Vec<i64>> {
    let mut listed = Vec::new();
    if axis.t.has(&[0x60E3]).is_ok() {
        for sub in 1..=axis.number(0x60E3, 0)? as u8 {
            listed.push(axis.number(0x60E3, sub)?);
        }
    }
    let mut methods = vec![37, 35];
    methods.retain(|method| listed.is_empty() || listed.contains(method));
    let mut taken = Vec::new();
    for method in methods {
        if axis.set_if_it_can(0x6098, method)? {
            taken.push(method);
        }
    }
    Ok(taken)
}
