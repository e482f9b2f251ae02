//! One thread owns the link to the bus. Others send and receive through links to this thread.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};

use lexican_runtime::host::{Incoming, Link, LinkError, Pump, StateMachine, Turn};
use lexican_runtime::{CobId, Duration, Frame, Instant};

use super::lock::lock;
use crate::model::Model;

/// How long the thread waits for a frame before it looks for frames to send.
const TURN: Duration = Duration::from_millis(1);

/// Creates links to the bus.
#[derive(Clone)]
pub(super) struct Ports(Arc<Shared>);

struct Shared {
    clock: Mutex<Clock>,
    /// See [`Link::latency`].
    latency: Duration,
    next: AtomicU64,
    outgoing: Sender<(u64, Frame)>,
    mailboxes: Mutex<BTreeMap<u64, Mailbox>>,
    /// Whether the link is gone, or the bench has ended.
    is_over: AtomicBool,
}

/// The time of the bus between two reads of its link, and after the link is gone: then it passes as on the computer.
struct Clock {
    /// The last known time of the bus, and the computer's time then.
    seen: (Instant, std::time::Instant),
    /// The latest time returned so far, since the time of a slow simulation must not go back.
    latest: Instant,
}

struct Mailbox {
    incoming: Sender<Incoming>,
    /// The filter of received frames; empty for all.
    wanted: BTreeSet<CobId>,
}

/// A link to the bus in real time, one of several.
pub(super) struct Port {
    shared: Arc<Shared>,
    number: u64,
    incoming: Receiver<Incoming>,
}

/// The thread of the link.
struct Hub {
    shared: Arc<Shared>,
    model: Arc<Mutex<Model>>,
    outgoing: Receiver<(u64, Frame)>,
}

/// Starts the thread of a link; returns what creates links to the bus.
pub(super) fn begin(link: Box<dyn Link + Send>, model: Arc<Mutex<Model>>) -> std::io::Result<Ports> {
    let (outgoing, frames) = channel();
    lock(&model).set_latency(link.latency());
    let shared = Arc::new(Shared::new(link.now(), link.latency(), outgoing));
    let hub = Hub { shared: Arc::clone(&shared), model, outgoing: frames };
    std::thread::Builder::new().name("bus".to_owned()).spawn(move || hub.run(link))?;
    Ok(Ports(shared))
}

/// Links without a bus, for a recorded log: everything sent is lost.
pub(super) fn nowhere(now: Instant) -> Ports {
    let (outgoing, _) = channel();
    Ports(Arc::new(Shared::new(now, Duration::ZERO, outgoing)))
}

impl Ports {
    /// A link that receives all frames from now on.
    pub(super) fn link(&self) -> Port {
        let (sender, incoming) = channel();
        let number = self.0.next.fetch_add(1, Ordering::Relaxed);
        let mailbox = Mailbox { incoming: sender, wanted: BTreeSet::new() };
        lock(&self.0.mailboxes).insert(number, mailbox);
        Port { shared: Arc::clone(&self.0), number, incoming }
    }

    /// Cuts a link off from the bus; waiting on it ends at once.
    pub(super) fn cut(&self, number: u64) {
        lock(&self.0.mailboxes).remove(&number);
    }

    /// The time on the bus.
    pub(super) fn now(&self) -> Instant {
        self.0.now()
    }

    /// Whether the bus is gone.
    pub(super) fn is_over(&self) -> bool {
        self.0.is_over.load(Ordering::Acquire)
    }

    /// Ends the thread of the link.
    pub(super) fn end(&self) {
        self.0.is_over.store(true, Ordering::Release);
    }
}

impl Port {
    /// The number for [`Ports::cut`].
    pub(super) const fn number(&self) -> u64 {
        self.number
    }
}

impl Shared {
    fn new(now: Instant, latency: Duration, outgoing: Sender<(u64, Frame)>) -> Self {
        let clock = Mutex::new(Clock { seen: (now, machine_time()), latest: now });
        let (next, mailboxes, is_over) = (AtomicU64::new(0), Mutex::default(), AtomicBool::new(false));
        Shared { clock, latency, next, outgoing, mailboxes, is_over }
    }

    fn now(&self) -> Instant {
        lock(&self.clock).at(machine_time())
    }

    /// Passes a frame to all links but that of the sender.
    fn deliver(&self, sender: Option<u64>, incoming: Incoming) {
        for (number, mailbox) in &*lock(&self.mailboxes) {
            let is_wanted = match incoming {
                Incoming::Frame(frame) => mailbox.wanted.is_empty() || mailbox.wanted.contains(&frame.id()),
                _ => true,
            };
            if is_wanted && sender != Some(*number) {
                // Ignore links that are being dropped.
                let _ = mailbox.incoming.send(incoming);
            }
        }
    }
}

impl Clock {
    fn at(&mut self, machine: std::time::Instant) -> Instant {
        let (bus, seen) = self.seen;
        self.latest = self.latest.max(bus + machine.saturating_duration_since(seen).into());
        self.latest
    }
}

fn machine_time() -> std::time::Instant {
    #[expect(clippy::disallowed_methods, reason = "the bench runs in real time")]
    std::time::Instant::now()
}

impl StateMachine for Hub {
    type Event = Infallible;

    fn handle_frame(&mut self, now: Instant, frame: &Frame) -> Option<Infallible> {
        lock(&self.model).observe(now, frame);
        self.shared.deliver(None, Incoming::Frame(*frame));
        None
    }
    fn handle_timeout(&mut self, _: Instant) -> Option<Infallible> {
        None
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let (sender, frame) = self.outgoing.try_recv().ok()?;
        lock(&self.model).observe_own(now, &frame);
        self.shared.deliver(Some(sender), Incoming::Frame(frame));
        Some(frame)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

impl Hub {
    fn run(mut self, mut link: Box<dyn Link + Send>) {
        let mut pump = Pump::new();
        while !self.shared.is_over.load(Ordering::Acquire) {
            let until = link.now() + TURN;
            match pump.turn(&mut *link, &mut self, until) {
                Ok(Turn::Event(never)) => match never {},
                Ok(Turn::Idle | Turn::Over) => {}
                Ok(Turn::Bus(state)) => {
                    lock(&self.model).set_state(link.now(), state);
                    self.shared.deliver(None, Incoming::State(state));
                }
                Ok(Turn::Gap(frames)) => {
                    lock(&self.model).miss(frames);
                    self.shared.deliver(None, Incoming::Gap(frames));
                }
                Err(error) if error.is_final() => {
                    lock(&self.model).lose(error.to_string());
                    break;
                }
                // Ignore the error: the next frame may be accepted.
                Err(_) => {}
            }
            let now = link.now();
            lock(&self.shared.clock).seen = (now, machine_time());
            lock(&self.model).pass(now);
        }
    }
}

/// However the thread ends, even by a panic, links learn that the bus is lost.
impl Drop for Hub {
    fn drop(&mut self) {
        if std::thread::panicking() {
            lock(&self.model)
                .lose("the program that drives the bus has failed (a panic): start the bench anew".to_owned());
        }
        self.shared.is_over.store(true, Ordering::Release);
        lock(&self.shared.mailboxes).clear();
    }
}

impl Link for Port {
    fn is_real_time(&self) -> bool {
        true
    }

    fn now(&self) -> Instant {
        self.shared.now()
    }

    fn latency(&self) -> Duration {
        self.shared.latency
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        if self.shared.is_over.load(Ordering::Acquire) {
            return Err(LinkError::Closed);
        }
        self.shared.outgoing.send((self.number, *frame)).map_err(|_| LinkError::Closed)
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            match self.incoming.recv_timeout(until.since(self.now()).into()) {
                Ok(incoming) => return Ok(Some(incoming)),
                // In a slow simulation, the time is not over yet.
                Err(RecvTimeoutError::Timeout) if self.now() < until => {}
                Err(RecvTimeoutError::Timeout) => return Ok(None),
                Err(RecvTimeoutError::Disconnected) => return Err(LinkError::Closed),
            }
        }
    }

    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
        if let Some(mailbox) = lock(&self.shared.mailboxes).get_mut(&self.number) {
            mailbox.wanted = ids.iter().copied().collect();
        }
        Ok(())
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        lock(&self.shared.mailboxes).remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU32;

    use super::*;
    use crate::model::BusInfo;

    const HOUR: Duration = Duration::from_secs(3600);
    const LATENCY: Duration = Duration::from_millis(700);

    /// A link whose time advances by an hour with each turn, while the computer's time stands still.
    struct Leaping(Arc<AtomicU32>);

    impl Link for Leaping {
        fn now(&self) -> Instant {
            Instant::ZERO + HOUR.times(self.0.load(Ordering::Relaxed))
        }
        fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
            Ok(())
        }
        fn receive(&mut self, _: Instant) -> Result<Option<Incoming>, LinkError> {
            self.0.fetch_add(1, Ordering::Relaxed);
            std::thread::yield_now();
            Ok(None)
        }
        fn latency(&self) -> Duration {
            LATENCY
        }
    }

    #[test]
    fn links_have_the_time_and_the_latency_of_the_bus() {
        let turns = Arc::new(AtomicU32::new(0));
        let model = Arc::new(Mutex::new(Model::new(Instant::ZERO, BusInfo::default())));
        let ports = begin(Box::new(Leaping(Arc::clone(&turns))), model).unwrap();
        while turns.load(Ordering::Relaxed) < 10 {
            std::thread::yield_now();
        }
        let link = ports.link();
        assert!(link.now() >= Instant::ZERO + HOUR.times(9), "{}", link.now());
        assert_eq!(link.latency(), LATENCY);
        ports.end();
    }

    #[test]
    fn the_time_of_a_bus_that_lags_does_not_run_away_nor_back() {
        let (began, ms) = (machine_time(), Duration::from_millis);
        let machine = |after| began + std::time::Duration::from_millis(after);
        let mut clock = Clock { seen: (Instant::ZERO, began), latest: Instant::ZERO };
        for turn in 1..=1000 {
            // One millisecond on the bus takes ten.
            assert_eq!(clock.at(machine(turn * 10 - 7)), Instant::ZERO + ms(turn + 2));
            clock.seen = (Instant::ZERO + ms(turn), machine(turn * 10));
            assert_eq!(clock.at(machine(turn * 10)), Instant::ZERO + ms(turn + 2), "it is given once more");
        }
        // After the thread has ended, the bus's time goes on, so that values become old.
        assert_eq!(clock.at(machine(60_000)), Instant::ZERO + ms(51_000));
    }
}
