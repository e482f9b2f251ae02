//! The test bench: a bus with the simulated drive on it, a link to talk to the drive, and a recorder.

use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lexican_eds::model::Device;
use lexican_runtime::host::{Link, LinkError, Pace, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::{Event, SdoClient, SdoError};
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant};
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::worked_examples::NODE;

use super::console::Console;
use super::plot::Sample;
use crate::decode::{Decoder, Service};
use crate::output::Failure;
use crate::print;

const BIT_RATE_KBIT: u32 = 500;
/// How densely the motion is sampled for the picture.
const SAMPLING: Duration = Duration::from_millis(10);

const TPDO1: CobId = CobId::of_node(0x180, NODE);
const TPDO3: CobId = CobId::of_node(0x380, NODE);
const TPDO4: CobId = CobId::of_node(0x480, NODE);

/// The drive on its bus, as a controller sees it, with everything on record.
pub(crate) struct Bench<'a> {
    bus: VirtualBus,
    link: VirtualLink,
    drive: Arc<Mutex<SimulatedDrive>>,
    tap: Receiver<(Instant, Frame)>,
    decoder: Decoder<'a>,
    pub(crate) console: Console,
    pub(crate) heard: Heard,
    /// How far from a target the drive may rest (6067h), in increments.
    pub(crate) window: u32,
    recording: Recording,
}

/// What the drive has told of itself, the latest first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Heard {
    pub(crate) status: Option<u16>,
    pub(crate) position: Option<i32>,
    pub(crate) velocity: Option<i32>,
    pub(crate) nmt: Option<NmtState>,
}

/// Everything that happened.
#[derive(Default)]
pub(crate) struct Recording {
    pub(crate) frames: Vec<(Instant, Frame)>,
    pub(crate) samples: Vec<Sample>,
    /// Frames that report something wrong: emergencies, aborts, frames that nobody understands.
    pub(crate) alarms: Vec<String>,
}

/// Which of the two requested PDOs to ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Poll {
    Position,
    Velocity,
}

impl<'a> Bench<'a> {
    /// A bus with the drive, switched on a moment ago.
    pub(crate) fn new(device: &'a Device, console: Console, realtime: bool) -> Self {
        let bus = VirtualBus::with_bit_rate(BIT_RATE_KBIT);
        let (sender, tap) = channel();
        // Sending fails when the bench is gone, and then nobody misses the frame.
        bus.observe(move |at, frame| {
            let _ = sender.send((at, *frame));
        });
        let drive = Arc::new(Mutex::new(SimulatedDrive::new(NODE)));
        bus.attach(Arc::clone(&drive));
        let link = bus.link();
        if realtime {
            bus.set_pace(Pace::RealTime);
        }
        let mut decoder = Decoder::new();
        decoder.introduce(NODE, device);
        let (heard, recording) = (Heard::default(), Recording::default());
        Bench { bus, link, drive, tap, decoder, console, heard, window: 0, recording }
    }

    /// The bus itself, to tamper with.
    #[cfg(test)]
    pub(crate) fn bus(&self) -> &VirtualBus {
        &self.bus
    }

    pub(crate) fn now(&self) -> Instant {
        self.bus.now()
    }

    /// Sends a frame, exactly as it is.
    pub(crate) fn send(&mut self, frame: &Frame) -> Result<(), Failure> {
        self.link.send(frame).map_err(lost)
    }

    /// Lets time pass and listens.
    pub(crate) fn pass(&mut self, span: Duration) -> Result<(), Failure> {
        let until = self.now() + span;
        self.listen(until, |_, _| None::<()>).map(drop)
    }

    /// Listens until the drive tells its state by itself (TPDO1), no longer than `patience`.
    pub(crate) fn handshake(&mut self, patience: Duration) -> Result<(), Failure> {
        let until = self.now() + patience;
        self.listen(until, |_, frame| (frame.id() == TPDO1).then_some(())).map(drop)
    }

    /// Asks the drive for one of its PDOs, and waits for the answer.
    pub(crate) fn poll(&mut self, poll: Poll) -> Result<(), Failure> {
        let id = match poll {
            Poll::Position => TPDO3,
            Poll::Velocity => TPDO4,
        };
        self.ask(id, 6)
    }

    /// Asks for the NMT state by node guarding (CiA 301, 7.2.8.2.2).
    pub(crate) fn guard(&mut self) -> Result<(), Failure> {
        self.heard.nmt = None;
        self.ask(ErrorControl::cob_id(NODE), 1)
    }

    fn ask(&mut self, id: CobId, len: u8) -> Result<(), Failure> {
        const PATIENCE: Duration = Duration::from_millis(50);
        let request = Frame::remote(id, len).expect("no PDO is longer than eight bytes");
        self.send(&request)?;
        let until = self.now() + PATIENCE;
        self.listen(until, |_, frame| (frame.id() == id && !frame.is_remote()).then_some(())).map(drop)
    }

    /// Reads up to four bytes by SDO.
    pub(crate) fn read(&mut self, address: Address) -> Result<Result<u32, SdoError>, Failure> {
        let mut data = [0; 4];
        let done = self.transfer(&mut data, |client, now| client.read(now, address))?;
        Ok(done.map(|()| u32::from_le_bytes(data)))
    }

    /// Writes one byte by SDO.
    pub(crate) fn write(&mut self, address: Address, value: u8) -> Result<Result<(), SdoError>, Failure> {
        self.transfer(&mut [value], |client, now| client.write(now, address, 1))
    }

    fn transfer<const N: usize>(
        &mut self,
        data: &mut [u8; N],
        begin: impl FnOnce(&mut SdoClient, Instant) -> Result<(), lexican_runtime::service::sdo_client::Busy>,
    ) -> Result<Result<(), SdoError>, Failure> {
        let mut client = SdoClient::of_node(NODE);
        begin(&mut client, self.now()).expect("a new client is idle");
        loop {
            while let Some(frame) = client.poll_transmit(self.now(), data) {
                self.send(&frame)?;
            }
            let until = client.poll_timeout().unwrap_or(self.now());
            let event = self.listen(until, |now, frame| {
                let event = client.handle_frame(now, frame, data);
                // A frame may also have made the next request due.
                (event.is_some() || frame.id() == CobId::of_node(0x580, NODE)).then_some(event)
            })?;
            let event = event.unwrap_or_else(|| client.handle_timeout(self.now()));
            match event {
                Some(Event::Done { .. }) => return Ok(Ok(())),
                Some(Event::Failed(error)) => return Ok(Err(error)),
                None => {}
            }
        }
    }

    /// Where the drive is, asked of the simulation itself.
    pub(crate) fn truth(&self) -> Truth {
        truth(&lock(&self.drive), self.now())
    }

    /// Ends the run.
    pub(crate) fn finish(mut self) -> Recording {
        self.record();
        self.recording
    }

    /// Listens until `until`, or until `wanted` finds what it wants.
    fn listen<T>(
        &mut self,
        until: Instant,
        mut wanted: impl FnMut(Instant, &Frame) -> Option<T>,
    ) -> Result<Option<T>, Failure> {
        loop {
            let sample_at = self.recording.samples.len() as u64 * SAMPLING.as_micros();
            let next = until.min(Instant::from_micros(sample_at));
            let received = self.link.receive_frame(next).map_err(lost)?;
            self.record();
            if let Some(frame) = received {
                self.heard.take(&frame);
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

    /// Puts on record, and prints, what was on the bus.
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
        self.recording.samples.push(Sample {
            at_s: self.now().since(Instant::ZERO).as_secs_f64(),
            position_increments: truth.position_increments,
            velocity_rpm: truth.velocity_rpm,
        });
        let (position, velocity) = (truth.position_increments, truth.velocity_rpm);
        self.console.status(format!("position {position:+8.0} increments   velocity {velocity:+6.1} rev/min"));
    }
}

impl Heard {
    fn take(&mut self, frame: &Frame) {
        match *frame.data() {
            [a, b] if frame.id() == TPDO1 => self.status = Some(u16::from_le_bytes([a, b])),
            [a, b, c, d, e, f] if frame.id() == TPDO3 => {
                self.status = Some(u16::from_le_bytes([a, b]));
                self.position = Some(i32::from_le_bytes([c, d, e, f]));
            }
            [a, b, c, d, e, f] if frame.id() == TPDO4 => {
                self.status = Some(u16::from_le_bytes([a, b]));
                self.velocity = Some(i32::from_le_bytes([c, d, e, f]));
            }
            ref data if frame.id() == ErrorControl::cob_id(NODE) => {
                self.nmt = ErrorControl::parse(data).map(|told| told.state);
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
}

fn truth(drive: &SimulatedDrive, now: Instant) -> Truth {
    let state = drive.shaft(now);
    Truth { position_increments: state.position, velocity_rpm: state.velocity * 60.0 / 1600.0 }
}

fn lost(error: LinkError) -> Failure {
    Failure::new(error)
}

fn lock(drive: &Mutex<SimulatedDrive>) -> MutexGuard<'_, SimulatedDrive> {
    drive.lock().unwrap_or_else(PoisonError::into_inner)
}
