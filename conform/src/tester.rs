//! The tester, which sends frames, receives frames and waits. It knows the data sheet and the node-ID of the device
//! under test, and the stimuli for what no CANopen service can request.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::{iter, mem};

use lexican_eds::model::{Entry, Value};
use lexican_eds::types::DataType;
use lexican_runtime::host::{Incoming, Link, LinkError};
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use crate::hazard::Hazard;
use crate::host::HostLateness;
use crate::known::Known;
use crate::lss::Changes;
use crate::sheet::Sheet;
use crate::verdict::{Ended, Level, Outcome, Verdict, ensure, failed, not_applicable};

/// How long the tester waits for an immediate reaction.
pub(crate) const PATIENCE_MS: u64 = 100;
pub(crate) const PATIENCE: Duration = Duration::from_millis(PATIENCE_MS);

/// How many frames of a case are kept.
const FRAMES: usize = 4096;

/// Does what has to be done even after Ctrl-C, such as putting back what was written.
pub(crate) fn uncancelled<T>(cancelled: &AtomicBool, work: impl FnOnce() -> T) -> T {
    let was = cancelled.swap(false, Ordering::Relaxed);
    let done = work();
    cancelled.fetch_or(was, Ordering::Relaxed);
    done
}

/// How often cancellation and the lateness of this computer are checked. A longer wait would not notice that it was
/// woken late for a frame.
const LOOK: Duration = Duration::from_millis(1);

/// If this computer was late by more than this, the shortest period of a case, a failure judged by time is tried again.
const VERY_LATE: Duration = Duration::from_millis(10);

/// The id of the case about answers to guarding.
pub(crate) const GUARDING: &str = "301/7.2.8.3.2.1/1";

/// How a device is tested.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The node-ID of the device.
    pub node: NodeId,
    /// The hazards that are allowed.
    pub allow: BTreeSet<Hazard>,
    /// How long an answer to an SDO request may take.
    pub answer: Duration,
    /// How long the device may take to boot.
    pub boot: Duration,
    /// How long one case may take.
    pub case: Duration,
    /// How long to wait for the bus after it was lost.
    pub bus: Duration,
    /// If set, the test ends at the first failed case: of a requirement, or also of a recommendation.
    pub fail_fast: Option<Level>,
    /// The bit rate of the bus in kbit/s. Without it, no device is given a bit rate, since it could not be put back.
    pub bit_rate_kbit: Option<u16>,
    /// How to make the device do what no service can request.
    pub stimuli: Stimuli,
    /// The known deviations of the device, by the [id](crate::Case::id) of the case that fails.
    pub known: BTreeMap<String, Known>,
    /// How far a drive travels (6064h); `None` lets [`Settings::motion`] choose.
    pub travel: Option<u32>,
    /// How fast a drive travels (6081h, 60FFh); `None` lets [`Settings::motion`] choose.
    pub velocity: Option<u32>,
    /// The lateness of this computer, if it is measured, in real time.
    pub host: HostLateness,
}

impl Settings {
    /// Settings for most devices: no hazard is allowed, and there are no stimuli.
    #[must_use]
    pub fn new(node: NodeId) -> Self {
        Settings {
            node,
            allow: BTreeSet::new(),
            answer: Duration::from_millis(500),
            boot: Duration::from_secs(5),
            case: Duration::from_secs(120),
            bus: Duration::from_secs(30),
            fail_fast: None,
            bit_rate_kbit: None,
            stimuli: Stimuli::default(),
            known: BTreeMap::new(),
            travel: None,
            velocity: None,
            host: HostLateness::default(),
        }
    }

    /// How far and how fast a drive travels in the test. By default, the velocity is a tenth of the profile velocity
    /// (6081h), between 100 and 1000, and within the limits of 6081h and 60FFh. The travel is that of one second, at
    /// most a quarter of the range of 607Dh.
    #[must_use]
    pub fn motion(&self, sheet: &Sheet) -> Motion {
        let entry = |index, sub| sheet.device.entry(index, sub);
        let number = |value: Option<&Value>| value.and_then(Value::as_integer);
        let default = |index, sub| entry(index, sub).and_then(|entry| number(entry.default.as_ref()));
        let most = [0x6081, 0x60FF].into_iter().filter_map(|index| number(entry(index, 0)?.high.as_ref()));
        let most = most.chain(default(0x607F, 0)).filter(|most| *most > 0).min().unwrap_or(i128::MAX);
        let usual = (default(0x6081, 0).unwrap_or_default() / 10).clamp(100, 1000).min(most);
        let velocity = self.velocity.map_or(usual, i128::from);
        let range = default(0x607D, 2).zip(default(0x607D, 1)).map(|(high, low)| high - low);
        let far = range.filter(|range| *range > 0).map_or(velocity, |range| velocity.min(range / 4));
        let travel = self.travel.map_or(far, i128::from);
        let within = |number: i128| number.clamp(1, i128::from(i32::MAX / 40)) as i64;
        Motion { travel: within(travel), velocity: within(velocity) }
    }
}

/// Distance and velocity of a drive's travel in the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motion {
    /// In the units of 6064h.
    pub travel: i64,
    /// In the units of 6081h and 60FFh.
    pub velocity: i64,
}

/// A value to be written by SDO.
#[derive(Clone, Copy, Debug)]
pub struct Write {
    /// The object.
    pub index: u16,
    /// The sub-index.
    pub sub: u8,
    /// The value.
    pub value: u32,
}

/// How the tester makes the device do things beyond CANopen, which differs between devices. Cases without their
/// stimulus do not apply.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stimuli {
    /// Makes the device send an emergency.
    pub emergency: Option<Write>,
    /// Makes an input change periodically.
    pub input: Option<InputStimulus>,
}

/// Makes an input change at least every 20 ms; TPDOs map an object that shows it.
#[derive(Clone, Copy, Debug)]
pub struct InputStimulus {
    /// The write that starts it.
    pub starts: Write,
    /// The write that stops it.
    pub stops: Write,
    /// The entry that shows the input.
    pub shown_by: (u16, u8),
}

/// A received frame and its time.
pub type Heard = (Instant, Frame);

/// A frame of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// When it was sent or received.
    pub at: Instant,
    /// The frame.
    pub frame: Frame,
    /// Whether the tester sent it.
    pub sent: bool,
}

/// The tester of one device.
pub struct Tester<'a> {
    pub(crate) sheet: &'a Sheet,
    pub(crate) settings: &'a Settings,
    pub(crate) node: NodeId,
    link: &'a mut dyn Link,
    cancelled: &'a AtomicBool,
    /// COB-IDs of other nodes on the bus.
    others: BTreeSet<CobId>,
    /// When the case has to be over.
    deadline: Instant,
    frames: Vec<Record>,
    /// The entries that this case has written by SDO.
    written: BTreeSet<(u16, u8)>,
    measured: Vec<String>,
    /// The sets of accepted answers of this case.
    expected: Vec<String>,
    /// Changes by LSS that have not been undone.
    pub(crate) lss: Changes,
    /// The COB-ID read from 1014h in this case.
    pub(crate) emergency: Option<CobId>,
    /// How many frames this computer has missed in this case.
    missed: u32,
    /// How late this computer was in this case, at most.
    late: Duration,
    /// When the link last returned.
    returned: Option<Instant>,
    /// How late this computer may be before that affects the present judgement; `None` if no time is judged.
    margin: Option<Duration>,
    /// The id of the case that checks the step which failed last.
    pub(crate) missing: Option<&'static str>,
    /// A reset was sent, and the device has not booted since.
    may_boot: bool,
    /// The device has booted in this case without a reset.
    has_booted: bool,
}

impl<'a> Tester<'a> {
    /// A tester of the device at the other end of a link.
    pub fn new(link: &'a mut dyn Link, sheet: &'a Sheet, settings: &'a Settings, cancelled: &'a AtomicBool) -> Self {
        let deadline = link.now() + settings.case;
        let (others, frames, written) = (BTreeSet::new(), Vec::new(), BTreeSet::new());
        let node = settings.node;
        let (measured, missed, may_boot, has_booted) = (Vec::new(), 0, false, false);
        Tester {
            sheet,
            settings,
            node,
            link,
            cancelled,
            others,
            deadline,
            frames,
            written,
            measured,
            expected: Vec::new(),
            lss: Changes::default(),
            emergency: None,
            missed,
            late: Duration::ZERO,
            returned: None,
            margin: None,
            missing: None,
            may_boot,
            has_booted,
        }
    }

    /// Resets the records for a new case.
    pub(crate) fn begin(&mut self) {
        self.frames.clear();
        self.written.clear();
        self.measured.clear();
        self.expected.clear();
        (self.missed, self.has_booted, self.emergency) = (0, false, None);
        (self.late, self.returned, self.margin, self.missing) = (Duration::ZERO, None, None, None);
        self.settings.host.forget();
        self.limit(self.settings.case);
    }

    /// The frames of the last case; only the first ones if there were very many.
    #[must_use]
    pub fn frames(&self) -> &[Record] {
        &self.frames
    }

    /// The measurements of the last case with the allowed values, and its observations.
    #[must_use]
    pub fn measured(&self) -> &[String] {
        &self.measured
    }

    /// Notes an observation for the report, once.
    pub(crate) fn observe(&mut self, sentence: String) {
        if !self.measured.contains(&sentence) {
            self.measured.push(sentence);
        }
    }

    /// The sets of accepted answers of the last case.
    pub(crate) fn expected(&self) -> &[String] {
        &self.expected
    }

    /// Notes the accepted answers for the report.
    pub(crate) fn expect_one_of(&mut self, set: String) {
        if !self.expected.contains(&set) {
            self.expected.push(set);
        }
    }

    /// Resets the device, waits until it has booted, and enters PRE-OPERATIONAL. Other cases judge how it boots.
    pub(crate) fn reset(&mut self, command: NmtCommand) -> Outcome {
        self.nmt(command)?;
        self.boot_up()?;
        self.hear(PATIENCE)?;
        // Some devices enter OPERATIONAL by themselves.
        self.enter(NmtState::PreOperational)
    }

    /// Sets how long the following steps may take in all.
    pub(crate) fn limit(&mut self, span: Duration) {
        self.deadline = self.now() + span;
    }

    /// An event in the last case that may have made it fail without fault of the device.
    pub(crate) fn disturbance(&self) -> Option<String> {
        if self.has_booted {
            return Some("the device has booted without being reset".to_owned());
        }
        if self.missed > 0 {
            return Some(format!("this computer has missed {} frames", self.missed));
        }
        // The computer may have been later than what was measured.
        let late = self.lateness();
        let counts = self.margin.is_some() && late > VERY_LATE;
        counts.then(|| format!("this computer was late by up to {} ms", ms(late.as_micros())))
    }

    /// Waits, and ignores all frames. Returns `false` if the link has ended, or the test is cancelled.
    pub(crate) fn wait(&mut self, span: Duration) -> bool {
        let until = self.now() + span;
        self.returned = None;
        while self.now() < until {
            if self.cancelled.load(Ordering::Relaxed) || self.link.receive(until).is_err() {
                return false;
            }
        }
        true
    }

    /// From now on, ignores the frames of other nodes.
    pub(crate) fn ignore(&mut self, others: BTreeSet<CobId>) {
        self.others = others;
    }

    /// Whether a COB-ID belongs to another node on the bus.
    pub(crate) fn is_of_others(&self, id: CobId) -> bool {
        self.others.contains(&id)
    }

    /// Checks that writing an object is harmless or allowed.
    pub(crate) fn allows(&self, index: u16) -> Outcome {
        match Hazard::of_write(&self.sheet.device, index) {
            Some(hazard) if !self.settings.allow.contains(&hazard) => Err(Verdict::NotAllowed(hazard)),
            _ => Ok(()),
        }
    }

    /// Whether writing an entry is harmless or allowed.
    pub(crate) fn may_write(&self, entry: &Entry) -> bool {
        self.allows(entry.index).is_ok()
    }

    /// Notes that an entry is about to be written, if that is allowed.
    pub(crate) fn writes(&mut self, index: u16, sub: u8) -> Outcome {
        self.allows(index)?;
        self.written.insert((index, sub));
        Ok(())
    }

    /// The entries that the last case has written by SDO.
    pub(crate) fn written(&self) -> Vec<(u16, u8)> {
        self.written.iter().copied().collect()
    }

    // Sending.

    pub(crate) fn send(&mut self, id: CobId, data: &[u8]) -> Outcome {
        self.put(&Frame::new(id, data).expect("cases send frames of up to eight bytes"))
    }

    pub(crate) fn send_remote(&mut self, id: CobId, len: usize) -> Outcome {
        self.put(&Frame::remote(id, len as u8).expect("cases ask for up to eight bytes"))
    }

    pub(crate) fn put(&mut self, frame: &Frame) -> Outcome {
        self.record(*frame, true);
        self.link.send(frame).map_err(lost)
    }

    fn record(&mut self, frame: Frame, sent: bool) {
        if self.frames.len() < FRAMES {
            self.frames.push(Record { at: self.link.now(), frame, sent });
        }
    }

    /// The next frame of the device, at the latest at `until`.
    pub(crate) fn receive(&mut self, until: Instant) -> Outcome<Option<Frame>> {
        loop {
            if self.cancelled.load(Ordering::Relaxed) {
                return Err(Verdict::Unfinished(Ended::Cancelled));
            }
            let now = self.now();
            if now > self.deadline {
                return Err(failed(format!(
                    "the case took longer than {} s",
                    self.settings.case.as_micros() / 1_000_000
                )));
            }
            let look = until.min(now + LOOK);
            if let Some(returned) = self.returned {
                self.late = self.late.max(now.since(returned));
            }
            let incoming = self.link.receive(look).map_err(lost)?;
            let returned = self.now();
            if returned > look.max(now) {
                self.late = self.late.max(returned.since(look.max(now)));
            }
            self.returned = Some(returned);
            match incoming {
                Some(Incoming::Frame(frame)) if self.others.contains(&frame.id()) => {}
                Some(Incoming::Frame(frame)) => {
                    self.record(frame, false);
                    if frame.id() == self.error_control() && frame.data() == [0] {
                        self.has_booted |= !mem::take(&mut self.may_boot);
                    }
                    return Ok(Some(frame));
                }
                Some(Incoming::State(state)) if !state.carries_frames() => return Err(lost(LinkError::NoBus(state))),
                Some(Incoming::State(_)) => {}
                Some(Incoming::Gap(frames)) => self.missed += frames,
                None if look >= until => return Ok(None),
                None => {}
            }
        }
    }

    /// Sends an NMT command to the device.
    pub(crate) fn nmt(&mut self, command: NmtCommand) -> Outcome {
        self.nmt_to(command, self.node.get())
    }

    pub(crate) fn nmt_to(&mut self, command: NmtCommand, node: u8) -> Outcome {
        self.may_boot |= matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication);
        self.send(CobId::NMT, &[command.code(), node])
    }

    /// Commands an NMT state, and waits for its effects.
    pub(crate) fn enter(&mut self, state: NmtState) -> Outcome {
        self.nmt(match state {
            NmtState::Operational => NmtCommand::Start,
            NmtState::Stopped => NmtCommand::Stop,
            _ => NmtCommand::EnterPreOperational,
        })?;
        self.hear(Duration::from_millis(5))?;
        Ok(())
    }

    /// Sends a SYNC, with a counter if the device expects one.
    pub(crate) fn sync(&mut self, counter: Option<u8>) -> Outcome {
        let data = counter.map(|counter| [counter]);
        self.send(CobId::SYNC, data.as_ref().map_or(&[], |data| data))
    }

    // Receiving.

    pub(crate) fn now(&self) -> Instant {
        self.link.now()
    }

    /// All frames received within `span`.
    pub(crate) fn hear(&mut self, span: Duration) -> Outcome<Vec<Heard>> {
        let (end, mut heard) = (self.now() + span, Vec::new());
        while let Some(frame) = self.receive(end)? {
            heard.push((self.now(), frame));
        }
        Ok(heard)
    }

    pub(crate) fn hear_ms(&mut self, ms: u64) -> Outcome<Vec<Heard>> {
        self.hear(Duration::from_millis(ms))
    }

    /// The frames with one COB-ID within `ms`.
    pub(crate) fn hear_id(&mut self, id: CobId, ms: u64) -> Outcome<Vec<Heard>> {
        let heard = self.hear_ms(ms)?;
        self.depends_on(Duration::from_micros(ms * 500));
        Ok(heard.into_iter().filter(|(_, frame)| frame.id() == id).collect())
    }

    /// Notes that the present judgement would be different if this computer were late by `margin`.
    pub(crate) fn depends_on(&mut self, margin: Duration) {
        self.margin = Some(margin);
    }

    /// Notes that no time is judged until the next reception.
    pub(crate) fn depends_on_no_time(&mut self) {
        self.margin = None;
    }

    /// How late a frame was because of this computer in the last case, at most: a simulated device, the carrier of its
    /// frames, and the tester all wait for it.
    fn lateness(&self) -> Duration {
        self.late + self.settings.host.most().times(2)
    }

    /// Makes a failure undecidable if the lateness of this computer may explain it.
    pub(crate) fn decided(&self, outcome: Outcome) -> Outcome {
        let late = self.lateness();
        match (outcome, self.margin) {
            // The lateness is measured with the resolution of a look.
            (Err(Verdict::Failed(why)), Some(margin)) if !late.is_zero() && late + LOOK > margin => {
                let [late, margin] = [late, margin].map(|span| ms(span.as_micros()));
                Err(Verdict::NotDecidable(format!(
                    "{why}; this computer was late by up to {late} ms, and {margin} ms decide"
                )))
            }
            (outcome, _) => outcome,
        }
    }

    /// The outcome of a step that is also a case: if that case fails too, it blocks the present one.
    pub(crate) fn needs<T>(&mut self, id: &'static str, outcome: Outcome<T>) -> Outcome<T> {
        self.missing = matches!(outcome, Err(Verdict::Failed(_))).then_some(id);
        outcome
    }

    /// The next frame with one COB-ID.
    pub(crate) fn next(&mut self, id: CobId, within: Duration) -> Outcome<Option<Frame>> {
        let end = self.now() + within;
        while let Some(frame) = self.receive(end)? {
            if frame.id() == id {
                return Ok(Some(frame));
            }
        }
        Ok(None)
    }

    /// Checks that no frame with a COB-ID comes within this time.
    pub(crate) fn silence_of(&mut self, id: CobId, ms: u64) -> Outcome {
        let heard = self.hear_id(id, ms)?;
        ensure(heard.is_empty(), || format!("silence of {id} was expected, {} came", text(&heard)))
    }

    /// Whether the boot-up message comes. A heartbeat that was sent before the reset may precede it.
    pub(crate) fn boot_up(&mut self) -> Outcome<bool> {
        let end = self.now() + self.settings.boot;
        while let Some(frame) = self.receive(end)? {
            if frame.id() == self.error_control() && frame.data() == [0] && !frame.is_remote() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The COB-ID of emergencies: that read from 1014h, or else that of the data sheet, or else that of the predefined
    /// connection set.
    pub(crate) fn emergency_id(&self) -> CobId {
        let described = || {
            let entry = self.entry(0x1014, 0).ok()?;
            Some(CobId::from_parameter(u32::from_le_bytes(self.power_on_value(&entry)?.try_into().ok()?)))
        };
        self.emergency.or_else(described).unwrap_or(CobId::of_node(0x80, self.node))
    }

    /// The emergencies with an error code that come within `ms`.
    pub(crate) fn emergencies(&mut self, code: u16, ms: u64) -> Outcome<Vec<Heard>> {
        let mut heard = self.hear_id(self.emergency_id(), ms)?;
        heard.retain(|(_, frame)| frame.data().starts_with(&code.to_le_bytes()));
        Ok(heard)
    }

    /// Checks that exactly this frame comes, and no other with its COB-ID.
    pub(crate) fn hears_once(&mut self, id: CobId, data: &[u8], ms: u64) -> Outcome {
        let heard = self.hear_id(id, ms)?;
        let is_it = matches!(&heard[..], [(_, frame)] if frame.data() == data && !frame.is_remote());
        ensure(is_it, || format!("{id}#{data:02X?} was expected once, {} came", text(&heard)))
    }

    /// Checks that frames with `id` come every `period_ms`, for this many periods.
    pub(crate) fn hears_every(&mut self, id: CobId, period_ms: u64, periods: u64) -> Outcome<Vec<Heard>> {
        // Measured from the first frame on, since its phase does not matter.
        let first = self.next(id, Duration::from_millis(2 * period_ms))?;
        ensure(first.is_some(), || format!("{id} does not come"))?;
        let begun = self.now();
        let heard = self.hear_id(id, period_ms * periods + period_ms / 2)?;
        let times: Vec<Instant> = iter::once(begun).chain(heard.iter().map(|(at, _)| *at)).collect();
        let (low, high) = (period_ms * 900, period_ms * 1100);
        self.gaps_are(&format!("{id} every {period_ms} ms"), &times, low, Some(high))?;
        let right = heard.len() as u64 == periods;
        self.depends_on(Duration::from_micros(period_ms * 500));
        ensure(right, || format!("{id} comes {} times in {periods} periods of {period_ms} ms", heard.len()))?;
        Ok(heard)
    }

    /// Checks the mean period of the frames with `id` to 1 %, since a small error adds up.
    pub(crate) fn hears_in_the_mean(&mut self, id: CobId, period_ms: u64, periods: u64) -> Outcome {
        let heard = self.hears_every(id, period_ms, periods)?;
        let (Some((first, _)), Some((last, _))) = (heard.first(), heard.last()) else { return Ok(()) };
        let mean = last.since(*first).as_micros() / (periods - 1);
        let (low, high) = (period_ms * 990, period_ms * 1010);
        let measured = format!(
            "{id} every {period_ms} ms: {} ms in the mean of {periods}, allowed {} to {}",
            ms(mean),
            ms(low),
            ms(high)
        );
        self.measured.push(measured.clone());
        // One late frame at either end changes the mean by its share.
        let beyond = low.saturating_sub(mean).max(mean.saturating_sub(high));
        self.depends_on(Duration::from_micros(beyond * (periods - 1)));
        ensure(beyond == 0, || measured)
    }

    /// Checks that the frames come at least `span_ms` apart, less 10 %.
    pub(crate) fn are_apart(&mut self, id: CobId, heard: &[Heard], span_ms: u64) -> Outcome {
        let times: Vec<Instant> = heard.iter().map(|(at, _)| *at).collect();
        // A computer that is late with one frame makes the next one seem early.
        self.gaps_are(&format!("{id} at least {span_ms} ms apart"), &times, span_ms * 900, None)
    }

    /// Measures the gaps between times, in microseconds. The figures become part of the case's report.
    fn gaps_are(&mut self, what: &str, times: &[Instant], low: u64, high: Option<u64>) -> Outcome {
        let gaps = times.windows(2).map(|two| two[1].since(two[0]).as_micros());
        let (Some(least), Some(most)) = (gaps.clone().min(), gaps.max()) else { return Ok(()) };
        let allowed =
            high.map_or_else(|| format!("at least {}", ms(low)), |high| format!("{} to {}", ms(low), ms(high)));
        let over = times.len() - 1;
        let measured = format!("{what}: {} to {} ms over {over}, allowed {allowed}", ms(least), ms(most));
        self.measured.push(measured.clone());
        let beyond = low.saturating_sub(least).max(high.map_or(0, |high| most.saturating_sub(high)));
        self.depends_on(Duration::from_micros(beyond));
        ensure(beyond == 0, || measured)
    }

    // COB-IDs that cannot be configured.

    /// Error control: boot-up, heartbeat and answers to guarding.
    pub(crate) fn error_control(&self) -> CobId {
        CobId::of_node(0x700, self.node)
    }

    /// The state in the next error control message, a heartbeat or the answer to a guarding request.
    pub(crate) fn state(&mut self, within_ms: u64) -> Outcome<u8> {
        let message = self.next(self.error_control(), Duration::from_millis(within_ms))?;
        self.depends_on(Duration::from_micros(within_ms * 500));
        match message.as_ref().map(Frame::data) {
            Some(&[state]) => Ok(state),
            Some(data) => Err(failed(format!("error control has {data:02X?}"))),
            None => Err(failed("no error control message comes")),
        }
    }

    /// The state of the device, read by guarding.
    pub(crate) fn guarded_state(&mut self) -> Outcome<u8> {
        self.send_remote(self.error_control(), 1)?;
        let state = self.state(PATIENCE_MS);
        Ok(self.needs(GUARDING, state)? & 0x7F)
    }

    pub(crate) fn is_in(&mut self, state: NmtState) -> Outcome {
        let reported = self.guarded_state()?;
        ensure(reported == state.code(), || format!("the device says {reported:02X}, and should be {state}"))
    }

    // The data sheet.

    pub(crate) fn has(&self, indices: &[u16]) -> Outcome {
        match indices.iter().find(|&&index| self.sheet.device.object(index).is_none()) {
            Some(index) => Err(not_applicable(format!("no object {index:04X}h"))),
            None => Ok(()),
        }
    }

    /// All wanted entries, cloned, since cases use the tester meanwhile.
    pub(crate) fn entries(&self, wanted: impl Fn(&Entry) -> bool) -> Vec<Entry> {
        self.sheet.device.entries().filter(|entry| wanted(entry)).cloned().collect()
    }

    /// The wanted entries; the case does not apply if there is none.
    pub(crate) fn some(&self, what: &str, wanted: impl Fn(&Entry) -> bool) -> Outcome<Vec<Entry>> {
        let entries = self.entries(wanted);
        if entries.is_empty() { Err(not_applicable(format!("no entry {what}"))) } else { Ok(entries) }
    }

    /// The wanted entries that may be written; if none may, the case is not allowed.
    pub(crate) fn some_to_write(&self, what: &str, wanted: impl Fn(&Entry) -> bool) -> Outcome<Vec<Entry>> {
        let mut entries = self.some(what, wanted)?;
        let first = entries.first().map_or(Ok(()), |entry| self.allows(entry.index));
        entries.retain(|entry| self.may_write(entry));
        if entries.is_empty() { Err(first.err().unwrap_or_else(|| not_applicable(what))) } else { Ok(entries) }
    }

    pub(crate) fn entry(&self, index: u16, sub: u8) -> Outcome<Entry> {
        let entry = self.sheet.device.entry(index, sub);
        entry.cloned().ok_or_else(|| not_applicable(format!("no entry {index:04X}h:{sub:02X}h")))
    }

    pub(crate) fn bits(&self, entry: &Entry) -> Option<u8> {
        self.sheet.device.bits(entry.data_type)
    }

    /// The size of an entry in bytes; `None` if it is not fixed.
    pub(crate) fn size(&self, entry: &Entry) -> Option<usize> {
        self.bits(entry).map(|bits| usize::from(bits.div_ceil(8)))
    }

    /// The SDO data of a value in the data sheet.
    pub(crate) fn bytes_of(&self, entry: &Entry, value: &Value) -> Option<Vec<u8>> {
        let number = match value {
            Value::Integer(number) => *number,
            Value::NodeIdPlus(base) => i128::from(*base) + i128::from(self.node.get()),
            Value::Text(text) if entry.data_type == DataType::VisibleString => {
                return Some(Value::visible_string(text));
            }
            Value::Text(_) => return None,
            Value::Bytes(bytes) => return Some(bytes.clone()),
            Value::Real(_) => return None,
        };
        Some(number.to_le_bytes()[..self.size(entry)?].to_vec())
    }

    /// The value after power-on: that of the DCF, or else the default.
    pub(crate) fn power_on_value(&self, entry: &Entry) -> Option<Vec<u8>> {
        self.bytes_of(entry, entry.configured.as_ref().or(entry.default.as_ref())?)
    }

    /// The `ObjFlags` of the object, which forbid writing on download, or reading on scan (CiA 306-1, 6.5.2).
    pub(crate) fn flags(&self, entry: &Entry) -> u32 {
        self.sheet.device.object(entry.index).map_or(0, |object| object.flags)
    }
}

/// Microseconds as a text in milliseconds.
fn ms(us: u64) -> String {
    format!("{}.{:02}", us / 1000, us % 1000 / 10)
}

fn lost(error: LinkError) -> Verdict {
    Verdict::Unfinished(Ended::BusLost(error.to_string()))
}

/// Frames in the format of candump.
pub(crate) fn text(heard: &[Heard]) -> String {
    let frames: Vec<String> = heard.iter().take(8).map(|(_, frame)| frame.to_string()).collect();
    if frames.is_empty() { "nothing".to_owned() } else { frames.join(" ") }
}
