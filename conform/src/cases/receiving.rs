//! Beyond the plan: RPDOs of a wrong length or too late, a SYNC of a wrong length, and the emergencies that report
//! them.
//!
//! Devices need not send these emergencies (CiA 301, 7.2.7): a case that waits for one is recommended.

use lexican_eds::model::Pdo;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration};

use super::error_control::{beat, guard, has_emergency, watch};
use super::nmt::{received, received_by, values, where_it_applies};
use super::pdo_mapping::switch_off;
use super::sync::produce_nothing;
use crate::case::{Case, case};
use crate::tester::{Tester, text};
use crate::verdict::{Outcome, ensure, failed, not_applicable};

const LONG_PDO: &str = "Of an RPDO with more bytes than are mapped the first ones are used, and 8220h may report it.";
const DEADLINE: &str = "An RPDO with an event timer that does not come again within it is reported (8250h).";

pub(crate) const CASES: &[Case] = &[
    case("301/7.2.2.1/3", "", "of an RPDO with too many bytes, the first ones are taken", |t| {
        let (id, pdo) = with_room(t)?;
        let mut sent: Vec<u8> = values(t, &pdo)?.iter().map(|byte| byte ^ 1).collect();
        let expected = sent.clone();
        t.enter(NmtState::Operational)?;
        sent.push(0);
        t.send(id, &sent)?;
        t.hear_ms(20)?;
        t.enter(NmtState::PreOperational)?;
        let after = values(t, &pdo)?;
        ensure(after == expected, || format!("{id}#{sent:02X?}: the objects have {after:02X?}"))
    })
    .requires(LONG_PDO)
    .recommended(),
    case("301/7.2.2.1/4", "", "an RPDO with too many bytes is reported by the emergency 8220h", |t| {
        has_emergency(t)?;
        let (id, pdo) = with_room(t)?;
        let mut sent = values(t, &pdo)?;
        t.enter(NmtState::Operational)?;
        sent.push(0);
        t.send(id, &sent)?;
        is_reported(t, 0x8220)
    })
    .requires(LONG_PDO)
    .recommended(),
    case("301/7.5.2.35/2", "", "an RPDO in time is no error of its event timer, nor is one before the first", |t| {
        let (id, sent) = with_deadline(t)?;
        t.enter(NmtState::Operational)?;
        let mut heard = t.emergencies(LATE, 3 * DEADLINE_MS)?;
        for _ in 0..5 {
            t.send(id, &sent)?;
            heard.extend(t.emergencies(LATE, DEADLINE_MS / 2)?);
            t.depends_on(Duration::from_millis(DEADLINE_MS / 2));
        }
        ensure(heard.is_empty(), || format!("{} came", text(&heard)))
    })
    .requires(DEADLINE),
    case("301/7.5.2.35/3", "", "an RPDO that is late is reported by the emergency 8250h", |t| {
        has_emergency(t)?;
        let (id, sent) = with_deadline(t)?;
        t.enter(NmtState::Operational)?;
        t.send(id, &sent)?;
        is_reported(t, LATE)
    })
    .requires(DEADLINE)
    .recommended(),
    case("301/7.5.2.35/4", "", "with its event timer switched off, no RPDO is late", |t| {
        let (id, sent) = with_deadline(t)?;
        let (_, pdo) = received_by(t, has_event_timer)?;
        set_event_timer(t, &pdo, 0)?;
        t.enter(NmtState::Operational)?;
        t.send(id, &sent)?;
        let heard = t.emergencies(LATE, 3 * DEADLINE_MS)?;
        ensure(heard.is_empty(), || format!("{} came", text(&heard)))
    })
    .requires("With 0 in its event timer no RPDO is waited for."),
    case("301/7.2.5/3", "", "a SYNC with a counter is reported by the emergency 8240h, if 1019h has none", |t| {
        t.has(&[0x1005, 0x1019])?;
        has_emergency(t)?;
        produce_nothing(t)?;
        if t.read(0x1019, 0)? != 0 {
            t.write(0x1019, 0, 0)?;
        }
        t.enter(NmtState::Operational)?;
        t.sync(None)?;
        t.hear_ms(20)?;
        t.sync(Some(1))?;
        is_reported(t, 0x8240)
    })
    .requires("A SYNC with other data than 1019h asks for is reported by the emergency 8240h.")
    .recommended(),
    case("301/7.3.2.2.4/7", "", "STOPPED: no emergency is sent", |t| {
        let contact = if t.entry(0x1016, 1).is_ok() {
            watch(t)?;
            |t: &mut Tester<'_>| beat(t, 0x05)
        } else {
            guard(t)?;
            |t: &mut Tester<'_>| t.send_remote(t.error_control(), 1)
        };
        // If the device never sends this emergency, its absence means nothing.
        contact(t)?;
        if t.hear_id(t.emergency_id(), LOST_MS)?.is_empty() {
            return Err(not_applicable("a heartbeat or guarding that is lost brings no emergency"));
        }
        t.enter(NmtState::PreOperational)?;
        contact(t)?;
        t.hear_ms(20)?;
        t.enter(NmtState::Stopped)?;
        let heard = t.hear_id(t.emergency_id(), LOST_MS)?;
        ensure(heard.is_empty(), || format!("{} came in STOPPED", text(&heard)))
    })
    .requires("In STOPPED no emergency is sent."),
    case("301/7.5.2.2/3", "", "1001h shows the error register of each emergency", |t| {
        t.has(&[0x1001])?;
        has_emergency(t)?;
        let mut lacks = Some(not_applicable("nothing is known that lets the device send an emergency"));
        for brings in TROUBLES {
            t.reset(NmtCommand::ResetNode)?;
            let brought = brings(t);
            if where_it_applies(brought)?.is_none() {
                continue;
            }
            if let Some((_, frame)) = t.hear_id(t.emergency_id(), LOST_MS)?.last() {
                let &[_, _, register, ..] = frame.data() else {
                    return Err(failed(format!("{frame} is no emergency")));
                };
                t.reads(0x1001, 0, u64::from(register))?;
                lacks = None;
            }
        }
        lacks.map_or(Ok(()), Err)
    })
    .requires("The error register of an emergency is that of 1001h."),
];

/// Errors that are known to make devices send emergencies.
const TROUBLES: [fn(&mut Tester<'_>) -> Outcome; 7] = [
    |t| {
        let (id, _) = received(t)?;
        t.enter(NmtState::Operational)?;
        t.send(id, &[])
    },
    |t| {
        let (id, pdo) = received(t)?;
        let whole = values(t, &pdo)?;
        t.enter(NmtState::Operational)?;
        t.send(id, &[])?;
        // A correct RPDO ends the error.
        t.send(id, &whole)
    },
    |t| {
        let (id, pdo) = with_room(t)?;
        let mut sent = values(t, &pdo)?;
        sent.push(0);
        t.enter(NmtState::Operational)?;
        t.send(id, &sent)
    },
    |t| {
        let (id, sent) = with_deadline(t)?;
        t.enter(NmtState::Operational)?;
        t.send(id, &sent)
    },
    |t| {
        t.has(&[0x1005])?;
        produce_nothing(t)?;
        t.enter(NmtState::Operational)?;
        t.sync(Some(1))
    },
    |t| {
        watch(t)?;
        beat(t, 0x05)
    },
    |t| {
        guard(t)?;
        t.send_remote(t.error_control(), 1)
    },
];

/// The longest time between RPDOs.
const DEADLINE_MS: u64 = 100;

/// The error code of a late RPDO.
const LATE: u16 = 0x8250;

/// The time after which a missing heartbeat or guarding request has been noticed.
const LOST_MS: u64 = 400;

/// Checks that an emergency with this code comes.
fn is_reported(t: &mut Tester<'_>, code: u16) -> Outcome {
    let heard = t.emergencies(code, 3 * DEADLINE_MS)?;
    let right = matches!(&heard[..], [(_, frame)] if frame.dlc() == 8);
    ensure(right, || format!("the emergency {code:04X}h was expected, {} came", text(&heard)))
}

/// An RPDO that is shorter than a frame can be.
fn with_room(t: &mut Tester<'_>) -> Outcome<(CobId, Pdo)> {
    received_by(t, |_, pdo| pdo.mapping.iter().map(|mapped| u32::from(mapped.bits)).sum::<u32>() <= 56)
}

fn has_event_timer(t: &Tester<'_>, pdo: &Pdo) -> bool {
    [1, 5].into_iter().all(|sub| t.entry(0x13FF + pdo.number, sub).is_ok_and(|entry| entry.access.writable()))
}

/// Configures a deadline for an RPDO: its COB-ID, and data that change nothing.
fn with_deadline(t: &mut Tester<'_>) -> Outcome<(CobId, Vec<u8>)> {
    let lacks = |_| not_applicable("no RPDO that has an event timer (sub-index 5) and objects that can be read");
    let (id, pdo) = received_by(t, has_event_timer).map_err(lacks)?;
    set_event_timer(t, &pdo, DEADLINE_MS as u32)?;
    Ok((id, values(t, &pdo)?))
}

fn set_event_timer(t: &mut Tester<'_>, pdo: &Pdo, ms: u32) -> Outcome {
    let index = 0x13FF + pdo.number;
    let cob_id = t.read(index, 1)? as u32;
    t.enter(NmtState::PreOperational)?;
    switch_off(t, pdo)?;
    t.write(index, 5, ms)?;
    t.write(index, 1, cob_id)
}
