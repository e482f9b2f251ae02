//! Plays a worked example: sends its frames, and waits as its rows say.

use lexican_pictures::{BLUE, Curve, Event, GREEN, Lane, PURPLE, Panel, Picture};
use lexican_runtime::object::Address;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, cia301};
use siko_ag03_1::words::{control, status};
use siko_ag03_1::worked_examples::{Action, Example, NODE, Row, Until};

use super::bench::{Bench, DriveStatus, Poll, Sample, Truth};
use crate::output::Failure;
use lexican_toolbox::node::identity::VENDOR;

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

impl DriveStatus {
    fn has(self, bit: u16) -> bool {
        self.status_word.is_some_and(|status| status & bit != 0)
    }

    /// Whether the drive reports that it rests at this position.
    fn is_at(self, target: i32, window: u32) -> bool {
        self.has(status::TARGET_REACHED)
            && !self.has(status::POSITIONING | status::MOVING)
            && self.position.is_some_and(|position| position.abs_diff(target) <= window)
    }

    fn runs_at(self, target: i32) -> bool {
        self.has(status::TARGET_REACHED) && self.velocity == Some(target)
    }

    fn stands_still(self, poll: Poll) -> bool {
        match poll {
            Poll::Position => self.status_word.is_some() && !self.has(status::MOVING),
            Poll::Velocity => self.has(status::STANDSTILL) && self.velocity == Some(0),
        }
    }
}

impl Played {
    /// The motion that was seen, and the orders that caused it.
    pub(crate) fn picture(&self, samples: &[Sample]) -> Picture {
        let Example { table, title, operating_mode, rows: _ } = self.example;
        let seconds = |at: Instant| at.since(Instant::ZERO).as_secs_f64();
        let seen = || samples.iter().filter(|it| (self.begin..=self.end).contains(&it.at));
        let of = |value: fn(&Truth) -> f64| seen().map(|it| (seconds(it.at), value(&it.truth))).collect();
        let sent = || {
            self.steps.iter().filter_map(|step| match step.row.action {
                Action::Send(frame) => Some((seconds(step.begin), frame, step.row.meaning)),
                Action::Wait(_) => None,
            })
        };
        let targets = sent().filter_map(|(at_s, frame, _)| Some((at_s, target(&frame, *operating_mode)?.into())));
        let target = Curve::target(&targets.collect::<Vec<_>>(), seconds(self.end));
        let mut positions =
            vec![Curve { color: Some(BLUE), ..Curve::new("position", of(|truth| truth.position_increments)) }];
        let mut velocities =
            vec![Curve { color: Some(GREEN), ..Curve::new("velocity", of(|truth| truth.velocity_rpm)) }];
        if *operating_mode == 1 { &mut positions } else { &mut velocities }.push(target);
        let lane =
            |name, color, bit| Lane::new(name, color, seen().map(|it| (seconds(it.at), it.truth.status & bit != 0)));
        let reached = lane("reached (bit 10)", GREEN, status::TARGET_REACHED);
        let lanes = if *operating_mode == 1 {
            let active = lane("active (bit 14)", PURPLE, status::POSITIONING);
            vec![active, lane("moving (bit 15)", BLUE, status::MOVING), reached]
        } else {
            vec![reached, lane("stands (bit 12)", PURPLE, status::STANDSTILL)]
        };
        Picture {
            title: format!("Table {table}: {title}"),
            subtitle: format!("SIKO AG03/1, node {NODE}: a worked example of the manual with a simulated drive"),
            axis: "time on the bus [s]".to_owned(),
            span: seconds(self.begin)..seconds(self.end),
            panels: vec![
                Panel::curves("position [increments]", positions),
                Panel::curves("velocity [rev/min]", velocities),
                Panel::lanes("status word 6041h", lanes),
            ],
            events: sent().map(|(at_s, _, meaning)| Event { at_s, text: meaning.to_owned() }).collect(),
        }
    }
}

/// The target in a frame of the examples, in the unit of its operating mode.
fn target(frame: &Frame, operating_mode: u8) -> Option<i32> {
    match (frame.id(), frame.data()) {
        (RPDO1, &[low, high]) if operating_mode == 2 && u16::from_le_bytes([low, high]) & control::STOP != 0 => Some(0),
        (RPDO3 | RPDO4, &[_, _, a, b, c, d]) => Some(i32::from_le_bytes([a, b, c, d])),
        _ => None,
    }
}
