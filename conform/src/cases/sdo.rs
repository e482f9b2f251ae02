//! 1 and 2: the data sheet, and SDO.

use lexican_runtime::CobId;
use lexican_runtime::wire::nmt::NmtCommand;

use super::storing::{BOTH, changed_parameters, forget};
use crate::answers::{self, Accepted};
use crate::case::{Case, Scope, case};
use crate::sdo::{abort_of, initiate};
use crate::tester::Tester;
use crate::verdict::{Outcome, ensure, failed, not_applicable};

const LENGTH: &str = "A server aborts a write of more or fewer bytes than the data type of the entry has.";
const RANGE: &str = "A server aborts a write of a value beyond the limits of the entry.";
const SEGMENTS: &str = "A server that takes segments writes an entry of any size by them.";
const BLOCKS: &str = "A server with block transfer takes an entry as a block.";
const CHECKSUM: &str =
    "A block whose initiation agrees on it ends with a CRC of its data, and is refused if that is wrong.";

pub(crate) const CASES: &[Case] = &[
    case("306-1/6/1", "1.0", "the data sheet has no errors by which no device could be tested", |t| {
        ensure(!t.sheet.is_unfit, || t.sheet.findings.lines.first().cloned().unwrap_or_default())
    })
    .requires("A data sheet follows the format of CiA 306-1, and describes a device of CiA 301.")
    .about(Scope::DataSheet),
    case("306-1/6/2", "", "the data sheet contradicts neither itself nor the standard", |t| {
        if t.sheet.is_unfit {
            return Err(not_applicable("it has errors"));
        }
        ensure(t.sheet.findings.lines.is_empty(), || &t.sheet.findings)
    })
    .requires("What a data sheet says of an object is what CiA 301 says of it, and agrees with the rest of the sheet.")
    .about(Scope::DataSheet)
    .recommended(),
    case("301/7.2.4.3.6/1", "2.1", "1000h is read in one message", |t| {
        let answer = t.request([0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
        // With or without its size.
        let right = matches!(answer, [0x42 | 0x43, 0x00, 0x10, 0, ..]);
        ensure(right, || format!("{answer:02X?}"))?;
        let entry = t.entry(0x1000, 0)?;
        let default = t.power_on_value(&entry);
        ensure(default.is_none_or(|default| default == answer[4..]), || {
            format!("1000h is {}", t.shown((0x1000, 0), &answer[4..]))
        })
    })
    .requires("A server sends up to four bytes in the answer to the request itself (expedited)."),
    case("301/7.5.2/1", "2.2", "communication parameters are written and read back", |t| {
        changed_parameters(t).map(|_| ())
    })
    .requires("Communication parameters that are rw take a value that is allowed, and show it."),
    case("301/7.2.4.3.17/1", "2.3", "1000h is not written", |t| t.refuses(0x1000, 0, 0, &answers::READ_ONLY))
        .requires("A server aborts a write to an entry that is ro or const, and changes nothing."),
    case("301/7.2.4.3.17/2", "2.4", "an entry that is write-only is not read", |t| {
        let entries = t.some("is write-only", |entry| !entry.access.readable())?;
        t.refuses_read(entries[0].index, entries[0].sub, &answers::WRITE_ONLY)
    })
    .requires("A server aborts a read of an entry that is wo."),
    case("301/7.2.4.3.17/3", "2.5", "1000h:01 does not exist", |t| t.refuses_read(0x1000, 1, &answers::NO_SUB_INDEX))
        .requires("A server aborts a transfer of a sub-index that the object does not have."),
    case("301/7.2.4.3.17/4", "2.6", "1004h does not exist", |t| t.refuses_read(0x1004, 0, &answers::NO_OBJECT))
        .requires("A server aborts a transfer of an object that the device does not have."),
    case("301/7.2.4.3.17/5", "2.7", "an unknown command is aborted", |t| {
        t.aborts([0xE0, 0x00, 0x10, 0, 0, 0, 0, 0], &answers::COMMAND)
    })
    .requires("A server aborts a request whose command specifier is none of the protocol's."),
    case("301/7.2.4.3.17/6", "2.8", "four bytes do not fit into one or two", |t| {
        if t.sheet.device.sdo_writes_four_bytes {
            return Err(not_applicable("every write to this device has four bytes"));
        }
        for bits in [8, 16] {
            of_another_length(t, bits, &[0; 4], &answers::TOO_LONG)?;
        }
        Ok(())
    })
    .requires(LENGTH),
    case("301/7.2.4.3.17/7", "2.9", "one byte does not fill two or four", |t| {
        for bits in [16, 32] {
            of_another_length(t, bits, &[0], &answers::TOO_SHORT)?;
        }
        Ok(())
    })
    .requires(LENGTH),
    case("301/7.2.4.3.17/11", "", "five bytes in segments do not fit into four", |t| {
        of_another_length(t, 32, &[0; 5], &answers::TOO_LONG)
    })
    .requires(LENGTH),
    case("301/7.2.4.3.17/8", "2.10", "a value above its limit is not written", |t| {
        beyond_its_limit(t, |low_high| low_high.1.checked_add(1), &answers::TOO_HIGH)
    })
    .requires(RANGE),
    case("301/7.2.4.3.17/9", "2.11", "a value below its limit is not written", |t| {
        beyond_its_limit(t, |low_high| low_high.0.checked_sub(1), &answers::TOO_LOW)
    })
    .requires(RANGE),
    case("301/7.5.2.33/1", "2.12", "1200h has the identifiers of the default server", |t| {
        t.has(&[0x1200])?;
        let node = u64::from(t.node.get());
        t.reads(0x1200, 1, 0x600 + node)?;
        t.reads(0x1200, 2, 0x580 + node)
    })
    .requires("1200h, where it exists, has 600h and 580h + node-ID as the identifiers of the default SDO."),
    case("301/7.2.4.3.7/1", "2.13", "1000h is read by a client that goes on with segments", |t| {
        // Four bytes are transferred at once, so no segment can be requested.
        t.read(0x1000, 0)?;
        t.aborts([0x60, 0, 0, 0, 0, 0, 0, 0], &answers::COMMAND)
    })
    .requires("A request for a segment is aborted while no transfer is under way."),
    case("301/7.2.4.3.4/1", "2.14", "100Ch is written in segments", |t| in_segments(t, 0x100C)).requires(SEGMENTS),
    case("301/7.2.4.3.4/2", "2.15", "1017h is written in segments", |t| in_segments(t, 0x1017)).requires(SEGMENTS),
    case("301/7.2.4.3.5/1", "", "a segment whose toggle bit is wrong is not taken", |t| {
        t.has(&[0x1017])?;
        let value = t.read(0x1017, 0)?;
        let answer = t.request(initiate(0x21, (0x1017, 0), &[2]))?;
        if answer[0] != 0x60 {
            return Err(not_applicable("1017h is not written in segments"));
        }
        let segment = [0x1B, 0x10, 0x27, 0, 0, 0, 0, 0];
        t.send_request(segment)?;
        match t.next(t.sdo_ids().1, t.settings.answer)? {
            Some(frame) => {
                let code = frame.data().try_into().ok().and_then(|answer| abort_of(&answer));
                t.is_refused(code.map_or(Ok(()), Err), &answers::TOGGLE, &format!("{segment:02X?}"))?;
            }
            // lely-core sends no answer.
            None => {
                t.observe("a segment whose toggle bit is wrong is not answered, which CiA 301 leaves open".to_owned());
                t.abort((0x1017, 0))?;
            }
        }
        t.reads(0x1017, 0, value)
    })
    .requires("The toggle bit begins with 0 and alternates; a server does not take a segment in which it does not."),
    case("301/7.2.4.3.6/2", "2.16", "more than four bytes are read in segments", |t| {
        let (index, sub, default) = long_text(t)?;
        let answer = t.request(initiate(0x40, (index, sub), &[]))?;
        let size = (default.len() as u32).to_le_bytes();
        let sized = answer[0] == 0x41 && answer[4..] == size;
        ensure(sized || answer[0] == 0x40, || format!("{answer:02X?} begins {} bytes", default.len()))?;
        let bytes = t.upload_segments(&answer)?.map_err(|code| failed(format!("a segment is refused: {code}")))?;
        ensure(bytes == default, || format!("{index:04X}:{sub:02X} is {}", t.shown((index, sub), &bytes)))
    })
    .requires("More than four bytes are announced by the first answer, and follow in segments."),
    case("301/7.2.4.3.7/2", "2.17", "a wrong toggle bit is aborted", |t| {
        let (index, sub, _) = long_text(t)?;
        t.request([0x40, index as u8, (index >> 8) as u8, sub, 0, 0, 0, 0])?;
        t.aborts([0x70, 0, 0, 0, 0, 0, 0, 0], &answers::TOGGLE)
    })
    .requires("The toggle bit begins with 0 and alternates; a server aborts a request in which it does not."),
    case("301/7.2.4.3.7/3", "2.18", "segments come to their end, time and again", |t| {
        let (index, sub, default) = long_text(t)?;
        for _ in 0..3 {
            let bytes = t.read_bytes(index, sub)?;
            ensure(bytes == default, || format!("{index:04X}:{sub:02X} is {}", t.shown((index, sub), &bytes)))?;
            // There is no segment after the last one.
            t.aborts([0x60, 0, 0, 0, 0, 0, 0, 0], &answers::COMMAND)?;
        }
        Ok(())
    })
    .requires("An upload has so many segments as its data needs, and the last one is marked as such."),
    case("301/7.2.4.3.13/1", "2.19", "1000h is read as a block without checksum", |t| {
        let bytes = t.upload_block((0x1000, 0), false)?;
        let value = t.read_bytes(0x1000, 0)?;
        ensure(bytes == value, || {
            let [block, value] = [bytes, value].map(|bytes| t.shown((0x1000, 0), &bytes));
            format!("{block} as a block, {value} else")
        })
    })
    .requires("A server with block transfer sends an entry as a block, or in segments where the client allows it."),
    case("301/7.2.4.3.9/1", "2.20", "100Ch is written as a block without checksum", |t| as_block(t, 0x100C, false))
        .requires(BLOCKS),
    case("301/7.2.4.3.9/2", "2.21", "1017h is written as a block without checksum", |t| as_block(t, 0x1017, false))
        .requires(BLOCKS),
    case("301/7.2.4.3.14/1", "2.22", "several segments are read as a block without checksum", |t| {
        text_as_block(t, false)
    })
    .requires("A block has segments numbered from 1, and the end says how many bytes of the last one are unused."),
    case("301/7.2.4.3.16/1", "2.23", "several segments are read as a block with checksum", |t| text_as_block(t, true))
        .requires(CHECKSUM),
    case("301/7.2.4.3.16/2", "2.24", "100Ch is written as a block with checksum", |t| as_block(t, 0x100C, true))
        .requires(CHECKSUM),
    case("301/7.2.4.3.16/3", "2.25", "1017h is written as a block with checksum", |t| as_block(t, 0x1017, true))
        .requires(CHECKSUM),
    case("301/7.2.4.3.13/2", "2.26", "a block of 128 segments is refused", |t| {
        let (index, sub, _) = long_text(t)?;
        let begin = [0xA0, index as u8, (index >> 8) as u8, sub, 128, 0, 0, 0];
        t.aborts(begin, &answers::BLOCK_SIZE)
    })
    .requires("A block has 1 to 127 segments; a server aborts a request for another number."),
    case("301/7.2.4.3.14/2", "2.27", "segment 128 of a block is not confirmed", |t| {
        let (index, sub, default) = long_text(t)?;
        t.request([0xA0, index as u8, (index >> 8) as u8, sub, 127, 0, 0, 0])?;
        t.send_request([0xA3, 0, 0, 0, 0, 0, 0, 0])?;
        for _ in default.chunks(7) {
            t.answer()?;
        }
        t.aborts([0xA2, 128, 127, 0, 0, 0, 0, 0], &answers::SEQUENCE)
    })
    .requires("A server aborts a confirmation of a segment that it has not sent."),
    case("301/7.5.2.33/2", "2.28", "the parameters of more servers are read", |t| {
        for index in servers(t)? {
            channel_is_default(t, index)?;
        }
        Ok(())
    })
    .requires("The parameters of an additional SDO server can be read, and have the values of the data sheet."),
    case("301/7.5.2.33/3", "2.29", "the parameters of more servers are the defaults after a reset", |t| {
        for (number, index) in servers(t)?.into_iter().enumerate() {
            configure_channel(t, index, number as u32)?;
            t.reset(NmtCommand::ResetCommunication)?;
            channel_is_default(t, index)?;
        }
        Ok(())
    })
    .requires("The parameters of an additional SDO server are the defaults after a reset, unless they were stored."),
    case("301/7.5.2.34/1", "2.30", "the parameters of clients are stored", |t| {
        let clients: Vec<u16> = (0x1280..=0x12FF).filter(|&index| t.entry(index, 1).is_ok()).collect();
        if clients.is_empty() {
            return Err(not_applicable("no object 1280h to 12FFh"));
        }
        t.entry(0x1010, 1)?;
        for &index in &clients {
            for sub in [1, 2] {
                can_be_put_back(t, index, sub)?;
            }
        }
        for (number, &index) in clients.iter().enumerate() {
            configure_channel(t, index, number as u32)?;
        }
        t.write(0x1010, 1, u32::from_le_bytes(*b"save"))?;
        t.reset(NmtCommand::ResetCommunication)?;
        for (number, &index) in clients.iter().enumerate() {
            t.reads(index, 1, u64::from(0x6C0 + 2 * number as u32))?;
            t.reads(index, 2, u64::from(0x6C1 + 2 * number as u32))?;
        }
        forget(t)
    })
    .requires("The parameters of SDO clients are among those that 1010h stores.")
    .needs(BOTH),
];

/// Tries the writable numbers of a width, in which only the length of the data is wrong.
fn of_another_length(t: &mut Tester<'_>, bits: u8, data: &[u8], accepted: &Accepted) -> Outcome {
    let wanted = |entry: &lexican_eds::model::Entry| entry.access.writable() && t.bits(entry) == Some(bits);
    let entries = t.some_to_write(&format!("of {bits} bits can be written"), wanted)?;
    for entry in entries {
        t.refuses_bytes(entry.index, entry.sub, data, accepted)?;
    }
    Ok(())
}

fn beyond_its_limit(t: &mut Tester<'_>, beyond: fn((i128, i128)) -> Option<i128>, accepted: &Accepted) -> Outcome {
    let limited = super::dictionary::limited(t)?;
    for (entry, low, high) in limited {
        let fits = |value: &i128| (0..=super::dictionary::highest(t, &entry)).contains(value);
        let value =
            beyond((low, high)).filter(fits).ok_or_else(|| not_applicable("the limits are those of the type"))?;
        super::pdo_mapping::switch_off_of(t, entry.index)?;
        t.refuses(entry.index, entry.sub, value as u32, accepted)?;
    }
    Ok(())
}

/// Ten seconds: long enough to disturb nothing.
const LONG_MS: u32 = 10_000;

fn in_segments(t: &mut Tester<'_>, index: u16) -> Outcome {
    t.has(&[index])?;
    let answer = t.download_segments((index, 0), &LONG_MS.to_le_bytes()[..2])?;
    answer.map_err(|code| failed(format!("segments are refused: {code}")))?;
    t.reads(index, 0, u64::from(LONG_MS))
}

fn as_block(t: &mut Tester<'_>, index: u16, with_crc: bool) -> Outcome {
    t.has(&[index])?;
    t.download_block((index, 0), &LONG_MS.to_le_bytes()[..2], with_crc)?;
    t.reads(index, 0, u64::from(LONG_MS))?;
    if !with_crc {
        return Ok(());
    }
    // A wrong checksum is noticed.
    t.request(initiate(0xC6, (index, 0), &[2]))?;
    t.request([0x81, 0, 0, 0, 0, 0, 0, 0])?;
    t.aborts([0xD5, 0xFF, 0xFF, 0, 0, 0, 0, 0], &answers::CHECKSUM)?;
    t.reads(index, 0, u64::from(LONG_MS))
}

/// A text of more than four bytes whose value is in the data sheet.
pub(crate) fn long_text(t: &Tester<'_>) -> Outcome<(u16, u8, Vec<u8>)> {
    let texts = t.entries(|entry| entry.access.readable()).into_iter().filter_map(|entry| {
        let bytes = t.power_on_value(&entry)?;
        Some((entry.index, entry.sub, bytes))
    });
    texts
        .into_iter()
        .max_by_key(|(.., bytes)| bytes.len())
        .filter(|(.., bytes)| bytes.len() > 4)
        .ok_or_else(|| not_applicable("no entry of more than four bytes has a default"))
}

fn text_as_block(t: &mut Tester<'_>, with_crc: bool) -> Outcome {
    let (index, sub, default) = long_text(t)?;
    let bytes = t.upload_block((index, sub), with_crc)?;
    ensure(bytes == default, || format!("{index:04X}:{sub:02X} is {} as a block", t.shown((index, sub), &bytes)))
}

fn servers(t: &Tester<'_>) -> Outcome<Vec<u16>> {
    let servers: Vec<u16> = (0x1201..=0x127F).filter(|&index| t.entry(index, 1).is_ok()).collect();
    if servers.is_empty() { Err(not_applicable("no object 1201h to 127Fh")) } else { Ok(servers) }
}

/// Configures two COB-IDs that no service has by default, for the SDO channel at `index`.
fn configure_channel(t: &mut Tester<'_>, index: u16, number: u32) -> Outcome {
    for sub in [1, 2] {
        let id = 0x6BF + 2 * number + u32::from(sub);
        t.write(index, sub, 1 << 31 | id)?;
        t.write(index, sub, id)?;
        t.reads(index, sub, u64::from(id))?;
    }
    if index < 0x1280 {
        // Checks that the channel works.
        let (request, answer) = ((0x6C0 + 2 * number) as u16, (0x6C1 + 2 * number) as u16);
        let (request, answer) = (CobId::standard(request), CobId::standard(answer));
        let (Some(request), Some(answer)) = (request, answer) else { return Err(failed("too many servers")) };
        t.send(request, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
        let served = t.next(answer, t.settings.answer)?;
        let right = served.is_some_and(|frame| frame.data().starts_with(&[0x43, 0x00, 0x10, 0]));
        ensure(right, || format!("the server at {index:04X}h does not answer"))?;
    }
    Ok(())
}

/// Checks that a stored value can be put back: 1011h restores it, or the device accepts the former value again, which
/// it may not if that is a default that no service may have, such as 0.
fn can_be_put_back(t: &mut Tester<'_>, index: u16, sub: u8) -> Outcome {
    let before = t.read(index, sub)? as u32;
    let restores = t.entry(0x1011, 1).is_ok();
    let is_taken = restores || before >> 31 != 0 || !CobId::from_parameter(before).is_restricted();
    if is_taken {
        Ok(())
    } else {
        Err(not_applicable(format!("{index:04X}:{sub:02X} is {before:03X}h, and could not be put back")))
    }
}

fn channel_is_default(t: &mut Tester<'_>, index: u16) -> Outcome {
    t.entries(|entry| entry.index == index).iter().try_for_each(|entry| t.is_default(entry))
}
