//! An order to a drive, from what is said before it to what is said after it.

use lexican_driver::sequence::Recovery;
use lexican_driver::{Capability, Description, Error, Missing, Protection, Supervision};
use lexican_runtime::Duration;
use lexican_runtime::profile::cia402::State;
use lexican_toolbox::drive::{
    Ending, Look, Order, Scales, Times, carry_out, explain_profile, has_ended, prepare, set_profile, to_set,
};
use serde_json::{Value as Json, json};

use super::args::Args;
use super::explain;
use super::node::Drive;
use super::report::Report;
use crate::output::{Failure, Outcome, note, warn};

/// How long to try to stop a drive whose bus is lost.
const RESCUE: Duration = Duration::from_secs(5);

/// A drive, and what it is to do.
pub(super) struct Moving<'a> {
    pub(super) args: &'a Args,
    pub(super) drive: Drive,
    pub(super) order: Order,
    /// The velocity and the acceleration to set before it.
    pub(super) profile: [Option<i64>; 2],
    pub(super) description: &'static Description,
    pub(super) scales: &'a Scales<'a>,
    /// The command has enabled it, and has to disable it.
    pub(super) enabled: bool,
}

impl Moving<'_> {
    pub(super) fn carry_out(&mut self, report: &mut Report<'_>) -> Result<Ending, Error> {
        let (order, times) = (self.order, Times { within: self.args.within, lasting: self.args.span });
        if order.moves() {
            self.protect()?;
            let [velocity, acceleration] = self.profile;
            self.drive.run(async |drive| set_profile(&drive, velocity, acceleration).await)?;
            if self.args.enable && self.drive.state()? != State::OperationEnabled {
                // Also if it is cancelled half way.
                self.enabled = true;
                self.drive.run(async |drive| prepare(&drive, order).await)?;
                self.drive.enable()?;
            }
        }
        let (name, value, text) = self.words()?;
        if let Err(failure) = report.order(name, value, &text) {
            warn(failure);
        }
        let ending = self
            .drive
            .run(async |drive| carry_out(&drive, order, times, &mut |look| report.look(look), &mut |_| None).await)?;
        if ending == Ending::Stalled {
            self.drive.stop()?;
            let facts = self.drive.run(async |drive| explain_profile(&drive).await)?;
            explain::say(&facts);
        }
        Ok(ending)
    }

    /// Arms what lets the drive notice that the command is gone, if it has that.
    fn protect(&mut self) -> Result<(), Error> {
        let (within, manager) = (self.args.protect, self.args.manager);
        if within.is_zero() {
            return Ok(());
        }
        match self.drive.protect(Supervision { within, manager }) {
            Err(error @ (Error::Unsupported { .. } | Error::HeartbeatExcludesGuarding { .. })) => {
                note(format_args!("the drive goes on with its order if this command is killed: {error}"));
                Ok(())
            }
            protected => protected.map(|_| ()),
        }
    }

    /// What is about to be done: the order, its value, and a sentence.
    fn words(&mut self) -> Result<(&'static str, Option<Json>, String), Error> {
        let from = |drive: &mut Drive, scales: &Scales<'_>| drive.position().map(|position| scales.position(position));
        let (drive, scales) = (&mut self.drive, self.scales);
        Ok(match self.order {
            Order::Enable => ("enable", None, "enabling it".to_owned()),
            Order::Disable => ("disable", None, "stopping and disabling it".to_owned()),
            Order::ResetFault => ("reset-fault", None, "resetting its fault".to_owned()),
            Order::MoveTo(target) => {
                let text = format!("travels from {} to {}", from(drive, scales)?, scales.target(target));
                ("move-to", Some(json!(target)), text)
            }
            Order::Step(Some(width)) => {
                let text = format!("travels from {} by {}", from(drive, scales)?, scales.target(width));
                ("step", Some(json!(width)), text)
            }
            Order::Step(None) => ("step", None, format!("takes a step from {}", from(drive, scales)?)),
            Order::Run(velocity) => {
                let end = match self.args.span {
                    Some(span) => format!("for {} s", span.as_secs_f64()),
                    None => "until Ctrl-C".to_owned(),
                };
                ("run", Some(json!(velocity)), format!("runs at {} {end}", scales.target_velocity(velocity)))
            }
            Order::Home(method) => {
                let by = method.map_or_else(|| "the method that it is set to".to_owned(), |it| format!("method {it}"));
                ("home", method.map(Json::from), format!("homes by {by}, from {}", from(drive, scales)?))
            }
            Order::Stop => ("stop", None, "stopping it".to_owned()),
            Order::QuickStop => ("quick-stop", None, "stopping it at once".to_owned()),
            Order::Watch => ("watch", None, "watching it".to_owned()),
        })
    }

    /// Says how it has ended. The drive stands then, or that it may not is the failure.
    pub(super) fn end(mut self, report: &mut Report<'_>, result: Result<Ending, Error>) -> Result<Outcome, Failure> {
        let result = match result {
            Err(error) if !has_ended(&error) => return Err(self.rescue(report, error)),
            result => result,
        };
        if self.enabled {
            // Ctrl-C may come once more, and cancel this before it has begun.
            match self.drive.disable().or_else(|_| self.drive.disable()) {
                // A fault has done so.
                Ok(()) | Err(Error::Fault(_)) => {}
                Err(error) => return Err(self.rescue(report, error)),
            }
            report.look(self.drive.run(async |drive| Ok(Look::at(&drive))).map_err(Failure::new)?);
        }
        let outcome = self.report(report, result);
        drop(self.drive.release());
        outcome
    }

    fn report(&self, report: &mut Report<'_>, result: Result<Ending, Error>) -> Result<Outcome, Failure> {
        match result {
            Ok(ending) => {
                report.ending(&ending, &self.order.sentence(ending))?;
                Ok(if ending.is_success() { Outcome::Clean } else { Outcome::Found })
            }
            Err(Error::Cancelled { stopped, .. }) => {
                let text = if stopped { "interrupted: it has been stopped" } else { "interrupted" };
                report.close("cancelled", text, None)?;
                // These have no other end.
                let is_end = matches!(self.order, Order::Run(_) | Order::Watch);
                Ok(if is_end { Outcome::Clean } else { Outcome::Found })
            }
            Err(Error::Restarted) => {
                let remedy = "see why its power has failed, or which node has reset it";
                report.close("restarted", "it has restarted", Some(remedy))?;
                Ok(Outcome::Found)
            }
            Err(error) => {
                report.close("refused", &error.to_string(), Some(&self.remedy(&error)))?;
                Ok(Outcome::Found)
            }
        }
    }

    fn remedy(&self, error: &Error) -> String {
        let order = |order: &str| {
            format!("`lexican drive {} {order}` with the same --bus and --device does so", self.args.node)
        };
        match error {
            Error::Refused(refusal) if refusal.0.iter().any(|it| matches!(it, Missing::Enabled(_))) => {
                format!("enable it first: {}; so does --enable", order("enable"))
            }
            Error::Refused(refusal) if refusal.0.iter().any(|it| matches!(it, Missing::NoTravel)) => {
                format!("stop it first: {}", order("stop"))
            }
            Error::Refused(refusal) if refusal.0.iter().any(|it| to_set(it).is_some()) => {
                refusal.0.iter().find_map(to_set).unwrap_or_default()
            }
            Error::Refused(refusal) if refusal.0.iter().any(|it| matches!(it, Missing::Supply)) => {
                "switch the supply of its output stage on".to_owned()
            }
            Error::Fault(_) | Error::Refused(_) if is_fault(error) => {
                format!("remove its cause, then reset the fault: {}", order("reset-fault"))
            }
            Error::Unsupported { what: Capability::HomingMethod(_), .. } => {
                let homing = self.description.homing;
                let methods = homing.map_or(&[][..], |homing| homing.methods).iter().map(i8::to_string);
                format!("its methods are {} (6098h)", methods.collect::<Vec<_>>().join(", "))
            }
            Error::Unsupported { .. } => "see the manual of the drive; `lexican eds dump` lists what it has".to_owned(),
            Error::OutOfRange(_) => "the data sheet has its limits: `lexican eds dump`".to_owned(),
            _ => "nothing has moved; `lexican drive NODE watch` shows its state".to_owned(),
        }
    }

    /// Tries to stop a drive that has failed or is not to be reached; what is to be reported.
    fn rescue(mut self, report: &mut Report<'_>, error: Error) -> Failure {
        let node = self.args.node;
        if !matches!(error, Error::MayBeMoving { .. }) {
            let failure = Failure::new(format_args!("node {node}: {error}"));
            return match report.close("failed", &error.to_string(), None) {
                Ok(()) if self.enabled => failure.help(format!("it has been enabled: `lexican drive {node} disable`")),
                _ => failure,
            };
        }
        let error = error.into_cause();
        match self.drive.recover(&Recovery::within(RESCUE)) {
            Ok(_) | Err(Error::Cancelled { stopped: true, .. }) => {
                let _ = report.close("stopped", "it has been stopped", None);
                drop(self.drive.release());
                Failure::new(format_args!("node {node}: {error}; it has been stopped since"))
            }
            Err(last) => {
                let _ = report.close("may-be-moving", "it may be moving, and could not be stopped", None);
                let notices = match self.drive.protection() {
                    Protection::None => "it does not notice that by itself".to_owned(),
                    protection => format!("it notices that by itself: {protection}"),
                };
                let last = last.into_cause().to_string();
                let why = Some(error.to_string()).filter(|error| *error != last);
                let before = why.map_or_else(String::new, |error| format!(", after this: {error}"));
                Failure::new(format_args!(
                    "THE DRIVE AT NODE {node} MAY STILL BE MOVING: it could not be told to stop: {last}{before}"
                ))
                .help(format!("stop it by its emergency stop or its supply; {notices}"))
            }
        }
    }
}

fn is_fault(error: &Error) -> bool {
    match error {
        Error::Fault(_) => true,
        Error::Refused(refusal) => refusal.0.iter().any(|it| matches!(it, Missing::NoFault(_))),
        _ => false,
    }
}
