//! One drive of a change-over, from its check to its final state.

use std::future::Future;

use lexican_driver::sequence::Progress;
use lexican_driver::{Description, Error, Mode, Outcome, Units};
use lexican_machine::MachineError;
use lexican_machine::tokio::{Drive, Machine};
use lexican_runtime::host::tokio::Network;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{Duration, Instant};

use crate::progress::Bar;
use crate::recipe::{Entry, Problem, Unit};
use crate::stop::{Reason, Stop};

/// How long a drive may take to stop, and again to be disabled.
const WITHIN: Duration = Duration::from_secs(5);

/// A drive with its target.
pub(crate) struct Axis {
    pub(crate) entry: Entry,
    pub(crate) drive: Drive,
    network: Network,
    units: Option<Units>,
    pub(crate) limits: Option<(i32, i32)>,
    /// The start position and the target, in counts.
    pub(crate) from: i32,
    pub(crate) to: i32,
    /// Whether it waits for SYNC to move to its target.
    pub(crate) by_sync: bool,
    /// The positions seen so far.
    pub(crate) course: Vec<(Instant, i32)>,
    /// When it was ordered to stop.
    pub(crate) halted: Option<Instant>,
    pub(crate) end: Option<End>,
}

/// How the motion of a drive has ended.
pub(crate) struct End {
    pub(crate) outcome: &'static str,
    /// A fault in the words of the manual, or errors.
    pub(crate) why: Vec<String>,
    pub(crate) at: Instant,
}

impl Axis {
    pub(crate) async fn connect(machine: Machine, entry: Entry) -> Result<Axis, Problem> {
        let problem = |error: &Error| Problem {
            what: format!("{}: {error}", entry.name),
            span: entry.node_span.clone(),
            remedy: error.remedy().text.to_owned(),
        };
        let mut drive = machine.drive(&entry.name).await.map_err(|error| match error {
            MachineError::Drive(error) => problem(&error),
            other => Problem {
                what: other.to_string(),
                span: entry.node_span.clone(),
                remedy: "see its data sheet in the machine's file".to_owned(),
            },
        })?;
        let units = match drive.units().await {
            Ok(units) => Some(units),
            Err(Error::Unsupported { .. }) => None,
            Err(error) => return Err(problem(&error)),
        };
        let limits = drive.limits().await.map_err(|error| problem(&error))?;
        let from = drive.position().await.map_err(|error| problem(&error))?;
        let description =
            drive.run(async |context| Ok(context.description())).await.map_err(|error| problem(&error))?;
        let to = target(&entry, description, units, limits)?;
        let by_sync = entry.sync && description.outputs.start_by_sync().is_some();
        Ok(Axis {
            entry,
            drive,
            network: machine.network().clone(),
            units,
            limits,
            from,
            to,
            by_sync,
            course: Vec::new(),
            halted: None,
            end: None,
        })
    }

    /// A position in the unit of the recipe.
    pub(crate) fn value(&self, position: i32) -> f64 {
        self.entry.position.unit().of(position, self.units)
    }

    pub(crate) fn show(&self, position: i32) -> String {
        self.entry.position.unit().show(self.value(position))
    }

    pub(crate) async fn enable(mut self, stop: Stop) -> Axis {
        if stop.reason().is_none()
            && let Err(error) = self.try_to_enable().await
        {
            self.fail("not enabled", error.to_string(), &stop).await;
        }
        self
    }

    async fn try_to_enable(&mut self) -> Result<(), Error> {
        self.drive.set_mode(Mode::Positioning).await?;
        if self.by_sync {
            match self.drive.set_start_by_sync(true).await {
                // The drive does not support this, so it starts without SYNC.
                Err(Error::Sdo(SdoError::Aborted { .. })) => self.by_sync = false,
                other => other?,
            }
        }
        self.drive.enable().await
    }

    /// Gives the drive its target, if it waits for SYNC.
    pub(crate) async fn prepare(mut self, stop: Stop) -> Axis {
        if stop.reason().is_none()
            && self.by_sync
            && let Err(error) = self.drive.prepare_moving_to(self.to).await
        {
            self.fail("not started", error.to_string(), &stop).await;
        }
        self
    }

    /// Waits for the end of the motion, or until all drives are stopped.
    pub(crate) async fn travel(mut self, started: Result<(), Error>, bar: Bar, stop: Stop) -> Axis {
        let travelled = tokio::select! {
            biased;
            () = stop.ordered() => None,
            outcome = self.finish(started, &bar) => Some(outcome),
        };
        match travelled {
            Some(Ok(Outcome::Reached { .. })) => self.end("reached").await,
            Some(Ok(outcome)) => {
                let (outcome, why) = words(outcome);
                self.fail(outcome, why, &stop).await;
            }
            Some(Err(error)) => self.fail("failed", error.to_string(), &stop).await,
            None => self.halt("stopped").await,
        }
        bar.end(&self.outcome());
        self
    }

    async fn finish(&mut self, started: Result<(), Error>, bar: &Bar) -> Result<Outcome, Error> {
        started?;
        if self.by_sync {
            self.drive.confirm_start().await?;
        }
        let course = &mut self.course;
        let watch = |seen: Progress| {
            course.push((seen.at, seen.position));
            bar.at(seen.position);
        };
        self.drive.finish_watched(watch).await
    }

    /// Starts without SYNC.
    pub(crate) async fn start(&mut self) -> Result<(), Error> {
        (*self.drive).start_moving_to(self.to).await
    }

    /// Disables the drive, and takes back the setting to wait for SYNC, which would last until it restarts.
    pub(crate) async fn disable(mut self, _: Stop) -> Axis {
        if self.end.is_none() {
            self.halt("not started").await;
        }
        let released = async {
            match self.drive.disable().await {
                // After a fault it has no torque already.
                Ok(()) | Err(Error::Fault(_)) => {}
                Err(error) => return Err(error),
            }
            if self.by_sync {
                self.drive.set_start_by_sync(false).await?;
            }
            // The network ends with the program: a drive that is still protected would take that for the loss of its
            // manager.
            self.drive.unprotect().await
        };
        if let Err(error) = in_time(&self.network, released).await {
            self.add(format!("not disabled: {error}"));
        }
        self
    }

    /// Notes that this drive has failed, and stops all others.
    async fn fail(&mut self, outcome: &'static str, why: String, stop: &Stop) {
        let at = self.now().await;
        stop.order(Reason::Drive { name: self.entry.name.clone(), outcome, why: why.clone(), at });
        self.halt(outcome).await;
        self.add(why);
    }

    /// Stops the drive.
    async fn halt(&mut self, outcome: &'static str) {
        self.halted = Some(self.now().await);
        let stopped = in_time(&self.network, self.drive.stop()).await;
        self.end(outcome).await;
        if let Err(error) = stopped {
            self.add(format!("not stopped: {error}"));
        }
    }

    async fn end(&mut self, outcome: &'static str) {
        let position = self.drive.position().await;
        let at = self.now().await;
        self.course.extend(position.ok().map(|position| (at, position)));
        self.end = Some(End { outcome, why: Vec::new(), at });
    }

    /// Adds a reason to the end.
    fn add(&mut self, why: String) {
        self.end.iter_mut().for_each(|end| end.why.push(why.clone()));
    }

    pub(crate) fn outcome(&self) -> String {
        let Some(end) = &self.end else { return "not moved".to_owned() };
        let place = self.course.last().map(|(_, position)| format!(" at {}", self.show(*position))).unwrap_or_default();
        let why = if end.why.is_empty() { String::new() } else { format!(": {}", end.why.join("; ")) };
        format!("{}{place}{why}", end.outcome)
    }

    /// The time of the bus; if the bus is gone, the time of the last position.
    async fn now(&self) -> Instant {
        let last = self.course.last().map_or(Instant::ZERO, |(at, _)| *at);
        self.network.now().await.unwrap_or(last)
    }
}

/// The error of a call, or that it has not ended in time.
async fn in_time(network: &Network, call: impl Future<Output = Result<(), Error>>) -> Result<(), String> {
    let until = network.now().await.map_err(|error| error.to_string())? + WITHIN;
    tokio::select! {
        biased;
        done = call => done.map_err(|error| error.to_string()),
        _ = network.sleep_until(until) => Err(format!("it takes longer than {WITHIN}")),
    }
}

/// The target in counts, if the drive can move there.
fn target(
    entry: &Entry,
    description: &Description,
    units: Option<Units>,
    limits: Option<(i32, i32)>,
) -> Result<i32, Problem> {
    let (position, span) = (entry.position, entry.position_span.clone());
    let unit = position.unit();
    let Some(target) = position.counts(units) else {
        let (what, remedy) = match units {
            Some(Units { spindle_pitch_10um: 0, .. }) if unit == Unit::Mm => (
                "the drive has no spindle pitch, and cannot count in mm",
                "set its spindle pitch up, or give the position in degrees or increments",
            ),
            Some(_) => ("no position is so far away", "give a position that the drive can count"),
            None => ("the driver does not know the units of the drive", "give the position in increments"),
        };
        return Err(Problem { what: format!("{}: {what}", entry.name), span, remedy: remedy.to_owned() });
    };
    if let Some((low, high)) = limits.filter(|(low, high)| !(*low..=*high).contains(&target)) {
        let [low, high] = [low, high].map(|limit| unit.show(unit.of(limit, units)));
        let what = format!("{}: {position} is beyond its limits, {low} to {high}", entry.name);
        let remedy = "give a position between them; or set other limits up (607Dh), if the machine has room";
        return Err(Problem { what, span, remedy: remedy.to_owned() });
    }
    if let Err(error) = description.objects.target_position.check(target.into()) {
        let remedy = "give a position that the drive can count".to_owned();
        return Err(Problem { what: format!("{}: {error}", entry.name), span, remedy });
    }
    Ok(target)
}

/// The outcome of a motion that has not reached its target.
fn words(outcome: Outcome) -> (&'static str, String) {
    match outcome {
        Outcome::Fault(cause) => ("fault", cause.to_string()),
        Outcome::Limit { .. } => ("limit", "it has passed one of its limits".to_owned()),
        Outcome::TorqueDeactivated { .. } => ("overloaded", "its load has stopped it".to_owned()),
        Outcome::Overridden { .. } => ("overridden", "another manager has ordered something else".to_owned()),
        Outcome::Interrupted { state, .. } => ("interrupted", format!("it is in {state}")),
        Outcome::TimedOut { .. } => ("timed out", "it is still under way".to_owned()),
        Outcome::Reached { .. } => ("reached", String::new()),
    }
}
