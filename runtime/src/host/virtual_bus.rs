//! A CAN bus inside the process, in virtual time.
//!
//! It works as a bus does: one frame at a time, the lowest identifier wins, a frame takes as long as
//! its bits take, and all nodes but the sender receive it. Time jumps from event to event, so an hour of
//! a slow drive takes milliseconds, and the same program gives the same log every time. Faults are
//! injected frame by frame ([`Fate`]).

use std::boxed::Box;
use std::collections::{BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard};
use std::vec::Vec;

use super::clock::pause;
use super::node::lock;
use super::{BusState, Incoming, Link, LinkError, Node};
use crate::{CobId, Duration, Frame, Instant};

/// What happens to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// All nodes receive it.
    Deliver,
    /// No node receives it.
    Lose,
    /// All nodes receive it twice.
    Repeat,
    /// All nodes receive another frame.
    Replace(Frame),
    /// All nodes receive it later; frames sent meanwhile overtake it.
    Delay(Duration),
}

/// How fast virtual time passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// As fast as the machine can compute it.
    #[default]
    Virtual,
    /// As fast as the clock on the wall.
    RealTime,
}

/// A handle of a bus; clones are handles of the same bus.
#[derive(Clone)]
pub struct VirtualBus {
    state: Arc<Mutex<State>>,
}

impl VirtualBus {
    /// A bus on which a frame takes no time.
    #[must_use]
    pub fn new() -> Self {
        VirtualBus { state: Arc::new(Mutex::new(State::default())) }
    }

    /// A bus of `kbit_per_s`, such as 125 or 500.
    ///
    /// # Panics
    ///
    /// When it is 0.
    #[must_use]
    pub fn with_bit_rate(kbit_per_s: u32) -> Self {
        assert!(kbit_per_s > 0, "a bus has a bit rate");
        let bus = VirtualBus::new();
        bus.lock().kbit_per_s = Some(kbit_per_s);
        bus
    }

    /// Connects a node.
    pub fn attach(&self, node: impl Node + Send + 'static) {
        self.lock().stations.push(Station::new(Box::new(node)));
    }

    /// A link to this bus, for a shell.
    #[must_use]
    pub fn link(&self) -> VirtualLink {
        let mailbox = Arc::new(Mutex::new(Mailbox::default()));
        self.attach(Arc::clone(&mailbox));
        self.lock().links.push(Arc::clone(&mailbox));
        VirtualLink { bus: self.clone(), mailbox }
    }

    /// Calls `observer` with each frame that is delivered, and its time.
    pub fn observe(&self, observer: impl FnMut(Instant, &Frame) + Send + 'static) {
        self.lock().observers.push(Box::new(observer));
    }

    /// Calls `fate` for each frame, with its number from 0, to decide what happens to it.
    pub fn set_fate(&self, fate: impl FnMut(u64, &Frame) -> Fate + Send + 'static) {
        let mut state = self.lock();
        state.fate = Some(Box::new(fate));
        state.frames = 0;
    }

    /// Sets the state of the bus. Every link reports it, and while the state [carries no
    /// frames](BusState::carries_frames) all frames are lost.
    pub fn set_state(&self, condition: BusState) {
        let mut state = self.lock();
        if core::mem::replace(&mut state.condition, condition) != condition {
            state.links.retain(|mailbox| {
                let mut mailbox = lock(mailbox);
                mailbox.take(Incoming::State(condition));
                !mailbox.closed
            });
        }
    }

    /// How fast time passes from now on.
    #[expect(clippy::disallowed_methods, reason = "real time is what is asked for")]
    pub fn set_pace(&self, pace: Pace) {
        let mut state = self.lock();
        state.pacer = match pace {
            Pace::Virtual => None,
            Pace::RealTime => Some(Pacer { wall: std::time::Instant::now(), bus: state.now }),
        };
    }

    /// The time on the bus.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.lock().now
    }

    /// Lets time pass until `until`, with all events in between.
    pub fn advance_to(&self, until: Instant) {
        while self.step(until) {}
    }

    /// Lets `span` pass, with all events in between.
    pub fn advance(&self, span: Duration) {
        let until = self.now() + span;
        self.advance_to(until);
    }

    /// One event, not later than `until`, or in real time a part of the wait for it. `false` when none is left.
    fn step(&self, until: Instant) -> bool {
        let mut state = self.lock();
        let lead = state.lead(until);
        if lead.is_zero() {
            return state.step(until);
        }
        // Other threads may use the bus meanwhile.
        drop(state);
        pause(lead.min(TURN));
        true
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}

impl Default for VirtualBus {
    fn default() -> Self {
        VirtualBus::new()
    }
}

/// A link to a [`VirtualBus`]. Virtual time passes while a link is waited on.
pub struct VirtualLink {
    bus: VirtualBus,
    mailbox: Arc<Mutex<Mailbox>>,
}

impl Link for VirtualLink {
    fn is_real_time(&self) -> bool {
        self.bus.lock().pacer.is_some()
    }

    fn now(&self) -> Instant {
        self.bus.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        let condition = self.bus.lock().condition;
        if !condition.carries_frames() {
            return Err(LinkError::NoBus(condition));
        }
        lock(&self.mailbox).outgoing.push_back(*frame);
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            if let Some(incoming) = lock(&self.mailbox).incoming.pop_front() {
                return Ok(Some(incoming));
            }
            if !self.bus.step(until) {
                return Ok(lock(&self.mailbox).incoming.pop_front());
            }
        }
    }

    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
        lock(&self.mailbox).wanted = ids.iter().copied().collect();
        Ok(())
    }
}

/// A link leaves the bus when it is dropped, so that frames do not pile up for it.
impl Drop for VirtualLink {
    fn drop(&mut self) {
        let mut mailbox = lock(&self.mailbox);
        mailbox.closed = true;
        mailbox.incoming.clear();
    }
}

#[derive(Default)]
struct Mailbox {
    incoming: VecDeque<Incoming>,
    outgoing: VecDeque<Frame>,
    /// The frames that come in; all, when there are none.
    wanted: BTreeSet<CobId>,
    closed: bool,
}

impl Mailbox {
    fn take(&mut self, incoming: Incoming) {
        if !self.closed {
            self.incoming.push_back(incoming);
        }
    }
}

impl Node for Mailbox {
    fn handle_frame(&mut self, _: Instant, frame: &Frame) {
        if self.wanted.is_empty() || self.wanted.contains(&frame.id()) {
            self.take(Incoming::Frame(*frame));
        }
    }
    fn handle_timeout(&mut self, _: Instant) {}
    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        self.outgoing.pop_front()
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// In real time, how often a wait checks for frames that other threads have sent.
const TURN: Duration = Duration::from_millis(1);

/// How many events may happen while no time passes, as endless ones do by a bug in a node.
const MOST_AT_ONCE: u32 = 1_000_000;

type Observer = Box<dyn FnMut(Instant, &Frame) + Send>;
type Judge = Box<dyn FnMut(u64, &Frame) -> Fate + Send>;

#[derive(Default)]
struct State {
    now: Instant,
    kbit_per_s: Option<u32>,
    condition: BusState,
    stations: Vec<Station>,
    links: Vec<Arc<Mutex<Mailbox>>>,
    wire: Option<InFlight>,
    delayed: Vec<InFlight>,
    observers: Vec<Observer>,
    fate: Option<Judge>,
    frames: u64,
    pacer: Option<Pacer>,
    /// How many events happened since time last passed.
    standstill: u32,
}

/// A node with the transmit buffer of its controller: a frame that lost arbitration waits there.
struct Station {
    node: Box<dyn Node + Send>,
    buffer: Option<Frame>,
}

impl Station {
    fn new(node: Box<dyn Node + Send>) -> Self {
        Station { node, buffer: None }
    }
}

#[derive(Clone, Copy)]
struct InFlight {
    sender: usize,
    frame: Frame,
    arrives: Instant,
}

struct Pacer {
    wall: std::time::Instant,
    bus: Instant,
}

impl State {
    /// One event, not later than `until`; `false` when none is left before it.
    fn step(&mut self, until: Instant) -> bool {
        if self.wire.is_none() {
            self.arbitrate();
        }
        let Some(next) = self.next_event().filter(|next| *next <= until) else {
            self.pass_to(until);
            return false;
        };
        self.pass_to(next);
        self.standstill += 1;
        assert!(self.standstill < MOST_AT_ONCE, "a node sends or expires without end while no time passes");
        if let Some(arrived) = self.wire.take_if(|frame| frame.arrives <= next) {
            self.decide(arrived);
        } else if let Some(at) = self.delayed.iter().position(|frame| frame.arrives <= next) {
            let arrived = self.delayed.remove(at);
            self.deliver(arrived.sender, &arrived.frame);
        } else {
            self.expire();
        }
        true
    }

    /// Of all frames that wait, sends the one with the lowest identifier.
    fn arbitrate(&mut self) {
        let now = self.now;
        for station in &mut self.stations {
            if station.buffer.is_none() {
                station.buffer = station.node.poll_transmit(now);
            }
        }
        let winner = (0..self.stations.len())
            .filter_map(|sender| Some((self.stations[sender].buffer?, sender)))
            .min_by_key(|(frame, sender)| (arbitration(frame), *sender));
        if let Some((frame, sender)) = winner {
            self.stations[sender].buffer = None;
            self.wire = Some(InFlight { sender, frame, arrives: now + self.duration(&frame) });
        }
    }

    fn next_event(&self) -> Option<Instant> {
        let deadlines = self.stations.iter().filter_map(|station| station.node.poll_timeout());
        let arrivals = self.wire.iter().chain(&self.delayed).map(|frame| frame.arrives);
        deadlines.chain(arrivals).min().map(|next| next.max(self.now))
    }

    fn pass_to(&mut self, next: Instant) {
        if next > self.now {
            self.standstill = 0;
            self.now = next;
        }
    }

    /// In real time, how long it takes to the next event, or to `until`. Lets the time pass that has passed by the clock
    /// on the wall.
    fn lead(&mut self, until: Instant) -> Duration {
        let Some(wall) = self.pacer.as_ref().map(|pacer| pacer.bus + pacer.wall.elapsed().into()) else {
            return Duration::ZERO;
        };
        if self.wire.is_none() {
            self.arbitrate();
        }
        let goal = self.next_event().filter(|next| *next <= until).unwrap_or(until);
        self.pass_to(wall.min(goal));
        goal.since(wall)
    }

    fn decide(&mut self, sent: InFlight) {
        let number = self.frames;
        self.frames += 1;
        if !self.condition.carries_frames() {
            return;
        }
        match self.fate.as_mut().map_or(Fate::Deliver, |fate| fate(number, &sent.frame)) {
            Fate::Deliver => self.deliver(sent.sender, &sent.frame),
            Fate::Lose => {}
            Fate::Repeat => {
                self.deliver(sent.sender, &sent.frame);
                self.deliver(sent.sender, &sent.frame);
            }
            Fate::Replace(frame) => self.deliver(sent.sender, &frame),
            Fate::Delay(span) => self.delayed.push(InFlight { arrives: self.now + span, ..sent }),
        }
    }

    fn deliver(&mut self, sender: usize, frame: &Frame) {
        for observer in &mut self.observers {
            observer(self.now, frame);
        }
        for (receiver, station) in self.stations.iter_mut().enumerate() {
            if receiver != sender {
                station.node.handle_frame(self.now, frame);
            }
        }
    }

    fn expire(&mut self) {
        let now = self.now;
        for station in &mut self.stations {
            if station.node.poll_timeout().is_some_and(|at| at <= now) {
                station.node.handle_timeout(now);
            }
        }
    }

    /// The time a frame occupies the wire, without stuff bits: 44 bits around the data of a standard
    /// frame, 64 around that of an extended one, and three of silence (ISO 11898-1).
    fn duration(&self, frame: &Frame) -> Duration {
        let Some(kbit_per_s) = self.kbit_per_s else { return Duration::ZERO };
        let overhead = if frame.id().is_extended() { 64 } else { 44 } + 3;
        let bits = overhead + 8 * frame.data().len() as u64;
        Duration::from_micros((bits * 1000).div_ceil(u64::from(kbit_per_s)))
    }
}

/// The lower key wins: by the 11 bits that both formats begin with, then standard before extended,
/// data before remote.
fn arbitration(frame: &Frame) -> (u32, bool, u32, bool) {
    let id = frame.id();
    let base = if id.is_extended() { id.raw() >> 18 } else { id.raw() };
    (base, id.is_extended(), id.raw(), frame.is_remote())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    fn frame(id: u16, data: &[u8]) -> Frame {
        Frame::new(CobId::standard(id).unwrap(), data).unwrap()
    }

    /// Sends `frame` whenever `every` has passed.
    struct Metronome {
        frame: Frame,
        every: Duration,
        next: Instant,
        due: bool,
    }

    impl Node for Metronome {
        fn handle_frame(&mut self, _: Instant, _: &Frame) {}
        fn handle_timeout(&mut self, now: Instant) {
            self.due = true;
            self.next = now + self.every;
        }
        fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
            core::mem::take(&mut self.due).then_some(self.frame)
        }
        fn poll_timeout(&self) -> Option<Instant> {
            Some(self.next)
        }
    }

    fn metronome(id: u16) -> Metronome {
        let every = Duration::from_millis(10);
        Metronome { frame: frame(id, &[0; 8]), every, next: Instant::ZERO + every, due: false }
    }

    #[test]
    fn the_lowest_identifier_wins_and_a_frame_takes_its_bits() {
        let bus = VirtualBus::with_bit_rate(500);
        bus.attach(metronome(0x300));
        bus.attach(metronome(0x100));
        let mut link = bus.link();
        let second = Instant::from_micros(1_000_000);
        // 111 bits at 2 us each.
        assert_eq!(link.receive_frame(second).unwrap().unwrap().id().raw(), 0x100);
        assert_eq!(link.now(), Instant::from_micros(10_222));
        assert_eq!(link.receive_frame(second).unwrap().unwrap().id().raw(), 0x300);
        assert_eq!(link.now(), Instant::from_micros(10_444));
    }

    #[test]
    fn a_link_waits_until_its_deadline_and_does_not_receive_its_own_frames() {
        let bus = VirtualBus::new();
        let (mut a, mut b) = (bus.link(), bus.link());
        a.send(&frame(0x123, &[1])).unwrap();
        assert_eq!(a.receive(Instant::from_micros(50)).unwrap(), None);
        assert_eq!(a.now(), Instant::from_micros(50));
        assert_eq!(b.receive_frame(Instant::from_micros(50)).unwrap(), Some(frame(0x123, &[1])));
    }

    #[test]
    fn a_link_that_is_read_often_is_no_endless_node() {
        let bus = VirtualBus::new();
        let mut link = bus.link();
        bus.lock().standstill = MOST_AT_ONCE - 1;
        for _ in 0..10 {
            assert_eq!(link.receive(link.now()).unwrap(), None);
        }
    }

    #[test]
    fn a_node_with_endless_events_is_noticed() {
        let bus = VirtualBus::new();
        bus.attach(Metronome { every: Duration::ZERO, ..metronome(0x100) });
        bus.lock().standstill = MOST_AT_ONCE - 100;
        assert!(std::thread::spawn(move || bus.advance(Duration::from_millis(20))).join().is_err());
    }

    #[test]
    fn in_real_time_a_wait_lets_other_threads_send() {
        let bus = VirtualBus::new();
        bus.set_pace(Pace::RealTime);
        let (mut a, mut b) = (bus.link(), bus.link());
        let late = Instant::from_micros(5_000_000);
        let heard = std::thread::spawn(move || (a.receive_frame(late).unwrap(), a.now()));
        while bus.now() == Instant::ZERO {
            std::thread::yield_now();
        }
        b.send(&frame(0x123, &[1])).unwrap();
        // Either thread may carry the frame.
        b.receive(bus.now() + Duration::from_millis(5)).unwrap();
        let (heard, now) = heard.join().unwrap();
        assert_eq!(heard, Some(frame(0x123, &[1])));
        assert!(now < Instant::from_micros(4_000_000), "{now}");
    }

    #[test]
    fn fates_apply_to_frames() {
        let bus = VirtualBus::new();
        let (mut a, mut b) = (bus.link(), bus.link());
        bus.set_fate(|n, _| match n {
            0 => Fate::Lose,
            1 => Fate::Repeat,
            2 => Fate::Delay(Duration::from_millis(1)),
            3 => Fate::Replace(frame(0x7, &[7])),
            _ => Fate::Deliver,
        });
        for id in 0..5 {
            a.send(&frame(id, &[])).unwrap();
        }
        let mut heard = vec![];
        while let Some(frame) = b.receive_frame(Instant::from_micros(2_000)).unwrap() {
            heard.push(frame.id().raw());
        }
        assert_eq!(heard, [1, 1, 7, 4, 2]);
    }

    #[test]
    fn frames_do_not_pile_up_for_a_dropped_link() {
        let bus = VirtualBus::new();
        let link = bus.link();
        let mailbox = Arc::clone(&link.mailbox);
        drop(link);
        bus.link().send(&frame(1, &[])).unwrap();
        bus.advance(Duration::from_millis(1));
        bus.set_state(BusState::Off);
        assert!(lock(&mailbox).incoming.is_empty());
    }

    #[test]
    fn links_report_the_state_and_a_bus_that_is_off_carries_no_frames() {
        let bus = VirtualBus::new();
        let (mut a, mut b) = (bus.link(), bus.link());
        let soon = Instant::from_micros(10);
        a.send(&frame(1, &[])).unwrap();
        bus.set_state(BusState::Off);
        assert!(matches!(a.send(&frame(2, &[])), Err(error @ LinkError::NoBus(BusState::Off)) if !error.is_final()));
        bus.set_state(BusState::Active);
        a.send(&frame(3, &[])).unwrap();
        let heard: Vec<_> = core::iter::from_fn(|| b.receive(soon).unwrap()).collect();
        let states = [BusState::Off, BusState::Active].map(Incoming::State);
        assert_eq!(heard, [states[0], states[1], Incoming::Frame(frame(1, &[])), Incoming::Frame(frame(3, &[]))]);
    }
}
