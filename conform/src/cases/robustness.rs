//! Beyond the plan: frames that break a protocol, come at the wrong time or are meant for others do not affect a
//! device.

use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{AbortCode, CobId, Frame};

use super::block::long_to_write;
use super::error_control::{HEARTBEAT, has_emergency};
use super::nmt::{received, reports, shows_its_state, values, where_it_applies};
use super::sdo::long_text;
use crate::answers;
use crate::case::{Case, case};
use crate::sdo::{self, initiate};
use crate::tester::{PATIENCE_MS, Record, text};
use crate::verdict::{Outcome, Verdict, ensure, failed, not_applicable};

const AVAILABLE: &str = "The server serves each request by itself, whatever came before.";

pub(crate) const CASES: &[Case] = &[
    case("301/7.2.4.3/1", "", "a request of other than eight bytes is not carried out", |t| {
        let (request, answer) = t.sdo_ids();
        for len in 0..8 {
            t.send(request, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0][..len])?;
            let heard = t.hear_id(answer, 20)?;
            // An abort is as right as silence.
            let read = heard.iter().any(|(_, frame)| frame.data().first() != Some(&0x80));
            ensure(!read, || format!("{len} bytes are answered with {}", text(&heard)))?;
            t.read(0x1000, 0)?;
        }
        Ok(())
    })
    .requires("A frame of an SDO has eight bytes; what a server does with another is left to it.")
    .recommended(),
    case("301/7.2.4.3/2", "", "a transfer that begins while another is under way is served or aborted", |t| {
        let (index, sub, default) = long_text(t)?;
        t.request(initiate(0x40, (index, sub), &[]))?;
        // CiA 301 leaves it open; a client that follows it aborts the other transfer first. So either transfer may be
        // aborted.
        let answer = t.request(initiate(0x40, (0x1000, 0), &[]))?;
        let of = |at| initiate(answer[0], at, &answer[4..]) == answer;
        let aborted = sdo::abort_of(&answer);
        let right = of((0x1000, 0)) || aborted.is_some() && of((index, sub));
        ensure(right, || format!("{answer:02X?} answers a read of 1000h"))?;
        if let Some(code) = aborted {
            t.is_refused(Err(code), &answers::COMMAND, "a transfer while another is under way")?;
        }
        t.abort((index, sub))?;
        let bytes = t.read_bytes(index, sub)?;
        ensure(bytes == default, || format!("{index:04X}:{sub:02X} is {} afterwards", t.shown((index, sub), &bytes)))
    })
    .requires("A request that begins a transfer is answered by that transfer, or by an abort."),
    case("301/7.2.4.3.17/10", "", "an abort by the client ends a transfer, and is not answered", |t| {
        let (index, sub, _) = long_text(t)?;
        t.request(initiate(0x40, (index, sub), &[]))?;
        t.abort((index, sub))?;
        let heard = t.hear_id(t.sdo_ids().1, 50)?;
        ensure(heard.is_empty(), || format!("{} answers an abort", text(&heard)))?;
        t.aborts([0x60, 0, 0, 0, 0, 0, 0, 0], &answers::COMMAND)
    })
    .requires("An abort by either side ends a transfer, and is not confirmed."),
    case("301/7.2.4.3/3", "", "after a flood of requests the server answers as before", |t| {
        let (request, answer) = t.sdo_ids();
        for _ in 0..100 {
            t.send(request, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
        }
        let heard = t.hear_id(answer, 500)?;
        ensure(heard.len() <= 100, || format!("{} answers to 100 requests", heard.len()))?;
        t.read(0x1000, 0).map(|_| ())
    })
    .requires(AVAILABLE),
    case("301/7.2.4.3/4", "", "after any first byte of a request the server answers as before", |t| {
        let (request, answer) = t.sdo_ids();
        // Commands that begin a download are left out, since they would write.
        for first in (0..=0xFF_u8).filter(|first| !matches!(first >> 5, 1 | 6)) {
            t.send(request, &[first, 0x00, 0x10, 0, 0, 0, 0, 0])?;
            let is_abort = first >> 5 == 4;
            if !is_abort {
                t.next(answer, t.settings.answer)?;
            }
            // Ends whatever may have begun. An abort has no answer; another case notices one.
            t.send(request, &[0x80, 0x00, 0x10, 0, 0, 0, 0, 0x08])?;
            t.hear_ms(5)?;
            if t.upload(0x1000, 0)?.is_err() {
                // That was a late answer to the frame before.
                t.hear_ms(PATIENCE_MS)?;
                t.read(0x1000, 0)?;
            }
        }
        Ok(())
    })
    .requires(AVAILABLE),
    case("301/7.2.4.3/5", "", "a remote frame of an SDO is not answered", |t| {
        let (request, answer) = t.sdo_ids();
        for id in [request, answer] {
            t.send_remote(id, 8)?;
            t.silence_of(answer, 50)?;
        }
        Ok(())
    })
    .requires("SDOs are data frames; a remote frame of their identifier asks for nothing."),
    case("301/7.2.8.3.1/1", "", "an NMT command that is unknown or of another length is ignored", |t| {
        let node = t.node.get();
        shows_its_state(t)?;
        for data in [&[][..], &[0x01], &[0x02], &[0x00, node], &[0x03, node], &[0x7F, node], &[0xFF, 0]] {
            t.send(CobId::NMT, data)?;
            reports(t, NmtState::PreOperational)?;
        }
        Ok(())
    })
    .requires("An NMT command has two bytes, and one of five command specifiers; anything else has no effect."),
    case("301/7.3.2.2.2/7", "", "an SDO request right behind the boot-up message is answered", |t| {
        t.nmt(NmtCommand::ResetNode)?;
        let booted = t.boot_up()?;
        t.needs("301/7.3.2.2.1/1", ensure(booted, || "no boot-up message comes"))?;
        t.read(0x1000, 0).map(|_| ())
    })
    .requires("In PRE-OPERATIONAL, which the boot-up message announces, there is SDO."),
    case("301/7.2.2.1/1", "", "an RPDO with too few bytes is not taken", |t| {
        let (id, pdo) = received(t)?;
        let before = values(t, &pdo)?;
        let sent: Vec<u8> = before.iter().map(|byte| byte ^ 1).collect();
        t.enter(NmtState::Operational)?;
        for len in 0..sent.len() {
            t.send(id, &sent[..len])?;
        }
        t.hear_ms(20)?;
        t.enter(NmtState::PreOperational)?;
        let after = values(t, &pdo)?;
        ensure(after == before, || format!("the objects were {before:02X?} and are {after:02X?}"))
    })
    .requires("An RPDO with fewer bytes than are mapped is not processed."),
    case("301/7.2.2.1/2", "", "an RPDO with too few bytes is reported by the emergency 8210h", |t| {
        let (id, _) = received(t)?;
        has_emergency(t)?;
        t.enter(NmtState::Operational)?;
        t.send(id, &[])?;
        let heard = t.hear_id(t.emergency_id(), PATIENCE_MS)?;
        let right = matches!(&heard[..], [(_, frame)] if frame.dlc() == 8 && frame.data().starts_with(&[0x10, 0x82]));
        ensure(right, || format!("the emergency 8210h was expected, {} came", text(&heard)))
    })
    .requires("An RPDO with fewer bytes than are mapped is reported by the emergency 8210h.")
    .recommended(),
    case("301/7.2.4.3.17/12", "", "what is refused is refused by another code than the general error", |t| {
        let answers = [t.download(0x1000, 0, &[0; 4])?, t.upload(0x1000, 1)?.map(drop), t.upload(0x1004, 0)?.map(drop)];
        let general = [AbortCode::GENERAL, AbortCode::CANNOT_TRANSFER];
        let refused = answers.into_iter().filter_map(Result::err).find(|code| general.contains(code));
        refused.map_or(Ok(()), |code| Err(failed(format!("writing 1000h, reading 1000:01 or 1004h: {code}"))))
    })
    .requires("The abort code says why a transfer is refused, where there is a code for it.")
    .recommended(),
    case("301/7.2.8.3.2.2/6", "", "the heartbeat is right in the mean", |t| {
        t.has(&[0x1017])?;
        t.write(0x1017, 0, PATIENCE_MS as u32)?;
        t.hears_in_the_mean(t.error_control(), PATIENCE_MS, 40)
    })
    .requires(HEARTBEAT)
    .recommended(),
    case("301/7.2.4.3/6", "", "the bytes of SDO answers that are reserved are 0", |t| {
        if let Ok(entry) = t.entry(0x1017, 0).and_then(|entry| t.allows(0x1017).map(|()| entry)) {
            let value = t.read_bytes(0x1017, 0)?;
            t.write_back(&entry, &value)?.ok();
            t.download_segments((0x1017, 0), &value)?.ok();
            for with_crc in [false, true] {
                where_it_applies(blocks(t.download_block((0x1017, 0), &value, with_crc)))?;
            }
        }
        if let Ok((index, sub, value)) = long_to_write(t) {
            t.download_segments((index, sub), &value)?.ok();
            where_it_applies(blocks(t.download_block((index, sub), &value, true)))?;
        }
        let answer = t.sdo_ids().1;
        let of_server = |record: &Record| !record.sent && record.frame.id() == answer;
        let written: Vec<Frame> =
            t.frames().iter().filter(|record| of_server(record)).map(|record| record.frame).collect();
        for frame in written {
            // Reserved bytes begin after the last field of the answer.
            let first = match frame.data() {
                [0x60, ..] => 4,
                [0x20 | 0x30 | 0xA1, ..] => 1,
                [0xA0 | 0xA4, ..] => 5,
                [0xA2, ..] => 3,
                _ => continue,
            };
            ensure(frame.data()[first..].iter().all(|&byte| byte == 0), || frame.to_string())?;
        }
        if let Ok((index, sub, _)) = long_text(t) {
            where_it_applies(blocks(t.upload_block((index, sub), false)))?;
            let end = t.frames().iter().rfind(|record| of_server(record)).map(|record| record.frame);
            let right =
                end.is_none_or(|end| end.data()[0] & 0xE3 != 0xC1 || end.data()[3..].iter().all(|&byte| byte == 0));
            ensure(right, || end.map_or(String::new(), |end| end.to_string()))?;
        }
        Ok(())
    })
    .requires("The bytes of an SDO message that are not used or reserved are 0.")
    .recommended(),
];

/// The case does not apply if blocks fail, since other cases judge them.
fn blocks<T>(outcome: Outcome<T>) -> Outcome<T> {
    outcome.map_err(|why| if let Verdict::Failed(why) = why { not_applicable(why) } else { why })
}
