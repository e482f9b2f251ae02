//! The cyclic modes, and interpolated position mode. Set-points are sent by SDO between two SYNCs, which every drive
//! with these modes can take, and by a synchronous RPDO, as controllers do.

use lexican_eds::model::{Direction, Pdo};
use lexican_runtime::profile::cia402::{State, control, status};
use lexican_runtime::{CobId, Duration};

use crate::axis::{Axis, CYCLIC_POSITION, CYCLIC_VELOCITY, ENABLE, INTERPOLATED_POSITION};
use crate::case::{Case, drive};
use crate::cases::pdo_mapping::{self, has_dynamic_mapping};
use crate::cases::sync::produce_nothing;
use crate::tester::Tester;
use crate::verdict::{Outcome, Verdict, ensure, failed, not_applicable};

const CYCLIC: &str = "In the cyclic synchronous modes the drive follows the target that is valid with each SYNC.";
const INTERPOLATED: &str = "In interpolated position mode the drive follows 60C1h:01 while bit 4 enables it.";

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
            for target in ramp(from, way * travel) {
                axis.set(0x607A, 0, target)?;
                cycle(&mut axis)?;
            }
            ensure(axis.shows(status::SET_POINT_ACKNOWLEDGE)?, || "bit 12 does not say that the drive follows")?;
            has_followed(&mut axis, from + way * travel, way, cycle)?;
        }
        Ok(())
    })
    .requires(CYCLIC),
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
    })
    .requires(CYCLIC),
    drive("402/607Ah/11", "mode 8: the position follows a synchronous RPDO", |t| {
        let (mut axis, rpdo) = by_rpdo(t, CYCLIC_POSITION, TARGET_POSITION)?;
        for way in [1, -1] {
            let from = axis.position()?;
            for target in ramp(from, way * axis.motion.travel) {
                rpdo.cycle(&mut axis, target, true)?;
            }
            let target = from + way * axis.motion.travel;
            has_followed(&mut axis, target, way, |axis| rpdo.cycle(axis, target, true))?;
        }
        Ok(())
    })
    .requires(CYCLIC),
    drive("402/607Ah/12", "mode 8: a synchronous RPDO moves nothing without SYNC", |t| {
        let (mut axis, rpdo) = by_rpdo(t, CYCLIC_POSITION, TARGET_POSITION)?;
        let from = axis.position()?;
        for target in ramp(from, axis.motion.travel) {
            rpdo.cycle(&mut axis, target, false)?;
        }
        axis.is_near(from, "without SYNC")
    })
    .requires(CYCLIC),
    drive("402/60FFh/6", "mode 9: the velocity follows a synchronous RPDO", |t| {
        let (mut axis, rpdo) = by_rpdo(t, CYCLIC_VELOCITY, TARGET_VELOCITY)?;
        for target in [axis.motion.velocity, -axis.motion.velocity] {
            let by = turns_by(&mut axis, &rpdo, target, true)?;
            let right = by * target.signum() > axis.noise();
            if !right && by * target >= 0 {
                let from = axis.position()?;
                for _ in 0..4 {
                    turns_by(&mut axis, &rpdo, target, true)?;
                }
                if (axis.position()? - from) * target > 0 {
                    return Err(axis.is_too_slow());
                }
            }
            ensure(right, || format!("with 60FFh = {target} by RPDO the position changes by {by}"))?;
        }
        Ok(())
    })
    .requires(CYCLIC),
    drive("402/60FFh/7", "mode 9: a synchronous RPDO turns nothing without SYNC", |t| {
        let (mut axis, rpdo) = by_rpdo(t, CYCLIC_VELOCITY, TARGET_VELOCITY)?;
        let velocity = axis.motion.velocity;
        let by = turns_by(&mut axis, &rpdo, velocity, false)?;
        ensure(by.abs() <= axis.noise(), || format!("without SYNC the position changes by {by}"))
    })
    .requires(CYCLIC),
    drive("402/60C1h/1", "mode 7: while bit 4 is set, the position follows 60C1h:01 with SYNC", |t| {
        let (mut axis, start) = interpolated(t)?;
        axis.order(ENABLE | control::NEW_SET_POINT)?;
        let target = start + axis.motion.travel;
        let step = |axis: &mut Axis<'_, '_>, set_point| {
            axis.set(INTERPOLATION_DATA, 1, set_point)?;
            cycle(axis)
        };
        ramp(start, axis.motion.travel).try_for_each(|set_point| step(&mut axis, set_point))?;
        has_followed(&mut axis, target, 1, |axis| step(axis, target))
    })
    .requires(INTERPOLATED),
    drive("402/60C1h/2", "mode 7: without bit 4, 60C1h:01 moves nothing", |t| {
        let (mut axis, start) = interpolated(t)?;
        for set_point in ramp(start, axis.motion.travel) {
            axis.set(INTERPOLATION_DATA, 1, set_point)?;
            cycle(&mut axis)?;
        }
        axis.is_near(start, "without bit 4")
    })
    .requires(INTERPOLATED),
];

const INTERPOLATION_DATA: u16 = 0x60C1;
const TARGET_POSITION: u16 = 0x607A;
const TARGET_VELOCITY: u16 = 0x60FF;

/// The time between two set-points.
const CYCLE: Duration = Duration::from_millis(10);

/// Selects a cyclic mode and, where 60C2h can be written, sets its period to 10 ms.
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

/// Interpolated position mode in OPERATION ENABLED, with the present position as set-point. Returns that position.
fn interpolated<'t, 'a>(t: &'t mut Tester<'a>) -> Outcome<(Axis<'t, 'a>, i64)> {
    if !t.entry(INTERPOLATION_DATA, 1)?.access.writable() {
        return Err(not_applicable("60C1h:01 cannot be written by SDO"));
    }
    if t.entry(0x60C4, 1).is_ok() && t.read(0x60C4, 1)? != 0 {
        return Err(not_applicable("60C4h:01 has room for set-points: they go through a buffer"));
    }
    let mut axis = cyclic(t, INTERPOLATED_POSITION, &[INTERPOLATION_DATA, 0x6064])?;
    let start = axis.position()?;
    axis.set(INTERPOLATION_DATA, 1, start)?;
    cycle(&mut axis)?;
    axis.bring(State::OperationEnabled)?;
    cycle(&mut axis)?;
    Ok((axis, start))
}

/// A synchronous RPDO with set-points, and at most the control word besides.
struct SetPoints {
    id: CobId,
    /// Its objects, each with its length in bytes.
    mapping: Vec<(u16, usize)>,
}

/// A cyclic mode in OPERATION ENABLED, with set-points by RPDO. No SYNC has come since.
fn by_rpdo<'t, 'a>(t: &'t mut Tester<'a>, mode: i8, target: u16) -> Outcome<(Axis<'t, 'a>, SetPoints)> {
    produce_nothing(t)?;
    let rpdo = SetPoints::of(t, target)?;
    let mut axis = cyclic(t, mode, &[target, 0x6064])?;
    if target == TARGET_POSITION {
        let here = axis.position()?;
        axis.set(target, 0, here)?;
    }
    cycle(&mut axis)?;
    axis.bring(State::OperationEnabled)?;
    Ok((axis, rpdo))
}

impl SetPoints {
    /// Configures an RPDO that has the object in the data sheet, or else one into which it can be mapped.
    fn of(t: &mut Tester<'_>, object: u16) -> Outcome<Self> {
        let entry = t.entry(object, 0)?;
        if !entry.pdo_mapping {
            return Err(not_applicable(format!("{object:04X}h cannot be mapped")));
        }
        let rpdos: Vec<Pdo> =
            t.sheet.device.pdos.iter().filter(|pdo| pdo.direction == Direction::Receive).cloned().collect();
        let has_it = |pdo: &&Pdo| {
            let mut mapped = pdo.mapping.iter().map(|mapped| mapped.index);
            mapped.clone().any(|index| index == object) && mapped.all(|index| index == object || index == 0x6040)
        };
        // The RPDO with only the control word is kept for orders.
        let is_free =
            |pdo: &&Pdo| has_dynamic_mapping(t, pdo) && !pdo.mapping.iter().all(|mapped| mapped.index == 0x6040);
        let pdo = rpdos.iter().find(has_it).or_else(|| rpdos.iter().find(is_free));
        let pdo =
            pdo.ok_or_else(|| not_applicable(format!("no RPDO has {object:04X}h, or a mapping that can be written")))?;
        let index = 0x13FF + pdo.number;
        let cob_id = t.read(index, 1)? as u32;
        let id = CobId::from_parameter(cob_id);
        if id.is_restricted() {
            return Err(not_applicable(format!("RPDO {} has no identifier", pdo.number)));
        }
        let mapping = if has_it(&pdo) {
            pdo_mapping::switch_off(t, pdo)?;
            pdo.mapping.iter().map(|mapped| (mapped.index, usize::from(mapped.bits / 8))).collect()
        } else {
            let parameter = pdo_mapping::parameter(t, &entry);
            let answer = pdo_mapping::map(t, pdo, &[parameter])?;
            answer.map_err(|code| failed(format!("{object:04X}h is not mapped into RPDO {}: {code}", pdo.number)))?;
            vec![(object, usize::from(t.bits(&entry).unwrap_or(32) / 8))]
        };
        if t.entry(index, 2)?.access.writable() {
            let answer = t.try_write(index, 2, 1)?;
            answer.map_err(|code| not_applicable(format!("RPDO {} is not synchronous: {code}", pdo.number)))?;
        } else if t.read(index, 2)? > 240 {
            return Err(not_applicable(format!("RPDO {} is not synchronous", pdo.number)));
        }
        t.write(index, 1, cob_id & !(1 << 31))?;
        Ok(SetPoints { id, mapping })
    }

    /// Sends a set-point, with or without SYNC, and waits for the end of the cycle.
    fn cycle(&self, axis: &mut Axis<'_, '_>, target: i64, with_sync: bool) -> Outcome {
        let end = axis.t.now() + CYCLE;
        let value = |object: u16| if object == 0x6040 { i64::from(ENABLE) } else { target };
        let bytes = self.mapping.iter().flat_map(|&(object, len)| value(object).to_le_bytes().into_iter().take(len));
        axis.t.send(self.id, &bytes.collect::<Vec<u8>>())?;
        if with_sync {
            axis.t.sync(None)?;
        }
        let left = end.since(axis.t.now());
        axis.t.hear(left).map(|_| ())
    }
}

/// Set-points from a position to `by` away from it, in 50 cycles.
fn ramp(from: i64, by: i64) -> impl Iterator<Item = i64> {
    (1..=50).map(move |step| from + by * step / 50)
}

/// Checks that the position is at the end of a ramp. A drive still on its way counts as too slow.
fn has_followed(
    axis: &mut Axis<'_, '_>,
    target: i64,
    way: i64,
    cycle: impl Fn(&mut Axis<'_, '_>) -> Outcome,
) -> Outcome {
    (0..5).try_for_each(|_| cycle(axis))?;
    let is_near = axis.is_near(target, "after 50 cycles");
    let before = axis.position()?;
    if matches!(is_near, Err(Verdict::Failed(_))) && (target - before) * way > 0 {
        (0..20).try_for_each(|_| cycle(axis))?;
        if (axis.position()? - before) * way > axis.noise() {
            return Err(axis.is_too_slow());
        }
    }
    is_near
}

/// How much the position changes in 50 cycles at a velocity.
fn turns_by(axis: &mut Axis<'_, '_>, rpdo: &SetPoints, velocity: i64, with_sync: bool) -> Outcome<i64> {
    let before = axis.position()?;
    for _ in 0..50 {
        rpdo.cycle(axis, velocity, with_sync)?;
    }
    Ok(axis.position()? - before)
}

pub(super) fn cycle(axis: &mut Axis<'_, '_>) -> Outcome {
    axis.t.sync(None)?;
    axis.t.hear_ms(9).map(|_| ())
}
