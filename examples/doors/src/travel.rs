//! The program, and the interfaces through which it runs.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use lexican_profibus::bus::Bus;
use lexican_profibus::virtual_bus::{self, MASTER};
use lexican_runtime::host::{Link, VirtualBus};
use lexican_runtime::{Instant, NodeId};
use profirust::Baudrate;
use profirust::fdl::ParametersBuilder;
use siko_ag02::driver::{Drive, Error, Outcome};
use siko_ag02::sim::{MODEL, SimulatedDrive};
use siko_profibus::{AG02, bus, line};
use siko_serial::sim::{SerialDrive, VirtualLine};
use siko_serial::{Line, Settings, gateway};

pub(crate) const TARGET: i32 = 5000;
const NODE: NodeId = NodeId::literal(5);

/// What the program has seen of one motion.
pub(crate) struct Run {
    pub(crate) door: &'static str,
    pub(crate) outcome: Outcome,
    /// Seconds since the order, with the position then.
    pub(crate) positions: Vec<(f64, f64)>,
    /// The traffic on the line, as text.
    pub(crate) traffic: String,
}

/// Positions over seconds since the order.
type Positions = Vec<(f64, f64)>;

/// The program: returns the outcome, the positions over seconds since the order, and the link.
fn travel<L: Link + Send + 'static>(link: L) -> Result<(Outcome, Positions, L), Error> {
    let mut drive = Drive::connect(link, NODE)?;
    drive.enable()?;
    let began = drive.run(async |context| Ok(context.now()))?;
    let mut positions = Vec::new();
    let outcome = drive.move_to_watched(TARGET, |progress| {
        positions.push((progress.at.since(began).as_secs_f64(), progress.position.into()));
    })?;
    drive.disable()?;
    Ok((outcome, positions, drive.release()))
}

pub(crate) fn through_each_door() -> Result<[Run; 3], Error> {
    Ok([through_canopen()?, through_serial()?, through_profibus()?])
}

fn through_canopen() -> Result<Run, Error> {
    let can = VirtualBus::with_bit_rate(500);
    can.attach(SimulatedDrive::new(&MODEL, NODE));
    let frames = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&frames);
    can.observe(move |_, _| _ = counted.fetch_add(1, Ordering::Relaxed));
    let (outcome, positions, _) = travel(can.link())?;
    let traffic = format!("{} frames at 500 kbit/s", frames.load(Ordering::Relaxed));
    Ok(Run { door: "CANopen", outcome, positions, traffic })
}

fn through_serial() -> Result<Run, Error> {
    let settings = Settings { baud: 19_200, ..Settings::default() };
    let line = VirtualLine::with_settings(SerialDrive::default(), settings);
    let link = gateway::link(Counted { line, telegrams: 0, bytes: 0 }, settings, NODE);
    let (outcome, positions, mut link) = travel(link)?;
    let lasted_s = link.now().as_micros() as f64 / 1e6;
    let Counted { telegrams, bytes, .. } = link.carrier().0;
    let busy = settings.on_line(bytes).as_secs_f64() / lasted_s * 100.0;
    let traffic =
        format!("{telegrams} telegrams, {bytes} bytes with the answers: {busy:.0} % of the time at 19.2 kbit/s");
    Ok(Run { door: "serial port", outcome, positions, traffic })
}

fn through_profibus() -> Result<Run, Error> {
    let mut parameters = ParametersBuilder::new(MASTER, Baudrate::B1500000);
    let parameters = parameters.slot_bits(300).highest_station_address(3).build();
    let mut segment = virtual_bus::VirtualBus::with_parameters(parameters);
    let drive = bus::attach_unknown(&mut segment, &AG02, NODE.get());
    let segment = Bus::new(segment);
    let (outcome, positions, link) = travel(line::link(&segment, &AG02, NODE).expect("below 127"))?;
    let exchanges = segment.with(|line| line.exchanges(drive));
    let each_ms = link.now().as_micros() as f64 / 1e3 / exchanges as f64;
    let traffic = format!("{exchanges} exchanges of data, one in {each_ms:.2} ms at 1500 kbit/s");
    Ok(Run { door: "PROFIBUS", outcome, positions, traffic })
}

impl Run {
    /// The time from the order to the last position.
    pub(crate) fn took_s(&self) -> f64 {
        self.positions.last().map_or(0.0, |(at_s, _)| *at_s)
    }

    /// How far the drive is ahead of another run, in increments over seconds.
    pub(crate) fn differences<'a>(&'a self, other: &'a Run) -> impl Iterator<Item = (f64, f64)> + 'a {
        self.positions.iter().map(|&(at_s, position)| (at_s, position - other.position_at(at_s)))
    }

    /// The position at a time: interpolated between two readings, and the last one after them.
    fn position_at(&self, at_s: f64) -> f64 {
        let next = self.positions.iter().position(|point| point.0 >= at_s).unwrap_or(self.positions.len() - 1).max(1);
        let ((from_s, from), (to_s, to)) = (self.positions[next - 1], self.positions[next]);
        from + (to - from) * ((at_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0)
    }
}

/// A serial line that counts bytes.
struct Counted {
    line: VirtualLine,
    telegrams: usize,
    /// In both directions.
    bytes: usize,
}

impl Line for Counted {
    fn now(&self) -> Instant {
        self.line.now()
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.telegrams += 1;
        self.bytes += bytes.len();
        self.line.send(bytes)
    }

    fn receive(&mut self, until: Instant, buffer: &mut [u8]) -> io::Result<usize> {
        let len = self.line.receive(until, buffer)?;
        self.bytes += len;
        Ok(len)
    }

    fn is_real_time(&self) -> bool {
        false
    }
}
