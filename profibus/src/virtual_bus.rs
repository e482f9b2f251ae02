//! A bus in virtual time: the master of `profirust` and simulated slaves on a virtual line.

use core::ops::Range;
use std::vec::Vec;

use lexican_runtime::{Duration, Instant};
use profirust::dp::{Peripheral, PeripheralEvent, PeripheralHandle, PeripheralOptions};
use profirust::fdl::{Parameters, ParametersBuilder};
use profirust::phy::ProfibusPhy;
use profirust::{Baudrate, time};

use crate::dp::Lengths;
use crate::fdl::IDLE_BITS;
pub use crate::master::MASTER;
use crate::master::{Master, Segment, instant};
use crate::pkw::{Event, Pkw, PkwMaster, Reply, Task};
use crate::slave::{Application, BitRate, Slave};
use crate::virtual_line::VirtualLine;

/// How long a task of the PKW may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// A master with its slaves. Time passes only in [`VirtualBus::run`] and what is built on it.
#[derive(Debug)]
pub struct VirtualBus<A> {
    master: Master<VirtualLine>,
    stations: Vec<Station<A>>,
    bit_rate: BitRate,
    step: time::Duration,
}

#[derive(Debug)]
struct Station<A> {
    slave: Slave<A>,
    line: VirtualLine,
    handle: Option<PeripheralHandle>,
    events: Vec<PeripheralEvent>,
    exchanges: u64,
    tasks: PkwMaster,
    /// Which of the next answers are lost, counted from 0.
    lost_answers: Range<u32>,
    is_on: bool,
}

/// A slave, by the order of attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SlaveId(usize);

impl<A: Application> VirtualBus<A> {
    /// A bus with a master at 500 kbit/s, whose slaves give it up after 100 ms of silence.
    ///
    /// # Panics
    ///
    /// Never: the parameters are fixed.
    #[must_use]
    pub fn new() -> Self {
        let mut builder = ParametersBuilder::new(MASTER, Baudrate::B500000);
        builder.slot_bits(300).watchdog_timeout(time::Duration::from_millis(100)).highest_station_address(3);
        VirtualBus::with_parameters(builder.build())
    }

    /// A bus with these parameters of `profirust`.
    #[must_use]
    pub fn with_parameters(parameters: Parameters) -> Self {
        let line = VirtualLine::new(parameters.baudrate);
        let bit_rate = BitRate(parameters.baudrate.to_rate() as u32);
        let step = parameters.bits_to_time(IDLE_BITS);
        VirtualBus { master: Master::new(parameters, line), stations: Vec::new(), bit_rate, step }
    }

    /// The bit rate of the bus.
    #[must_use]
    pub fn bit_rate(&self) -> BitRate {
        self.bit_rate
    }

    /// Attaches a slave, which the master exchanges data with by `options`. `inputs` and `outputs` are in bytes.
    pub fn attach(
        &mut self,
        slave: Slave<A>,
        options: PeripheralOptions<'static>,
        (inputs, outputs): (usize, usize),
    ) -> SlaveId {
        let handle = self.master.add(slave.address(), options, Lengths { inputs, outputs });
        self.join(slave, Some(handle))
    }

    /// Attaches a slave that the master is not told of, unless by [`Segment::add`].
    pub fn attach_unknown(&mut self, slave: Slave<A>) -> SlaveId {
        self.join(slave, None)
    }

    fn join(&mut self, slave: Slave<A>, handle: Option<PeripheralHandle>) -> SlaveId {
        let line = self.master.line().another_end();
        let tasks = PkwMaster::new(PATIENCE);
        let (events, exchanges, lost_answers, is_on) = (Vec::new(), 0, 0..0, true);
        self.stations.push(Station { slave, line, handle, events, exchanges, tasks, lost_answers, is_on });
        SlaveId(self.stations.len() - 1)
    }

    /// The time on the bus.
    #[must_use]
    pub fn now(&self) -> Instant {
        instant(self.master.line().now())
    }

    /// A slave.
    #[must_use]
    pub fn slave(&self, id: SlaveId) -> &Slave<A> {
        &self.stations[id.0].slave
    }

    /// A slave, to be changed.
    pub fn slave_mut(&mut self, id: SlaveId) -> &mut Slave<A> {
        &mut self.stations[id.0].slave
    }

    /// The master's view of a slave, if it knows it.
    pub fn peripheral(&mut self, id: SlaveId) -> Option<&mut Peripheral<'static>> {
        Some(self.master.peripheral(self.stations[id.0].handle?))
    }

    /// The events of a slave since the last call, except exchanges of data.
    pub fn events(&mut self, id: SlaveId) -> Vec<PeripheralEvent> {
        core::mem::take(&mut self.stations[id.0].events)
    }

    /// How often data has been exchanged with a slave.
    #[must_use]
    pub fn exchanges(&self, id: SlaveId) -> u64 {
        self.stations[id.0].exchanges
    }

    /// Loses these answers of a slave: number 0 is the next one.
    pub fn lose_answers(&mut self, id: SlaveId, numbers: Range<u32>) {
        self.stations[id.0].lost_answers = numbers;
    }

    /// Disconnects a slave, or connects it again.
    pub fn set_connected(&mut self, id: SlaveId, is_connected: bool) {
        self.stations[id.0].is_on = is_connected;
    }

    /// Makes the master leave the bus, or come back.
    pub fn set_master_online(&mut self, is_online: bool) {
        self.master.set_online(is_online);
    }

    /// Lets some time pass.
    pub fn run(&mut self, span: Duration) {
        let until = self.now() + span;
        while self.now() < until {
            self.turn();
        }
    }

    /// Runs until something holds, but no longer than `span`. Returns whether it holds.
    pub fn run_until(&mut self, span: Duration, mut holds: impl FnMut(&mut Self) -> bool) -> bool {
        let until = self.now() + span;
        while !holds(self) {
            if self.now() >= until {
                return false;
            }
            self.turn();
        }
        true
    }

    /// Runs until data has been exchanged twice, so that the inputs are an answer to the present outputs. Returns
    /// whether that took less than a second.
    pub fn exchange(&mut self, id: SlaveId) -> bool {
        let before = self.exchanges(id);
        self.run_until(Duration::from_secs(1), |bus| bus.exchanges(id) >= before + 2)
    }

    /// Reads or writes a parameter through the PKW, which is the first eight bytes in both directions. `None` if there
    /// is no answer.
    pub fn ask(&mut self, id: SlaveId, task: Task) -> Option<Reply> {
        let now = self.now();
        if !self.stations[id.0].tasks.start(now, task) {
            return None;
        }
        loop {
            let now = self.now();
            let tasks = &mut self.stations[id.0].tasks;
            let output = tasks.output().bytes();
            let mut event = tasks.handle_timeout(now);
            let peripheral = self.peripheral(id)?;
            if let Some(place) = peripheral.pi_q_mut().first_chunk_mut() {
                *place = output;
            }
            let input = Pkw::parse(peripheral.pi_i())?;
            event = event.or_else(|| self.stations[id.0].tasks.handle_input(input));
            match event {
                Some(Event::Answered { reply, .. }) => return Some(reply),
                Some(Event::TimedOut { .. }) => return None,
                None => _ = self.turn(),
            }
        }
    }

    /// Runs for three characters on the line, which is the idle time before a request.
    fn turn(&mut self) -> Option<(PeripheralHandle, PeripheralEvent)> {
        self.master.line().advance(self.step);
        let at = self.master.line().now();
        let noticed = self.master.poll(at);
        if let Some((handle, event)) = noticed
            && let Some(station) = self.stations.iter_mut().find(|station| station.handle == Some(handle))
        {
            match event {
                PeripheralEvent::DataExchanged => station.exchanges += 1,
                other => station.events.push(other),
            }
        }
        let now = instant(at);
        for station in &mut self.stations {
            station.turn(at, now);
        }
        noticed
    }
}

impl<A: Application> Segment for VirtualBus<A> {
    fn now(&self) -> Instant {
        self.now()
    }

    fn is_real_time(&self) -> bool {
        false
    }

    fn add(&mut self, address: u8, options: PeripheralOptions<'static>, lengths: Lengths) -> PeripheralHandle {
        let handle = self.master.add(address, options, lengths);
        for station in self.stations.iter_mut().filter(|station| station.slave.address() == address) {
            station.handle = Some(handle);
        }
        handle
    }

    fn peripheral(&mut self, handle: PeripheralHandle) -> &mut Peripheral<'static> {
        self.master.peripheral(handle)
    }

    fn poll(&mut self, now: Instant) -> Option<(PeripheralHandle, PeripheralEvent)> {
        while self.now() < now {
            let noticed = self.turn();
            if noticed.is_some() {
                return noticed;
            }
        }
        None
    }
}

impl<A: Application> Default for VirtualBus<A> {
    fn default() -> Self {
        VirtualBus::new()
    }
}

impl<A: Application> Station<A> {
    fn turn(&mut self, at: time::Instant, now: Instant) {
        self.slave.handle_timeout(now);
        if self.line.poll_transmission(at) {
            return;
        }
        let (slave, is_on) = (&mut self.slave, self.is_on);
        self.line.receive_data(at, |bytes| {
            if is_on {
                slave.handle_bytes(now, bytes);
            }
            (bytes.len(), ())
        });
        if let Some(answer) = slave.poll_transmit(now) {
            let lost = self.lost_answers.clone();
            self.lost_answers = lost.start.saturating_sub(1)..lost.end.saturating_sub(1);
            if lost.contains(&0) {
                return;
            }
            self.line.transmit_data(at, |buffer| {
                buffer[..answer.len()].copy_from_slice(answer);
                (answer.len(), ())
            });
        }
    }
}
