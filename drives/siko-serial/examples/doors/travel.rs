//! The travel, and what is seen of it.

use std::io;

use lexican_runtime::Instant;
use lexican_runtime::NodeId;
use lexican_runtime::host::{Link, VirtualBus};
use siko_ag02::driver::{Drive, Error, Outcome};
use siko_ag02::sim::{MODEL, SimulatedDrive};
use siko_serial::sim::{SerialDrive, VirtualLine};
use siko_serial::{Line, Settings, gateway};

use crate::chart::{AMBER, BLUE, Content, Curve, Panel, Picture};

pub(crate) const TARGET: i32 = 5000;
const NODE: NodeId = NodeId::literal(5);

/// A door: its name, its colour, and the line that opens the link.
type Door = (&'static str, &'static str, fn() -> Box<dyn Link>);

const DOORS: &[Door] = &[("CANopen", BLUE, can), ("serial", AMBER, serial)];

fn can() -> Box<dyn Link> {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedDrive::new(&MODEL, NODE));
    Box::new(bus.link())
}

fn serial() -> Box<dyn Link> {
    Box::new(gateway::link(VirtualLine::with_settings(SerialDrive::default(), FAST), FAST, NODE))
}

const FAST: Settings = Settings { baud: 19_200, reaction: lexican_runtime::Duration::from_millis(200), echo: false };

/// A travel through one of the doors.
pub(crate) struct Run {
    pub(crate) door: &'static str,
    color: &'static str,
    pub(crate) outcome: Outcome,
    /// Positions over seconds since the order, as the driver has read them.
    pub(crate) positions: Vec<(f64, f64)>,
}

/// The program.
fn travel(link: Box<dyn Link>) -> Result<(Outcome, Vec<(f64, f64)>), Error> {
    let mut drive = Drive::connect(link, NODE)?;
    drive.enable()?;
    let (mut began, mut positions) = (None, Vec::new());
    let outcome = drive.move_to_watched(TARGET, |progress| {
        let began = *began.get_or_insert(progress.at);
        positions.push((progress.at.since(began).as_secs_f64(), progress.position.into()));
    })?;
    drive.disable()?;
    Ok((outcome, positions))
}

pub(crate) fn through_each_door() -> Result<Vec<Run>, Error> {
    let run = |&(door, color, open): &Door| {
        let (outcome, positions) = travel(open())?;
        Ok(Run { door, color, outcome, positions })
    };
    DOORS.iter().map(run).collect()
}

/// The curves on each other; the later ones are dashed, so that the first can be seen.
pub(crate) fn picture(runs: &[Run]) -> Picture {
    let curve = |(number, run): (usize, &Run)| Curve {
        name: run.door.to_owned(),
        color: run.color,
        dashed: number > 0,
        points: run.positions.clone(),
    };
    let end = runs.iter().filter_map(|run| run.positions.last()).fold(0.0, |end: f64, (at, _)| end.max(*at));
    Picture {
        title: format!("One program moves the AG02 to {TARGET}"),
        subtitle: "Positions as the driver reads them through each interface: the same motion, the same outcome"
            .to_owned(),
        span_s: (0.0, end),
        panels: vec![Panel {
            title: "position 6064h in increments",
            content: Content::Curves(runs.iter().enumerate().map(curve).collect()),
        }],
        events: Vec::new(),
    }
}

/// What a travel costs on the serial line.
pub(crate) struct Cost {
    pub(crate) baud: u32,
    pub(crate) telegrams: usize,
    pub(crate) bytes: usize,
    /// How long bytes are on the line.
    pub(crate) busy_s: f64,
    pub(crate) span_s: f64,
}

/// Measures from the order to the end.
pub(crate) fn line_of_a_travel() -> Result<Cost, Error> {
    let line = Counted { line: VirtualLine::with_settings(SerialDrive::default(), FAST), telegrams: 0, bytes: 0 };
    let mut drive = Drive::connect(gateway::link(line, FAST, NODE), NODE)?;
    drive.enable()?;
    let mut link = drive.release();
    let (began, telegrams, bytes) = (link.now(), link.carrier().0.telegrams, link.carrier().0.bytes);
    let mut drive = Drive::connect(link, NODE)?;
    drive.move_to(TARGET)?;
    let mut link = drive.release();
    let (telegrams, bytes) = (link.carrier().0.telegrams - telegrams, link.carrier().0.bytes - bytes);
    let busy_s = FAST.on_line(bytes).as_secs_f64();
    Ok(Cost { baud: FAST.baud, telegrams, bytes, busy_s, span_s: link.now().since(began).as_secs_f64() })
}

/// A line that counts.
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
