//! A CAN bus inside the process, in virtual time.
//!
//! The bus carries one frame at a time, for as long as its bits take, including stuff bits and the intermission. A
//! frame that is ready while the bus is busy waits in the transmit buffer of its node; of the frames that wait, the one
//! with the lowest identifier goes first (ISO 11898-1). All nodes but the sender receive it, and take a while to handle
//! it. Time jumps from event to event, so an hour of a slow drive takes milliseconds, and the same program gives the
//! same log every time.
//!
//! A node may be [unplugged, without power, or slow](Attachment). Faults are injected frame by frame ([`Fate`]), for
//! all frames or for those of one node.
//!
//! What a real bus has, and this one has not:
//!
//! - Bit errors and error frames: a frame is lost for all nodes or for none, and is not sent again. The states of the
//!   controllers are [set](VirtualBus::set_state), and do not follow from errors.
//! - Missing acknowledgements: a frame counts as sent even if there is no other node.
//! - Two nodes that send with the same identifier: here one waits for the other; on a real bus, an error follows where
//!   their frames differ.
//! - Clocks that drift: all nodes have the time of the bus, and the same bit rate.
//! - Reception before the end of a frame: a real controller accepts it two bit times earlier.

mod agenda;
mod attachment;
mod controller;
mod fate;
mod inbox;
mod link;
mod state;

use std::boxed::Box;
use std::sync::{Arc, Mutex, MutexGuard};

pub use self::attachment::Attachment;
use self::controller::Controller;
pub use self::fate::Fate;
use self::fate::Judge;
use self::inbox::Inbox;
pub use self::link::VirtualLink;
use self::state::{Clock, State};
use super::node::lock;
use super::{BusState, Node};
use crate::{Duration, Frame, Instant};

/// How long a node takes for a frame on a bus with a bit rate: as a microcontroller whose main loop has other work.
/// Without this time, an SDO server would answer within the intermission, its client would ask again, and nothing else
/// would get through.
const RESPONSE_TIME: Duration = Duration::from_micros(100);

/// How fast virtual time passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// As fast as the machine can compute it.
    #[default]
    Virtual,
    /// As fast as the wall clock.
    RealTime,
}

/// A handle of a bus; clones are handles of the same bus.
#[derive(Clone)]
pub struct VirtualBus {
    clock: Clock,
    state: Arc<Mutex<State>>,
}

impl Default for VirtualBus {
    fn default() -> Self {
        VirtualBus::new()
    }
}

impl VirtualBus {
    /// A bus without a bit rate: neither the frames nor the nodes take time.
    #[must_use]
    pub fn new() -> Self {
        VirtualBus::of(State::default())
    }

    /// A bus of `kbit_per_s`, such as 125 or 500. Nodes take 100 us to handle a frame.
    ///
    /// # Panics
    ///
    /// When it is 0.
    #[must_use]
    pub fn with_bit_rate(kbit_per_s: u32) -> Self {
        assert!(kbit_per_s > 0, "a bus has a bit rate");
        VirtualBus::of(State::with_bit_rate(kbit_per_s))
    }

    fn of(state: State) -> Self {
        VirtualBus { clock: state.clock.clone(), state: Arc::new(Mutex::new(state)) }
    }

    /// Connects a node. With the handle it can be unplugged, lose its power or be slowed down.
    pub fn attach(&self, node: impl Node + Send + 'static) -> Attachment {
        let mut state = self.lock();
        let response_time = if state.has_bit_times() { RESPONSE_TIME } else { Duration::ZERO };
        self.place(state.add(Controller::new(Box::new(node), response_time)))
    }

    /// A link to this bus, for a shell.
    #[must_use]
    pub fn link(&self) -> VirtualLink {
        let inbox = Arc::new(Mutex::new(Inbox::new()));
        let place = self.lock().add(Controller::of_link(&inbox));
        VirtualLink::new(Arc::clone(&self.state), inbox, self.place(place))
    }

    /// Calls `observer` with each frame that is delivered, and its time.
    pub fn observe(&self, observer: impl FnMut(Instant, &Frame) + Send + 'static) {
        self.lock().observers.push(Box::new(observer));
    }

    /// Calls `fate` for each frame, with its number from 0, to decide what happens to it. [`Attachment::set_fate`] does
    /// this for the frames of one node.
    pub fn set_fate(&self, fate: impl FnMut(u64, &Frame) -> Fate + Send + 'static) {
        self.lock().judge = Judge::new(fate);
    }

    /// Sets the state of the bus. Every link reports it, and while the state [carries no
    /// frames](BusState::carries_frames) all frames are lost.
    pub fn set_state(&self, condition: BusState) {
        let mut state = self.lock();
        if core::mem::replace(&mut state.condition, condition) != condition {
            state.controllers.iter().for_each(|controller| controller.report(condition));
        }
    }

    /// Sets how fast time passes from now on.
    pub fn set_pace(&self, pace: Pace) {
        self.lock().set_real_time(pace == Pace::RealTime);
    }

    /// The time on the bus. It never waits for the bus, so an observer may call it, and so may a thread that holds a
    /// node.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// Lets time pass until `until`, with all events in between.
    pub fn advance_to(&self, until: Instant) {
        while state::step(&self.state, until) {}
    }

    /// Lets `span` pass, with all events in between.
    pub fn advance(&self, span: Duration) {
        let until = self.now() + span;
        self.advance_to(until);
    }

    fn place(&self, place: usize) -> Attachment {
        Attachment::new(Arc::clone(&self.state), place)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}

#[cfg(test)]
mod tests {
    use super::state::MOST_AT_ONCE;
    use super::*;
    use crate::CobId;
    use crate::host::{Incoming, Link, LinkError};
    use proptest::prelude::*;
    use std::vec;
    use std::vec::Vec;

    fn frame(id: u16, data: &[u8]) -> Frame {
        Frame::new(CobId::standard(id).unwrap(), data).unwrap()
    }

    /// Sends `frame` whenever `every` has passed.
    struct Metronome {
        frame: Frame,
        every: Duration,
        next: Instant,
        due: bool,
        is_settled: bool,
    }

    impl Node for Metronome {
        /// A frame with the same data as the node's own restarts the period.
        fn handle_frame(&mut self, now: Instant, frame: &Frame) {
            if frame.data() == self.frame.data() {
                self.next = now + self.every;
            }
        }
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
        fn concerns(&self) -> Vec<CobId> {
            [0x100, self.frame.id().raw() as u16 ^ 1].into_iter().filter_map(CobId::standard).collect()
        }
        fn changes_only_when_called(&self) -> bool {
            self.is_settled
        }
    }

    fn metronome(id: u16) -> Metronome {
        let every = Duration::from_millis(10);
        Metronome { frame: frame(id, &[0; 8]), every, next: Instant::ZERO + every, due: false, is_settled: true }
    }

    /// The frames on a bus of metronomes, each given by identifier, period in 100 us and data byte. For 10 ms the first
    /// one is unplugged and the last one has no power.
    fn log(metronomes: &[(u16, u64, u8)], kbit_per_s: Option<u32>, is_settled: bool) -> Vec<(Instant, Frame)> {
        let bus = kbit_per_s.map_or_else(VirtualBus::new, VirtualBus::with_bit_rate);
        let nodes = metronomes.iter().map(|&(id, every, byte)| {
            let every = Duration::from_micros(100 * every);
            let frame = frame(id, &[byte]);
            bus.attach(Metronome { frame, every, next: Instant::ZERO + every, is_settled, ..metronome(id) })
        });
        let nodes: Vec<_> = nodes.collect();
        let log = Arc::new(Mutex::new(Vec::new()));
        let heard = Arc::clone(&log);
        bus.observe(move |at, frame| heard.lock().unwrap().push((at, *frame)));
        bus.advance(Duration::from_millis(20));
        nodes[0].detach();
        nodes[nodes.len() - 1].power_off();
        bus.advance(Duration::from_millis(10));
        nodes[0].attach();
        nodes[nodes.len() - 1].power_on();
        bus.advance(Duration::from_millis(20));
        log.lock().unwrap().clone()
    }

    proptest! {
        /// Settled nodes, which change only when called, against nodes that the bus asks before each event.
        #[test]
        fn nodes_that_are_not_asked_send_the_same(
            metronomes in prop::collection::vec((0x100..0x108_u16, 1..30_u64, 0..4_u8), 1..8),
            kbit_per_s in prop::option::of(Just(500_u32)),
        ) {
            let [settled, asked] = [true, false].map(|is_settled| log(&metronomes, kbit_per_s, is_settled));
            prop_assert!(!asked.is_empty());
            prop_assert_eq!(settled, asked);
        }
    }

    #[test]
    fn the_time_is_known_while_the_bus_is_busy() {
        let bus = VirtualBus::new();
        let (asked, times) = (bus.clone(), Arc::new(Mutex::new(Vec::new())));
        let seen = Arc::clone(&times);
        // An observer is called while the bus is locked.
        bus.observe(move |at, _| seen.lock().unwrap().push((at, asked.now())));
        bus.attach(metronome(0x181));
        bus.advance(Duration::from_millis(10));
        let at = Instant::from_micros(10_000);
        assert_eq!(*times.lock().unwrap(), [(at, at)]);
    }

    #[test]
    fn the_lowest_identifier_wins_and_a_frame_takes_its_bits() {
        let bus = VirtualBus::with_bit_rate(500);
        bus.attach(metronome(0x300));
        bus.attach(metronome(0x100));
        let mut link = bus.link();
        let second = Instant::from_micros(1_000_000);
        // 111 bits at 2 us each, and 15 stuff bits.
        assert_eq!(link.receive_frame(second).unwrap().unwrap().id().raw(), 0x100);
        assert_eq!(link.now(), Instant::from_micros(10_252));
        assert_eq!(link.receive_frame(second).unwrap().unwrap().id().raw(), 0x300);
        assert_eq!(link.now(), Instant::from_micros(10_504));
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
        let inbox = Arc::clone(&link.inbox);
        drop(link);
        bus.link().send(&frame(1, &[])).unwrap();
        bus.advance(Duration::from_millis(1));
        bus.set_state(BusState::Off);
        assert!(lock(&inbox).incoming.is_empty());
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
