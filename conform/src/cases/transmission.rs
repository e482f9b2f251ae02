//! Beyond the plan: every transmission type with its timing, and what must not change while a PDO exists.

use lexican_eds::model::{Entry, Mapped, Pdo, Value};
use lexican_runtime::wire::nmt::NmtState;

use super::nmt::{all_received, are_readable, received, received_by, values, where_it_applies};
use super::pdo::{BY_TIMER, Tpdo, Transmission, comes_every, configure, tpdos, transmission, with_input};
use super::sync::produce_nothing;
use crate::answers;
use crate::case::{Case, case};
use crate::sdo::number;
use crate::tester::{InputStimulus, PATIENCE, PATIENCE_MS, Tester, text};
use crate::verdict::{Outcome, ensure, failed, not_applicable};

const SAMPLED: &str = "A TPDO with transmission type 252 is sampled by SYNC, and sent when a remote frame asks for it.";
const EVENT_TIMER: &str = "An event-driven TPDO is sent whenever its event timer has elapsed (in ms).";

pub(crate) const CASES: &[Case] = &[
    case("301/7.5.2.37/3", "", "each transmission type is taken, or refused as a value", |t| {
        let pdo = switched_off(t)?;
        for code in (0..=0xFF).filter(|code| !RESERVED.contains(code)) {
            match t.try_write(parameter(&pdo), 2, code)? {
                Ok(()) => t.reads(parameter(&pdo), 2, u64::from(code))?,
                Err(refused) => ensure(answers::TRANSMISSION_TYPE.takes(refused), || {
                    format!("type {code} is refused with {refused}")
                })?,
            }
        }
        Ok(())
    })
    .requires("A transmission type that the device does not support is refused, and all others are taken."),
    case("301/7.5.2.37/4", "", "reserved transmission types, 241 to 251, are refused", |t| {
        let pdo = switched_off(t)?;
        RESERVED.into_iter().try_for_each(|code| t.refuses(parameter(&pdo), 2, code, &answers::TRANSMISSION_TYPE))
    })
    .requires("Transmission types 241 to 251 are reserved, and refused."),
    case("301/7.2.2.2/4", "", "a TPDO comes with every nth SYNC", |t| {
        let pdo = tpdos(t)?.remove(0);
        produce_nothing(t)?;
        for every in [1, 2, 7, 240] {
            let tpdo = configure(t, &pdo, transmission(every))?;
            t.enter(NmtState::Operational)?;
            comes_every(t, &tpdo, every, 1)?;
        }
        Ok(())
    })
    .requires("A TPDO with transmission type n is sent with every nth SYNC (1 to 240)."),
    case("301/7.2.2.3/4", "", "type 252: a remote frame asks for what SYNC has sampled", |t| {
        produce_nothing(t)?;
        let pdo = tpdos(t)?.remove(0);
        let tpdo = of_type(t, &pdo, 252)?;
        t.enter(NmtState::Operational)?;
        t.sync(None)?;
        let heard = t.hear_id(tpdo.id, 20)?;
        ensure(heard.is_empty(), || format!("{} came with SYNC", text(&heard)))?;
        for _ in 0..2 {
            t.send_remote(tpdo.id, tpdo.len)?;
            let heard = t.hear_id(tpdo.id, 50)?;
            ensure(heard.len() == 1, || format!("{} answers a remote frame", text(&heard)))?;
        }
        Ok(())
    })
    .requires(SAMPLED),
    case("301/7.2.2.3/7", "", "type 252: what is answered is from the last SYNC", |t| {
        let (pdo, source) = with_source(t)?;
        produce_nothing(t)?;
        let tpdo = of_type(t, &pdo, 252)?;
        if let Source::Input(input) = source {
            t.apply(input.starts)?;
        }
        t.enter(NmtState::Operational)?;
        let first = sampled(t, &tpdo)?;
        match &source {
            Source::Input(_) => _ = t.hear_ms(PATIENCE_MS)?,
            Source::Entry(entry) => {
                let value = t.read(entry.index, entry.sub)? as u32;
                t.write(entry.index, entry.sub, value ^ 1)?;
            }
        }
        let second = asked(t, &tpdo)?;
        ensure(first == second, || format!("without SYNC between them, {first:02X?} and {second:02X?} come"))?;
        let third = sampled(t, &tpdo)?;
        ensure(second != third, || format!("{third:02X?} comes again after a change and SYNC"))
    })
    .requires(SAMPLED),
    case("301/7.2.2.3/5", "", "type 255: the event timer sends a TPDO", |t| {
        let pdo = with_event_timer(t)?;
        let tpdo = configure(t, &pdo, Transmission { code: 255, event_timer_ms: 100, sync_start: 0 })?;
        t.enter(NmtState::Operational)?;
        t.hears_every(tpdo.id, 100, 10).map(|_| ())
    })
    .requires(EVENT_TIMER),
    case("301/7.2.2.3/6", "", "the event timer is right in the mean", |t| {
        let pdo = with_event_timer(t)?;
        let tpdo = configure(t, &pdo, Transmission { code: 254, event_timer_ms: 50, sync_start: 0 })?;
        t.enter(NmtState::Operational)?;
        t.hears_in_the_mean(tpdo.id, 50, 40)
    })
    .requires(EVENT_TIMER)
    .recommended(),
    case("301/7.5.2.37/5", "", "the event timer is switched off", |t| {
        let pdo = with_event_timer(t)?;
        let tpdo = configure(t, &pdo, Transmission { code: 254, event_timer_ms: 50, sync_start: 0 })?;
        t.enter(NmtState::Operational)?;
        let heard = t.hears_every(tpdo.id, 50, 4);
        t.needs(BY_TIMER, heard)?;
        let low = &t.entry(parameter(&pdo), 5)?.low;
        if low.as_ref().and_then(Value::as_integer) > Some(0) {
            return Err(not_applicable("the event timer has no value for never"));
        }
        let tpdo = configure(t, &pdo, transmission(254))?;
        t.enter(NmtState::Operational)?;
        // A first PDO may come by the change of state.
        t.hear_ms(PATIENCE_MS)?;
        let heard = t.hear_id(tpdo.id, 500)?;
        ensure(heard.is_empty(), || format!("{} come without event timer", text(&heard)))
    })
    .requires("With 0 in its event timer a TPDO is not sent by time."),
    case("301/7.5.2.37/6", "", "the inhibit time keeps TPDOs away from each other", |t| {
        const INHIBIT_MS: u64 = 100;
        let pdo = with_event_timer(t)?;
        let index = parameter(&pdo);
        if !t.entry(index, 3)?.access.writable() {
            return Err(not_applicable("the inhibit time cannot be written"));
        }
        let tpdo = configure(t, &pdo, Transmission { code: 254, event_timer_ms: 20, sync_start: 0 })?;
        switch_off(t, &pdo)?;
        if let Err(refused) = t.try_write(index, 3, INHIBIT_MS as u32 * 10)? {
            let why = format!("an inhibit time of {INHIBIT_MS} ms beside a shorter event timer is refused: {refused}");
            return Err(not_applicable(why));
        }
        t.write(index, 1, tpdo.id.raw())?;
        t.enter(NmtState::Operational)?;
        let heard = t.hear_id(tpdo.id, INHIBIT_MS * 10 + INHIBIT_MS / 2)?;
        let come = ensure(heard.len() >= 5, || format!("{} TPDOs come in ten inhibit times", heard.len()));
        t.needs(BY_TIMER, come)?;
        t.are_apart(tpdo.id, &heard, INHIBIT_MS)
    })
    .requires("TPDOs are at least their inhibit time apart (multiples of 100 µs)."),
    case("301/7.5.2.37/7", "", "the inhibit time is not changed while the PDO exists", |t| {
        let pdo = tpdos(t)?.remove(0);
        let index = parameter(&pdo);
        if !t.entry(index, 3)?.access.writable() {
            return Err(not_applicable("the inhibit time cannot be written"));
        }
        configure(t, &pdo, transmission(254))?;
        // Writing the present value would be no change.
        let other = if t.read(index, 3)? == 100 { 200 } else { 100 };
        t.refuses(index, 3, other, &answers::WHILE_IT_EXISTS)
    })
    .requires("The inhibit time is not changed while the PDO exists."),
    case("301/7.5.2.37/8", "", "the identifier is not changed while the PDO exists", |t| {
        let pdo = tpdos(t)?.remove(0);
        let tpdo = configure(t, &pdo, transmission(254))?;
        let other = tpdo.id.raw() ^ 1;
        t.refuses(parameter(&pdo), 1, other, &answers::WHILE_IT_EXISTS)
    })
    .requires("Bits 0 to 29 of a PDO's identifier are not changed while the PDO exists."),
    case("301/7.2.2.2/5", "", "a synchronous RPDO acts with the next SYNC", |t| {
        let (id, pdo) = received(t)?;
        let index = 0x13FF + pdo.number;
        if !t.entry(index, 2)?.access.writable() {
            return Err(not_applicable("the transmission type of the RPDO cannot be written"));
        }
        if let Err(refused) = t.try_write(index, 2, 1)? {
            ensure(answers::TRANSMISSION_TYPE.takes(refused), || format!("type 1 is refused with {refused}"))?;
            return Err(not_applicable("the RPDO is not synchronous"));
        }
        produce_nothing(t)?;
        let before = values(t, &pdo)?;
        let sent: Vec<u8> = before.iter().map(|byte| byte ^ 1).collect();
        t.enter(NmtState::Operational)?;
        t.send(id, &sent)?;
        t.hear_ms(20)?;
        for (expected, when) in [(&before, "before"), (&sent, "after")] {
            let now = values(t, &pdo)?;
            ensure(now == *expected, || format!("{id}#{sent:02X?}: the objects have {now:02X?} {when} SYNC"))?;
            t.sync(None)?;
            t.hear_ms(20)?;
        }
        Ok(())
    })
    .requires("What a synchronous RPDO has brought is used with the SYNC that follows."),
    case("301/7.5.2.37/9", "", "the SYNC start value is not changed while the PDO exists", |t| {
        let settable = |pdo: &Pdo| t.entry(parameter(pdo), 6).is_ok_and(|entry| entry.access.writable());
        let pdo = tpdos(t)?.into_iter().find(settable);
        let pdo = pdo.ok_or_else(|| not_applicable("no TPDO whose SYNC start value can be set"))?;
        configure(t, &pdo, transmission(1))?;
        t.refuses(parameter(&pdo), 6, 5, &answers::WHILE_IT_EXISTS)
    })
    .requires("The SYNC start value is not changed while the PDO exists (bit 31 of sub-index 1 is 0)."),
    case("301/7.5.2.35/5", "", "the identifier of an RPDO is not changed while it exists", |t| {
        let settable = |t: &Tester<'_>, pdo: &Pdo| t.entry(0x13FF + pdo.number, 1).is_ok_and(|it| it.access.writable());
        let (id, pdo) = received_by(t, settable)?;
        t.refuses(0x13FF + pdo.number, 1, id.raw() ^ 1, &answers::WHILE_IT_EXISTS)
    })
    .requires("The identifier of an RPDO is not changed while the RPDO exists (bit 31 of sub-index 1 is 0)."),
    case("301/7.2.2.1/5", "", "OPERATIONAL: every RPDO is taken", |t| {
        for (id, pdo) in all_received(t)? {
            t.enter(NmtState::PreOperational)?;
            let is_synchronous = matches!(t.upload(0x13FF + pdo.number, 2)?, Ok(kind) if number(&kind) <= 240);
            let before = values(t, &pdo)?;
            let sent: Vec<u8> = before.iter().map(|byte| byte ^ 1).collect();
            t.enter(NmtState::Operational)?;
            t.send(id, &sent)?;
            if is_synchronous {
                t.sync(None)?;
            }
            t.hear_ms(20)?;
            t.enter(NmtState::PreOperational)?;
            let after = values(t, &pdo)?;
            // An object may refuse the value at present.
            ensure(after != before, || format!("{id}#{sent:02X?}: the objects have {after:02X?}"))?;
        }
        Ok(())
    })
    .requires("What an RPDO carries is written to the objects that it maps, for each RPDO that exists."),
    case("301/7.2.2.1/6", "", "OPERATIONAL: every TPDO has the values of its objects", |t| {
        produce_nothing(t)?;
        let mut lacks = Some(not_applicable("no TPDO whose objects can be read, and stay as they are"));
        for pdo in tpdos(t)?.into_iter().filter(|pdo| are_readable(t, pdo)).collect::<Vec<_>>() {
            let Some(tpdo) = where_it_applies(configure(t, &pdo, transmission(1)))? else { continue };
            t.enter(NmtState::Operational)?;
            for _ in 0..3 {
                let before = values(t, &pdo)?;
                t.sync(None)?;
                let heard = t.hear_id(tpdo.id, 20)?;
                // Values that change meanwhile are not judged.
                if values(t, &pdo)? == before {
                    let right = matches!(&heard[..], [(_, frame)] if frame.data() == before);
                    ensure(right, || format!("{} comes as {}, its objects have {before:02X?}", tpdo.id, text(&heard)))?;
                    lacks = None;
                }
            }
        }
        lacks.map_or(Ok(()), Err)
    })
    .requires("A TPDO carries the values of the objects that it maps, in the order of its mapping."),
];

const RESERVED: std::ops::RangeInclusive<u32> = 241..=251;

fn parameter(pdo: &Pdo) -> u16 {
    0x17FF + pdo.number
}

fn switch_off(t: &mut Tester<'_>, pdo: &Pdo) -> Outcome {
    let cob_id = t.read(parameter(pdo), 1)? as u32;
    t.write(parameter(pdo), 1, cob_id | 1 << 31)
}

fn switched_off(t: &mut Tester<'_>) -> Outcome<Pdo> {
    let pdo = tpdos(t)?.remove(0);
    switch_off(t, &pdo)?;
    Ok(pdo)
}

/// A TPDO of a transmission type by which remote frames request it.
fn of_type(t: &mut Tester<'_>, pdo: &Pdo, code: u8) -> Outcome<Tpdo> {
    let tpdo = configure(t, pdo, transmission(code))?;
    tpdo.takes_remote()?;
    Ok(tpdo)
}

/// The means by which the test changes the contents of a TPDO.
enum Source {
    Input(InputStimulus),
    Entry(Entry),
}

/// A TPDO whose contents the test can change.
fn with_source(t: &Tester<'_>) -> Outcome<(Pdo, Source)> {
    if let Ok((pdo, input)) = with_input(t) {
        return Ok((pdo, Source::Input(input)));
    }
    let changeable = |mapped: &Mapped| {
        let entry = t.entry(mapped.index, mapped.sub).ok()?;
        let both = entry.access.readable() && entry.access.writable();
        (both && t.size(&entry) <= Some(4) && t.may_write(&entry)).then_some(entry)
    };
    let found = tpdos(t)?.into_iter().find_map(|pdo| Some((pdo.mapping.iter().find_map(changeable)?, pdo)));
    let (entry, pdo) = found.ok_or_else(|| not_applicable("nothing is known that changes what a TPDO has"))?;
    Ok((pdo, Source::Entry(entry)))
}

/// The data that a remote frame requests, after a SYNC.
fn sampled(t: &mut Tester<'_>, tpdo: &Tpdo) -> Outcome<Vec<u8>> {
    t.sync(None)?;
    t.hear_ms(20)?;
    asked(t, tpdo)
}

fn asked(t: &mut Tester<'_>, tpdo: &Tpdo) -> Outcome<Vec<u8>> {
    t.send_remote(tpdo.id, tpdo.len)?;
    let answer = t.next(tpdo.id, PATIENCE)?;
    let answer = answer.map(|frame| frame.data().to_vec()).ok_or_else(|| failed("a remote frame is not answered"));
    t.needs("301/7.2.2.3/4", answer)
}

fn with_event_timer(t: &Tester<'_>) -> Outcome<Pdo> {
    let settable = |pdo: &Pdo| t.entry(parameter(pdo), 5).is_ok_and(|entry| entry.access.writable());
    let mut pdos = tpdos(t)?.into_iter().filter(settable);
    pdos.next().ok_or_else(|| not_applicable("no TPDO whose event timer can be set"))
}
