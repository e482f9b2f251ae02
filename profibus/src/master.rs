//! The master of `profirust` on a line, and segments: lines with a master and a clock.

use std::io::ErrorKind;
use std::vec;
use std::vec::Vec;

use lexican_runtime::Instant;
use profirust::dp::{DpMaster, Peripheral, PeripheralEvent, PeripheralHandle, PeripheralOptions};
use profirust::fdl::{FdlActiveStation, Parameters};
use profirust::phy::ProfibusPhy;
use profirust::time;

use crate::dp::Lengths;

/// The default address of the master: 0, so that any node-ID can be the address of a drive.
pub const MASTER: u8 = 0;

/// The master on its line.
#[derive(Debug)]
pub struct Master<P> {
    fdl: FdlActiveStation,
    peripherals: Peripherals,
    line: P,
}

struct Peripherals(DpMaster<'static>);

impl core::fmt::Debug for Peripherals {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Peripherals").finish_non_exhaustive()
    }
}

impl<P: ProfibusPhy> Master<P> {
    /// A master that is online, and exchanges data with all its peripherals.
    pub fn new(parameters: Parameters, line: P) -> Self {
        let mut fdl = FdlActiveStation::new(parameters);
        fdl.set_online();
        let mut peripherals = DpMaster::new(Vec::new());
        peripherals.enter_operate();
        Master { fdl, peripherals: Peripherals(peripherals), line }
    }

    /// Adds a slave to exchange data with.
    pub fn add(&mut self, address: u8, options: PeripheralOptions<'static>, lengths: Lengths) -> PeripheralHandle {
        let (inputs, outputs) = (vec![0; lengths.inputs], vec![0; lengths.outputs]);
        self.peripherals.0.add(Peripheral::new(address, options, inputs, outputs))
    }

    /// The master's view of a slave.
    pub fn peripheral(&mut self, handle: PeripheralHandle) -> &mut Peripheral<'static> {
        self.peripherals.0.get_mut(handle)
    }

    /// Makes the master leave the line, or come back.
    pub fn set_online(&mut self, is_online: bool) {
        if is_online { self.fdl.set_online() } else { self.fdl.set_offline() }
    }

    /// The line.
    pub const fn line(&self) -> &P {
        &self.line
    }

    /// Runs the master; returns an event of a slave, if any. To be called at least once in each slot time.
    pub fn poll(&mut self, now: time::Instant) -> Option<(PeripheralHandle, PeripheralEvent)> {
        self.fdl.poll(now, &mut self.line, &mut self.peripherals.0);
        self.peripherals.0.take_last_events().peripheral
    }
}

/// A line with its master.
pub trait Segment {
    /// The time on it.
    fn now(&self) -> Instant;

    /// Whether it runs in real time, so that it has to be polled without a pause.
    fn is_real_time(&self) -> bool;

    /// The error that has ended it.
    fn failed(&self) -> Option<ErrorKind> {
        None
    }

    /// Adds a slave to exchange data with.
    fn add(&mut self, address: u8, options: PeripheralOptions<'static>, lengths: Lengths) -> PeripheralHandle;

    /// The master's view of a slave.
    fn peripheral(&mut self, handle: PeripheralHandle) -> &mut Peripheral<'static>;

    /// Runs the master until its next event of a slave; `None` if there is none until `now`. Outputs set after an
    /// exchange go into the next one.
    fn poll(&mut self, now: Instant) -> Option<(PeripheralHandle, PeripheralEvent)>;
}

pub(crate) fn instant(at: time::Instant) -> Instant {
    Instant::from_micros(at.total_micros().unsigned_abs())
}
