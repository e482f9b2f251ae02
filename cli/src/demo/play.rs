//! Plays a worked example: sends its frames, and waits as its rows say.

use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, cia301};
use siko_ag03_1::worked_examples::{Action, Example, NODE, Row, Until};

use super::bench::{Bench, DriveStatus, Poll, Truth};
use super::plot::{Command, Course, Sample, Target};
use crate::output::Failure;
use lexican_toolbox::identity::VENDOR;

/// How long a controller waits for the drive to report its state, which it does every 100 ms (1800h:05).
const HANDSHAKE: Duration = Duration::from_millis(150);
/// How often a waiting controller polls the drive.
const POLLING: Duration = Duration::from_millis(200);
/// The longest wait for a state.
const PATIENCE: Duration = Duration::from_secs(60);

const DEVICE_TYPE: Address = Address::new(cia301::DEVICE_TYPE, 0x00);
const OPERATING_MODE: Address = Address::new(0x6060, 0x00);
const POSITION_WINDOW: Address = Address::new(0x6067, 0x00);
const STATUS_WORD: Address = Address::new(0x6041, 0x00);

pub(crate) struct Played {
    pub(crate) example: &'static Example,
    pub(crate) begin: Instant,
    pub(crate) end: Instant,
    /// One per row of the example.
    pub(crate) steps: Vec<Step>,
    /// The operating mode before the example, read by SDO.
    pub(crate) operating_mode: Option<u8>,
    /// The status word, read by SDO after the example.
    pub(crate) final_status: Option<u16>,
    /// The NMT state after the example.
    pub(crate) final_nmt: Option<NmtState>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub(crate) row: Row,
    pub(crate) begin: Instant,
    pub(crate) end: Instant,
    /// Whether the wait has succeeded.
    pub(crate) done: bool,
    /// The values that the drive had reported at the end of the row.
    pub(crate) status: DriveStatus,
    /// The motion at the end of the row.
    pub(crate) truth: Truth,
}

/// Plays the examples, one after the other.
pub(crate) fn all(bench: &mut Bench<'_>, examples: &[&'static Example]) -> Result<Vec<Played>, Failure> {
    bench.console.heading("Power on");
    wait(bench, |bench| Ok(bench.status.nmt.is_some()))?;
    // A careful controller first checks that this is the right device.
    bench.read(DEVICE_TYPE)?;
    bench.read(VENDOR)?;
    bench.window = bench.read(POSITION_WINDOW)?.unwrap_or(0);
    examples.iter().map(|example| play(bench, example)).collect()
}

fn play(bench: &mut Bench<'_>, example: &'static Example) -> Result<Played, Failure> {
    bench.console.heading(format_args!("Table {}: {}", example.table, example.title));
    let operating_mode = set_operating_mode(bench, example.operating_mode)?;
    let begin = bench.now();
    let mut steps = Vec::new();
    for row in example.rows {
        steps.push(step(bench, example, *row)?);
        bench.console.step();
    }
    let end = bench.now();
    bench.guard()?;
    let final_nmt = bench.status.nmt;
    let final_status = bench.read(STATUS_WORD)?.map(|status| status as u16);
    bench.pass(POLLING)?;
    Ok(Played { example, begin, end, steps, operating_mode, final_status, final_nmt })
}

/// Changes the operating mode via parameter 20, as the manual says; the drive is PRE-OPERATIONAL now.
fn set_operating_mode(bench: &mut Bench<'_>, mode: u8) -> Result<Option<u8>, Failure> {
    let read = |bench: &mut Bench<'_>| Ok(bench.read(OPERATING_MODE)?.map(|mode| mode as u8));
    let current = read(bench)?;
    if current == Some(mode) {
        return Ok(current);
    }
    bench.console.remark("operating mode change via parameter 20");
    bench.write(OPERATING_MODE, mode)?;
    read(bench)
}

fn step(bench: &mut Bench<'_>, example: &Example, row: Row) -> Result<Step, Failure> {
    let begin = bench.now();
    let done = match row.action {
        Action::Send(frame) => {
            bench.send(&frame)?;
            bench.handshake(HANDSHAKE)?;
            true
        }
        Action::Wait(until) => {
            bench.console.remark(format_args!("waiting: {}", row.meaning));
            let poll = if example.operating_mode == 1 { Poll::Position } else { Poll::Velocity };
            wait_until(bench, poll, until)?
        }
    };
    Ok(Step { row, begin, end: bench.now(), done, status: bench.status, truth: bench.truth() })
}

/// Polls the drive until it is as a row says; `false` if that takes too long.
fn wait_until(bench: &mut Bench<'_>, poll: Poll, until: Until) -> Result<bool, Failure> {
    let elapsed = match until {
        Until::Elapsed(span) => Some(bench.now() + span),
        _ => None,
    };
    wait(bench, |bench| {
        bench.poll(poll)?;
        let status = bench.status;
        Ok(match until {
            Until::Elapsed(_) => Some(bench.now()) >= elapsed,
            Until::Position(target) => status.is_at(target, bench.window),
            Until::Velocity(target) => status.runs_at(target),
            Until::Standstill => status.stands_still(poll),
        })
    })
}

fn wait(
    bench: &mut Bench<'_>,
    mut happened: impl FnMut(&mut Bench<'_>) -> Result<bool, Failure>,
) -> Result<bool, Failure> {
    let limit = bench.now() + PATIENCE;
    while bench.now() < limit {
        let begin = bench.now();
        if happened(bench)? {
            return Ok(true);
        }
        bench.pass(POLLING - bench.now().since(begin))?;
    }
    Ok(false)
}

pub(super) const RPDO1: CobId = CobId::of_node(cia301::connection::RPDO_1, NODE);
const RPDO3: CobId = CobId::of_node(cia301::connection::RPDO_1 + 0x200, NODE);
const RPDO4: CobId = CobId::of_node(cia301::connection::RPDO_1 + 0x300, NODE);

/// Bits of the status word (table 21).
mod status {
    pub(super) const TARGET_REACHED: u16 = 1 << 10;
    /// In velocity mode.
    pub(super) const STANDS_STILL: u16 = 1 << 12;
    /// In positioning mode.
    pub(super) const POSITIONING_ACTIVE: u16 = 1 << 14;
    /// In positioning mode.
    pub(super) const TRAVELS: u16 = 1 << 15;
}

impl DriveStatus {
    fn has(self, bit: u16) -> bool {
        self.status_word.is_some_and(|status| status & bit != 0)
    }

    /// Whether the drive reports that it rests at this position.
    fn is_at(self, target: i32, window: u32) -> bool {
        self.has(status::TARGET_REACHED)
            && !self.has(status::POSITIONING_ACTIVE | status::TRAVELS)
            && self.position.is_some_and(|position| position.abs_diff(target) <= window)
    }

    fn runs_at(self, target: i32) -> bool {
        self.has(status::TARGET_REACHED) && self.velocity == Some(target)
    }

    fn stands_still(self, poll: Poll) -> bool {
        match poll {
            Poll::Position => self.status_word.is_some() && !self.has(status::TRAVELS),
            Poll::Velocity => self.has(status::STANDS_STILL) && self.velocity == Some(0),
        }
    }
}

impl Played {
    /// The example for the picture.
    pub(crate) fn course(&self, samples: &[Sample]) -> Course {
        let seconds = |at: Instant| at.since(Instant::ZERO).as_secs_f64();
        let (begin, end) = (seconds(self.begin), seconds(self.end));
        let mut commands = Vec::new();
        let mut targets = Vec::new();
        for step in &self.steps {
            let Action::Send(frame) = step.row.action else { continue };
            commands.push(Command { at_s: seconds(step.begin), label: step.row.meaning.to_owned() });
            targets.extend(target(&frame, self.example).map(|target| (seconds(step.begin), target)));
        }
        Course {
            title: format!("Table {}: {}", self.example.table, self.example.title),
            samples: samples.iter().filter(|it| (begin..=end).contains(&it.at_s)).copied().collect(),
            commands,
            targets,
        }
    }
}

/// The target in a frame of the examples.
fn target(frame: &Frame, example: &Example) -> Option<Target> {
    const STOP: u8 = 1 << 0;
    match (frame.id(), frame.data()) {
        (RPDO1, &[_, high]) if example.operating_mode == 2 && high & STOP != 0 => Some(Target::Velocity(0)),
        (RPDO3, &[_, _, a, b, c, d]) => Some(Target::Position(i32::from_le_bytes([a, b, c, d]))),
        (RPDO4, &[_, _, a, b, c, d]) => Some(Target::Velocity(i32::from_le_bytes([a, b, c, d]))),
        _ => None,
    }
}
