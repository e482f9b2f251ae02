//! The test bench: a bus with the simulated drive, a link to it, and a recorder.

use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lexican_eds::model::Device;
use lexican_runtime::cia301::connection;
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link, Pace, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::worked_examples::NODE;

use super::console::Console;
use crate::output::Failure;
use crate::print;
use lexican_toolbox::decode::{Decoder, Service};

const BIT_RATE_KBIT: u32 = 500;
/// The sampling interval of the picture.
const SAMPLING: Duration = Duration::from_millis(10);

const TPDO1: CobId = CobId::of_node(connection::TPDO_1, NODE);
const TPDO3: CobId = CobId::of_node(connection::TPDO_1 + 0x200, NODE);
const TPDO4: CobId = CobId::of_node(connection::TPDO_1 + 0x300, NODE);

/// The drive on its bus, as a controller sees it.
pub(crate) struct Bench<'a> {
    bus: VirtualBus,
    /// For frames as they are.
    link: VirtualLink,
    /// For SDO.
    network: Network<VirtualLink>,
    drive: Arc<Mutex<SimulatedDrive>>,
    tap: Receiver<(Instant, Frame)>,
    decoder: Decoder<'a>,
    pub(crate) console: Console,
    pub(crate) status: DriveStatus,
    /// How far from a target the drive may rest (6067h), in increments.
    pub(crate) window: u32,
    recording: Recording,
}

/// The last values that the drive has reported.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DriveStatus {
    pub(crate) status_word: Option<u16>,
    pub(crate) position: Option<i32>,
    pub(crate) velocity: Option<i32>,
    pub(crate) nmt: Option<NmtState>,
}

#[derive(Default)]
pub(crate) struct Recording {
    pub(crate) frames: Vec<(Instant, Frame)>,
    pub(crate) samples: Vec<Sample>,
    /// Emergencies, aborts, and frames that cannot be decoded.
    pub(crate) alarms: Vec<String>,
}

/// The motion at one moment.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) at: Instant,
    pub(crate) truth: Truth,
}

/// Which of the two PDOs to request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Poll {
    Position,
    Velocity,
}

impl<'a> Bench<'a> {
    /// A bus with the drive, which has just been switched on.
    pub(crate) fn new(device: &'a Device, console: Console, realtime: bool) -> Self {
        let bus = VirtualBus::with_bit_rate(BIT_RATE_KBIT);
        let (sender, tap) = channel();
        // Sending fails only after the bench is dropped.
        bus.observe(move |at, frame| {
            let _ = sender.send((at, *frame));
        });
        let drive = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
        bus.attach(Arc::clone(&drive));
        let (link, network) = (bus.link(), Network::new(bus.link()));
        if realtime {
            bus.set_pace(Pace::RealTime);
        }
        let mut decoder = Decoder::new();
        decoder.introduce(NODE, device);
        let (status, recording) = (DriveStatus::default(), Recording::default());
        Bench { bus, link, network, drive, tap, decoder, console, status, window: 0, recording }
    }

    /// The bus itself, to manipulate it.
    #[cfg(test)]
    pub(crate) fn bus(&self) -> &VirtualBus {
        &self.bus
    }

    pub(crate) fn now(&self) -> Instant {
        self.bus.now()
    }

    pub(crate) fn send(&mut self, frame: &Frame) -> Result<(), Failure> {
        Ok(self.link.send(frame)?)
    }

    pub(crate) fn pass(&mut self, span: Duration) -> Result<(), Failure> {
        let until = self.now() + span;
        self.listen(until, |_, _| None::<()>).map(drop)
    }

    /// Waits for the drive to report its state (TPDO1), no longer than `patience`.
    pub(crate) fn handshake(&mut self, patience: Duration) -> Result<(), Failure> {
        let until = self.now() + patience;
        self.listen(until, |_, frame| (frame.id() == TPDO1).then_some(())).map(drop)
    }

    /// Requests one of the PDOs, and waits for it.
    pub(crate) fn poll(&mut self, poll: Poll) -> Result<(), Failure> {
        let id = match poll {
            Poll::Position => TPDO3,
            Poll::Velocity => TPDO4,
        };
        self.ask(id, 6)
    }

    /// Requests the NMT state by node guarding (CiA 301, 7.2.8.2.2).
    pub(crate) fn guard(&mut self) -> Result<(), Failure> {
        self.status.nmt = None;
        self.ask(ErrorControl::cob_id(NODE), 1)
    }

    fn ask(&mut self, id: CobId, len: u8) -> Result<(), Failure> {
        const PATIENCE: Duration = Duration::from_millis(50);
        let request = Frame::remote(id, len).expect("no PDO is longer than eight bytes");
        self.send(&request)?;
        let until = self.now() + PATIENCE;
        self.listen(until, |_, frame| (frame.id() == id && !frame.is_remote()).then_some(())).map(drop)
    }

    /// Reads a number of up to four bytes by SDO; `None` if the drive does not give it.
    pub(crate) fn read(&mut self, address: Address) -> Result<Option<u32>, Failure> {
        let data = answer(self.network.read_bytes(NODE, address))?;
        self.record();
        Ok(data.map(|data| data.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))))
    }

    /// Writes one byte by SDO, if the drive takes it.
    pub(crate) fn write(&mut self, address: Address, value: u8) -> Result<(), Failure> {
        answer(self.network.write_bytes(NODE, address, &[value]))?;
        self.record();
        Ok(())
    }

    /// The motion, from the simulation itself.
    pub(crate) fn truth(&self) -> Truth {
        truth(&lock(&self.drive), self.now())
    }

    pub(crate) fn finish(mut self) -> Recording {
        self.record();
        self.recording
    }

    /// Listens until `until`, or until `wanted` returns something.
    fn listen<T>(
        &mut self,
        until: Instant,
        mut wanted: impl FnMut(Instant, &Frame) -> Option<T>,
    ) -> Result<Option<T>, Failure> {
        loop {
            let sample_at = self.recording.samples.len() as u64 * SAMPLING.as_micros();
            let next = until.min(Instant::from_micros(sample_at));
            let received = self.link.receive_frame(next)?;
            self.record();
            if let Some(frame) = received {
                self.status.take(&frame);
                if let Some(found) = wanted(self.now(), &frame) {
                    return Ok(Some(found));
                }
            } else if next == until {
                return Ok(None);
            }
            if self.now() >= Instant::from_micros(sample_at) {
                self.sample();
            }
        }
    }

    /// Records and prints the frames of the bus.
    fn record(&mut self) {
        while let Ok((at, frame)) = self.tap.try_recv() {
            let decoded = self.decoder.decode(&frame);
            let line = print::line(at, &frame, &decoded);
            if decoded.alarming || decoded.service == Service::Unknown {
                self.recording.alarms.push(format!("{at} {frame} {}", decoded.text));
            }
            self.console.line(line);
            self.recording.frames.push((at, frame));
        }
    }

    fn sample(&mut self) {
        let truth = self.truth();
        self.recording.samples.push(Sample { at: self.now(), truth });
        let (position, velocity) = (truth.position_increments, truth.velocity_rpm);
        self.console.status(format!("position {position:+8.0} increments   velocity {velocity:+6.1} rev/min"));
    }
}

impl DriveStatus {
    fn take(&mut self, frame: &Frame) {
        match *frame.data() {
            [a, b] if frame.id() == TPDO1 => self.status_word = Some(u16::from_le_bytes([a, b])),
            [a, b, c, d, e, f] if frame.id() == TPDO3 => {
                self.status_word = Some(u16::from_le_bytes([a, b]));
                self.position = Some(i32::from_le_bytes([c, d, e, f]));
            }
            [a, b, c, d, e, f] if frame.id() == TPDO4 => {
                self.status_word = Some(u16::from_le_bytes([a, b]));
                self.velocity = Some(i32::from_le_bytes([c, d, e, f]));
            }
            ref data if frame.id() == ErrorControl::cob_id(NODE) => {
                self.nmt = ErrorControl::parse(data).map(|message| message.state);
            }
            _ => {}
        }
    }
}

/// Position and velocity of the shaft.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Truth {
    pub(crate) position_increments: f64,
    pub(crate) velocity_rpm: f64,
    /// The status word, as the drive would report it now.
    pub(crate) status: u16,
}

fn truth(drive: &SimulatedDrive, now: Instant) -> Truth {
    let state = drive.shaft(now);
    Truth {
        position_increments: state.position,
        velocity_rpm: state.velocity * 60.0 / 1600.0,
        status: drive.status_word(now),
    }
}

/// What the drive has answered; `None` if it does not.
fn answer<T>(result: Result<T, AccessError>) -> Result<Option<T>, Failure> {
    match result {
        Ok(answer) => Ok(Some(answer)),
        Err(AccessError::Sdo { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

fn lock(drive: &Mutex<SimulatedDrive>) -> MutexGuard<'_, SimulatedDrive> {
    drive.lock().unwrap_or_else(PoisonError::into_inner)
}
