//! 9 and 10: the NMT states and their transitions.

use lexican_eds::model::{Direction, Mapped, Pdo};
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration};

use super::pdo::{Transmission, configure, tpdos, transmission};
use super::{error_control, pdo, storing, sync};
use crate::case::{Case, case};
use crate::sdo;
use crate::tester::{PATIENCE_MS, Tester, text};
use crate::verdict::{Outcome, Verdict, ensure, not_applicable};

const COMMANDS: &str = "Each NMT command leads to its state from every other one.";

pub(crate) const CASES: &[Case] = &[
    case("301/7.3.2.2.1/1", "9.1", "the device boots up, with its defaults", |t| {
        for command in [NmtCommand::ResetNode, NmtCommand::ResetCommunication] {
            let changed = [(0x1017, 1000), (0x1006, 10_000), (0x1007, 1)];
            for (index, value) in changed {
                if t.entry(index, 0).is_ok() && t.has_value(index, 0, value) {
                    t.write(index, 0, value)?;
                }
            }
            let keeps = storing::stores_by_itself(t)?;
            t.nmt(command)?;
            boots(t)?;
            for (index, _) in changed.into_iter().filter(|_| !keeps) {
                if let Ok(entry) = t.entry(index, 0) {
                    t.is_default(&entry)?;
                }
            }
        }
        Ok(())
    })
    .requires("After both resets the device sends its boot-up message, and has its power-on values."),
    case("301/7.3.2.2.5/1", "9.2", "PRE-OPERATIONAL comes with the boot-up message, and has all but PDOs", |t| {
        t.nmt(NmtCommand::ResetNode)?;
        boots(t)?;
        // If the device is not there already, which case 10.1 checks.
        t.enter(NmtState::PreOperational)?;
        has_services(t, NmtState::PreOperational)
    })
    .requires("In PRE-OPERATIONAL there are SDO, SYNC, EMCY, NMT and error control, and no PDO."),
    case("301/7.3.2.2.5/2", "9.3", "OPERATIONAL has all services, and is left when guarding stops", |t| {
        has_services(t, NmtState::Operational)?;
        if t.has(&[0x100C, 0x100D]).is_err() {
            return Ok(());
        }
        for (behaviour, state) in [(0, NmtState::PreOperational), (1, NmtState::Operational), (2, NmtState::Stopped)] {
            t.reset(NmtCommand::ResetNode)?;
            if t.entry(0x1029, 1).is_ok() {
                t.write(0x1029, 1, behaviour)?;
            } else if behaviour != 0 {
                continue;
            }
            error_control::guard(t)?;
            t.enter(NmtState::Operational)?;
            t.is_in(NmtState::Operational)?;
            t.hear_ms(300)?;
            t.is_in(state)?;
        }
        Ok(())
    })
    .requires("In OPERATIONAL all services are there; a communication error leads to the state of 1029h:01."),
    case("301/7.3.2.2.5/3", "9.4", "STOPPED has NMT and error control, and nothing else", |t| {
        has_services(t, NmtState::Stopped)
    })
    .requires("In STOPPED there are NMT and error control alone."),
    case("301/7.2.8.2.1/1", "10.1", "both resets lead to PRE-OPERATIONAL from every state", |t| {
        let booted = boots_into(t)?;
        for state in STATES {
            for node in [t.node.get(), 0] {
                for command in [NmtCommand::ResetNode, NmtCommand::ResetCommunication] {
                    t.enter(state)?;
                    t.nmt_to(command, node)?;
                    boots(t)?;
                    reports(t, booted)?;
                }
            }
            t.enter(state)?;
            t.nmt_to(NmtCommand::ResetNode, other(t))?;
            let heard = t.hear_id(t.error_control(), PATIENCE_MS)?;
            let booted = heard.iter().any(|(_, frame)| frame.data() == [0]);
            ensure(!booted, || "a reset of another node is obeyed")?;
        }
        t.reset(NmtCommand::ResetNode)?;
        // A reset of the communication does not change application parameters.
        let Ok(limited) = super::dictionary::limited(t) else { return Ok(()) };
        let Some((entry, low, _)) = limited.into_iter().find(|(entry, ..)| entry.index >= 0x2000) else {
            return Ok(());
        };
        let default = t.read(entry.index, entry.sub)?;
        t.write(entry.index, entry.sub, low as u32)?;
        t.reset(NmtCommand::ResetCommunication)?;
        t.reads(entry.index, entry.sub, low as u64)?;
        // At power-on the value is the default, unless the device stores its parameters by itself.
        t.reset(NmtCommand::ResetNode)?;
        let value = t.read(entry.index, entry.sub)?;
        ensure([default, low as u64].contains(&value), || {
            format!("{:04X}:{:02X} is {value:X}h after a reset, and was {default:X}h before", entry.index, entry.sub)
        })
    })
    .requires("Reset node and reset communication are obeyed in every state, and lead to PRE-OPERATIONAL."),
    case("301/7.2.8.2.1/2", "10.2", "PRE-OPERATIONAL is entered from every state", |t| {
        transitions(t, NmtCommand::EnterPreOperational, NmtState::PreOperational)
    })
    .requires(COMMANDS),
    case("301/7.2.8.2.1/3", "10.3", "OPERATIONAL is entered from every state", |t| {
        transitions(t, NmtCommand::Start, NmtState::Operational)
    })
    .requires(COMMANDS),
    case("301/7.2.8.2.1/4", "10.4", "STOPPED is entered from every state", |t| {
        transitions(t, NmtCommand::Stop, NmtState::Stopped)
    })
    .requires(COMMANDS),
];

/// Checks that the boot-up message comes once.
fn boots(t: &mut Tester<'_>) -> Outcome {
    let booted = t.boot_up()?;
    t.needs("301/7.3.2.2.1/1", ensure(booted, || "no boot-up message comes"))?;
    let again = t.hear_id(t.error_control(), PATIENCE_MS)?;
    let booted = again.iter().any(|(_, frame)| frame.data() == [0] && !frame.is_remote());
    ensure(!booted, || "the boot-up message comes again")
}

/// Resets the device, and returns its state then: PRE-OPERATIONAL, or OPERATIONAL, which a device may enter by local
/// control (CiA 301, 7.3.2.2, transition 3), unless 1F80h says that it does not (CiA 302-2).
fn boots_into(t: &mut Tester<'_>) -> Outcome<NmtState> {
    const STAYS: u64 = 1 | 1 << 2;
    t.nmt(NmtCommand::ResetNode)?;
    boots(t)?;
    if t.entry(0x1F80, 0).is_ok()
        && let Ok(startup) = t.upload(0x1F80, 0)?
    {
        let stays = sdo::number(&startup) & STAYS != 0;
        return Ok(if stays { NmtState::PreOperational } else { NmtState::Operational });
    }
    shows_its_state(t)?;
    if reported(t)? != NmtState::Operational.code() {
        return Ok(NmtState::PreOperational);
    }
    t.observe("the device goes on to OPERATIONAL by itself".to_owned());
    Ok(NmtState::Operational)
}

const STATES: [NmtState; 3] = [NmtState::PreOperational, NmtState::Operational, NmtState::Stopped];

/// Another node-ID than the device's.
fn other(t: &Tester<'_>) -> u8 {
    if t.node.get() == 127 { 126 } else { t.node.get() + 1 }
}

fn transitions(t: &mut Tester<'_>, command: NmtCommand, target: NmtState) -> Outcome {
    shows_its_state(t)?;
    for state in STATES {
        for node in [t.node.get(), 0] {
            t.enter(state)?;
            reports(t, state)?;
            t.nmt_to(command, node)?;
            reports(t, target)?;
        }
        t.enter(state)?;
        t.nmt_to(command, other(t))?;
        reports(t, state)?;
    }
    Ok(())
}

/// Whether the state is read by guarding, since no heartbeat can be configured.
fn is_asked(t: &Tester<'_>) -> bool {
    t.has(&[0x100C]).is_ok() && !t.entry(0x1017, 0).is_ok_and(|entry| entry.access.writable())
}

/// Makes the device send its state by itself, if it can.
pub(crate) fn shows_its_state(t: &mut Tester<'_>) -> Outcome {
    if is_asked(t) {
        return Ok(());
    }
    t.has(&[0x1017])?;
    t.write(0x1017, 0, PATIENCE_MS as u32)
}

/// Checks the state that the device reports, by its heartbeat or else by guarding. For STOPPED, that has to be
/// configured before.
pub(crate) fn reports(t: &mut Tester<'_>, state: NmtState) -> Outcome {
    if state != NmtState::Stopped {
        shows_its_state(t)?;
    }
    // Frames that came with the command are not the answer.
    t.hear_ms(5)?;
    let reported = reported(t)?;
    ensure(reported == state.code(), || format!("the device says {reported:02X}, and should be {state}"))
}

/// The state that the device reports, if it does.
fn reported(t: &mut Tester<'_>) -> Outcome<u8> {
    if is_asked(t) {
        return t.guarded_state();
    }
    let reported = t.state(2 * PATIENCE_MS);
    t.needs(error_control::BEATS, reported)
}

/// Checks that the device offers the services of CiA 301, 7.3.2.2.5, in a state, and no others.
fn has_services(t: &mut Tester<'_>, state: NmtState) -> Outcome {
    let (messages, pdos) = (state != NmtState::Stopped, state == NmtState::Operational);
    // Error control: guarding and heartbeat.
    t.enter(NmtState::PreOperational)?;
    let guarded = error_control::is_guarded(t);
    if where_it_applies(guarded)?.is_some() {
        t.enter(state)?;
        for _ in 0..2 {
            t.is_in(state)?;
        }
        // Ends guarding by a reset, since a missing request would be an error.
        t.reset(NmtCommand::ResetCommunication)?;
    }
    if t.has(&[0x1017]).is_ok() {
        t.enter(NmtState::PreOperational)?;
        t.write(0x1017, 0, 100)?;
        t.enter(state)?;
        let beats = t.hears_every(t.error_control(), 100, 3);
        let beats = t.needs(error_control::BEATS, beats)?;
        let right = beats.iter().all(|(_, frame)| frame.data() == [state.code()]);
        ensure(right, || format!("heartbeats {} in {state}", text(&beats)))?;
        t.enter(NmtState::PreOperational)?;
        t.write(0x1017, 0, 0)?;
    }
    // SDO.
    t.enter(state)?;
    t.send_request([0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
    let answers = t.hear_id(CobId::of_node(0x580, t.node), PATIENCE_MS)?;
    ensure(answers.len() == usize::from(messages), || format!("SDO is answered {} times in {state}", answers.len()))?;
    // SYNC.
    if t.has(&[0x1005, 0x1006]).is_ok() {
        t.enter(NmtState::PreOperational)?;
        sync::produce(t)?;
        t.enter(state)?;
        let syncs = t.hear_id(CobId::SYNC, 105)?;
        t.depends_on(Duration::from_millis(5));
        let right = if messages { (9..=11).contains(&syncs.len()) } else { syncs.is_empty() };
        let produced = ensure(right, || format!("{} SYNCs of ten in {state}", syncs.len()));
        t.needs(sync::PRODUCED, produced)?;
        t.enter(NmtState::PreOperational)?;
        t.write(0x1005, 0, 0x80)?;
        t.write(0x1006, 0, 0)?;
    }
    // TPDOs: by remote request, and by event timer.
    if let Ok(tpdos) = tpdos(t) {
        let asked = configure(t, &tpdos[0], transmission(253)).and_then(|asked| asked.takes_remote().map(|()| asked));
        if let Some(asked) = where_it_applies(asked)? {
            t.enter(state)?;
            t.send_remote(asked.id, asked.len)?;
            let heard = t.hear_id(asked.id, 50)?;
            let right = heard.len() == usize::from(pdos);
            let asked = ensure(right, || format!("{} TPDOs on request in {state}", heard.len()));
            t.needs(pdo::ON_REQUEST, asked)?;
        }
        let timed = configure(t, &tpdos[0], Transmission { code: 254, event_timer_ms: 50, sync_start: 0 });
        if let Some(timed) = where_it_applies(timed)? {
            t.enter(state)?;
            let heard = t.hear_id(timed.id, 205)?;
            let right = if pdos { (3..=5).contains(&heard.len()) } else { heard.is_empty() };
            let timed = ensure(right, || format!("{} TPDOs of four by the event timer in {state}", heard.len()));
            t.needs(pdo::BY_TIMER, timed)?;
        }
    }
    // RPDOs.
    t.enter(NmtState::PreOperational)?;
    let received = received(t);
    where_it_applies(received)?.map_or(Ok(()), |(id, pdo)| takes(t, state, id, &pdo))
}

/// `None` if the case does not apply, because the device does not offer the service.
pub(crate) fn where_it_applies<T>(outcome: Outcome<T>) -> Outcome<Option<T>> {
    match outcome {
        Err(Verdict::NotApplicable(_)) => Ok(None),
        outcome => outcome.map(Some),
    }
}

/// An RPDO whose objects can be read back, with its COB-ID.
pub(crate) fn received(t: &mut Tester<'_>) -> Outcome<(CobId, Pdo)> {
    received_by(t, |_, _| true)
}

/// The same, among the wanted RPDOs.
pub(crate) fn received_by(t: &mut Tester<'_>, wanted: fn(&Tester<'_>, &Pdo) -> bool) -> Outcome<(CobId, Pdo)> {
    for pdo in t.sheet.device.pdos.clone() {
        if wanted(t, &pdo)
            && let Some(id) = receives(t, &pdo)?
        {
            return Ok((id, pdo));
        }
    }
    Err(not_applicable(NONE_READ))
}

/// All RPDOs whose objects can be read back.
pub(crate) fn all_received(t: &mut Tester<'_>) -> Outcome<Vec<(CobId, Pdo)>> {
    let mut all = Vec::new();
    for pdo in t.sheet.device.pdos.clone() {
        all.extend(receives(t, &pdo)?.map(|id| (id, pdo)));
    }
    if all.is_empty() { Err(not_applicable(NONE_READ)) } else { Ok(all) }
}

const NONE_READ: &str = "no RPDO whose objects can be read";

/// The COB-ID of an RPDO that exists and whose objects can be read back.
fn receives(t: &mut Tester<'_>, pdo: &Pdo) -> Outcome<Option<CobId>> {
    let is_received = pdo.direction == Direction::Receive && !pdo.mapping.is_empty();
    let may_write = |mapped: &Mapped| t.entry(mapped.index, mapped.sub).is_ok_and(|entry| t.may_write(&entry));
    if !is_received || !are_readable(t, pdo) || !pdo.mapping.iter().all(may_write) {
        return Ok(None);
    }
    let cob_id = t.read(0x13FF + pdo.number, 1)? as u32;
    Ok((cob_id >> 31 == 0).then(|| CobId::from_parameter(cob_id)))
}

/// Whether the [`values`] of a PDO can be read.
pub(crate) fn are_readable(t: &Tester<'_>, pdo: &Pdo) -> bool {
    pdo.mapping.iter().all(|mapped| {
        let readable = t.entry(mapped.index, mapped.sub).is_ok_and(|entry| entry.access.readable());
        mapped.bits.is_multiple_of(8) && readable
    })
}

/// The values of a PDO's objects, in its order.
pub(crate) fn values(t: &mut Tester<'_>, pdo: &Pdo) -> Outcome<Vec<u8>> {
    let each = pdo.mapping.iter().map(|mapped| t.read_bytes(mapped.index, mapped.sub));
    Ok(each.collect::<Outcome<Vec<_>>>()?.concat())
}

fn takes(t: &mut Tester<'_>, state: NmtState, id: CobId, pdo: &Pdo) -> Outcome {
    t.enter(NmtState::PreOperational)?;
    let before = values(t, pdo)?;
    let sent: Vec<u8> = before.iter().map(|byte| byte ^ 1).collect();
    t.enter(state)?;
    t.send(id, &sent)?;
    t.hear_ms(20)?;
    t.enter(NmtState::PreOperational)?;
    let after = values(t, pdo)?;
    let expected = if state == NmtState::Operational { &sent } else { &before };
    ensure(after == *expected, || format!("{id}#{sent:02X?} in {state}: the objects have {after:02X?}"))
}
