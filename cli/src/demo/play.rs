//! Plays a worked example: sends its frames, waits as its rows say, and compares the effects with the manual.

use lexican_pictures::{BLUE, Curve, Event, GREEN, Lane, PURPLE, Panel, Picture};
use lexican_runtime::cia301::connection::{RPDO_1, TPDO_1};
use lexican_runtime::object::Address;
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, Duration, Frame, Instant, cia301};
use siko_ag03_1::state::State;
use siko_ag03_1::words::{control, status};
use siko_ag03_1::worked_examples::{Action, Example, NODE, Row, Until};

use super::stage::{Stage, Truth};
use crate::output::Failure;
use lexican_toolbox::node::identity::VENDOR;

/// How long the controller waits for the drive's state, which comes every 100 ms (1800h:05).
const HANDSHAKE: Duration = Duration::from_millis(150);
/// The interval of polling the drive.
const POLLING: Duration = Duration::from_millis(200);
/// The longest wait for a state.
const PATIENCE: Duration = Duration::from_secs(60);

const DEVICE_TYPE: Address = Address::new(cia301::DEVICE_TYPE, 0x00);
const STATUS_WORD: Address = Address::new(0x6041, 0x00);
const OPERATING_MODE: Address = Address::new(0x6060, 0x00);
const POSITION: Address = Address::new(0x6064, 0x00);
const POSITION_WINDOW: Address = Address::new(0x6067, 0x00);
const VELOCITY: Address = Address::new(0x606C, 0x00);

const RPDO1: CobId = CobId::of_node(RPDO_1, NODE);
const RPDO3: CobId = CobId::of_node(RPDO_1 + 0x200, NODE);
const RPDO4: CobId = CobId::of_node(RPDO_1 + 0x300, NODE);
const TPDO1: CobId = CobId::of_node(TPDO_1, NODE);
const TPDO3: CobId = CobId::of_node(TPDO_1 + 0x200, NODE);
const TPDO4: CobId = CobId::of_node(TPDO_1 + 0x300, NODE);

/// A condition that must hold, and whether it does.
pub(super) struct Check {
    pub(super) what: String,
    pub(super) seen: String,
    pub(super) passed: bool,
}

impl Check {
    fn new(what: impl Into<String>, passed: bool, seen: impl ToString) -> Self {
        Check { what: what.into(), seen: seen.to_string(), passed }
    }
}

fn or_none(seen: Option<impl ToString>) -> String {
    seen.map_or_else(|| "no answer".to_owned(), |seen| seen.to_string())
}

/// Plays the examples, one after the other.
pub(super) fn all(stage: &mut Stage<'_>, examples: &[&Example]) -> Result<(Vec<Check>, Vec<Picture>), Failure> {
    stage.heading("Power on")?;
    wait(stage, |stage| Ok(stage.nmt.is_some()))?;
    // A careful controller checks first that the device is the right one.
    stage.read(DEVICE_TYPE)?;
    stage.read(VENDOR)?;
    let window = stage.read(POSITION_WINDOW)?.unwrap_or(0);
    let (mut checks, mut pictures) = (Vec::new(), Vec::new());
    for example in examples {
        let mut play = Play { stage, example, window, sent: Vec::new() };
        let (found, picture) = play.run()?;
        let of_table = |check: Check| Check { what: format!("table {}: {}", example.table, check.what), ..check };
        checks.extend(found.into_iter().map(of_table));
        pictures.push(picture);
    }
    let alarm = stage.alarms.first().cloned();
    let passed = alarm.is_none();
    checks.push(Check::new(
        "no emergency, no abort, no frame out of place",
        passed,
        alarm.unwrap_or_else(|| "none".to_owned()),
    ));
    Ok((checks, pictures))
}

/// Polls the drive until something has happened; `false` on timeout.
fn wait<'a>(
    stage: &mut Stage<'a>,
    mut happened: impl FnMut(&mut Stage<'a>) -> Result<bool, Failure>,
) -> Result<bool, Failure> {
    let limit = stage.now() + PATIENCE;
    while stage.now() < limit {
        let begin = stage.now();
        if happened(stage)? {
            return Ok(true);
        }
        stage.listen(POLLING - stage.now().since(begin), None)?;
    }
    Ok(false)
}

/// An example under way.
struct Play<'s, 'a> {
    stage: &'s mut Stage<'a>,
    example: &'s Example,
    /// How far from the target the drive may stop (6067h), in increments.
    window: u32,
    /// The rows whose frames were sent, with time and frame.
    sent: Vec<(Instant, Frame, &'static str)>,
}

impl Play<'_, '_> {
    fn run(&mut self) -> Result<(Vec<Check>, Picture), Failure> {
        let Example { table, title, operating_mode: mode, rows } = self.example;
        self.stage.heading(format_args!("Table {table}: {title}"))?;
        let set = self.set_operating_mode()?;
        let begin = self.stage.now();
        let (mut of_rows, mut before) = (Vec::new(), None);
        for row in *rows {
            let begin = self.stage.now();
            let done = self.step(row)?;
            let (took, truth) = (self.stage.now().since(begin), self.stage.truth());
            of_rows.extend(self.check(row, done, took, truth, before));
            before = Some((row.action, truth));
            self.stage.progress.inc(1);
        }
        let end = self.stage.now();
        // Ask for the state by node guarding (CiA 301, 7.2.8.2.2).
        self.stage.nmt = None;
        self.stage.ask(ErrorControl::cob_id(NODE), 1)?;
        let nmt = self.stage.nmt;
        let state = self.stage.read(STATUS_WORD)?.and_then(|status| State::from_status_word(status as u16));
        self.stage.listen(POLLING, None)?;

        let name = if self.is_positioning() { "profile position" } else { "profile velocity" };
        let seen = or_none(set.map(|mode| format!("6060h = {mode}")));
        let mut checks = vec![Check::new(format!("operating mode is {name}"), set == Some(*mode), seen)];
        let mut bus = self.stage.frames.iter().filter(|(at, _)| (begin..=end).contains(at));
        let in_order = self.sent.iter().take_while(|(_, row, _)| bus.any(|(_, frame)| frame == row)).count();
        let seen = format!("{in_order} of {}", self.sent.len());
        checks.push(Check::new("every frame on the bus, byte for byte, in order", in_order == self.sent.len(), seen));
        checks.extend(of_rows);
        let passed = state == Some(State::SwitchOnDisabled);
        checks.push(Check::new("drive ends in SWITCH ON DISABLED", passed, or_none(state)));
        let passed = nmt == Some(NmtState::PreOperational);
        checks.push(Check::new("node ends in PRE-OPERATIONAL", passed, or_none(nmt)));
        Ok((checks, self.picture(begin, end)))
    }

    fn is_positioning(&self) -> bool {
        self.example.operating_mode == 1
    }

    /// Sets the operating mode by parameter 20, as in the manual; the drive is then PRE-OPERATIONAL.
    fn set_operating_mode(&mut self) -> Result<Option<u8>, Failure> {
        let mode = self.example.operating_mode;
        let current = self.stage.read(OPERATING_MODE)?;
        if current == Some(mode.into()) {
            return Ok(Some(mode));
        }
        self.stage.remark("operating mode change via parameter 20")?;
        self.stage.write(OPERATING_MODE, mode)?;
        Ok(self.stage.read(OPERATING_MODE)?.map(|mode| mode as u8))
    }

    /// Carries out a row; returns whether a wait has succeeded.
    fn step(&mut self, row: &Row) -> Result<bool, Failure> {
        match row.action {
            Action::Send(frame) => {
                self.sent.push((self.stage.now(), frame, row.meaning));
                self.stage.send(&frame)?;
                self.stage.listen(HANDSHAKE, Some(TPDO1))?;
                Ok(true)
            }
            Action::Wait(until) => {
                self.stage.remark(format_args!("waiting: {}", row.meaning))?;
                let (positioning, window) = (self.is_positioning(), self.window);
                let poll = if positioning { TPDO3 } else { TPDO4 };
                let begin = self.stage.now();
                wait(self.stage, |stage| {
                    stage.ask(poll, 6)?;
                    let word = stage.reported(STATUS_WORD);
                    let has = |bits: u16| word.is_some_and(|word| word & i128::from(bits) != 0);
                    let (position, velocity) = (stage.reported(POSITION), stage.reported(VELOCITY));
                    Ok(match until {
                        Until::Elapsed(span) => stage.now() >= begin + span,
                        Until::Position(target) => {
                            let is_near = |position: i128| position.abs_diff(target.into()) <= window.into();
                            has(status::TARGET_REACHED)
                                && !has(status::POSITIONING | status::MOVING)
                                && position.is_some_and(is_near)
                        }
                        Until::Velocity(target) => has(status::TARGET_REACHED) && velocity == Some(target.into()),
                        Until::Standstill if positioning => word.is_some() && !has(status::MOVING),
                        Until::Standstill => has(status::STANDSTILL) && velocity == Some(0),
                    })
                })
            }
        }
    }

    /// What must hold after a row. `before` is the action of the previous row, and the motion at that time.
    fn check(
        &self,
        row: &Row,
        done: bool,
        took: Duration,
        truth: Truth,
        before: Option<(Action, Truth)>,
    ) -> Option<Check> {
        let took = took.as_secs_f64();
        let Truth { position_increments, velocity_rpm, .. } = truth;
        let reported = |address| self.stage.reported(address).unwrap_or_default();
        let agrees = |reported: i128, truth: f64| done && (reported as f64 - truth).abs() < 1.0;
        Some(match row.action {
            Action::Send(frame) if frame.id() == RPDO1 && frame.data() == [0x0F, 0x01] => {
                let word = self.stage.reported(STATUS_WORD);
                let state = word.and_then(|word| State::from_status_word(word as u16));
                let what = format!("OPERATION ENABLED after {}", row.meaning);
                Check::new(what, state == Some(State::OperationEnabled), or_none(state))
            }
            Action::Send(_) => return None,
            Action::Wait(Until::Position(target)) => {
                let position = reported(POSITION);
                let seen = format!("{position:+} increments after {took:.1} s");
                let what = format!("position {target:+} increments reached");
                Check::new(what, agrees(position, position_increments), seen)
            }
            Action::Wait(Until::Velocity(target)) => {
                let velocity = reported(VELOCITY);
                let seen = format!("{velocity:+} rev/min after {took:.1} s");
                let what = format!("velocity {target:+} rev/min reached");
                Check::new(what, agrees(velocity, velocity_rpm), seen)
            }
            Action::Wait(Until::Standstill) => {
                let seen = format!("{velocity_rpm:.0} rev/min at {position_increments:+.0} increments");
                Check::new("stop seen", done && velocity_rpm == 0.0, seen)
            }
            Action::Wait(Until::Elapsed(_)) => {
                let (action, then) = before.filter(|_| self.is_positioning())?;
                let moved = position_increments - then.position_increments;
                let seen = format!("moved by {moved:+.0} increments in {took:.1} s");
                let stopped = matches!(action, Action::Wait(Until::Standstill));
                let what = if stopped { "stands still until the next command" } else { "under way before the stop" };
                Check::new(what, (moved == 0.0) == stopped, seen)
            }
        })
    }

    /// A picture of the observed motion and the commands that caused it.
    fn picture(&self, begin: Instant, end: Instant) -> Picture {
        let Example { table, title, .. } = self.example;
        let seconds = |at: Instant| at.since(Instant::ZERO).as_secs_f64();
        let seen = || self.stage.samples.iter().filter(|(at, _)| (begin..=end).contains(at));
        let curve = |name, color, value: fn(&Truth) -> f64| {
            let points = seen().map(|(at, truth)| (seconds(*at), value(truth))).collect();
            Curve { color: Some(color), ..Curve::new(name, points) }
        };
        let lane = |name, color, bit| {
            Lane::new(name, color, seen().map(|(at, truth)| (seconds(*at), truth.status & bit != 0)))
        };
        let targets = self.sent.iter().filter_map(|(at, frame, _)| Some((seconds(*at), self.target(frame)?.into())));
        let target = Curve::target(&targets.collect::<Vec<_>>(), seconds(end));
        let mut positions = vec![curve("position", BLUE, |truth| truth.position_increments)];
        let mut velocities = vec![curve("velocity", GREEN, |truth| truth.velocity_rpm)];
        let reached = lane("reached (bit 10)", GREEN, status::TARGET_REACHED);
        let lanes = if self.is_positioning() {
            positions.push(target);
            let active = lane("active (bit 14)", PURPLE, status::POSITIONING);
            vec![active, lane("moving (bit 15)", BLUE, status::MOVING), reached]
        } else {
            velocities.push(target);
            vec![reached, lane("stands (bit 12)", PURPLE, status::STANDSTILL)]
        };
        let event =
            |(at, _, meaning): &(Instant, Frame, &str)| Event { at_s: seconds(*at), text: (*meaning).to_owned() };
        Picture {
            title: format!("Table {table}: {title}"),
            subtitle: format!("SIKO AG03/1, node {NODE}: a worked example of the manual with a simulated drive"),
            axis: "time on the bus [s]".to_owned(),
            span: seconds(begin)..seconds(end),
            panels: vec![
                Panel::curves("position [increments]", positions),
                Panel::curves("velocity [rev/min]", velocities),
                Panel::lanes("status word 6041h", lanes),
            ],
            events: self.sent.iter().map(event).collect(),
        }
    }

    /// The target in a frame, in the unit of the operating mode.
    fn target(&self, frame: &Frame) -> Option<i32> {
        match (frame.id(), frame.data()) {
            (RPDO1, &[low, high]) if u16::from_le_bytes([low, high]) & control::STOP != 0 => {
                (!self.is_positioning()).then_some(0)
            }
            (RPDO3 | RPDO4, &[_, _, a, b, c, d]) => Some(i32::from_le_bytes([a, b, c, d])),
            _ => None,
        }
    }
}
