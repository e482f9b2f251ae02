//! Beyond the plan: SDO block transfers with lost segments, or with segments one by one.

use lexican_eds::model::Entry;

use super::sdo::long_text;
use crate::case::{Case, case};
use crate::sdo::{initiate, message};
use crate::tester::Tester;
use crate::verdict::{Outcome, ensure, not_applicable};

pub(crate) const CASES: &[Case] = &[
    case("301/7.2.4.3.14/3", "", "segments of a block that were lost are sent again", |t| {
        let (index, sub, default) = long_text(t)?;
        t.request(initiate(0xA0, (index, sub), &[127]))?;
        t.send_request(message(&[0xA3], &[]))?;
        let segments = default.len().div_ceil(7);
        for _ in 0..segments {
            t.answer()?;
        }
        // Confirms the first segment only, or none if there is only one.
        let arrived = usize::from(segments > 1);
        t.send_request(message(&[0xA2, arrived as u8, 127], &[]))?;
        for (number, rest) in (1..).zip(default.chunks(7).skip(arrived)) {
            let segment = t.answer()?;
            let right = usize::from(segment[0] & 0x7F) == number && segment[1..].starts_with(rest);
            ensure(right, || format!("{segment:02X?} is not segment {number} of what was not confirmed"))?;
        }
        let end = t.request(message(&[0xA2, (segments - arrived) as u8, 127], &[]))?;
        ensure(end[0] & 0xE3 == 0xC1, || format!("{end:02X?} does not end the transfer"))?;
        t.send_request(message(&[0xA1], &[]))?;
        t.read(0x1000, 0).map(|_| ())
    })
    .requires("A server sends again the segments behind the one that the client confirmed last."),
    case("301/7.2.4.3.14/4", "", "blocks have as few segments as the client wants", |t| {
        let (index, sub, default) = long_text(t)?;
        t.request(initiate(0xA0, (index, sub), &[1]))?;
        let (mut bytes, mut next) = (Vec::<u8>::new(), message(&[0xA3], &[]));
        loop {
            let segment = t.request(next)?;
            ensure(segment[0] & 0x7F == 1, || format!("{segment:02X?} is not the only segment of a block"))?;
            let heard = t.hear_id(t.sdo_ids().1, 5)?;
            ensure(heard.is_empty(), || "a block of one segment has more")?;
            bytes.extend(&segment[1..]);
            next = message(&[0xA2, 1, 1], &[]);
            ensure(bytes.len() < default.len() + 14, || "a block transfer without end")?;
            if segment[0] & 0x80 != 0 {
                break;
            }
        }
        let end = t.request(next)?;
        ensure(end[0] & 0xE3 == 0xC1, || format!("{end:02X?} does not end the transfer"))?;
        t.send_request(message(&[0xA1], &[]))?;
        bytes.truncate(bytes.len() - usize::from(end[0] >> 2 & 7));
        ensure(bytes == default, || format!("{index:04X}:{sub:02X} is {}", t.shown((index, sub), &bytes)))
    })
    .requires("A server sends no more segments in a block than the client has asked for."),
    case("301/7.2.4.3.10/1", "", "segments of a block that did not come are asked for", |t| {
        let (index, sub, value) = long_to_write(t)?;
        t.download_block_without((index, sub), &value, true, 1)?;
        let after = t.read_bytes(index, sub)?;
        ensure(after == value, || format!("{index:04X}:{sub:02X} is {} afterwards", t.shown((index, sub), &after)))
    })
    .requires("A server confirms the last segment that came in sequence, and goes on from there."),
    case("301/7.2.4.3.9/3", "", "a segment whose number is not next is not taken", |t| {
        t.has(&[0x1017])?;
        let value = t.read(0x1017, 0)?;
        let answer = t.request(initiate(0xC2, (0x1017, 0), &[2]))?;
        ensure(answer[0] & 0xFB == 0xA0, || format!("{answer:02X?} does not begin a block"))?;
        t.send_request(message(&[0x82, 0x10, 0x27], &[]))?;
        let answer = t.answer_of_block()?;
        ensure(answer[..2] == [0xA2, 0], || format!("{answer:02X?} confirms segment 2, which came first"))?;
        t.abort((0x1017, 0))?;
        t.reads(0x1017, 0, value)
    })
    .requires("A server takes the segments of a block in sequence only."),
];

/// A writable entry whose value takes several segments, with that value.
pub(crate) fn long_to_write(t: &mut Tester<'_>) -> Outcome<(u16, u8, Vec<u8>)> {
    let entries = t.some_to_write("of more than four bytes can be written", |entry| {
        entry.access.readable() && entry.access.writable() && t.bits(entry).is_none_or(|bits| bits > 56)
    })?;
    for Entry { index, sub, .. } in entries {
        let value = t.read_bytes(index, sub)?;
        if (8..=127 * 7).contains(&value.len()) {
            return Ok((index, sub, value));
        }
    }
    Err(not_applicable("no value that can be written has several segments"))
}
