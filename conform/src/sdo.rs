//! SDO in the tester, byte by byte, since some cases break the protocol on purpose.

use lexican_eds::model::{Entry, Value};
use lexican_eds::types::DataType;
use lexican_runtime::wire::crc::Crc;
use lexican_runtime::{AbortCode, CobId, Duration};

use crate::answers::Accepted;
use crate::tester::{Tester, Write};
use crate::verdict::{Outcome, Verdict, ensure, failed, not_applicable};

/// The answer of the server to a whole transfer.
pub(crate) type Answer<T = ()> = Result<T, AbortCode>;

/// A bit in the first byte of a block transfer: its sender supports a checksum.
const CRC: u8 = 1 << 2;

/// The eight bytes of a request or an answer.
pub(crate) type Message = [u8; 8];

pub(crate) fn message(head: &[u8], rest: &[u8]) -> Message {
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(head.iter().chain(rest)).for_each(|(to, from)| *to = *from);
    bytes
}

pub(crate) fn initiate(command: u8, at: (u16, u8), rest: &[u8]) -> Message {
    let [low, high] = at.0.to_le_bytes();
    message(&[command, low, high, at.1], rest)
}

impl Tester<'_> {
    pub(crate) fn sdo_ids(&self) -> (CobId, CobId) {
        (CobId::of_node(0x600, self.node), CobId::of_node(0x580, self.node))
    }

    /// Sends a request, and returns its answer.
    pub(crate) fn request(&mut self, request: Message) -> Outcome<Message> {
        self.send_request(request)?;
        let answer = self.answer()?;
        if begins_block(request[0]) && abort_of(&answer) == Some(AbortCode::UNKNOWN_COMMAND) {
            self.has_blocks(request)?;
        }
        Ok(answer)
    }

    /// Block transfers are optional (CiA 301, 7.2.4.1): if one was refused as unknown, and that of another entry is as
    /// well, with or without checksum, the case does not apply.
    fn has_blocks(&mut self, refused: Message) -> Outcome {
        let is_download = begins_download(refused[0]);
        let is_other = |entry: &Entry| initiate(refused[0], (entry.index, entry.sub), &[])[1..4] != refused[1..4];
        let others = self.entries(|entry| {
            let access = entry.access;
            is_other(entry) && if is_download { access.writable() && self.may_write(entry) } else { access.readable() }
        });
        let Some(other) = others.first() else { return Ok(()) };
        let at = (other.index, other.sub);
        let size = self.size(other).unwrap_or(4) as u8;
        self.send_request(initiate(refused[0] ^ CRC, at, &[if is_download { size } else { 127 }]))?;
        if abort_of(&self.answer()?) == Some(AbortCode::UNKNOWN_COMMAND) {
            let what = if is_download { "download" } else { "upload" };
            return Err(not_applicable(format!("the SDO server refuses every block {what} with 0504 0001h")));
        }
        self.abort(at)
    }

    pub(crate) fn abort(&mut self, at: (u16, u8)) -> Outcome {
        self.send_request(initiate(0x80, at, &AbortCode::GENERAL.0.to_le_bytes()))
    }

    /// Sends a request without waiting for the answer.
    pub(crate) fn send_request(&mut self, request: Message) -> Outcome {
        if begins_download(request[0]) {
            self.writes(u16::from_le_bytes([request[1], request[2]]), request[3])?;
        }
        self.send(self.sdo_ids().0, &request)
    }

    pub(crate) fn answer(&mut self) -> Outcome<Message> {
        let frame = self.next(self.sdo_ids().1, self.settings.answer)?;
        if frame.is_some() {
            self.depends_on_no_time();
        } else {
            self.depends_on(Duration::from_micros(self.settings.answer.as_micros() / 2));
        }
        let frame = frame.ok_or_else(|| failed("the SDO server does not answer"))?;
        frame.data().try_into().map_err(|_| failed(format!("{frame} is no SDO")))
    }

    /// Returns the answer, which has to be an abort, or name the requested entry.
    fn initiated(&mut self, request: Message) -> Outcome<Answer<Message>> {
        let answer = self.request(request)?;
        ensure(answer[1..4] == request[1..4], || format!("{answer:02X?} answers {request:02X?}"))?;
        Ok(abort_of(&answer).map_or(Ok(answer), Err))
    }

    /// Reads an entry, in one message or in segments, as the server chooses.
    pub(crate) fn upload(&mut self, index: u16, sub: u8) -> Outcome<Answer<Vec<u8>>> {
        let answer = match self.initiated(initiate(0x40, (index, sub), &[]))? {
            Ok(answer) => answer,
            Err(code) => return Ok(Err(code)),
        };
        match answer[0] {
            // The answer has no size, so that of the data sheet is taken.
            0x42 => {
                let size = self.entry(index, sub).ok().and_then(|entry| self.size(&entry)).unwrap_or(4).min(4);
                return Ok(Ok(answer[4..4 + size].to_vec()));
            }
            0x43 | 0x47 | 0x4B | 0x4F => return Ok(Ok(answer[4..8 - usize::from(answer[0] >> 2 & 3)].to_vec())),
            0x40 | 0x41 => {}
            other => return Err(failed(format!("an upload is answered with {other:02X}"))),
        }
        self.upload_segments(&answer)
    }

    /// Reads the segments of an upload that this answer has begun.
    pub(crate) fn upload_segments(&mut self, begun: &Message) -> Outcome<Answer<Vec<u8>>> {
        let mut bytes = Vec::new();
        for toggle in [0, 0x10].into_iter().cycle() {
            let segment = self.request(message(&[0x60 | toggle], &[]))?;
            if let Some(code) = abort_of(&segment) {
                return Ok(Err(code));
            }
            ensure(segment[0] & 0xF0 == toggle, || format!("{segment:02X?} does not toggle"))?;
            bytes.extend(&segment[1..8 - usize::from(segment[0] >> 1 & 7)]);
            if segment[0] & 1 != 0 {
                break;
            }
            ensure(bytes.len() < 1 << 20, || "an upload without end")?;
        }
        let announced = u32::from_le_bytes([begun[4], begun[5], begun[6], begun[7]]) as usize;
        let right = begun[0] == 0x40 || announced == bytes.len();
        ensure(right, || format!("{announced} bytes are announced, {} come", bytes.len()))?;
        Ok(Ok(bytes))
    }

    /// Writes an entry, in one message if it fits.
    pub(crate) fn download(&mut self, index: u16, sub: u8, data: &[u8]) -> Outcome<Answer> {
        if data.is_empty() || data.len() > 4 {
            return self.download_segments((index, sub), data);
        }
        let command = 0x23 | (4 - data.len() as u8) << 2;
        let answer = self.initiated(initiate(command, (index, sub), data))?;
        answer.map(|answer| expect(&answer, 0x60)).map_or_else(|code| Ok(Err(code)), |ok| ok.map(Ok))
    }

    pub(crate) fn download_segments(&mut self, at: (u16, u8), data: &[u8]) -> Outcome<Answer> {
        let size = (data.len() as u32).to_le_bytes();
        if let Err(code) = self.initiated(initiate(0x21, at, &size))? {
            return Ok(Err(code));
        }
        let mut chunks = data.chunks(7).enumerate().peekable();
        while let Some((number, chunk)) = chunks.next() {
            let toggle = (number as u8 & 1) << 4;
            let last = u8::from(chunks.peek().is_none());
            let answer = self.request(message(&[toggle | (7 - chunk.len() as u8) << 1 | last], chunk))?;
            if let Some(code) = abort_of(&answer) {
                return Ok(Err(code));
            }
            expect(&answer, 0x20 | toggle)?;
        }
        Ok(Ok(()))
    }

    /// Writes bytes as one block.
    pub(crate) fn download_block(&mut self, at: (u16, u8), data: &[u8], with_crc: bool) -> Outcome {
        self.download_block_without(at, data, with_crc, 0)
    }

    /// Writes bytes as one block; the first `lost` segments are sent only when the server asks for them.
    pub(crate) fn download_block_without(
        &mut self,
        at: (u16, u8),
        data: &[u8],
        with_crc: bool,
        lost: usize,
    ) -> Outcome {
        let size = (data.len() as u32).to_le_bytes();
        let answer = self.initiated(initiate(0xC2 | u8::from(with_crc) << 2, at, &size))?.map_err(refused)?;
        // The server states whether it supports a checksum, whatever the client does.
        expect(&answer, 0xA0 | if with_crc { CRC } else { answer[0] & CRC })?;
        let segments = data.chunks(7).count();
        let room = usize::from(answer[4]);
        ensure((segments..=127).contains(&room), || format!("blocks of {room} segments, {segments} are to be sent"))?;
        if lost > 0 {
            self.send_segments(data, lost)?;
            let answer = self.answer_of_block()?;
            ensure(answer[..2] == [0xA2, 0], || format!("{answer:02X?} confirms segments that have not come"))?;
        }
        self.send_segments(data, 0)?;
        let answer = self.answer()?;
        let all = [0xA2, segments as u8];
        ensure(answer[..2] == all, || format!("{answer:02X?} does not confirm a block of {segments} segments"))?;
        let [low, high] = if with_crc { crc_of(data) } else { 0 }.to_le_bytes();
        let unused = (7 * segments - data.len()) as u8;
        let answer = self.request(message(&[0xC1 | unused << 2, low, high], &[]))?;
        expect(&answer, 0xA1)
    }

    /// Sends the segments of a block, from number `first` on.
    fn send_segments(&mut self, data: &[u8], first: usize) -> Outcome {
        let last = data.chunks(7).count() - 1;
        for (number, chunk) in data.chunks(7).enumerate().skip(first) {
            let end = u8::from(number == last) << 7;
            // Not by `send_request`, since the number of a segment is not a command.
            self.send(self.sdo_ids().0, &message(&[end | (number + 1) as u8], chunk))?;
        }
        Ok(())
    }

    /// The confirmation of a block that does not begin with its first segment. A server may wait for that segment until
    /// its own time-out, for which CiA 301 has no value.
    pub(crate) fn answer_of_block(&mut self) -> Outcome<Message> {
        match self.next(self.sdo_ids().1, self.settings.answer + self.settings.answer)? {
            Some(frame) => frame.data().try_into().map_err(|_| failed(format!("{frame} is no SDO"))),
            None => self.answer(),
        }
    }

    /// Reads an entry as a block.
    pub(crate) fn upload_block(&mut self, at: (u16, u8), with_crc: bool) -> Outcome<Vec<u8>> {
        let request = initiate(0xA0 | u8::from(with_crc) << 2, at, &[127]);
        let answer = self.initiated(request)?.map_err(refused)?;
        let sized = answer[0] & 2 != 0;
        expect(&answer, 0xC0 | answer[0] & 2 | if with_crc { CRC } else { answer[0] & CRC })?;
        let announced = u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]) as usize;
        self.send_request(message(&[0xA3], &[]))?;
        let mut bytes = Vec::new();
        for number in 1.. {
            let segment = self.answer()?;
            let is_next = segment[0] & 0x7F == number && number <= 127;
            ensure(is_next, || format!("{segment:02X?} is not segment {number} of a block"))?;
            bytes.extend(&segment[1..]);
            if segment[0] & 0x80 != 0 {
                break;
            }
        }
        let confirmed = (bytes.len() / 7) as u8;
        let end = self.request(message(&[0xA2, confirmed, 127], &[]))?;
        expect(&end, 0xC1 | end[0] & 0x1C)?;
        bytes.truncate(bytes.len() - usize::from(end[0] >> 2 & 7));
        let right = !sized || announced == bytes.len();
        ensure(right, || format!("{announced} bytes are announced, {} come", bytes.len()))?;
        let (crc, own) = (u16::from_le_bytes([end[1], end[2]]), crc_of(&bytes));
        ensure(!with_crc || crc == own, || format!("the checksum is {crc:04X}, of these bytes it is {own:04X}"))?;
        self.send_request(message(&[0xA1], &[]))?;
        self.silence_of(self.sdo_ids().1, 20)?;
        Ok(bytes)
    }

    // Frequent operations.

    /// The bytes of an entry; an abort fails the case.
    pub(crate) fn read_bytes(&mut self, index: u16, sub: u8) -> Outcome<Vec<u8>> {
        self.upload(index, sub)?.map_err(|code| failed(format!("reading {index:04X}:{sub:02X}: {code}")))
    }

    /// The number in an entry; an abort fails the case.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Outcome<u64> {
        Ok(number(&self.read_bytes(index, sub)?))
    }

    pub(crate) fn reads(&mut self, index: u16, sub: u8, expected: u64) -> Outcome {
        let bytes = self.read_bytes(index, sub)?;
        let right = &expected.to_le_bytes()[..bytes.len().min(8)];
        ensure(number(&bytes) == expected, || {
            let [value, right] = [&bytes, right].map(|bytes| self.shown((index, sub), bytes));
            format!("{index:04X}:{sub:02X} is {value}, not {right}")
        })
    }

    /// Checks that the value is the default of the data sheet, if it has one.
    pub(crate) fn is_default(&mut self, entry: &Entry) -> Outcome {
        let (index, sub) = (entry.index, entry.sub);
        let bytes = self.read_bytes(index, sub)?;
        let default = self.power_on_value(entry).unwrap_or(bytes.clone());
        // A device may pad strings to a fixed length.
        let fills = entry.data_type == DataType::OctetString
            && bytes.strip_prefix(&default[..]).is_some_and(|rest| rest.iter().all(|&byte| byte == 0));
        ensure(fills || bytes == default, || {
            let [value, default] = [bytes, default].map(|bytes| self.shown((index, sub), &bytes));
            format!("{index:04X}:{sub:02X} is {value}, by default {default}")
        })
    }

    /// The size with which a number is written: its own, or four bytes if the device takes nothing else.
    fn written_size(&self, index: u16, sub: u8) -> Outcome<usize> {
        let entry = self.entry(index, sub)?;
        let own = self.size(&entry).unwrap_or(4).min(4);
        Ok(if self.sheet.device.sdo_writes_four_bytes { 4 } else { own })
    }

    /// Writes a number in the size of the data sheet.
    pub(crate) fn try_write(&mut self, index: u16, sub: u8, value: u32) -> Outcome<Answer> {
        let size = self.written_size(index, sub)?;
        self.download(index, sub, &value.to_le_bytes()[..size])
    }

    /// Writes a value that was read before.
    pub(crate) fn write_back(&mut self, entry: &Entry, bytes: &[u8]) -> Outcome<Answer> {
        let mut padded = bytes.to_vec();
        if self.sheet.device.sdo_writes_four_bytes && bytes.len() < 4 {
            padded.resize(4, 0);
        }
        self.download(entry.index, entry.sub, &padded)
    }

    /// Writes a number within the limits of the data sheet; if it is outside, the case does not apply.
    pub(crate) fn write(&mut self, index: u16, sub: u8, value: u32) -> Outcome {
        let shown = self.shown((index, sub), &value.to_le_bytes()[..self.written_size(index, sub)?]);
        if !self.has_value(index, sub, value) {
            return Err(not_applicable(format!("{index:04X}:{sub:02X} is never {shown}")));
        }
        let answer = self.try_write(index, sub, value)?;
        answer.map_err(|code| failed(format!("writing {shown} to {index:04X}:{sub:02X}: {code}")))
    }

    /// Whether a number is within the limits of the data sheet.
    pub(crate) fn has_value(&self, index: u16, sub: u8, value: u32) -> bool {
        // A signature is a command; the limits apply to the value that is read.
        if matches!(index, 0x1010 | 0x1011) {
            return true;
        }
        let Some(entry) = self.sheet.device.entry(index, sub) else { return true };
        let limit = |limit: &Option<Value>| limit.as_ref().and_then(Value::as_integer);
        let value = i128::from(value);
        limit(&entry.low).is_none_or(|low| low <= value) && limit(&entry.high).is_none_or(|high| value <= high)
    }

    pub(crate) fn apply(&mut self, write: Write) -> Outcome {
        self.write(write.index, write.sub, write.value)
    }

    /// Writes without waiting for the answer, for cases that first wait for something else.
    pub(crate) fn send_write(&mut self, write: Write) -> Outcome {
        let size = self.written_size(write.index, write.sub)?;
        let command = 0x23 | (4 - size as u8) << 2;
        self.send_request(initiate(command, (write.index, write.sub), &write.value.to_le_bytes()[..size]))
    }

    /// Checks that a write is refused, and changes nothing.
    pub(crate) fn refuses(&mut self, index: u16, sub: u8, value: u32, accepted: &Accepted) -> Outcome {
        let size = self.written_size(index, sub)?;
        self.refuses_bytes(index, sub, &value.to_le_bytes()[..size], accepted)
    }

    pub(crate) fn refuses_bytes(&mut self, index: u16, sub: u8, data: &[u8], accepted: &Accepted) -> Outcome {
        let readable = self.entry(index, sub).is_ok_and(|entry: Entry| entry.access.readable());
        let before = if readable { Some(self.upload(index, sub)?) } else { None };
        let answer = self.download(index, sub, data)?;
        let what = format!("writing {} to {index:04X}:{sub:02X}", self.shown((index, sub), data));
        self.is_refused(answer, accepted, &what)?;
        let after = if readable { Some(self.upload(index, sub)?) } else { None };
        ensure(before == after, || format!("{index:04X}:{sub:02X} is not what it was before a refused write"))
    }

    pub(crate) fn refuses_read(&mut self, index: u16, sub: u8, accepted: &Accepted) -> Outcome {
        let answer = self.upload(index, sub)?;
        self.is_refused(answer.map(|_| ()), accepted, &format!("reading {index:04X}:{sub:02X}"))
    }

    /// Checks that a message that breaks the protocol is aborted, and that the server is ready afterwards.
    pub(crate) fn aborts(&mut self, request: Message, accepted: &Accepted) -> Outcome {
        let answer = self.request(request)?;
        let got = abort_of(&answer).map_or(Ok(()), Err);
        self.is_refused(got, accepted, &format!("{request:02X?}"))?;
        self.read(0x1000, 0).map(|_| ())
    }

    /// Checks that something was refused with an accepted code; one that is only observed is noted in the report.
    pub(crate) fn is_refused(&mut self, answer: Answer, accepted: &Accepted, what: &str) -> Outcome {
        self.expect_one_of(accepted.to_string());
        match answer {
            Ok(()) => Err(failed(format!("{what} is taken"))),
            Err(code) if accepted.takes(code) => {
                if accepted.observed.contains(&code) {
                    self.observe(format!(
                        "{what} is refused with {code}, which is not what CiA's test takes ({})",
                        accepted.source
                    ));
                }
                Ok(())
            }
            Err(code) => Err(failed(format!("{what} is refused with {code}"))),
        }
    }
}

/// The little-endian number of an SDO's data.
pub(crate) fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

/// Whether a command begins a download: expedited, in segments or in blocks.
const fn begins_download(command: u8) -> bool {
    command >> 5 == 1 || command >> 5 == 6 && command & 1 == 0
}

const fn begins_block(command: u8) -> bool {
    command >> 5 == 6 && command & 1 == 0 || command >> 5 == 5 && command & 3 == 0
}

fn refused(code: AbortCode) -> Verdict {
    failed(format!("a block transfer is refused: {code}"))
}

pub(crate) fn abort_of(answer: &Message) -> Option<AbortCode> {
    let [.., a, b, c, d] = *answer;
    (answer[0] == 0x80).then_some(AbortCode(u32::from_le_bytes([a, b, c, d])))
}

fn expect(answer: &Message, command: u8) -> Outcome {
    ensure(answer[0] == command, || format!("{answer:02X?} came, its command should be {command:02X}"))
}

fn crc_of(bytes: &[u8]) -> u16 {
    let mut crc = Crc::new();
    crc.update(bytes);
    crc.get()
}
