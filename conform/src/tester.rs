//! The tester: it sends frames, hears frames and waits. Of the device under test it knows the data sheet, the
//! node-ID, and what makes it do the things that no CANopen service can ask for.

use std::fmt::Display;

use lexican_eds::model::{Device, Entry, Value};
use lexican_runtime::host::Link;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

/// How long an answer may take.
pub const PATIENCE_MS: u64 = 100;
pub const PATIENCE: Duration = Duration::from_millis(PATIENCE_MS);

/// Why a case was not passed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The data sheet says that the device lacks what the case is about.
    NotApplicable(String),
    /// The device does something else.
    Failed(String),
}

/// The result of a case, or of a step of it.
pub type Outcome<T = ()> = Result<T, Verdict>;

/// One case of the plan.
pub struct Case {
    /// The number in the plan.
    pub id: &'static str,
    /// What has to hold.
    pub title: &'static str,
    /// Finds out whether it does.
    pub run: fn(&mut Tester<'_>) -> Outcome,
}

pub const fn case(id: &'static str, title: &'static str, run: fn(&mut Tester<'_>) -> Outcome) -> Case {
    Case { id, title, run }
}

/// A value to be written by SDO.
#[derive(Clone, Copy, Debug)]
pub struct Write {
    pub index: u16,
    pub sub: u8,
    pub value: u32,
}

/// What the tester has the device do beyond CANopen: for each kind of device another, and for some an operator.
#[derive(Clone, Copy, Debug)]
pub struct Stimuli {
    /// Lets the device send an emergency.
    pub emergency: Write,
    /// Lets an input change again and again, faster than every 20 ms; an object that TPDOs map shows it.
    pub input_starts: Write,
    pub input_stops: Write,
    pub input: (u16, u8),
}

/// The data sheet of the device, and what the linter finds in it.
pub struct Sheet {
    pub device: Device,
    pub findings: String,
}

/// A frame that was heard.
pub type Heard = (Instant, Frame);

/// The tester, on one device.
pub struct Tester<'a> {
    pub sheet: &'a Sheet,
    pub node: NodeId,
    pub stimuli: &'a Stimuli,
    link: &'a mut dyn Link,
}

impl<'a> Tester<'a> {
    pub fn new(link: &'a mut dyn Link, node: NodeId, sheet: &'a Sheet, stimuli: &'a Stimuli) -> Self {
        Tester { sheet, node, stimuli, link }
    }

    /// Runs one case on a device that has its defaults.
    pub fn run(&mut self, case: &Case) -> Outcome {
        self.nmt(NmtCommand::ResetNode)?;
        // Whether it boots as it should is for some of the cases to judge.
        self.hear(PATIENCE)?;
        (case.run)(self)
    }

    // What is sent.

    pub fn send(&mut self, id: CobId, data: &[u8]) -> Outcome {
        self.put(&Frame::new(id, data).expect("cases send frames of up to eight bytes"))
    }

    pub fn send_remote(&mut self, id: CobId, len: usize) -> Outcome {
        self.put(&Frame::remote(id, len as u8).expect("cases ask for up to eight bytes"))
    }

    fn put(&mut self, frame: &Frame) -> Outcome {
        self.link.send(frame).map_err(failed)
    }

    /// A command to this device.
    pub fn nmt(&mut self, command: NmtCommand) -> Outcome {
        self.nmt_to(command, self.node.get())
    }

    pub fn nmt_to(&mut self, command: NmtCommand, node: u8) -> Outcome {
        self.send(CobId::NMT, &[command.code(), node])
    }

    /// Commands the state, and lets pass what comes of it.
    pub fn enter(&mut self, state: NmtState) -> Outcome {
        self.nmt(match state {
            NmtState::Operational => NmtCommand::Start,
            NmtState::Stopped => NmtCommand::Stop,
            _ => NmtCommand::EnterPreOperational,
        })?;
        self.hear(Duration::from_millis(5))?;
        Ok(())
    }

    /// A SYNC, with a counter if the device expects one.
    pub fn sync(&mut self, counter: Option<u8>) -> Outcome {
        let data = counter.map(|counter| [counter]);
        self.send(CobId::SYNC, data.as_ref().map_or(&[], |data| data))
    }

    // What is heard.

    pub fn now(&self) -> Instant {
        self.link.now()
    }

    /// All that is heard within `span`.
    pub fn hear(&mut self, span: Duration) -> Outcome<Vec<Heard>> {
        let (end, mut heard) = (self.now() + span, Vec::new());
        while let Some(frame) = self.link.receive_frame(end).map_err(failed)? {
            heard.push((self.now(), frame));
        }
        Ok(heard)
    }

    pub fn hear_ms(&mut self, ms: u64) -> Outcome<Vec<Heard>> {
        self.hear(Duration::from_millis(ms))
    }

    /// The frames of one identifier within `ms`.
    pub fn hear_id(&mut self, id: CobId, ms: u64) -> Outcome<Vec<Heard>> {
        let heard = self.hear_ms(ms)?;
        Ok(heard.into_iter().filter(|(_, frame)| frame.id() == id).collect())
    }

    /// The next frame of one identifier.
    pub fn next(&mut self, id: CobId, within: Duration) -> Outcome<Option<Frame>> {
        let end = self.now() + within;
        while let Some(frame) = self.link.receive_frame(end).map_err(failed)? {
            if frame.id() == id {
                return Ok(Some(frame));
            }
        }
        Ok(None)
    }

    /// Nothing is heard for so long.
    pub fn silence(&mut self, ms: u64) -> Outcome {
        let heard = self.hear_ms(ms)?;
        ensure(heard.is_empty(), || format!("silence was expected, {} came", text(&heard)))
    }

    /// Exactly this frame comes, and no other of its identifier.
    pub fn hears_once(&mut self, id: CobId, data: &[u8], ms: u64) -> Outcome {
        let heard = self.hear_id(id, ms)?;
        let is_it = matches!(&heard[..], [(_, frame)] if frame.data() == data && !frame.is_remote());
        ensure(is_it, || format!("{id}#{data:02X?} was expected once, {} came", text(&heard)))
    }

    /// The frames of `id` come every `period_ms`, for `periods` of them.
    pub fn hears_every(&mut self, id: CobId, period_ms: u64, periods: u64) -> Outcome<Vec<Heard>> {
        // Beginning with the first, so that its phase does not matter.
        let first = self.next(id, Duration::from_millis(2 * period_ms))?;
        ensure(first.is_some(), || format!("{id} does not come"))?;
        let mut last = self.now();
        let heard = self.hear_id(id, period_ms * periods + period_ms / 2)?;
        for (at, _) in &heard {
            let ms = at.since(last).as_micros() / 1000;
            let fits = (period_ms * 9 / 10..=period_ms * 11 / 10).contains(&ms);
            ensure(fits, || format!("{id} comes {ms} ms after the last, not {period_ms}"))?;
            last = *at;
        }
        let right = heard.len() as u64 == periods;
        ensure(right, || format!("{id} comes {} times in {periods} periods", heard.len()))?;
        Ok(heard)
    }

    // Identifiers that cannot be configured.

    /// Error control: boot-up, heartbeat and the answers to guarding.
    pub fn error_control(&self) -> CobId {
        CobId::of_node(0x700, self.node)
    }

    /// What the next error control message says: a heartbeat, or the answer to a guarding request.
    pub fn state(&mut self, within_ms: u64) -> Outcome<u8> {
        let message = self.next(self.error_control(), Duration::from_millis(within_ms))?;
        match message.as_ref().map(Frame::data) {
            Some(&[state]) => Ok(state),
            Some(data) => Err(failed(format!("error control has {data:02X?}"))),
            None => Err(failed("no error control message comes")),
        }
    }

    /// The state that the device says it is in, asked for by guarding.
    pub fn guarded_state(&mut self) -> Outcome<u8> {
        self.send_remote(self.error_control(), 1)?;
        Ok(self.state(PATIENCE_MS)? & 0x7F)
    }

    pub fn is_in(&mut self, state: NmtState) -> Outcome {
        let reported = self.guarded_state()?;
        ensure(reported == state.code(), || format!("the device says {reported:02X}, and should be {state}"))
    }

    // What the data sheet says.

    pub fn has(&self, indices: &[u16]) -> Outcome {
        match indices.iter().find(|&&index| self.sheet.device.object(index).is_none()) {
            Some(index) => Err(not_applicable(format!("no object {index:04X}h"))),
            None => Ok(()),
        }
    }

    /// All entries, cloned: cases talk to the device meanwhile.
    pub fn entries(&self, wanted: impl Fn(&Entry) -> bool) -> Vec<Entry> {
        self.sheet.device.entries().filter(|entry| wanted(entry)).cloned().collect()
    }

    /// The entries, of which there must be one.
    pub fn some(&self, what: &str, wanted: impl Fn(&Entry) -> bool) -> Outcome<Vec<Entry>> {
        let entries = self.entries(wanted);
        if entries.is_empty() { Err(not_applicable(format!("no entry {what}"))) } else { Ok(entries) }
    }

    pub fn entry(&self, index: u16, sub: u8) -> Outcome<Entry> {
        let entry = self.sheet.device.entry(index, sub);
        entry.cloned().ok_or_else(|| not_applicable(format!("no entry {index:04X}h:{sub:02X}h")))
    }

    pub fn bits(&self, entry: &Entry) -> Option<u8> {
        self.sheet.device.bits(entry.data_type)
    }

    /// The number of bytes, of an entry of a fixed size.
    pub fn size(&self, entry: &Entry) -> Option<usize> {
        self.bits(entry).map(|bits| usize::from(bits.div_ceil(8)))
    }

    /// A value of the data sheet, as SDO carries it.
    pub fn bytes_of(&self, entry: &Entry, value: &Value) -> Option<Vec<u8>> {
        let number = match value {
            Value::Integer(number) => *number,
            Value::NodeIdPlus(base) => i128::from(*base) + i128::from(self.node.get()),
            Value::Text(text) => return Some(text.as_bytes().to_vec()),
            Value::Bytes(bytes) => return Some(bytes.clone()),
            Value::Real(_) => return None,
        };
        Some(number.to_le_bytes()[..self.size(entry)?].to_vec())
    }

    /// Whether a scan may read the entry and a download may write it (`ObjFlags`, CiA 306-1, 6.5.2).
    pub fn flags(&self, entry: &Entry) -> u32 {
        self.sheet.device.object(entry.index).map_or(0, |object| object.flags)
    }
}

pub fn failed(why: impl Display) -> Verdict {
    Verdict::Failed(why.to_string())
}

pub fn not_applicable(why: impl Display) -> Verdict {
    Verdict::NotApplicable(why.to_string())
}

pub fn ensure<S: Display>(holds: bool, why: impl FnOnce() -> S) -> Outcome {
    if holds { Ok(()) } else { Err(failed(why())) }
}

/// Frames as candump writes them.
pub fn text(heard: &[Heard]) -> String {
    let frames: Vec<String> = heard.iter().take(8).map(|(_, frame)| frame.to_string()).collect();
    if frames.is_empty() { "nothing".to_owned() } else { frames.join(" ") }
}
