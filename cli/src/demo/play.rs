//! Plays a worked example: sends its frames, waits as its rows say, and notes what happened.

use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, Frame, Instant};
use siko_ag03_1::worked_examples::{Action, Example, Row, Until};

use super::bench::{Bench, Heard, Poll, Truth};
use super::plot::{Command, Course, Sample, Target};
use crate::output::Failure;

/// How long a controller waits for the drive to tell its state, which it does every 100 ms (1800h:05).
const HANDSHAKE: Duration = Duration::from_millis(150);
/// How often a controller that waits asks the drive.
const POLLING: Duration = Duration::from_millis(200);
/// What takes longer than this is not going to happen.
const PATIENCE: Duration = Duration::from_secs(60);

const DEVICE_TYPE: Address = Address::new(0x1000, 0x00);
const VENDOR_ID: Address = Address::new(0x1018, 0x01);
const OPERATING_MODE: Address = Address::new(0x6060, 0x00);
const POSITION_WINDOW: Address = Address::new(0x6067, 0x00);
const STATUS_WORD: Address = Address::new(0x6041, 0x00);

/// An example as it went.
pub(crate) struct Played {
    pub(crate) example: &'static Example,
    pub(crate) begin: Instant,
    pub(crate) end: Instant,
    /// One per row of the example.
    pub(crate) steps: Vec<Step>,
    /// The operating mode as the drive tells it before the example.
    pub(crate) operating_mode: Option<u8>,
    /// The status word, read by SDO after the example.
    pub(crate) final_status: Option<u16>,
    /// The NMT state after the example.
    pub(crate) final_nmt: Option<NmtState>,
}

/// A row as it went.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub(crate) row: Row,
    pub(crate) begin: Instant,
    pub(crate) end: Instant,
    /// Whether what was waited for has happened.
    pub(crate) done: bool,
    /// What the drive had told when the row ended.
    pub(crate) heard: Heard,
    /// Where the shaft was when the row ended.
    pub(crate) truth: Truth,
}

/// Plays the examples, one after the other.
pub(crate) fn all(bench: &mut Bench<'_>, examples: &[&'static Example]) -> Result<Vec<Played>, Failure> {
    bench.console.heading("Power on");
    wait(bench, |bench| Ok(bench.heard.nmt.is_some()))?;
    // What a careful controller asks first: is this the device I think it is?
    let _ = bench.read(DEVICE_TYPE)?;
    let _ = bench.read(VENDOR_ID)?;
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
    let final_nmt = bench.heard.nmt;
    let final_status = bench.read(STATUS_WORD)?.ok().map(|status| status as u16);
    bench.pass(POLLING)?;
    Ok(Played { example, begin, end, steps, operating_mode, final_status, final_nmt })
}

/// Operating mode change via parameter 20, as the manual says; the drive is PRE-OPERATIONAL now.
fn set_operating_mode(bench: &mut Bench<'_>, mode: u8) -> Result<Option<u8>, Failure> {
    let mut told = bench.read(OPERATING_MODE)?.ok().map(|told| told as u8);
    if told != Some(mode) {
        bench.console.remark("operating mode change via parameter 20");
        let _ = bench.write(OPERATING_MODE, mode)?;
        told = bench.read(OPERATING_MODE)?.ok().map(|told| told as u8);
    }
    Ok(told)
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
    Ok(Step { row, begin, end: bench.now(), done, heard: bench.heard, truth: bench.truth() })
}

/// Waits for what a row says, asking the drive again and again; `false` when it does not happen.
fn wait_until(bench: &mut Bench<'_>, poll: Poll, until: Until) -> Result<bool, Failure> {
    let elapsed = match until {
        Until::Elapsed(span) => Some(bench.now() + span),
        _ => None,
    };
    wait(bench, |bench| {
        bench.poll(poll)?;
        let heard = bench.heard;
        Ok(match until {
            Until::Elapsed(_) => Some(bench.now()) >= elapsed,
            Until::Position(target) => heard.is_at(target, bench.window),
            Until::Velocity(target) => heard.runs_at(target),
            Until::Standstill => heard.stands_still(poll),
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

impl Heard {
    fn has(self, bit: u16) -> bool {
        self.status.is_some_and(|status| status & bit != 0)
    }

    /// Whether the drive tells that it rests at this position.
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
            Poll::Position => self.status.is_some() && !self.has(status::TRAVELS),
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

/// What a frame of the examples tells the drive to reach.
fn target(frame: &Frame, example: &Example) -> Option<Target> {
    const STOP: u8 = 1 << 0;
    match (frame.id().raw(), frame.data()) {
        (0x205, &[_, high]) if example.operating_mode == 2 && high & STOP != 0 => Some(Target::Velocity(0)),
        (0x405, &[_, _, a, b, c, d]) => Some(Target::Position(i32::from_le_bytes([a, b, c, d]))),
        (0x505, &[_, _, a, b, c, d]) => Some(Target::Velocity(i32::from_le_bytes([a, b, c, d]))),
        _ => None,
    }
}
