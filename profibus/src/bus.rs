//! A segment shared by several users, each of whom exchanges data with one slave through a [`Station`].

use std::io;
use std::io::ErrorKind;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::vec;
use std::vec::Vec;

use lexican_runtime::{Duration, Instant, Measured};
use profirust::dp::{PeripheralEvent, PeripheralHandle, PeripheralOptions};

use crate::dp::Lengths;
use crate::fdl::BROADCAST;
use crate::master::Segment;
use crate::trouble::Trouble;

/// A shared segment; clones are handles of the same.
#[derive(Debug)]
pub struct Bus<S>(Arc<Shared<S>>);

impl<S> Clone for Bus<S> {
    fn clone(&self) -> Self {
        Bus(Arc::clone(&self.0))
    }
}

#[derive(Debug)]
struct Shared<S> {
    state: Mutex<State<S>>,
    /// Signals that a station has a notice.
    changed: Condvar,
}

#[derive(Debug)]
struct State<S> {
    segment: S,
    places: Vec<Place>,
}

/// The address is not one of a slave: those are 0 to 126, and 127 is broadcast.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0} is no address of a slave: that is 0 to 126, and all of them listen to 127")]
pub struct AddressError(pub u8);

/// The state between the master and one slave.
#[derive(Debug)]
struct Place {
    handle: PeripheralHandle,
    /// The outputs of the next exchange.
    sends: Vec<u8>,
    wanted: Vec<u8>,
    /// An exchange has just ended, and the next one has not begun.
    is_between: bool,
    exchanges: u64,
    is_there: bool,
    lost: bool,
    exchanged: Option<Exchange>,
    /// Why the slave exchanges no data, as last seen; `None` while it does.
    trouble: Option<Measured<Trouble>>,
}

/// An exchange of data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exchange {
    /// What the master has sent.
    pub sent: Vec<u8>,
    /// What the slave has answered.
    pub received: Vec<u8>,
}

/// What a station learns of its slave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Data has been exchanged. If that has happened several times since the last call, this is the last one.
    Exchanged(Exchange),
    /// The slave exchanges no data any more, or has had to be parameterised again. Outputs are zero until the station
    /// sets them again.
    Lost,
}

impl<S: Segment> Bus<S> {
    /// Shares a segment.
    pub fn new(segment: S) -> Self {
        let state = Mutex::new(State { segment, places: Vec::new() });
        Bus(Arc::new(Shared { state, changed: Condvar::new() }))
    }

    /// The station for one slave, with outputs of zero.
    pub fn station(
        &self,
        address: u8,
        options: PeripheralOptions<'static>,
        lengths: Lengths,
    ) -> Result<Station<S>, AddressError> {
        if address >= BROADCAST {
            return Err(AddressError(address));
        }
        let mut state = self.0.lock();
        let handle = state.segment.add(address, options, lengths);
        let zeros = vec![0; lengths.outputs];
        state.places.push(Place {
            handle,
            sends: zeros.clone(),
            wanted: zeros,
            is_between: false,
            exchanges: 0,
            is_there: false,
            lost: false,
            exchanged: None,
            trouble: None,
        });
        Ok(Station { bus: self.clone(), place: state.places.len() - 1 })
    }

    /// Gives access to the segment.
    pub fn with<T>(&self, call: impl FnOnce(&mut S) -> T) -> T {
        call(&mut self.0.lock().segment)
    }
}

impl<S: Segment + Send + 'static> Bus<S> {
    /// Starts a thread that polls the segment until the bus and all its stations are dropped. Without it, time passes
    /// in [`Station::wait`] only, and in between slaves lose their master by the watchdog.
    pub fn keep(&self, every: Duration) -> io::Result<()> {
        let shared = Arc::downgrade(&self.0);
        std::thread::Builder::new().spawn(move || keep(&shared, every)).map(drop)
    }
}

#[expect(clippy::disallowed_methods, reason = "a port is in real time")]
fn keep<S: Segment>(shared: &Weak<Shared<S>>, every: Duration) {
    while let Some(shared) = shared.upgrade() {
        let mut state = shared.lock();
        let now = state.segment.now();
        while state.poll(now) {
            shared.changed.notify_all();
        }
        drop(state);
        drop(shared);
        std::thread::sleep(every.into());
    }
}

impl<S> Shared<S> {
    fn lock(&self) -> MutexGuard<'_, State<S>> {
        // The panic that poisoned it has been reported where it happened.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S: Segment> State<S> {
    /// Handles one event of the segment, not later than `now`; returns whether there was one.
    fn poll(&mut self, now: Instant) -> bool {
        self.places.iter_mut().for_each(|place| place.is_between = false);
        let Some((handle, event)) = self.segment.poll(now) else { return false };
        let Some(place) = self.places.iter_mut().find(|place| place.handle == handle) else { return true };
        let at = self.segment.now();
        let peripheral = self.segment.peripheral(handle);
        // A refused slave is reported offline as well, before it is asked again.
        if event != PeripheralEvent::Offline {
            place.trouble = Trouble::of(peripheral, event).map(|trouble| Measured::new(trouble, at));
        }
        if event == PeripheralEvent::DataExchanged {
            let received = peripheral.pi_i().to_vec();
            let sent = core::mem::replace(&mut place.sends, place.wanted.clone());
            place.exchanged = Some(Exchange { sent, received });
            place.exchanges += 1;
            (place.is_there, place.is_between) = (true, true);
        } else if event != PeripheralEvent::Diagnostics && core::mem::take(&mut place.is_there) {
            // Outputs must not outlive the exchange of data.
            place.lost = true;
            place.wanted.fill(0);
            place.sends.fill(0);
            place.exchanged = None;
        }
        peripheral.pi_q_mut().copy_from_slice(&place.sends);
        true
    }

    fn set(&mut self, place: usize, outputs: &[u8]) {
        let Some(place) = self.places.get_mut(place) else { return };
        if place.lost || place.wanted.len() != outputs.len() {
            return;
        }
        place.wanted.copy_from_slice(outputs);
        if place.is_between {
            place.sends.copy_from_slice(outputs);
            self.segment.peripheral(place.handle).pi_q_mut().copy_from_slice(outputs);
        }
    }

    fn notice(&mut self, place: usize) -> Option<Notice> {
        let place = self.places.get_mut(place)?;
        if core::mem::take(&mut place.lost) {
            return Some(Notice::Lost);
        }
        place.exchanged.take().map(Notice::Exchanged)
    }
}

/// The master's side of one slave.
#[derive(Debug)]
pub struct Station<S> {
    bus: Bus<S>,
    place: usize,
}

impl<S: Segment> Station<S> {
    /// The bus.
    pub fn bus(&self) -> &Bus<S> {
        &self.bus
    }

    /// The time on the segment.
    pub fn now(&self) -> Instant {
        self.bus.0.lock().segment.now()
    }

    /// Whether the segment is in real time.
    pub fn is_real_time(&self) -> bool {
        self.bus.0.lock().segment.is_real_time()
    }

    /// How often data has been exchanged.
    pub fn exchanges(&self) -> u64 {
        self.bus.0.lock().places.get(self.place).map_or(0, |place| place.exchanges)
    }

    /// Why no data is exchanged; `None` while it is.
    pub fn trouble(&self) -> Option<Trouble> {
        let mut state = self.bus.0.lock();
        let state = &mut *state;
        let (now, place) = (state.segment.now(), state.places.get(self.place)?);
        let peripheral = state.segment.peripheral(place.handle);
        if peripheral.is_running() {
            return None;
        }
        // A slave that is refused repeatedly shows that repeatedly; one that is gone shows nothing.
        let noticed = place.trouble.filter(|noticed| peripheral.is_live() || noticed.fresh(now, NOTICED).is_some());
        Some(noticed.map_or(Trouble::Silent { address: peripheral.address() }, |noticed| noticed.value))
    }

    /// Whether [`Station::wait`] would return a notice at once.
    pub fn has_notice(&self) -> bool {
        let state = self.bus.0.lock();
        state.places.get(self.place).is_some_and(|place| place.lost || place.exchanged.is_some())
    }

    /// Sets the outputs of the next exchange that begins; one under way is not affected. Does nothing until a loss of
    /// the slave has been noticed.
    pub fn set_outputs(&mut self, outputs: &[u8]) {
        self.bus.0.lock().set(self.place, outputs);
    }

    /// Waits for a notice, at most until `until`.
    pub fn wait(&mut self, until: Instant) -> Result<Option<Notice>, ErrorKind> {
        let shared = &self.bus.0;
        let mut state = shared.lock();
        loop {
            let notice = state.notice(self.place);
            let now = state.segment.now();
            if notice.is_some() || now >= until {
                return Ok(notice);
            }
            state.segment.failed().map_or(Ok(()), Err)?;
            if state.segment.is_real_time() {
                let span = until.since(now).min(TURN).into();
                state = shared.changed.wait_timeout(state, span).unwrap_or_else(PoisonError::into_inner).0;
            } else {
                state.poll(until);
            }
        }
    }
}

/// How long the reason of a refusal counts.
const NOTICED: Duration = Duration::from_secs(1);

/// How often a wait in real time checks whether the segment has failed.
const TURN: Duration = Duration::from_millis(50);
