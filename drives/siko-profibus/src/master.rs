//! The master's side of one drive, without I/O: what it sends in each telegram, and what it makes of what comes back.

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

/// How long the drive may take to answer a task, and to follow an order.
pub(crate) const REACTION: Duration = Duration::from_millis(400);

/// Over how long velocities are measured in positioning mode: one rev/min is a count and a third in this time.
const MEASURED_OVER: Duration = Duration::from_millis(50);

const MODE: u16 = 930;
const LOAD: u16 = 970;
const NUMERATOR: u16 = 1010;
const DENOMINATOR: u16 = 1011;
const SPINDLE_PITCH: u16 = 1012;
const SYSTEM_STATUS: u16 = 1020;

/// One drive, as its master sees it. Orders become words and edges of STW, along figures 13 and 14 of the AG02's manual;
/// what the drive is doing is read from ZSW, and from the system status word (PNU 1020), which is asked for whenever
/// no other task is under way.
///
/// What is sent is [`DriveMaster::outputs`], in every telegram; each exchange of data goes to
/// [`DriveMaster::handle_exchange`], and after everything that has happened, [`DriveMaster::poll`] says what is new.
///
/// A word is sent until an exchange has carried it, and the next one follows then; a target goes ahead of the edge
/// that starts it. Nothing that was ordered outlives the loss of the drive: the words begin with OFF again.
#[derive(Clone, Debug)]
pub struct DriveMaster {
    tasks: PkwMaster,
    /// Whose task is under way; `None` while there is none.
    asks: Option<Asks>,
    asked: Option<Task>,
    /// What goes out: STW with HSW.
    word: u16,
    target: i32,
    /// The words that follow.
    plan: VecDeque<u16>,
    /// The last word of the plan has been carried.
    is_carried: bool,
    ordered: Option<Ordered>,
    /// The number of the task from which on a reading of PNU 1020 is what [`DriveMaster::look`] waits for.
    look: Option<u64>,
    /// How many tasks have been begun.
    begun: u64,
    /// The last one of these that has read PNU 1020.
    looked: u64,
    seen: Option<Seen>,
    known: Known,
    /// When the task that is under way was begun.
    began: Instant,
    /// What follows from both, as long as they fit each other.
    facts: Option<Measured<Facts>>,
    trace: Option<Trace>,
    events: VecDeque<Event>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asks {
    Application,
    /// The master itself, to know the drive.
    Master,
}

/// What has come in the last telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Seen {
    status: u16,
    actual: i32,
}

/// What tasks of the master itself have read.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    mode: Option<Mode>,
    numerator: Option<u32>,
    denominator: Option<u32>,
    spindle_pitch: Option<u32>,
    system: Option<Measured<u16>>,
}

/// Where it was at a time, and how fast it came there.
#[derive(Clone, Copy, Debug)]
struct Trace {
    at: Instant,
    position: i32,
    velocity: i32,
}

/// An order that is under way.
#[derive(Clone, Copy, Debug)]
struct Ordered {
    order: Order,
    target: i32,
    due: Instant,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Until the operating mode is known.
    Waits,
    /// Its words are sent; ZSW.12 was so before.
    Sent(u16),
    /// The drive has followed; a reading of PNU 1020 from the task with this number on shows what has become of it.
    Followed(u64),
}

/// What is known of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// ZSW.
    pub status: u16,
    /// The system status word (PNU 1020), with the fault that ZSW shows earlier.
    pub system: u16,
    /// The operating mode.
    pub mode: Mode,
    /// HIW in positioning mode; in velocity mode, the position that was known last.
    pub position: i32,
    /// In rev/min: HIW in velocity mode; in positioning mode it is measured, over 50 ms.
    pub velocity: i32,
}

/// What is new.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The task of [`DriveMaster::ask`] is over.
    Answered(Reply),
    /// What was asked for has not been answered in time. A task may have been carried out, and an order has been followed.
    Silent,
    /// The drive has followed the order of [`DriveMaster::order`], and what it has shown since is known.
    Followed,
    /// The drive does not follow the order.
    NotFollowed,
    /// What [`DriveMaster::look`] has asked for is known.
    Looked,
    /// The drive exchanges no data any more; what was under way is over.
    Lost,
}

impl Default for DriveMaster {
    fn default() -> Self {
        DriveMaster::new()
    }
}

impl DriveMaster {
    /// A drive that does not exchange data yet.
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

    /// What the next telegram carries.
    #[must_use]
    pub fn outputs(&self) -> Telegram {
        let mut data = [0; PPO.len()];
        PPO.set_pkw(&mut data, self.tasks.output());
        PPO.set_word(&mut data, 0, self.word);
        PPO.set_double_word(&mut data, 1, self.target);
        data
    }

    /// What is known of the drive, as old as the reading of PNU 1020 in it; `None` until all of it is. While the operating
    /// mode is in question, what was known before.
    #[must_use]
    pub const fn facts(&self) -> Option<Measured<Facts>> {
        self.facts
    }

    /// Asks for something that is in no telegram; [`Event::Answered`] or [`Event::Silent`] follows. One task at a time.
    ///
    /// While a travel is under way, the operating mode is not written: bit 6 of STW, whose edges start travels, lets the
    /// drive turn in velocity mode.
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

    /// Gives an order; [`Event::Followed`] or [`Event::NotFollowed`] follows. One at a time. `target` is where
    /// [`Order::Start`] leads, or how fast.
    pub fn order(&mut self, now: Instant, order: Order, target: i32) {
        self.ordered = Some(Ordered { order, target, due: now + REACTION, stage: Stage::Waits });
        self.go_on_with_order();
    }

    /// Has the drive asked how it is; [`Event::Looked`] follows.
    pub fn look(&mut self) {
        self.look = Some(self.begun + 1);
    }

    /// What is new; `None` when that is all.
    pub fn poll(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// When [`DriveMaster::handle_timeout`] has something to do.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        [self.tasks.poll_timeout(), self.ordered.map(|ordered| ordered.due)].into_iter().flatten().min()
    }

    /// Takes note that a deadline has come.
    pub fn handle_timeout(&mut self, now: Instant) {
        let unanswered = self.tasks.handle_timeout(now).and_then(|_| self.asks.take());
        if unanswered == Some(Asks::Application) || unanswered.is_some() && self.look.take().is_some() {
            self.events.push_back(Event::Silent);
        }
        if let Some(ordered) = self.ordered.take_if(|ordered| ordered.due <= now) {
            let has_followed = matches!(ordered.stage, Stage::Followed(_));
            // A word that enables holds as long as it is sent: the drive would follow once it can.
            if !has_followed && ordered.order == Order::Enable {
                self.send(&[words::OFF]);
            }
            self.events.push_back(if has_followed { Event::Silent } else { Event::NotFollowed });
        }
        self.go_on(now);
    }

    /// Takes note of an exchange of data: `received` has answered `sent`.
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
        // The drive has let go by itself: it is not to go on by itself either.
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

    /// Takes note that the drive exchanges no data any more.
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

    /// It is enabled, or about to be, and not only until the word that releases it has arrived.
    fn keeps_enabled(&self) -> bool {
        self.word & control::ENABLE_OPERATION != 0
    }

    /// How fast the actual value changes: in positioning mode, that is the velocity.
    fn measure(&mut self, now: Instant, actual: i32) {
        let began = *self.trace.get_or_insert(Trace { at: now, position: actual, velocity: 0 });
        let span = now.since(began.at);
        if span < MEASURED_OVER {
            return;
        }
        let counts = i64::from(actual) - i64::from(began.position);
        let turns = self.units().map_or(0.0, |units| units.shaft_revolutions(counts as i32));
        let per_minute = (turns * 60.0 / span.as_secs_f64()).round() as i32;
        // What moves is not standing.
        let velocity = if per_minute == 0 { counts.signum() as i32 } else { per_minute };
        self.trace = Some(Trace { at: now, position: actual, velocity });
    }

    /// Sends these words one after the other; the last one stays.
    fn send(&mut self, words: &[u16]) {
        self.plan = words.iter().copied().collect();
        self.word = self.plan.pop_front().unwrap_or(self.word);
        self.is_carried = false;
    }

    fn take_reply(&mut self, task: Task, reply: Reply) {
        if self.asks.take() == Some(Asks::Application) {
            // What it may have changed is asked for again, and positions may mean another place.
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

    /// What is sent while nothing is under way depends on the mode; one leads to the other without starting anything.
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

    /// Does what has become due by a change.
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
        // It is not busy.
        let _ = self.tasks.start(now, task);
    }

    /// What to ask for next.
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

/// The words of an order, and how many they are. `edge` is the bit whose edges start travels, as it is: it stays so in
/// all words but that of a start, as long as the drive is enabled.
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

/// Whether the status word shows that the drive has followed; most orders show nowhere.
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
