//! The master's side of one drive, without I/O: makes each telegram to the drive, and evaluates the answers.

use std::collections::VecDeque;

use lexican_driver::{Direction, Units};
use lexican_profibus::pkw::{self, PkwMaster, Refusal, Reply, Task};
use lexican_runtime::{Duration, Instant, Measured};
use siko::order::{Braking, Order};
use siko::state::Mode;
use siko::words::system;

use crate::model::PPO;
use crate::words::{control, order as words, status};

/// The cyclic data of one direction.
pub type Telegram = [u8; PPO.len()];

/// How long the drive may take to answer a task, or to follow an order.
pub(crate) const REACTION: Duration = Duration::from_millis(400);

/// The time over which velocities are measured in positioning mode: 1 rev/min makes a count and a third in this time.
const MEASURED_OVER: Duration = Duration::from_millis(50);

const MODE: u16 = 930;
const LOAD: u16 = 970;
const NUMERATOR: u16 = 1010;
const DENOMINATOR: u16 = 1011;
const SPINDLE_PITCH: u16 = 1012;
const SYSTEM_STATUS: u16 = 1020;

/// One drive, as its master sees it. Orders become words and edges of STW, as in figures 13 and 14 of the AG02's
/// manual. The state of the drive is read from ZSW, and from the system status word (PNU 1020), which is read whenever
/// no other task is under way.
///
/// [`DriveMaster::outputs`] is sent in every telegram, and each exchange of data is passed to
/// [`DriveMaster::handle_exchange`]. After each event, [`DriveMaster::poll`] returns what is new.
///
/// A word is sent until an exchange has carried it; then the next one follows. A target is sent before the edge that
/// starts it. When the drive is lost, all orders are dropped, and the words begin with OFF again.
#[derive(Clone, Debug)]
pub struct DriveMaster {
    tasks: PkwMaster,
    /// Who has asked for the task under way; `None` while there is none.
    asks: Option<Asks>,
    asked: Option<Task>,
    /// The outputs: STW with HSW.
    word: u16,
    target: i32,
    /// The words to send next.
    plan: VecDeque<u16>,
    /// The last word of the plan has been sent.
    is_carried: bool,
    ordered: Option<Ordered>,
    /// From which task on a reading of PNU 1020 ends [`DriveMaster::look`].
    look: Option<u64>,
    /// How many tasks have been begun.
    begun: u64,
    /// The last task that has read PNU 1020.
    looked: u64,
    seen: Option<Seen>,
    known: Known,
    /// When the task under way was begun.
    began: Instant,
    /// The facts made of `seen` and `known`, as long as both match.
    facts: Option<Measured<Facts>>,
    trace: Option<Trace>,
    events: VecDeque<Event>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asks {
    Application,
    /// The master itself, to learn the set-up and the state of the drive.
    Master,
}

/// The inputs of the last telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Seen {
    status: u16,
    actual: i32,
}

/// The results of the master's own tasks.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    mode: Option<Mode>,
    numerator: Option<u32>,
    denominator: Option<u32>,
    spindle_pitch: Option<u32>,
    system: Option<Measured<u16>>,
}

/// The position at a time, and the velocity just before.
#[derive(Clone, Copy, Debug)]
struct Trace {
    at: Instant,
    position: i32,
    velocity: i32,
}

/// The order under way.
#[derive(Clone, Copy, Debug)]
struct Ordered {
    order: Order,
    target: i32,
    due: Instant,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Waiting until the operating mode is known.
    Waits,
    /// Its words are being sent; with ZSW.12 before them.
    Sent(u16),
    /// The drive has followed; a reading of PNU 1020 by the task with this number, or a later one, ends the order.
    Followed(u64),
}

/// The state of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// ZSW.
    pub status: u16,
    /// The system status word (PNU 1020), with the fault bit of ZSW, which shows a fault earlier.
    pub system: u16,
    /// The operating mode.
    pub mode: Mode,
    /// HIW in positioning mode; in velocity mode, the last known position.
    pub position: i32,
    /// In rev/min: HIW in velocity mode; in positioning mode it is measured over 50 ms.
    pub velocity: i32,
}

/// What is new.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The task of [`DriveMaster::ask`] has been answered.
    Answered(Reply),
    /// There was no answer in time. The task or order may have been carried out.
    Silent,
    /// The drive has followed the order of [`DriveMaster::order`], and its facts since then are known.
    Followed,
    /// The drive does not follow the order.
    NotFollowed,
    /// The facts that [`DriveMaster::look`] has asked for are known.
    Looked,
    /// The drive has stopped exchanging data; whatever was under way is over.
    Lost,
}

impl Default for DriveMaster {
    fn default() -> Self {
        DriveMaster::new()
    }
}

impl DriveMaster {
    /// For a drive that does not exchange data yet.
    #[must_use]
    pub fn new() -> Self {
        DriveMaster {
            tasks: PkwMaster::new(REACTION),
            asks: None,
            asked: None,
            word: words::OFF,
            target: 0,
            plan: VecDeque::new(),
            is_carried: true,
            ordered: None,
            look: None,
            begun: 0,
            looked: 0,
            seen: None,
            known: Known::default(),
            began: Instant::ZERO,
            facts: None,
            trace: None,
            events: VecDeque::new(),
        }
    }

    /// The outputs for the next telegram.
    #[must_use]
    pub fn outputs(&self) -> Telegram {
        let mut data = [0; PPO.len()];
        PPO.set_pkw(&mut data, self.tasks.output());
        PPO.set_word(&mut data, 0, self.word);
        PPO.set_double_word(&mut data, 1, self.target);
        data
    }

    /// The facts, with the time at which PNU 1020 was read; `None` until all of them are known. While the operating
    /// mode is unknown, the previous facts.
    #[must_use]
    pub const fn facts(&self) -> Option<Measured<Facts>> {
        self.facts
    }

    /// Starts a task of the application, one at a time; [`Event::Answered`] or [`Event::Silent`] follows.
    ///
    /// While a travel is under way, a change of the operating mode is refused: bit 6 of STW, whose edges start travels,
    /// would make the drive turn in velocity mode.
    pub fn ask(&mut self, task: Task) {
        if matches!(task, Task::Write { number: MODE, .. }) && self.keeps_enabled() {
            if self.known.system.is_none_or(|seen| seen.value & (system::POSITIONING | system::MOVING) != 0) {
                self.events.push_back(Event::Answered(Reply::Refused(Refusal::WRONG_STATE)));
                return;
            }
            self.send(&[words::ENABLE]);
        }
        self.asked = Some(task);
    }

    /// Gives an order, one at a time; [`Event::Followed`] or [`Event::NotFollowed`] follows. `target` is the position
    /// or velocity for [`Order::Start`].
    pub fn order(&mut self, now: Instant, order: Order, target: i32) {
        self.ordered = Some(Ordered { order, target, due: now + REACTION, stage: Stage::Waits });
        self.go_on_with_order();
    }

    /// Reads the state of the drive anew; [`Event::Looked`] follows.
    pub fn look(&mut self) {
        self.look = Some(self.begun + 1);
    }

    /// The next event; `None` if there is no other.
    pub fn poll(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// When [`DriveMaster::handle_timeout`] has something to do.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        [self.tasks.poll_timeout(), self.ordered.map(|ordered| ordered.due)].into_iter().flatten().min()
    }

    /// To call once the time of [`DriveMaster::poll_timeout`] has come.
    pub fn handle_timeout(&mut self, now: Instant) {
        let unanswered = self.tasks.handle_timeout(now).and_then(|_| self.asks.take());
        if unanswered == Some(Asks::Application) || unanswered.is_some() && self.look.take().is_some() {
            self.events.push_back(Event::Silent);
        }
        if let Some(ordered) = self.ordered.take_if(|ordered| ordered.due <= now) {
            let has_followed = matches!(ordered.stage, Stage::Followed(_));
            // The enabling word would be sent on, and the drive would follow it later.
            if !has_followed && ordered.order == Order::Enable {
                self.send(&[words::OFF]);
            }
            self.events.push_back(if has_followed { Event::Silent } else { Event::NotFollowed });
        }
        self.go_on(now);
    }

    /// Handles an exchange of data: `received` has answered `sent`.
    pub fn handle_exchange(&mut self, now: Instant, sent: &Telegram, received: &Telegram) {
        let (Some(status), Some(actual)) = (PPO.word(received, 0), PPO.double_word(received, 1)) else { return };
        let was_enabled = self.is_enabled();
        self.seen = Some(Seen { status, actual });
        self.measure(now, actual);
        if (PPO.word(sent, 0), PPO.double_word(sent, 1)) == (Some(self.word), Some(self.target)) {
            match self.plan.pop_front() {
                Some(next) => self.word = next,
                None => self.is_carried = true,
            }
        }
        // The drive has disabled itself: it must not enable itself again.
        if was_enabled && !self.is_enabled() && self.ordered.is_none() {
            self.send(&[words::OFF]);
        }
        let event = PPO.pkw(received).and_then(|pkw| self.tasks.handle_input(pkw));
        if let Some(pkw::Event::Answered { task, reply }) = event {
            self.take_reply(task, reply);
        }
        self.facts = self.draw_facts().or(self.facts);
        self.go_on(now);
    }

    /// Handles that the drive has stopped exchanging data.
    pub fn handle_offline(&mut self) {
        let was_there = self.seen.is_some();
        *self = DriveMaster { events: core::mem::take(&mut self.events), ..DriveMaster::new() };
        if was_there {
            self.events.push_back(Event::Lost);
        }
    }

    fn draw_facts(&self) -> Option<Measured<Facts>> {
        let (seen, mode, system) = (self.seen?, self.known.mode?, self.known.system?);
        self.units()?;
        let (position, velocity) = match mode {
            Mode::Positioning => (seen.actual, self.trace.map_or(0, |trace| trace.velocity)),
            Mode::Velocity => (self.facts.map_or(0, |facts| facts.value.position), seen.actual),
        };
        let fault = if seen.status & status::FAULT == 0 { 0 } else { system::FAULT };
        let with =
            |system| Facts { status: seen.status, system: system & !system::FAULT | fault, mode, position, velocity };
        Some(system.map(with))
    }

    fn units(&self) -> Option<Units> {
        let Known { numerator: Some(numerator), denominator: Some(denominator), spindle_pitch: Some(pitch), .. } =
            self.known
        else {
            return None;
        };
        Some(Units { increments: 1600, spindle_pitch_10um: pitch, numerator, denominator })
    }

    fn is_enabled(&self) -> bool {
        self.seen.is_some_and(|seen| seen.status & status::OPERATION_ENABLED != 0)
    }

    /// Whether the word that is being sent keeps the drive enabled, or will enable it.
    fn keeps_enabled(&self) -> bool {
        self.word & control::ENABLE_OPERATION != 0
    }

    /// Measures the rate of change of the actual value, which is the velocity in positioning mode.
    fn measure(&mut self, now: Instant, actual: i32) {
        let began = *self.trace.get_or_insert(Trace { at: now, position: actual, velocity: 0 });
        let span = now.since(began.at);
        if span < MEASURED_OVER {
            return;
        }
        let counts = i64::from(actual) - i64::from(began.position);
        let turns = self.units().map_or(0.0, |units| units.shaft_revolutions(counts as i32));
        let per_minute = (turns * 60.0 / span.as_secs_f64()).round() as i32;
        // A drive that moves must not seem to stand.
        let velocity = if per_minute == 0 { counts.signum() as i32 } else { per_minute };
        self.trace = Some(Trace { at: now, position: actual, velocity });
    }

    /// Sends these words one after another; the last one is kept.
    fn send(&mut self, words: &[u16]) {
        self.plan = words.iter().copied().collect();
        self.word = self.plan.pop_front().unwrap_or(self.word);
        self.is_carried = false;
    }

    fn take_reply(&mut self, task: Task, reply: Reply) {
        if self.asks.take() == Some(Asks::Application) {
            // A write may have changed values that were read, and the meaning of positions.
            if matches!(task, Task::Write { .. }) {
                self.trace = None;
            }
            match task {
                Task::Write { number: MODE, .. } => self.known.mode = None,
                Task::Write { number: LOAD | NUMERATOR..=SPINDLE_PITCH, .. } => {
                    self.known = Known { system: self.known.system, ..Known::default() };
                }
                _ => {}
            }
            self.events.push_back(Event::Answered(reply));
            return;
        }
        let Reply::Value(value) = reply else { return };
        let value = value.raw();
        match task.number() {
            MODE => self.enter(if value == 1 { Mode::Velocity } else { Mode::Positioning }),
            NUMERATOR => self.known.numerator = Some(value),
            DENOMINATOR => self.known.denominator = Some(value),
            SPINDLE_PITCH => self.known.spindle_pitch = Some(value),
            _ => {
                self.known.system = Some(Measured::new(value as u16, self.began));
                self.looked = self.begun;
            }
        }
    }

    /// Adapts the idle control word to the mode, without starting anything.
    fn enter(&mut self, mode: Mode) {
        self.known.mode = Some(mode);
        if self.keeps_enabled() {
            let rests = self.word & !words::START == words::ENABLE;
            match mode {
                Mode::Positioning if rests => self.send(&[words::READY | self.word & words::START]),
                Mode::Velocity if !rests => self.send(&[words::ENABLE]),
                _ => {}
            }
        }
    }

    /// Goes on after any change.
    fn go_on(&mut self, now: Instant) {
        self.go_on_with_order();
        self.begin_task(now);
        if self.look.take_if(|look| *look <= self.looked).is_some() {
            self.events.push_back(Event::Looked);
        }
    }

    fn go_on_with_order(&mut self) {
        let (Some(mut ordered), Some(mode), Some(seen)) = (self.ordered, self.known.mode, self.seen) else { return };
        if ordered.stage == Stage::Waits {
            ordered.stage = Stage::Sent(seen.status & status::ORDER_ACKNOWLEDGED);
            if ordered.order == Order::Start {
                self.target = ordered.target;
            }
            let (words, count) = words_of(ordered.order, mode, self.word & words::START);
            self.send(&words[..count]);
        }
        if let Stage::Sent(acknowledged) = ordered.stage
            && self.is_carried
            && has_followed(ordered.order, mode, seen.status, acknowledged)
        {
            ordered.stage = Stage::Followed(self.begun + 1);
        }
        self.ordered = Some(ordered);
        if matches!(ordered.stage, Stage::Followed(look) if look <= self.looked) {
            self.ordered = None;
            self.events.push_back(Event::Followed);
        }
    }

    fn begin_task(&mut self, now: Instant) {
        if self.seen.is_none() || self.tasks.is_busy() {
            return;
        }
        let task = match self.asked.take_if(|_| self.is_carried) {
            Some(task) => {
                self.asks = Some(Asks::Application);
                task
            }
            None => {
                self.asks = Some(Asks::Master);
                Task::Read { number: self.unknown() }
            }
        };
        self.begun += 1;
        self.began = now;
        // The client is not busy here.
        let _ = self.tasks.start(now, task);
    }

    /// The number of the parameter to read next.
    fn unknown(&self) -> u16 {
        let Known { mode, numerator, denominator, spindle_pitch, .. } = self.known;
        let unknown = [
            (MODE, mode.is_none()),
            (NUMERATOR, numerator.is_none()),
            (DENOMINATOR, denominator.is_none()),
            (SPINDLE_PITCH, spindle_pitch.is_none()),
        ];
        unknown.into_iter().find(|(_, is_unknown)| *is_unknown).map_or(SYSTEM_STATUS, |(number, _)| number)
    }
}

/// The words of an order, and their number. `edge` is the present state of the bit whose edges start travels: it is
/// kept in all words but that of a start, as long as the drive is enabled.
fn words_of(order: Order, mode: Mode, edge: u16) -> ([u16; 3], usize) {
    use words::{
        ACKNOWLEDGE, ENABLE, INCHING_1, INCHING_2_NEGATIVE, INCHING_2_POSITIVE, INTERMEDIATE_STOP, OFF, READY,
    };
    let one = |word| ([word, 0, 0], 1);
    let two = |before, word| ([before, word, 0], 2);
    match (order, mode) {
        (Order::Release, _) => one(OFF),
        (Order::Hold, _) => one(ENABLE & !control::ENABLE_OPERATION),
        (Order::ResetFault, _) => ([OFF, ACKNOWLEDGE, OFF], 3),
        (Order::Start, Mode::Velocity) => one(words::TURN),
        (_, Mode::Velocity) => one(ENABLE),
        (Order::Enable, Mode::Positioning) => two(ENABLE, READY),
        (Order::Start, Mode::Positioning) => two(READY | edge, (READY | edge) ^ words::START),
        (Order::Interrupt(Braking::Programmed), Mode::Positioning) => one(INTERMEDIATE_STOP | edge),
        (Order::Interrupt(Braking::Full) | Order::Abort(_) | Order::StopInching, Mode::Positioning) => {
            two(ENABLE | edge, READY | edge)
        }
        (Order::Resume, Mode::Positioning) => one(READY | edge),
        (Order::Step, Mode::Positioning) => two(ENABLE | edge, INCHING_1 | edge),
        (Order::Inch(Direction::Positive), Mode::Positioning) => two(ENABLE | edge, INCHING_2_POSITIVE | edge),
        (Order::Inch(Direction::Negative), Mode::Positioning) => two(ENABLE | edge, INCHING_2_NEGATIVE | edge),
    }
}

/// Whether the status word shows that the drive has followed; for most orders it shows nothing.
fn has_followed(order: Order, mode: Mode, seen: u16, acknowledged: u16) -> bool {
    let is_enabled = seen & status::OPERATION_ENABLED != 0;
    match (order, mode) {
        (Order::Enable, _) => is_enabled,
        (Order::Hold | Order::Release, _) => !is_enabled,
        (Order::ResetFault, _) => seen & (status::FAULT | status::SWITCH_ON_INHIBITED) == 0,
        (Order::Start, Mode::Positioning) => seen & status::ORDER_ACKNOWLEDGED != acknowledged,
        _ => true,
    }
}
