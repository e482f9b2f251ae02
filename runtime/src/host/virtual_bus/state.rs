//! Time, arbitration, and who receives what.

use std::boxed::Box;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::vec::Vec;

use super::agenda::Agenda;
use super::controller::{Controller, Taken};
use super::fate::{Fate, Judge};
use crate::host::clock::pause;
use crate::host::node::lock;
use crate::host::{BusState, wire_bits};
use crate::{Duration, Frame, Instant};

/// In real time, the longest wait before the bus looks for frames of other threads.
const TURN: Duration = Duration::from_millis(1);

/// How many events may happen while no time passes. More are a bug in a node.
pub(super) const MOST_AT_ONCE: u32 = 1_000_000;

pub(super) type Observer = Box<dyn FnMut(Instant, &Frame) + Send>;

#[derive(Default)]
pub(super) struct State {
    pub(super) clock: Clock,
    wire: Wire,
    pub(super) condition: BusState,
    pub(super) controllers: Vec<Controller>,
    agenda: Agenda,
    delayed: Vec<InFlight>,
    pub(super) observers: Vec<Observer>,
    pub(super) judge: Judge,
    pacer: Option<Pacer>,
    /// How many events happened since time last passed.
    pub(super) standstill: u32,
}

/// The time on the bus, which can be read without its lock: another thread may hold a node of the bus meanwhile.
#[derive(Clone, Default)]
pub(super) struct Clock(Arc<AtomicU64>);

impl Clock {
    pub(super) fn now(&self) -> Instant {
        Instant::from_micros(self.0.load(Ordering::Relaxed))
    }

    fn set(&self, now: Instant) {
        self.0.store(now.as_micros(), Ordering::Relaxed);
    }
}

/// The state of the wire.
#[derive(Default)]
struct Wire {
    /// `None`: frames take no time.
    kbit_per_s: Option<u32>,
    frame: Option<InFlight>,
    /// When the last frame ended, rounded down to a microsecond, and the remainder in 1/`kbit_per_s` us.
    free: (Instant, u64),
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

/// Handles one event until `until`; in real time, may only wait for a part of the time to it. `false` if none is left.
pub(super) fn step(state: &Mutex<State>, until: Instant) -> bool {
    let mut state = lock(state);
    let lead = state.lead(until);
    if lead.is_zero() {
        return state.step(until);
    }
    // Other threads may use the bus meanwhile.
    drop(state);
    pause(lead.min(TURN));
    true
}

impl State {
    pub(super) fn with_bit_rate(kbit_per_s: u32) -> Self {
        State { wire: Wire { kbit_per_s: Some(kbit_per_s), ..Wire::default() }, ..State::default() }
    }

    /// Whether a frame takes the time of its bits.
    pub(super) const fn has_bit_times(&self) -> bool {
        self.wire.kbit_per_s.is_some()
    }

    /// Adds a controller, and returns its place.
    pub(super) fn add(&mut self, controller: Controller) -> usize {
        self.agenda.add(&controller);
        self.controllers.push(controller);
        self.controllers.len() - 1
    }

    /// Calls a controller.
    pub(super) fn call<R>(&mut self, place: usize, what: impl FnOnce(&mut Controller, Instant) -> R) -> R {
        let controller = &mut self.controllers[place];
        let result = what(controller, self.clock.now());
        self.agenda.note(place, controller);
        result
    }

    #[expect(clippy::disallowed_methods, reason = "real time is what is asked for")]
    pub(super) fn set_real_time(&mut self, on: bool) {
        self.pacer = on.then(|| Pacer { wall: std::time::Instant::now(), bus: self.clock.now() });
    }

    pub(super) const fn is_in_real_time(&self) -> bool {
        self.pacer.is_some()
    }

    /// Handles one event that is not later than `until`; `false` if none is left.
    fn step(&mut self, until: Instant) -> bool {
        self.begin();
        let Some(next) = self.next_event().filter(|next| *next <= until) else {
            self.pass_to(until);
            return false;
        };
        self.pass_to(next);
        self.standstill += 1;
        assert!(self.standstill < MOST_AT_ONCE, "a node sends or expires without end while no time passes");
        if let Some(arrived) = self.wire.frame.take_if(|frame| frame.arrives <= next) {
            self.decide(arrived);
        } else if let Some(at) = self.delayed.iter().position(|frame| frame.arrives <= next) {
            let arrived = self.delayed.remove(at);
            self.deliver(arrived.sender, &arrived.frame);
        } else if let Some(place) = self.agenda.take_mail(next) {
            self.call(place, |controller, _| controller.handle_mail(next));
        } else {
            for place in self.agenda.take_due(next) {
                self.call(place, |controller, _| controller.handle_timeout(next));
            }
        }
        true
    }

    /// Begins the next frame, if the bus is free. All frames that get ready in one bit time take part in the
    /// arbitration, so with a bit rate, all other events of this moment happen first. Without one, frames come before
    /// deadlines.
    fn begin(&mut self) {
        let is_busy = self.wire.frame.is_some();
        if is_busy || self.has_bit_times() && self.next_event() == Some(self.clock.now()) {
            return;
        }
        let now = self.clock.now();
        if let Some((sender, frame)) = self.agenda.arbitrate(&mut self.controllers, now) {
            self.controllers[sender].win();
            self.wire.send(now, sender, frame);
        }
    }

    /// Takes the frame that this controller is sending from the wire.
    pub(super) fn cut_off(&mut self, sender: usize) -> Option<Frame> {
        self.wire.frame.take_if(|frame| frame.sender == sender).map(|cut| cut.frame)
    }

    fn next_event(&self) -> Option<Instant> {
        let arrivals = self.wire.frame.iter().chain(&self.delayed).map(|frame| frame.arrives);
        let deadline = self.agenda.poll_timeout(&self.controllers);
        deadline.into_iter().chain(arrivals).min().map(|next| next.max(self.clock.now()))
    }

    fn pass_to(&mut self, next: Instant) {
        if next > self.clock.now() {
            self.standstill = 0;
            self.clock.set(next);
        }
    }

    /// In real time, the wait until the next event or `until`; else zero. Advances the bus to the time of the wall
    /// clock.
    fn lead(&mut self, until: Instant) -> Duration {
        let Some(wall) = self.pacer.as_ref().map(|pacer| pacer.bus + pacer.wall.elapsed().into()) else {
            return Duration::ZERO;
        };
        self.begin();
        let goal = self.next_event().filter(|next| *next <= until).unwrap_or(until);
        self.pass_to(wall.min(goal));
        goal.since(wall)
    }

    fn decide(&mut self, sent: InFlight) {
        if !self.condition.carries_frames() {
            return;
        }
        let by_sender = self.controllers[sent.sender].judge.decide(&sent.frame);
        match if by_sender == Fate::Deliver { self.judge.decide(&sent.frame) } else { by_sender } {
            Fate::Deliver => self.deliver(sent.sender, &sent.frame),
            Fate::Lose => {}
            Fate::Repeat => {
                self.deliver(sent.sender, &sent.frame);
                self.deliver(sent.sender, &sent.frame);
            }
            Fate::Replace(frame) => self.deliver(sent.sender, &frame),
            Fate::Delay(span) => self.delayed.push(InFlight { arrives: self.clock.now() + span, ..sent }),
        }
    }

    fn deliver(&mut self, sender: usize, frame: &Frame) {
        for observer in &mut self.observers {
            observer(self.clock.now(), frame);
        }
        for (receiver, controller) in self.controllers.iter_mut().enumerate() {
            if receiver == sender {
                continue;
            }
            match controller.receive(self.clock.now(), frame) {
                Taken::Handled => self.agenda.note(receiver, controller),
                Taken::Until(handled) => self.agenda.add_mail(handled, receiver),
                Taken::Not => {}
            }
        }
    }
}

impl Wire {
    /// Begins a frame. Fractions of a microsecond add up over frames without a gap.
    fn send(&mut self, now: Instant, sender: usize, frame: Frame) {
        let Some(kbit_per_s) = self.kbit_per_s.map(u64::from) else {
            self.frame = Some(InFlight { sender, frame, arrives: now });
            return;
        };
        let fraction = if self.free.0 == now { self.free.1 } else { 0 };
        let length = u64::from(wire_bits(&frame)) * 1000 + fraction;
        let arrives = now + Duration::from_micros(length / kbit_per_s);
        self.free = (arrives, length % kbit_per_s);
        self.frame = Some(InFlight { sender, frame, arrives });
    }
}
