//! The bus with the simulated drive, seen by the controller, and the recording of it.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::Write;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};

use anstyle::Style;
use indicatif::ProgressBar;
use lexican_eds::model::{Device, Value};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link, Pace, VirtualBus, VirtualLink};
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant};
use siko_ag03_1::sim::{MODEL, SimulatedDrive};
use siko_ag03_1::worked_examples::NODE;

use crate::output::{Failure, stdout, styled};
use crate::print;
use lexican_toolbox::decode::{Decoded, Decoder, Detail, Service};

const BIT_RATE_KBIT: u32 = 500;
/// The sampling interval of the picture.
const SAMPLING: Duration = Duration::from_millis(10);

pub(super) struct Stage<'a> {
    pub(super) bus: VirtualBus,
    /// For sending and receiving frames directly.
    link: VirtualLink,
    /// For SDO transfers.
    network: Network<VirtualLink>,
    drive: Arc<Mutex<SimulatedDrive>>,
    tap: Receiver<(Instant, Frame)>,
    decoder: Decoder<'a>,
    pub(super) progress: ProgressBar,
    /// The last values in the drive's PDOs.
    reported: BTreeMap<Address, i128>,
    /// The last NMT state reported by the drive.
    pub(super) nmt: Option<NmtState>,
    pub(super) frames: Vec<(Instant, Frame)>,
    /// The motion, sampled at regular intervals.
    pub(super) samples: Vec<(Instant, Truth)>,
    /// Emergencies, aborts, and frames that cannot be decoded.
    pub(super) alarms: Vec<String>,
}

/// Position and velocity of the shaft, read from the simulation itself.
#[derive(Clone, Copy)]
pub(super) struct Truth {
    pub(super) position_increments: f64,
    pub(super) velocity_rpm: f64,
    /// The status word as the drive would report it.
    pub(super) status: u16,
}

impl<'a> Stage<'a> {
    /// A bus with the drive just switched on.
    pub(super) fn new(device: &'a Device, progress: ProgressBar, pace: Pace) -> Self {
        let bus = VirtualBus::with_bit_rate(BIT_RATE_KBIT);
        let (sender, tap) = channel();
        // Sending fails only after the stage is dropped.
        bus.observe(move |at, frame| _ = sender.send((at, *frame)));
        let drive = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
        bus.attach(Arc::clone(&drive));
        let (link, network) = (bus.link(), Network::new(bus.link()));
        bus.set_pace(pace);
        let mut decoder = Decoder::new();
        decoder.introduce(NODE, device);
        let (reported, nmt) = (BTreeMap::new(), None);
        let (frames, samples, alarms) = (Vec::new(), Vec::new(), Vec::new());
        Stage { bus, link, network, drive, tap, decoder, progress, reported, nmt, frames, samples, alarms }
    }

    pub(super) fn now(&self) -> Instant {
        self.bus.now()
    }

    pub(super) fn send(&mut self, frame: &Frame) -> Result<(), Failure> {
        Ok(self.link.send(frame)?)
    }

    /// Listens for `span`, or until the drive sends a frame with the wanted identifier.
    pub(super) fn listen(&mut self, span: Duration, wanted: Option<CobId>) -> Result<(), Failure> {
        let until = self.now() + span;
        loop {
            let sample_at = Instant::from_micros(self.samples.len() as u64 * SAMPLING.as_micros());
            let next = until.min(sample_at);
            let received = self.link.receive_frame(next)?;
            self.record()?;
            match received {
                Some(frame) if Some(frame.id()) == wanted && !frame.is_remote() => return Ok(()),
                None if next == until => return Ok(()),
                _ => {}
            }
            if self.now() >= sample_at {
                self.sample();
            }
        }
    }

    /// Requests a frame from the drive by a remote frame, and waits for it.
    pub(super) fn ask(&mut self, id: CobId, len: u8) -> Result<(), Failure> {
        const PATIENCE: Duration = Duration::from_millis(50);
        self.send(&Frame::remote(id, len).expect("no PDO is longer than eight bytes"))?;
        self.listen(PATIENCE, Some(id))
    }

    /// Reads a number of up to four bytes by SDO; `None` if the drive does not respond or refuses.
    pub(super) fn read(&mut self, address: Address) -> Result<Option<u32>, Failure> {
        let data = answer(self.network.read_bytes(NODE, address))?;
        self.record()?;
        Ok(data.map(|data| data.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))))
    }

    /// Writes one byte by SDO, ignoring a refusal.
    pub(super) fn write(&mut self, address: Address, value: u8) -> Result<(), Failure> {
        answer(self.network.write_bytes(NODE, address, &[value]))?;
        self.record()
    }

    /// The last value that the drive has reported for an entry.
    pub(super) fn reported(&self, address: Address) -> Option<i128> {
        self.reported.get(&address).copied()
    }

    pub(super) fn truth(&self) -> Truth {
        let (now, drive) = (self.now(), self.drive.lock().unwrap_or_else(PoisonError::into_inner));
        let shaft = drive.shaft(now);
        Truth {
            position_increments: shaft.position,
            // One revolution has 1600 increments.
            velocity_rpm: shaft.velocity * 60.0 / 1600.0,
            status: drive.status_word(now),
        }
    }

    /// Prints a line above the progress bar.
    pub(super) fn line(&self, line: impl Display) -> Result<(), Failure> {
        Ok(self.progress.suspend(|| writeln!(stdout(), "{line}"))?)
    }

    pub(super) fn heading(&self, text: impl Display) -> Result<(), Failure> {
        self.line(format_args!("\n{}\n", styled(Style::new().bold().underline(), text)))
    }

    /// Prints a comment between frames.
    pub(super) fn remark(&self, text: impl Display) -> Result<(), Failure> {
        self.line(styled(Style::new().dimmed().italic(), format_args!("{:>14}{text}", "")))
    }

    /// Records and prints the frames on the bus.
    fn record(&mut self) -> Result<(), Failure> {
        while let Ok((at, frame)) = self.tap.try_recv() {
            let decoded = self.decoder.decode(&frame);
            self.line(print::line(at, &frame, &decoded))?;
            if decoded.alarming || decoded.service == Service::Unknown {
                self.alarms.push(format!("{at} {frame} {}", decoded.text));
            }
            if decoded.is_from_node() {
                self.take(decoded);
            }
            self.frames.push((at, frame));
        }
        Ok(())
    }

    fn take(&mut self, decoded: Decoded) {
        let reports = match decoded.detail {
            Detail::Pdo(pdo) => pdo.fields,
            Detail::ErrorControl { state, .. } => return self.nmt = Some(state),
            _ => return,
        };
        for report in reports {
            if let Some(Value::Integer(number)) = report.value {
                self.reported.insert(report.address, number);
            }
        }
    }

    fn sample(&mut self) {
        let truth = self.truth();
        self.samples.push((self.now(), truth));
        let Truth { position_increments: position, velocity_rpm: velocity, .. } = truth;
        self.progress.set_message(format!("position {position:+8.0} increments   velocity {velocity:+6.1} rev/min"));
    }
}

/// The result, or `None` if the drive did not respond or refused.
fn answer<T>(result: Result<T, AccessError>) -> Result<Option<T>, Failure> {
    match result {
        Ok(answer) => Ok(Some(answer)),
        Err(AccessError::Sdo { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}
