//! 3.1 to 3.20: the parameters of PDOs, and when PDOs are sent in each NMT state.

use lexican_eds::model::{Direction, Pdo, Value};
use lexican_runtime::CobId;
use lexican_runtime::wire::nmt::NmtState;

use super::sync::{produce_nothing, without_period};
use crate::answers;
use crate::case::{Case, case};
use crate::tester::{InputStimulus, Tester};
use crate::verdict::{Outcome, Verdict, ensure, failed, not_applicable};

const STOPPED: &str = "In STOPPED a device sends no PDO.";
const PRE_OPERATIONAL: &str = "In PRE-OPERATIONAL a device sends no PDO.";

pub(crate) const CASES: &[Case] = &[
    case("301/7.5.2.35/1", "3.1", "the parameters of RPDOs are read", |t| are_read(t, 0x1400..=0x15FF))
        .requires("The communication parameters of an RPDO can be read, and are those of the data sheet."),
    case("301/7.5.2.37/1", "3.2", "the parameters of TPDOs are read", |t| are_read(t, 0x1800..=0x19FF))
        .requires("The communication parameters of a TPDO can be read, and are those of the data sheet."),
    case("301/7.2.2.3/1", "3.3", "OPERATIONAL: a remote frame asks for a TPDO", |t| remote(t, NmtState::Operational))
        .requires("In OPERATIONAL a TPDO that allows remote frames answers them."),
    case("301/7.2.2.3/2", "3.4", "OPERATIONAL: an event sends a TPDO", |t| event(t, NmtState::Operational))
        .requires("In OPERATIONAL an event-driven TPDO (254, 255) is sent when what it maps changes."),
    case("301/7.2.2.3/3", "3.5", "OPERATIONAL: the event timer sends a TPDO", |t| timer(t, NmtState::Operational))
        .requires("In OPERATIONAL an event-driven TPDO is sent whenever its event timer has elapsed."),
    case("301/7.2.2.2/1", "3.6", "OPERATIONAL: every third SYNC sends a TPDO", |t| cyclic(t, NmtState::Operational))
        .requires("A TPDO with transmission type n is sent with every nth SYNC (1 to 240)."),
    case("301/7.2.2.2/2", "3.7", "OPERATIONAL: the SYNC after an event sends a TPDO", |t| {
        acyclic(t, NmtState::Operational)
    })
    .requires("A TPDO with transmission type 0 is sent with the SYNC that follows an event."),
    case("301/7.5.2.37/2", "3.8", "OPERATIONAL: counting begins with the SYNC start value", |t| {
        sync_start(t, NmtState::Operational)
    })
    .requires("With a SYNC start value, a TPDO counts from the SYNC whose counter has that value."),
    case("301/7.3.2.2.4/1", "3.9", "STOPPED: a remote frame asks in vain", |t| remote(t, NmtState::Stopped))
        .requires(STOPPED),
    case("301/7.3.2.2.4/2", "3.10", "STOPPED: an event sends nothing", |t| event(t, NmtState::Stopped))
        .requires(STOPPED),
    case("301/7.3.2.2.4/3", "3.11", "STOPPED: the event timer sends nothing", |t| timer(t, NmtState::Stopped))
        .requires(STOPPED),
    case("301/7.3.2.2.4/4", "3.12", "STOPPED: every third SYNC sends nothing", |t| cyclic(t, NmtState::Stopped))
        .requires(STOPPED),
    case("301/7.3.2.2.4/5", "3.13", "STOPPED: the SYNC after an event sends nothing", |t| {
        acyclic(t, NmtState::Stopped)
    })
    .requires(STOPPED),
    case("301/7.3.2.2.4/6", "3.14", "STOPPED: the SYNC start value sends nothing", |t| {
        sync_start(t, NmtState::Stopped)
    })
    .requires(STOPPED),
    case("301/7.3.2.2.2/1", "3.15", "PRE-OPERATIONAL: a remote frame asks in vain", |t| {
        remote(t, NmtState::PreOperational)
    })
    .requires(PRE_OPERATIONAL),
    case("301/7.3.2.2.2/2", "3.16", "PRE-OPERATIONAL: an event sends nothing", |t| event(t, NmtState::PreOperational))
        .requires(PRE_OPERATIONAL),
    case("301/7.3.2.2.2/3", "3.17", "PRE-OPERATIONAL: the event timer sends nothing", |t| {
        timer(t, NmtState::PreOperational)
    })
    .requires(PRE_OPERATIONAL),
    case("301/7.3.2.2.2/4", "3.18", "PRE-OPERATIONAL: every third SYNC sends nothing", |t| {
        cyclic(t, NmtState::PreOperational)
    })
    .requires(PRE_OPERATIONAL),
    case("301/7.3.2.2.2/5", "3.19", "PRE-OPERATIONAL: the SYNC after an event sends nothing", |t| {
        acyclic(t, NmtState::PreOperational)
    })
    .requires(PRE_OPERATIONAL),
    case("301/7.3.2.2.2/6", "3.20", "PRE-OPERATIONAL: the SYNC start value sends nothing", |t| {
        sync_start(t, NmtState::PreOperational)
    })
    .requires(PRE_OPERATIONAL),
];

/// The ids of the cases about remote requests and about the event timer.
pub(crate) const ON_REQUEST: &str = "301/7.2.2.3/1";
pub(crate) const BY_TIMER: &str = "301/7.2.2.3/3";

fn are_read(t: &mut Tester<'_>, indices: std::ops::RangeInclusive<u16>) -> Outcome {
    t.some("of a PDO", |entry| indices.contains(&entry.index))?.iter().try_for_each(|entry| t.is_default(entry))
}

/// A TPDO that the tester has configured.
pub(crate) struct Tpdo {
    pub(crate) id: CobId,
    /// In bytes.
    pub(crate) len: usize,
    /// Whether remote frames may request it.
    pub(crate) remote: bool,
}

impl Tpdo {
    /// Cases about remote frames do not apply to a TPDO that takes none.
    pub(crate) fn takes_remote(&self) -> Outcome {
        if self.remote {
            Ok(())
        } else {
            Err(not_applicable(format!("remote frames may not ask for {} (bit 30)", self.id)))
        }
    }
}

/// The transmission parameters of a TPDO.
#[derive(Clone, Copy, Default)]
pub(crate) struct Transmission {
    pub(crate) code: u8,
    pub(crate) event_timer_ms: u16,
    pub(crate) sync_start: u8,
}

pub(crate) fn transmission(code: u8) -> Transmission {
    Transmission { code, ..Transmission::default() }
}

/// The TPDOs of the data sheet that have a COB-ID, and whose transmission type can be written.
pub(crate) fn tpdos(t: &Tester<'_>) -> Outcome<Vec<Pdo>> {
    let mut tpdos = t.sheet.device.pdos.clone();
    tpdos.retain(|pdo| {
        let settable = |sub| t.entry(0x17FF + pdo.number, sub).is_ok_and(|entry| entry.access.writable());
        // Without a COB-ID it cannot be enabled.
        let default = t.entry(0x17FF + pdo.number, 1).ok().and_then(|entry| t.power_on_value(&entry));
        let bytes = default.and_then(|bytes| bytes.try_into().ok());
        let has_id = bytes.is_none_or(|bytes| !CobId::from_parameter(u32::from_le_bytes(bytes)).is_restricted());
        let is_sent = pdo.direction == Direction::Transmit && !pdo.mapping.is_empty();
        is_sent && has_id && settable(1) && settable(2)
    });
    if tpdos.is_empty() { Err(not_applicable("no TPDO whose transmission type can be set")) } else { Ok(tpdos) }
}

/// Configures a TPDO while it is disabled; afterwards the device is PRE-OPERATIONAL. If the device refuses the
/// transmission type, the case does not apply.
pub(crate) fn configure(t: &mut Tester<'_>, pdo: &Pdo, how: Transmission) -> Outcome<Tpdo> {
    const OFF: u32 = 1 << 31;
    const NO_REMOTE: u32 = 1 << 30;
    let index = 0x17FF + pdo.number;
    t.enter(NmtState::PreOperational)?;
    let cob_id = t.read(index, 1)? as u32;
    t.write(index, 1, cob_id | OFF)?;
    let shown = how.code;
    if !t.has_value(index, 2, u32::from(how.code)) {
        return Err(not_applicable(format!("the limits of {index:04X}:02 do not have type {shown}")));
    }
    match t.try_write(index, 2, u32::from(how.code))? {
        Ok(()) => {}
        Err(refused) if answers::TRANSMISSION_TYPE.takes(refused) => {
            return Err(not_applicable(format!("the device has no type {shown}")));
        }
        Err(refused) => return Err(failed(format!("type {shown} is refused with {refused}"))),
    }
    if how.event_timer_ms > 0 && t.entry(index, 3).is_ok_and(|entry| entry.access.writable()) {
        // The event timer may have to be at least as long as the inhibit time.
        if t.read(index, 3)? > 10 * u64::from(how.event_timer_ms) {
            t.write(index, 3, 0)?;
        }
    }
    for (sub, value) in [(5, u32::from(how.event_timer_ms)), (6, u32::from(how.sync_start))] {
        match t.entry(index, sub) {
            // A device may have no value that disables the timer.
            Ok(entry) if value == 0 && entry.low.as_ref().and_then(Value::as_integer) > Some(0) => {}
            Ok(entry) if !entry.access.writable() => {
                if t.read(index, sub)? != u64::from(value) {
                    return Err(not_applicable(format!(
                        "{index:04X}:{sub:02X} is another than {value}, and read-only"
                    )));
                }
            }
            Ok(_) => t.write(index, sub, value)?,
            Err(_) if value == 0 => {}
            Err(lacks) => return Err(lacks),
        }
    }
    let cob_id = cob_id & !OFF;
    t.write(index, 1, cob_id)?;
    let bits: usize = pdo.mapping.iter().map(|mapped| usize::from(mapped.bits)).sum();
    Ok(Tpdo { id: CobId::from_parameter(cob_id), len: bits.div_ceil(8), remote: cob_id & NO_REMOTE == 0 })
}

/// Each TPDO in turn, configured, with the device in a state, and what entering it has sent heard already.
fn each(
    t: &mut Tester<'_>,
    how: Transmission,
    state: NmtState,
    look: impl Fn(&mut Tester<'_>, &Tpdo) -> Outcome,
) -> Outcome {
    let is_synchronous = how.code <= 240;
    let mut lacks = None;
    let mut looked = false;
    for pdo in tpdos(t)? {
        // SYNC is sent by the tester. If it has a counter, the device has been kept from producing SYNC before.
        if is_synchronous && how.sync_start == 0 {
            t.enter(NmtState::PreOperational)?;
            produce_nothing(t)?;
        }
        match configure(t, &pdo, how).and_then(|tpdo| t.enter(state).and_then(|()| look(t, &tpdo))) {
            Err(lack @ Verdict::NotApplicable(_)) => {
                lacks = Some(lack);
                continue;
            }
            outcome => outcome?,
        }
        looked = true;
        // Disables it, so that the next TPDO is tested alone.
        t.enter(NmtState::PreOperational)?;
        let cob_id = t.read(0x17FF + pdo.number, 1)? as u32;
        t.write(0x17FF + pdo.number, 1, cob_id | 1 << 31)?;
    }
    lacks.filter(|_| !looked).map_or(Ok(()), Err)
}

fn remote(t: &mut Tester<'_>, state: NmtState) -> Outcome {
    each(t, transmission(253), state, |t, tpdo| {
        tpdo.takes_remote()?;
        for _ in 0..2 {
            t.send_remote(tpdo.id, tpdo.len)?;
            let heard = t.hear_id(tpdo.id, 50)?;
            let expected = usize::from(state == NmtState::Operational);
            ensure(heard.len() == expected, || format!("{} answers {} times in {state}", tpdo.id, heard.len()))?;
            let whole = heard.iter().all(|(_, frame)| frame.data().len() == tpdo.len);
            ensure(whole, || format!("{} does not have {} bytes", tpdo.id, tpdo.len))?;
        }
        Ok(())
    })
}

/// The TPDO with the input that the stimulus changes.
pub(crate) fn with_input(t: &Tester<'_>) -> Outcome<(Pdo, InputStimulus)> {
    let stimulus = t.settings.stimuli.input.ok_or_else(|| not_applicable("nothing is known that changes an input"))?;
    let mapped = |pdo: &Pdo| pdo.mapping.iter().any(|mapped| (mapped.index, mapped.sub) == stimulus.shown_by);
    let pdo = tpdos(t)?.into_iter().find(mapped).ok_or_else(|| not_applicable("no TPDO shows the input"))?;
    Ok((pdo, stimulus))
}

fn event(t: &mut Tester<'_>, state: NmtState) -> Outcome {
    let (pdo, input) = with_input(t)?;
    for code in [254, 255] {
        let tpdo = configure(t, &pdo, transmission(code))?;
        t.apply(input.starts)?;
        t.enter(state)?;
        let heard = t.hear_id(tpdo.id, 200)?;
        if state == NmtState::Operational {
            ensure(heard.len() >= 9, || format!("{} comes {} times while the input changes", tpdo.id, heard.len()))?;
            let differ = heard.windows(2).all(|two| two[0].1.data() != two[1].1.data());
            ensure(differ, || format!("{} comes without a change", tpdo.id))?;
            t.apply(input.stops)?;
            t.hear_ms(20)?;
            t.silence_of(tpdo.id, 200)?;
        } else {
            ensure(heard.is_empty(), || format!("{} comes in {state}", tpdo.id))?;
            t.enter(NmtState::PreOperational)?;
            t.apply(input.stops)?;
        }
    }
    Ok(())
}

fn timer(t: &mut Tester<'_>, state: NmtState) -> Outcome {
    let by_type = |t: &mut Tester<'_>, code| {
        each(t, Transmission { code, event_timer_ms: 100, sync_start: 0 }, state, |t, tpdo| {
            if state == NmtState::Operational {
                t.hears_every(tpdo.id, 100, 10).map(|_| ())
            } else {
                let heard = t.hear_id(tpdo.id, 1000)?;
                ensure(heard.is_empty(), || format!("{} comes in {state}", tpdo.id))
            }
        })
    };
    // The manufacturer decides whether the timer is an event of type 254.
    match by_type(t, 254) {
        Err(Verdict::Failed(_) | Verdict::NotApplicable(_)) if state == NmtState::Operational => by_type(t, 255),
        outcome => outcome,
    }
}

/// How often a TPDO comes after each of several SYNCs.
fn after_each(t: &mut Tester<'_>, id: CobId, counters: impl Iterator<Item = Option<u8>>) -> Outcome<Vec<usize>> {
    let mut counts = Vec::new();
    for counter in counters {
        t.sync(counter)?;
        counts.push(t.hear_id(id, 20)?.len());
    }
    Ok(counts)
}

fn compare(counts: &[usize], expected: &[usize], state: NmtState) -> Outcome {
    let none = vec![0; expected.len()];
    let expected = if state == NmtState::Operational { expected } else { &none };
    ensure(counts == expected, || format!("after each SYNC come {counts:?} TPDOs, not {expected:?}, in {state}"))
}

/// Checks that a TPDO comes with every nth SYNC, this many times. Without a SYNC start value, counting may begin with
/// any SYNC.
pub(crate) fn comes_every(t: &mut Tester<'_>, tpdo: &Tpdo, every: u8, times: usize) -> Outcome {
    let mut counts = Vec::new();
    let latest = 2 * usize::from(every);
    while counts.len() < latest && counts.iter().all(|&count| count == 0) {
        counts.extend(after_each(t, tpdo.id, [None].into_iter())?);
    }
    let first = counts.len();
    counts.extend(after_each(t, tpdo.id, vec![None; usize::from(every) * times].into_iter())?);
    let expected = |(number, &count): (usize, &usize)| {
        count == usize::from(number + 1 >= first && (number + 1 - first).is_multiple_of(usize::from(every)))
    };
    let right = counts.iter().enumerate().all(expected);
    ensure(right, || {
        let came: Vec<usize> = (1..).zip(&counts).filter(|(_, count)| **count > 0).map(|(number, _)| number).collect();
        format!("type {every}: {} comes with SYNCs {came:?} of {}", tpdo.id, counts.len())
    })
}

fn cyclic(t: &mut Tester<'_>, state: NmtState) -> Outcome {
    each(t, transmission(3), state, |t, tpdo| {
        if state == NmtState::Operational {
            return comes_every(t, tpdo, 3, 2);
        }
        let counts = after_each(t, tpdo.id, [None; 9].into_iter())?;
        compare(&counts, &[0; 9], state)
    })
}

fn acyclic(t: &mut Tester<'_>, state: NmtState) -> Outcome {
    let (pdo, input) = with_input(t)?;
    produce_nothing(t)?;
    let tpdo = configure(t, &pdo, transmission(0))?;
    t.apply(input.starts)?;
    t.enter(state)?;
    // Without SYNC nothing is sent, even if the input changes.
    let heard = t.hear_id(tpdo.id, 100)?;
    ensure(heard.is_empty(), || format!("{} comes without SYNC", tpdo.id))?;
    let counts = after_each(t, tpdo.id, [None; 4].into_iter())?;
    compare(&counts, &[1; 4], state)?;
    if state == NmtState::Operational {
        t.apply(input.stops)?;
        after_each(t, tpdo.id, [None].into_iter())?;
        let counts = after_each(t, tpdo.id, [None; 3].into_iter())?;
        compare(&counts, &[0; 3], state)?;
    }
    Ok(())
}

fn sync_start(t: &mut Tester<'_>, state: NmtState) -> Outcome {
    without_period(t)?;
    t.write(0x1019, 0, 10)?;
    let how = Transmission { code: 2, event_timer_ms: 0, sync_start: 5 };
    each(t, how, state, |t, tpdo| {
        let counts = after_each(t, tpdo.id, (1..=8).map(Some))?;
        // CiA 301 calls it the first SYNC: CANopenNode sends with it, lely-core with every second one after it.
        if state == NmtState::Operational && counts == [0, 0, 0, 0, 0, 1, 0, 1] {
            t.observe(format!("{} comes with the second SYNC from the start value on", tpdo.id));
            return Ok(());
        }
        compare(&counts, &[0, 0, 0, 0, 1, 0, 1, 0], state)
    })
}
