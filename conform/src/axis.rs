//! A drive of CiA 402 for the cases: orders and reports. Orders are sent by the RPDO that has only the control word, as
//! controllers do, or else by SDO.

use lexican_eds::model::{Direction, Value};
use lexican_eds::types::DataType;
use lexican_runtime::profile::cia402::{Cause, Command, State, Transitions, control, status};
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Instant};

use crate::sdo;
use crate::tester::{Motion, Tester};
use crate::verdict::{Outcome, Verdict, ensure, failed, not_applicable};

/// How long a change of state may take, including switching the power on.
const REACTION: Duration = Duration::from_secs(3);

/// How long a motion may take.
const TRAVEL: Duration = Duration::from_secs(10);

/// How often the drive is read: first often, later less.
const LOOK_MS: u64 = 5;
const LATER_MS: u64 = 50;

/// How long a state has to last to count as one that the drive stays in.
const STAYS_MS: u64 = 150;

/// A drive that takes longer for 1/50 of its travel is too slow for the test.
const SLOW: Duration = Duration::from_millis(500);

/// After this time without a change of position, the drive stands.
const QUIET: Duration = Duration::from_millis(100);

pub(crate) const PROFILE_POSITION: i8 = 1;
pub(crate) const PROFILE_VELOCITY: i8 = 3;
pub(crate) const HOMING: i8 = 6;
pub(crate) const INTERPOLATED_POSITION: i8 = 7;
pub(crate) const CYCLIC_POSITION: i8 = 8;
pub(crate) const CYCLIC_VELOCITY: i8 = 9;

/// Bits 0 to 3 of "enable operation".
pub(crate) const ENABLE: u16 = 0x0F;

/// The drive under test, in NMT OPERATIONAL.
pub(crate) struct Axis<'t, 'a> {
    pub(crate) t: &'t mut Tester<'a>,
    /// The RPDO that has only the control word.
    control: Option<CobId>,
    pub(crate) motion: Motion,
    /// The position before the first travel.
    start: Option<i64>,
}

impl<'t, 'a> Axis<'t, 'a> {
    /// The drive, with targets by which it stays in place when it is enabled in any mode.
    pub(crate) fn of(t: &'t mut Tester<'a>) -> Outcome<Self> {
        t.has(&[0x6040, 0x6041])?;
        let control = control_pdo(t);
        t.enter(NmtState::Operational)?;
        let motion = t.settings.motion(t.sheet);
        let mut axis = Axis { t, control, motion, start: None };
        for target in [0x6042, 0x6071, 0x60FF] {
            axis.set_if_it_can(target, 0)?;
        }
        // A cyclic mode follows its target at once, so that is set to the present position.
        if axis.t.has(&[0x6064, 0x607A]).is_ok() {
            let here = axis.position()?;
            axis.set_if_it_can(0x607A, here)?;
        }
        Ok(axis)
    }

    /// Checks that 1000h names the kind of drive. A device without a kind has the number of the profile, but follows
    /// only parts of it.
    pub(crate) fn names_its_kind(&mut self) -> Outcome {
        let device_type = self.t.read(0x1000, 0)?;
        if device_type >> 16 & 0xFF == 0 {
            return Err(not_applicable(format!("1000h ({device_type:X}h) names no kind of drive in bits 16 to 23")));
        }
        Ok(())
    }

    // Objects.

    /// The number in an object, signed if its type is.
    pub(crate) fn number(&mut self, index: u16, sub: u8) -> Outcome<i64> {
        let bytes = self.t.read_bytes(index, sub)?;
        let raw = sdo::number(&bytes);
        let is_signed = self.t.entry(index, sub).is_ok_and(|entry| {
            matches!(entry.data_type, DataType::Integer8 | DataType::Integer16 | DataType::Integer32)
        });
        let unused = 64_u32.saturating_sub(8 * bytes.len() as u32);
        Ok(if is_signed { (raw << unused) as i64 >> unused } else { raw as i64 })
    }

    pub(crate) fn set(&mut self, index: u16, sub: u8, value: i64) -> Outcome {
        self.t.write(index, sub, value as u32)
    }

    /// Writes a value if the object exists. Returns whether the device took it.
    pub(crate) fn set_if_it_can(&mut self, index: u16, value: i64) -> Outcome<bool> {
        let writable = self.t.entry(index, 0).is_ok_and(|entry| entry.access.writable());
        Ok(writable && self.t.try_write(index, 0, value as u32)?.is_ok())
    }

    /// The values of an option code that the drive accepts.
    pub(crate) fn options(&mut self, index: u16, codes: std::ops::RangeInclusive<i64>) -> Outcome<Vec<i64>> {
        self.t.has(&[index])?;
        let mut taken = Vec::new();
        for code in codes {
            if self.set_if_it_can(index, code)? {
                taken.push(code);
            }
        }
        if taken.is_empty() { Err(not_applicable(format!("{index:04X}h takes no value"))) } else { Ok(taken) }
    }

    // The state.

    pub(crate) fn order(&mut self, word: u16) -> Outcome {
        match self.control {
            Some(id) => {
                self.t.send(id, &word.to_le_bytes())?;
                // Waits, so that no SDO overtakes it.
                self.t.hear_ms(2).map(|_| ())
            }
            None => self.order_by_sdo(word),
        }
    }

    pub(crate) fn order_by_sdo(&mut self, word: u16) -> Outcome {
        self.t.write(0x6040, 0, word.into())
    }

    /// Checks that there is an RPDO for orders.
    pub(crate) fn has_control_pdo(&self) -> Outcome {
        let lacks = || not_applicable("no RPDO has the control word and nothing else, and takes effect at once");
        self.control.map(|_| ()).ok_or_else(lacks)
    }

    pub(crate) fn status(&mut self) -> Outcome<u16> {
        Ok(self.t.read(0x6041, 0)? as u16)
    }

    pub(crate) fn state(&mut self) -> Outcome<State> {
        let word = self.status()?;
        State::from_status_word(word).ok_or_else(|| failed(format!("status word {word:04X}h is that of no state")))
    }

    /// Reads the drive until something holds.
    pub(crate) fn until(
        &mut self,
        within: Duration,
        what: &str,
        mut holds: impl FnMut(&mut Self) -> Outcome<bool>,
    ) -> Outcome {
        let begun = self.t.now();
        while !holds(self)? {
            let passed = self.t.now().since(begun);
            if passed > within {
                let (word, ms) = (self.status()?, within.as_micros() / 1000);
                return Err(failed(format!("{what} does not come within {ms} ms; the status word is {word:04X}h")));
            }
            self.t.hear_ms(if passed < QUIET.times(3) { LOOK_MS } else { LATER_MS })?;
        }
        Ok(())
    }

    pub(crate) fn reaches(&mut self, states: &[State]) -> Outcome<State> {
        let mut reached = State::NotReadyToSwitchOn;
        let names: Vec<_> = states.iter().map(State::to_string).collect();
        self.until(REACTION, &names.join(" or "), |axis| {
            reached = axis.state()?;
            Ok(states.contains(&reached))
        })?;
        Ok(reached)
    }

    /// Checks that a control word leads to one of these states.
    pub(crate) fn leads_to(&mut self, word: u16, states: &[State]) -> Outcome<State> {
        let from = self.state()?;
        self.order(word)?;
        self.reaches(states).map_err(|verdict| match verdict {
            Verdict::Failed(why) => failed(format!("control word {word:04X}h in {from}: {why}")),
            other => other,
        })
    }

    /// Checks that the drive stays in a state.
    pub(crate) fn stays(&mut self, state: State, after: &str) -> Outcome {
        let end = self.t.now() + Duration::from_millis(STAYS_MS);
        while self.t.now() < end {
            let now = self.state()?;
            ensure(now == state, || format!("{after} in {state} leads to {now}"))?;
            self.t.hear_ms(LOOK_MS)?;
        }
        Ok(())
    }

    /// Checks that the drive stays in `state` after a control word.
    pub(crate) fn ignores(&mut self, word: u16, state: State) -> Outcome {
        self.order(word)?;
        self.stays(state, &format!("control word {word:04X}h"))
    }

    /// Leads the drive into a state by commands of CiA 402-2.
    pub(crate) fn bring(&mut self, target: State) -> Outcome {
        loop {
            let state = self.state()?;
            if state == target {
                return Ok(());
            }
            // Not every drive can go on after a quick stop, except to SWITCH ON DISABLED.
            let leaves = state == State::QuickStopActive;
            let next = Transitions::CIA_402.next(state, target);
            match next.map(|arrow| (arrow.to, arrow.cause)) {
                _ if leaves => _ = self.leads_to(0, &[State::SwitchOnDisabled])?,
                Some((to, Cause::Command(command))) => {
                    if command == Command::FaultReset {
                        self.order(0)?;
                    }
                    self.leads_to(command.apply(0), &[to])?;
                }
                Some((to, Cause::Internal)) => _ = self.reaches(&[to])?,
                None => return Err(failed(format!("{target} cannot be commanded in {state}"))),
            }
        }
    }

    /// Leads the drive to a QUICK STOP ACTIVE that lasts; chooses that by 605Ah, if the drive has it.
    pub(crate) fn bring_to_quick_stop(&mut self) -> Outcome {
        let stays = self.set_if_it_can(0x605A, 6)? || self.set_if_it_can(0x605A, 5)?;
        self.enable()?;
        let states = [State::QuickStopActive, State::SwitchOnDisabled];
        let reached = self.leads_to(Command::QuickStop.apply(0), &states)?;
        if stays || reached == State::QuickStopActive {
            self.t.hear_ms(STAYS_MS)?;
        }
        match self.state()? {
            State::QuickStopActive => Ok(()),
            state if stays => Err(failed(format!("605Ah has the drive stay in QUICK STOP ACTIVE, it is in {state}"))),
            _ => Err(not_applicable("the drive leaves QUICK STOP ACTIVE by itself, and 605Ah cannot change that")),
        }
    }

    // Modes.

    /// Chooses a mode, if the device has these objects.
    pub(crate) fn mode(&mut self, mode: i8, objects: &[u16]) -> Outcome {
        self.t.has(&[0x6060, 0x6061])?;
        self.t.has(objects)?;
        let listed = self.modes()?;
        if listed.is_some_and(|modes| modes >> (mode - 1) & 1 == 0) {
            let modes = listed.unwrap_or_default();
            return Err(not_applicable(format!("6502h ({modes:X}h) does not have mode {mode}")));
        }
        match self.t.try_write(0x6060, 0, mode as u32)? {
            Ok(()) => {}
            Err(code) if listed.is_some() => {
                return Err(failed(format!("6502h has mode {mode}, and 6060h refuses it: {code}")));
            }
            Err(code) => return Err(not_applicable(format!("6060h refuses mode {mode}: {code}"))),
        }
        let shows = |axis: &mut Self| Ok(axis.number(0x6061, 0)? == i64::from(mode));
        self.until(REACTION, &format!("mode {mode} in 6061h"), shows)
    }

    /// The modes in 6502h, if the drive lists any.
    pub(crate) fn modes(&mut self) -> Outcome<Option<u64>> {
        if self.t.has(&[0x6502]).is_err() {
            return Ok(None);
        }
        Ok(Some(self.t.read(0x6502, 0)?).filter(|modes| *modes != 0))
    }

    /// Leads the drive to OPERATION ENABLED, in a mode that starts nothing by itself, if it has one.
    pub(crate) fn enable(&mut self) -> Outcome {
        for mode in [PROFILE_POSITION, PROFILE_VELOCITY] {
            match self.mode(mode, &[]) {
                Err(Verdict::NotApplicable(_)) => {}
                other => {
                    other?;
                    break;
                }
            }
        }
        self.bring(State::OperationEnabled)
    }

    // Motion.

    pub(crate) fn position(&mut self) -> Outcome<i64> {
        self.t.has(&[0x6064])?;
        self.number(0x6064, 0)
    }

    /// How much the position of a standing drive may vary.
    pub(crate) fn noise(&self) -> i64 {
        (self.motion.travel / 50).max(1)
    }

    /// How far from its target the drive may be when it has arrived.
    pub(crate) fn window(&mut self) -> Outcome<i64> {
        let window = if self.t.has(&[0x6067]).is_ok() { self.number(0x6067, 0)? } else { 0 };
        // FFFF FFFFh switches the window off.
        let window = if window == i64::from(u32::MAX) { 0 } else { window };
        Ok(window.min(self.motion.travel / 4).max(self.noise()))
    }

    pub(crate) fn is_near(&mut self, target: i64, what: &str) -> Outcome {
        let (position, window) = (self.position()?, self.window()?);
        let right = (position - target).abs() <= window;
        ensure(right, || format!("{what}: the position is {position}, {target} was expected, give or take {window}"))
    }

    /// Waits until the position does not change any more, and returns since when.
    pub(crate) fn comes_to_rest(&mut self) -> Outcome<Instant> {
        let (mut at, mut since) = (self.position()?, self.t.now());
        let noise = self.noise();
        self.until(TRAVEL, "rest", |axis| {
            let position = axis.position()?;
            if (position - at).abs() > noise {
                (at, since) = (position, axis.t.now());
            }
            Ok(since + QUIET <= axis.t.now())
        })?;
        Ok(since)
    }

    pub(crate) fn stands(&mut self, when: &str) -> Outcome {
        let before = self.position()?;
        self.t.hear_ms(STAYS_MS)?;
        let (after, noise) = (self.position()?, self.noise());
        ensure((after - before).abs() <= noise, || format!("the drive moves {when}: from {before} to {after}"))
    }

    /// Waits until the drive has moved by `by` in a direction.
    pub(crate) fn moves(&mut self, direction: i64, by: i64) -> Outcome {
        let (before, by) = (self.position()?, by.max(self.noise() + 1));
        let way = if direction < 0 { "a move in negative direction" } else { "a move in positive direction" };
        let begun = self.t.now();
        self.until(REACTION, way, |axis| Ok((axis.position()? - before) * direction.signum() >= by))?;
        if self.t.now().since(begun) > SLOW { Err(self.is_too_slow()) } else { Ok(()) }
    }

    /// Measurements of such a slow motion mean nothing.
    pub(crate) fn is_too_slow(&self) -> Verdict {
        let Motion { travel, velocity } = self.motion;
        not_applicable(format!(
            "the drive is too slow with a travel of {travel} and a velocity of {velocity}: set --velocity"
        ))
    }

    /// Whether the position changes in a direction, even if slowly.
    pub(crate) fn creeps(&mut self, direction: i64) -> Outcome<bool> {
        let before = self.position()?;
        self.t.hear(SLOW.times(4))?;
        Ok((self.position()? - before) * direction > 0)
    }

    /// Enters profile position mode, enabled, with the velocity of the test.
    pub(crate) fn positions(&mut self) -> Outcome {
        self.mode(PROFILE_POSITION, &[0x6064, 0x607A])?;
        self.set_if_it_can(0x6081, self.motion.velocity)?;
        self.bring(State::OperationEnabled)?;
        if self.start.is_none() {
            self.start = Some(self.position()?);
        }
        Ok(())
    }

    /// Runs `check` in profile position mode, and moves back to the start.
    pub(crate) fn positioning(t: &'t mut Tester<'a>, check: impl FnOnce(&mut Self, i64) -> Outcome) -> Outcome {
        let mut axis = Axis::of(t)?;
        axis.positions()?;
        let start = axis.position()?;
        check(&mut axis, start)?;
        axis.bring(State::OperationEnabled)?;
        axis.order(ENABLE)?;
        axis.goes_to(start)
    }

    /// Gives a set-point by its handshake: bit 4 is set, bit 12 follows; bit 4 is cleared, bit 12 follows. `bits` are
    /// further bits of the control word.
    pub(crate) fn set_point(&mut self, target: i64, bits: u16) -> Outcome {
        self.begin_set_point(target, bits)?;
        self.order(ENABLE | bits)?;
        self.until(REACTION, "the end of the set-point acknowledge", |axis| Ok(!axis.acknowledges()?))
    }

    /// Does the first half of the handshake.
    pub(crate) fn begin_set_point(&mut self, target: i64, bits: u16) -> Outcome {
        self.set(0x607A, 0, target)?;
        self.order(ENABLE | bits)?;
        self.order(ENABLE | bits | control::NEW_SET_POINT)?;
        self.until(REACTION, "the set-point acknowledge", Self::acknowledges)
    }

    pub(crate) fn acknowledges(&mut self) -> Outcome<bool> {
        self.shows(status::SET_POINT_ACKNOWLEDGE)
    }

    pub(crate) fn shows(&mut self, bits: u16) -> Outcome<bool> {
        Ok(self.status()? & bits == bits)
    }

    /// Waits for bit 10, target reached.
    pub(crate) fn arrives(&mut self, target: i64) -> Outcome {
        self.travels_to(target).map(|_| ())
    }

    /// Waits for bit 10, and returns the largest distance beyond the target. Ends early if the drive runs on.
    pub(crate) fn travels_to(&mut self, target: i64) -> Outcome<i64> {
        let way = target - self.position()?;
        let too_far = self.motion.travel.max(way.abs()) + self.window()?;
        let (mut left, mut beyond) = (way, 0);
        let arrived = self.until(TRAVEL, "target reached (bit 10)", |axis| {
            left = target - axis.position()?;
            beyond = beyond.max(-left * way.signum());
            Ok(left.abs() > too_far || axis.shows(status::TARGET_REACHED)?)
        });
        ensure(left.abs() <= too_far, || {
            format!("the drive runs on: the position is {}, the target {target}", target - left)
        })?;
        match arrived {
            // The drive is still on its way to the target.
            Err(Verdict::Failed(_)) if left * way > 0 && self.creeps(way)? => Err(self.is_too_slow()),
            other => other.map(|()| beyond),
        }
    }

    pub(crate) fn goes_to(&mut self, target: i64) -> Outcome {
        self.set_point(target, 0)?;
        self.arrives(target)?;
        self.comes_to_rest()?;
        self.is_near(target, "after a travel")
    }

    /// Starts a motion, away from or back to where the case began. Returns the target, if there is one.
    pub(crate) fn sets_off(&mut self) -> Outcome<Option<i64>> {
        match self.positions_from_here() {
            Err(Verdict::NotApplicable(_)) => {}
            other => return other.map(Some),
        }
        self.mode(PROFILE_VELOCITY, &[0x60FF])?;
        self.bring(State::OperationEnabled)?;
        self.order(ENABLE)?;
        self.set(0x60FF, 0, self.motion.velocity)?;
        self.moves(1, 0)?;
        Ok(None)
    }

    fn positions_from_here(&mut self) -> Outcome<i64> {
        self.positions()?;
        let here = self.position()?;
        let direction = if self.start.is_some_and(|start| here > start + self.noise()) { -1 } else { 1 };
        let target = here + direction * self.motion.travel;
        self.set_point(target, 0)?;
        self.moves(direction, 0)?;
        Ok(target)
    }

    /// Stops the drive while it moves, and checks that it comes to rest short of its target. Returns how long that
    /// took.
    pub(crate) fn stops(&mut self, stop: impl FnOnce(&mut Self) -> Outcome) -> Outcome<Duration> {
        let target = self.sets_off()?;
        let begun = self.t.now();
        stop(self)?;
        let since = self.comes_to_rest()?;
        if let Some(target) = target {
            let (position, window) = (self.position()?, self.window()?);
            let short = (position - target).abs() > window;
            ensure(short, || {
                format!("the drive goes on to its target {target}; or --travel is too short for its ramps")
            })?;
        }
        Ok(since.since(begun))
    }

    /// Checks which ramp a stop has: 6084h, or 6083h without it; or 6085h.
    pub(crate) fn brakes_with(&mut self, ramp: Ramp, mut stop: impl FnMut(&mut Self) -> Outcome) -> Outcome {
        let slow_down = if self.t.has(&[0x6084]).is_ok() { 0x6084 } else { 0x6083 };
        let (own, other) = match ramp {
            Ramp::SlowDown => (slow_down, 0x6085),
            Ramp::QuickStop => (0x6085, slow_down),
        };
        let mut took = [Duration::ZERO; 2];
        // They take half a second and a twentieth of one, if velocities and accelerations have the same unit.
        let [gentle, hard] = self.two_ramps(own, 2)?;
        let others = self.two_ramps(other, 2).unwrap_or([hard, gentle]);
        for (took, (own_ramp, other_ramp)) in took.iter_mut().zip([(gentle, others[1]), (hard, others[0])]) {
            self.set(own, 0, own_ramp)?;
            self.set_if_it_can(other, other_ramp)?;
            *took = self.stops(&mut stop)?;
        }
        let [gentle, hard] = took.map(|took| took.as_micros() / 1000);
        ensure(gentle >= 2 * hard, || {
            format!(
                "{own:04X}h does not matter: the drive stops in {gentle} ms with a small one, in {hard} ms with a large one"
            )
        })
    }

    /// Two values of a ramp, as far as the limits of the data sheet allow: a small one, which brings the drive to rest
    /// within a second divided by `steepness`, and a large one.
    pub(crate) fn two_ramps(&self, index: u16, steepness: i64) -> Outcome<[i64; 2]> {
        let entry = self.t.entry(index, 0)?;
        let limit = |value: &Option<Value>, otherwise| {
            let number = value.as_ref().and_then(Value::as_integer).and_then(|number| i64::try_from(number).ok());
            number.unwrap_or(otherwise)
        };
        let (low, high) = (limit(&entry.low, 1).max(1), limit(&entry.high, i64::MAX));
        let [small, large] = [steepness, 20].map(|factor| (factor * self.motion.velocity).min(high).max(low));
        let (least, enough) = (small * 4, large >= small * 4);
        if enough { Ok([small, large]) } else { Err(not_applicable(format!("{index:04X}h cannot be {least}"))) }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ramp {
    SlowDown,
    QuickStop,
}

/// The RPDO of the data sheet that has only the control word, and takes effect at once.
fn control_pdo(t: &Tester<'_>) -> Option<CobId> {
    let is_it = |pdo: &&lexican_eds::model::Pdo| {
        let mapped: Vec<_> = pdo.mapping.iter().map(|mapped| (mapped.index, mapped.sub)).collect();
        pdo.direction == Direction::Receive && mapped == [(0x6040, 0)] && pdo.transmission_type >= Some(254)
    };
    let pdo = t.sheet.device.pdos.iter().find(is_it)?;
    let cob_id = match pdo.cob_id.as_ref()? {
        Value::NodeIdPlus(base) => (*base as u32).wrapping_add(t.node.get().into()),
        other => other.as_integer()? as u32,
    };
    (cob_id >> 31 == 0).then(|| CobId::from_parameter(cob_id))
}

/// Disables a drive, and waits until it stands.
pub(crate) fn make_safe(t: &mut Tester<'_>) -> Result<(), String> {
    // Repeated, since the drive may be booting and not answer yet.
    let mut last = String::new();
    for _ in 0..5 {
        match disables(t) {
            Ok(()) | Err(Verdict::NotApplicable(_)) => return Ok(()),
            Err(verdict) => last = verdict.reason(),
        }
    }
    Err(last)
}

fn disables(t: &mut Tester<'_>) -> Outcome {
    t.has(&[0x6040, 0x6041])?;
    t.hear_ms(QUIET.as_micros() / 1000)?;
    t.enter(NmtState::Operational)?;
    let control = control_pdo(t);
    let motion = t.settings.motion(t.sheet);
    let mut axis = Axis { t, control, motion, start: None };
    axis.order(0)?;
    if control.is_some() && axis.t.entry(0x6040, 0).is_ok_and(|entry| entry.access.writable()) {
        // The state shows whether it was taken.
        let _ = axis.t.try_write(0x6040, 0, 0)?;
    }
    axis.until(REACTION, "a state without torque", |axis| {
        let state = axis.state()?;
        Ok(!matches!(state, State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive))
    })?;
    if axis.t.has(&[0x6064]).is_ok() {
        return axis.comes_to_rest().map(|_| ());
    }
    let shown = [0x606C, 0x6044].into_iter().find(|index| axis.t.has(&[*index]).is_ok());
    let index =
        shown.ok_or_else(|| not_applicable("neither a position nor a velocity shows whether the drive stands"))?;
    axis.until(TRAVEL, "a velocity of 0", |axis| Ok(axis.number(index, 0)?.abs() <= axis.motion.velocity / 50))
}
