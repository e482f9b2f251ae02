//! 7: guarding and heartbeat, each alone and against the other.

use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration};

use crate::answers;
use crate::case::{Case, case};
use crate::tester::{self, Heard, PATIENCE_MS, Tester, text};
use crate::verdict::{Outcome, ensure, not_applicable};

const GUARDING: &str = "A guarding request is answered with the NMT state and a toggle bit.";
pub(super) const HEARTBEAT: &str = "A heartbeat with the NMT state comes with the period of 1017h.";
const CONSUMER: &str =
    "A heartbeat that does not come within the time of 1016h is an error (8130h), and one in time is none.";
const EITHER: &str = "Heartbeat takes the place of guarding: a device does not use both at once.";

pub(crate) const CASES: &[Case] = &[
    case("301/7.5.2.11/1", "7.1", "100Ch and 100Dh are the defaults", |t| {
        guarded(t)?;
        for index in [0x100C, 0x100D] {
            let entry = t.entry(index, 0)?;
            t.is_default(&entry)?;
        }
        Ok(())
    })
    .requires("100Ch and 100Dh have the values of the data sheet after a reset."),
    case("301/7.2.8.3.2.1/1", "7.2", "a guarding request is answered with the state", |t| {
        is_guarded(t)?;
        t.send_remote(t.error_control(), 1)?;
        t.hears_once(t.error_control(), &[0x7F], PATIENCE_MS)
    })
    .requires(GUARDING),
    case("301/7.2.8.3.2.1/2", "7.3", "the toggle bit begins with 0, and toggles", |t| {
        // The second time comes after a reset, in the middle of the sequence.
        for answers in [&[0x7F, 0xFF, 0x7F, 0xFF, 0x7F][..], &[0x7F, 0xFF]] {
            is_guarded(t)?;
            for answer in answers {
                t.send_remote(t.error_control(), 1)?;
                t.hears_once(t.error_control(), &[*answer], PATIENCE_MS)?;
            }
            t.reset(NmtCommand::ResetCommunication)?;
        }
        Ok(())
    })
    .requires("The toggle bit of guarding is 0 in the first answer after a reset of communication, and alternates."),
    case("301/7.2.8.3.2.1/3", "7.4", "requests to other nodes are not answered", |t| {
        is_guarded(t)?;
        let own = u16::from(t.node.get());
        for node in (0..=127).filter(|&node| node != own) {
            let id = CobId::standard(0x700 + node).unwrap_or(CobId::SYNC);
            t.send_remote(id, 1)?;
            t.silence_of(id, 5)?;
        }
        t.is_in(NmtState::PreOperational)
    })
    .requires("A device answers guarding requests with its own identifier only."),
    case("301/7.5.2.11/2", "7.5", "100Ch and 100Dh are written", |t| {
        guard(t)?;
        t.reads(0x100C, 0, 100)?;
        t.reads(0x100D, 0, 2)
    })
    .requires("100Ch and 100Dh take other values, and show them."),
    case("301/7.2.8.3.2.1/4", "7.6", "life guarding notices that guarding stops", |t| {
        has_emergency(t)?;
        is_silent(t)?;
        guard(t)?;
        // Monitoring begins with the first request; requests in time cause no error.
        none_lost(t, 500)?;
        for _ in 0..5 {
            t.send_remote(t.error_control(), 1)?;
            none_lost(t, 150)?;
            t.depends_on(Duration::from_millis(50));
        }
        lost(t, 80)
    })
    .requires("Life guarding notices that no request came within 100Ch times 100Dh, and that one came again."),
    case("301/7.5.2.20/1", "7.101", "1017h is written", |t| {
        t.has(&[0x1017])?;
        t.write(0x1017, 0, 100)?;
        t.reads(0x1017, 0, 100)
    })
    .requires("1017h takes another period, and shows it."),
    case("301/7.2.8.3.2.2/1", "7.102", "heartbeats come in their time, with the state", |t| {
        heartbeat(t, 100)?;
        let beats = t.hears_every(t.error_control(), 100, 10)?;
        ensure(beats.iter().all(|(_, frame)| frame.data() == [0x7F]), || text(&beats))
    })
    .requires(HEARTBEAT),
    case("301/7.2.8.3.2.2/2", "7.103", "the heartbeat is switched off", |t| {
        heartbeat(t, 100)?;
        let beats = t.hears_every(t.error_control(), 100, 3);
        t.needs(BEATS, beats)?;
        t.write(0x1017, 0, 0)?;
        t.silence_of(t.error_control(), 1000)
    })
    .requires("With 0 in 1017h no heartbeat is sent."),
    case("301/7.5.2.19/1", "7.104", "a node has one heartbeat consumer", |t| {
        t.entry(0x1016, 2)?;
        t.write(0x1016, 1, WATCH)?;
        t.refuses(0x1016, 2, WATCH, &answers::CONSUMED_TWICE)?;
        // Writing the same entry again is not a second one.
        t.write(0x1016, 1, WATCH)
    })
    .requires("A node is monitored by one entry of 1016h; a second one with it is refused."),
    case("301/7.2.8.3.2.2/3", "7.105", "heartbeats in time are no error", |t| {
        watch(t)?;
        for _ in 0..20 {
            beat(t, 0x05)?;
            none_lost_before(t, 90)?;
        }
        Ok(())
    })
    .requires(CONSUMER),
    case("301/7.2.8.3.2.2/4", "7.106", "a heartbeat that is late is an error", |t| {
        has_emergency(t)?;
        watch(t)?;
        // Monitoring begins with the first heartbeat.
        none_lost(t, 300)?;
        beat(t, 0x05)?;
        none_lost_before(t, 90)?;
        lost(t, 20)
    })
    .requires(CONSUMER),
    case("301/7.2.8.3.2.2/5", "7.107", "after a reset no heartbeat is waited for", |t| {
        let power_on = t.entry(0x1016, 1).and_then(|_| t.read(0x1016, 1))?;
        watch(t)?;
        beat(t, 0x05)?;
        t.nmt(NmtCommand::ResetNode)?;
        none_lost(t, 500)?;
        t.reads(0x1016, 1, power_on)?;
        t.reads(0x1001, 0, 0)
    })
    .requires("Monitoring begins with the first heartbeat that comes, so none is missed before it."),
    case("301/7.2.8.2.2/1", "7.201", "heartbeat and guarding have their objects", |t| {
        both(t)?;
        for index in [0x100C, 0x100D, 0x1017] {
            t.read(index, 0)?;
        }
        Ok(())
    })
    .requires("A device has error control: heartbeat (1017h), guarding (100Ch and 100Dh), or both."),
    case("301/7.2.8.2.2/2", "7.202", "heartbeat off: none comes", |t| {
        both(t)?;
        heartbeat(t, 0)?;
        t.silence_of(t.error_control(), 1000)
    })
    .requires("With 0 in 1017h no heartbeat is sent."),
    case("301/7.2.8.2.2/3", "7.203", "heartbeat off, guarding on: requests are answered", |t| {
        both(t)?;
        heartbeat(t, 0)?;
        guard(t)?;
        for answer in [0x7F, 0xFF] {
            t.send_remote(t.error_control(), 1)?;
            t.hears_once(t.error_control(), &[answer], PATIENCE_MS)?;
        }
        Ok(())
    })
    .requires(GUARDING),
    case("301/7.2.8.2.2/4", "7.204", "guarding off, heartbeat on: heartbeats come", |t| {
        both(t)?;
        heartbeat(t, 100)?;
        let beats = t.hears_every(t.error_control(), 100, 10);
        t.needs(BEATS, beats).map(|_| ())
    })
    .requires(HEARTBEAT),
    case("301/7.2.8.2.2/5", "7.205", "guarding off, heartbeat on: requests are not answered", |t| {
        both(t)?;
        heartbeat(t, 100)?;
        unanswered(t)
    })
    .requires(EITHER),
    case("301/7.2.8.2.2/6", "7.206", "both on: heartbeats come", |t| {
        both_on(t)?;
        let beats = t.hears_every(t.error_control(), 100, 10);
        let beats = t.needs(BEATS, beats)?;
        ensure(beats.iter().all(|(_, frame)| frame.data() == [0x7F]), || text(&beats))
    })
    .requires(EITHER),
    case("301/7.2.8.2.2/7", "7.207", "both on: requests are not answered", |t| {
        both_on(t)?;
        unanswered(t)
    })
    .requires(EITHER),
    case("301/7.2.8.3.2.1/5", "", "in every state, a guarding request is answered once", |t| {
        is_guarded(t)?;
        let mut toggle = 0;
        for state in [NmtState::PreOperational, NmtState::Operational, NmtState::Stopped] {
            t.enter(state)?;
            for _ in 0..2 {
                t.send_remote(t.error_control(), 1)?;
                let answered = t.hears_once(t.error_control(), &[state.code() | toggle], PATIENCE_MS);
                t.needs(tester::GUARDING, answered)?;
                toggle ^= 0x80;
            }
        }
        Ok(())
    })
    .requires("A guarding request is answered once, with the NMT state and the toggle bit."),
    case("301/7.2.8.3.2.2/7", "", "the heartbeat goes on through the states, in its time", |t| {
        heartbeat(t, 100)?;
        for state in [NmtState::PreOperational, NmtState::Operational, NmtState::Stopped] {
            t.enter(state)?;
            let beats = t.hears_every(t.error_control(), 100, 4);
            let beats = t.needs(BEATS, beats)?;
            let right = beats.iter().all(|(_, frame)| frame.data() == [state.code()]);
            ensure(right, || format!("heartbeats {} in {state}", text(&beats)))?;
        }
        Ok(())
    })
    .requires("A heartbeat comes with the period of 1017h in every NMT state, and carries that state."),
    case("301/7.2.7/2", "", "a heartbeat that is lost is reported each time, and its return by the code 0000h", |t| {
        has_emergency(t)?;
        let id = CobId::of_node(0x80, t.node);
        for state in [NmtState::PreOperational, NmtState::Operational] {
            t.enter(NmtState::PreOperational)?;
            watch(t)?;
            t.enter(state)?;
            beat(t, 0x05)?;
            for _ in 0..2 {
                let heard = t.hear_id(id, 300)?;
                let lost = is_one_emergency(&heard, LOST);
                t.needs("301/7.2.8.3.2.2/4", lost)?;
                beat(t, 0x05)?;
                let heard = t.hear_id(id, 20)?;
                if heard.is_empty() {
                    return Err(not_applicable("the error lasts though the heartbeat is back"));
                }
                is_one_emergency(&heard, 0)?;
            }
        }
        Ok(())
    })
    .requires("An error is reported once when it occurs, and by the code 0000h when it is over.")
    .recommended(),
];

/// The id of the case about heartbeats.
pub(crate) const BEATS: &str = "301/7.2.8.3.2.2/1";

/// The value of 1016h: node 16, within 100 ms.
const WATCH: u32 = 16 << 16 | 100;

fn guarded(t: &Tester<'_>) -> Outcome {
    t.has(&[0x100C, 0x100D])
}

/// Switches the device's own heartbeat off: it would be taken for an answer, and would disturb silence.
fn is_silent(t: &mut Tester<'_>) -> Outcome {
    match t.entry(0x1017, 0) {
        Ok(entry) if t.read(0x1017, 0)? != 0 => {
            if !entry.access.writable() || !t.has_value(0x1017, 0, 0) {
                return Err(not_applicable("the heartbeat, which takes the place of guarding, cannot be switched off"));
            }
            t.write(0x1017, 0, 0)
        }
        _ => Ok(()),
    }
}

/// Configures guarding: a device that also has a heartbeat need not answer before that.
pub(crate) fn is_guarded(t: &mut Tester<'_>) -> Outcome {
    guarded(t)?;
    is_silent(t)?;
    let settable = |index| t.entry(index, 0).is_ok_and(|entry| entry.access.writable());
    if [0x100C, 0x100D].into_iter().all(settable) { guard(t) } else { Ok(()) }
}

/// Emergencies are optional: a device without 1014h, or with an invalid COB-ID in it, sends none.
pub(crate) fn has_emergency(t: &mut Tester<'_>) -> Outcome {
    t.has(&[0x1014])?;
    let cob_id = t.read(0x1014, 0)? as u32;
    if cob_id >> 31 != 0 {
        return Err(not_applicable("1014h says that there are no emergencies"));
    }
    t.emergency = Some(CobId::from_parameter(cob_id));
    Ok(())
}

fn both(t: &Tester<'_>) -> Outcome {
    t.has(&[0x100C, 0x100D, 0x1017])
}

/// A device may refuse to have both at a time (CiA 301, 7.2.8.2.2); the case then does not apply.
fn both_on(t: &mut Tester<'_>) -> Outcome {
    both(t)?;
    guard(t)?;
    match t.try_write(0x1017, 0, 100)? {
        Ok(()) => Ok(()),
        Err(code) => Err(not_applicable(format!("the device refuses a heartbeat while it is guarded: {code}"))),
    }
}

/// Configures a life time of 200 ms.
pub(crate) fn guard(t: &mut Tester<'_>) -> Outcome {
    guarded(t)?;
    t.write(0x100C, 0, 100)?;
    t.write(0x100D, 0, 2)
}

fn heartbeat(t: &mut Tester<'_>, period_ms: u32) -> Outcome {
    t.has(&[0x1017])?;
    t.write(0x1017, 0, period_ms)
}

pub(crate) fn watch(t: &mut Tester<'_>) -> Outcome {
    t.entry(0x1016, 1)?;
    is_silent(t)?;
    t.write(0x1016, 1, WATCH)
}

/// Sends a heartbeat of the monitored node.
pub(crate) fn beat(t: &mut Tester<'_>, state: u8) -> Outcome {
    t.send(CobId::standard(0x700 | (WATCH >> 16) as u16).unwrap_or(CobId::SYNC), &[state])
}

/// Checks that the emergency of a life guard or heartbeat error comes within this time, once.
fn lost(t: &mut Tester<'_>, within_ms: u64) -> Outcome {
    let heard = t.emergencies(LOST, within_ms)?;
    let right = matches!(&heard[..], [(_, frame)] if frame.data().len() == 8);
    ensure(right, || format!("the emergency 8130h was expected, {} came", text(&heard)))?;
    none_lost(t, 300)
}

fn is_one_emergency(heard: &[Heard], code: u16) -> Outcome {
    let right = matches!(heard, [(_, frame)] if frame.dlc() == 8 && frame.data().starts_with(&code.to_le_bytes()));
    ensure(right, || format!("one emergency {code:04X}h of eight bytes was expected, {} came", text(heard)))
}

/// The error code of a life guard or heartbeat error.
const LOST: u16 = 0x8130;

/// The same, before the next heartbeat, which has to come after 100 ms.
fn none_lost_before(t: &mut Tester<'_>, ms: u64) -> Outcome {
    let heard = none_lost(t, ms);
    t.depends_on(Duration::from_millis(100 - ms));
    heard
}

fn none_lost(t: &mut Tester<'_>, ms: u64) -> Outcome {
    let heard = t.emergencies(LOST, ms)?;
    ensure(heard.is_empty(), || format!("no emergency 8130h was expected, {} came", text(&heard)))
}

/// Checks that a request between heartbeats gets no answer.
fn unanswered(t: &mut Tester<'_>) -> Outcome {
    for _ in 0..3 {
        t.state(150)?;
        t.hear_ms(20)?;
        t.send_remote(t.error_control(), 1)?;
        t.silence_of(t.error_control(), 50)?;
    }
    Ok(())
}
