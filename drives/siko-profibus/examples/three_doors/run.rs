//! The same program through three doors.

use lexican_profibus::bus::Bus;
use lexican_profibus::virtual_bus::{self, MASTER};
use lexican_runtime::host::{Link, VirtualBus};
use lexican_runtime::{Duration, Instant, NodeId};
use profirust::Baudrate;
use profirust::fdl::ParametersBuilder;
use siko_ag02::driver::{Drive, Error, Outcome};
use siko_ag02::sim::{MODEL, SimulatedDrive};
use siko_profibus::{AG02, bus, line};
use siko_serial::Settings;
use siko_serial::sim::{SerialDrive, VirtualLine};

const NODE: NodeId = NodeId::literal(5);

pub(crate) const TARGET: i32 = 5000;

/// What a program has seen of a travel.
pub(crate) struct Run {
    pub(crate) door: &'static str,
    pub(crate) outcome: Outcome,
    /// Seconds since the travel was ordered, and positions.
    pub(crate) seen: Vec<(f64, i32)>,
    /// From the order to its end.
    pub(crate) took: Duration,
}

/// What went over a PROFIBUS in all.
pub(crate) struct Traffic {
    pub(crate) kbit_per_s: u32,
    pub(crate) exchanges: u64,
    pub(crate) lasted: Duration,
}

/// The program. It does not know what the link is.
fn travel(door: &'static str, link: impl Link) -> Result<Run, Error> {
    let mut drive = Drive::connect(link, NODE)?;
    drive.enable()?;
    let began = drive.run(async |context| Ok(context.now()))?;
    let mut seen = Vec::new();
    let outcome = drive.move_to_watched(TARGET, |now| seen.push((now.at.since(began).as_secs_f64(), now.position)))?;
    let took = drive.run(async |context| Ok(context.now().since(began)))?;
    drive.disable()?;
    Ok(Run { door, outcome, seen, took })
}

pub(crate) fn through_canopen() -> Result<Run, Error> {
    let can = VirtualBus::with_bit_rate(500);
    can.attach(SimulatedDrive::new(&MODEL, NODE));
    travel("CANopen", can.link())
}

pub(crate) fn through_serial() -> Result<Run, Error> {
    let settings = Settings { baud: 19_200, ..Settings::default() };
    let wire = VirtualLine::with_settings(SerialDrive::default(), settings);
    travel("serial", siko_serial::gateway::link(wire, settings, NODE))
}

pub(crate) fn through_profibus() -> Result<(Run, Traffic), Error> {
    let mut parameters = ParametersBuilder::new(MASTER, Baudrate::B1500000);
    let parameters = parameters.slot_bits(300).highest_station_address(3).build();
    let mut segment = virtual_bus::VirtualBus::with_parameters(parameters);
    let kbit_per_s = segment.bit_rate().0 / 1000;
    let id = bus::attach_unknown(&mut segment, &AG02, NODE.get());
    let segment = Bus::new(segment);
    let run = travel("PROFIBUS", line::link(&segment, &AG02, NODE))?;
    let (exchanges, lasted) = segment.with(|line| (line.exchanges(id), line.now().since(Instant::ZERO)));
    Ok((run, Traffic { kbit_per_s, exchanges, lasted }))
}

impl Run {
    /// When it passes a position, between two sightings.
    pub(crate) fn passes(&self, position: f64) -> Option<f64> {
        self.seen.windows(2).find_map(|pair| {
            let [(from_s, from), (to_s, to)] = [pair[0], pair[1]].map(|(at_s, at)| (at_s, f64::from(at)));
            let is_there = from <= position && position < to;
            is_there.then(|| from_s + (position - from) / (to - from) * (to_s - from_s))
        })
    }
}
