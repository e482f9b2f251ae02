//! Carries out an order, from the announcement to the final report.

use lexican_driver::{Error, Protection, Step, Supervision};
use lexican_runtime::profile::cia402::State;
use lexican_toolbox::drive::{
    Ending, Look, Order, SafeEnd, Scales, Times, carry_out, end_safely, explain_profile, prepare, see, set_profile,
};

use super::args::Args;
use super::explain;
use super::node::Drive;
use super::report::Report;
use crate::output::{Failure, Outcome, note, warn};

/// A drive with its order.
pub(super) struct Moving<'a> {
    pub(super) args: &'a Args,
    pub(super) drive: Drive,
    pub(super) order: Order,
    /// The velocity and the acceleration to set first.
    pub(super) profile: [Option<i64>; 2],
    pub(super) scales: &'a Scales<'a>,
    /// Whether the command has enabled the drive, and so has to disable it.
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
                // Set this first: enabling may be cancelled half way.
                self.enabled = true;
                self.drive.run(async |drive| prepare(&drive, order).await)?;
                self.drive.enable()?;
            }
        }
        self.announce(report)?;
        let ending = self
            .drive
            .run(async |drive| carry_out(&drive, order, times, &mut |look| report.look(look), &mut |_| None).await)?;
        if ending == Ending::Stalled {
            let facts = self.drive.run(async |drive| explain_profile(&drive).await)?;
            explain::say(&facts);
        }
        Ok(ending)
    }

    /// Arms the drive's protection against the loss of this command, if it has one.
    fn protect(&mut self) -> Result<(), Error> {
        let (within, manager) = (self.args.protect, self.args.manager);
        if within.is_zero() {
            return Ok(());
        }
        match self.drive.protect(Supervision { within, manager }) {
            Err(error) if Protection::is_lacking(&error) => {
                note(format_args!("the drive goes on with its order if this command is killed: {error}"));
                Ok(())
            }
            protected => protected.map(|_| ()),
        }
    }

    /// Announces what is about to be done.
    fn announce(&mut self, report: &mut Report<'_>) -> Result<(), Error> {
        let from = if self.order.verb().begins_at_a_position() { Some(self.drive.position()?) } else { None };
        let until = match self.args.span {
            Some(span) => format!("for {} s", span.as_secs_f64()),
            None => "until Ctrl-C".to_owned(),
        };
        let text = self.order.words(self.scales, from, &until);
        if let Err(failure) = report.order(self.order.verb().word(), self.order.value(), &text) {
            warn(failure);
        }
        Ok(())
    }

    /// Reports how the order has ended. The drive is at a standstill then; if it may not be, that is the failure.
    pub(super) fn end(mut self, report: &mut Report<'_>, result: Result<Ending, Error>) -> Result<Outcome, Failure> {
        let node = self.args.node;
        let mut end = end_safely(&mut self.drive, self.order, result);
        if end.is_known && self.enabled {
            // A second Ctrl-C may cancel the first attempt before it begins.
            match self.drive.disable().or_else(|_| self.drive.disable()) {
                // After a fault the drive is disabled already.
                Ok(()) | Err(Error::Fault(_)) => {}
                Err(error) => end = end_safely(&mut self.drive, Order::Disable, Err(error)),
            }
        }
        if !end.may_be_moving {
            // The last values are from before the stop; read them again.
            let _ = self.drive.run(async |drive| see(&drive).await);
        }
        let now = self.drive.run(async |drive| Ok((Look::at(&drive), drive.now())));
        if let Ok((look, now)) = now {
            report.look(look);
            report.ends_at(now);
        }
        let remedy = self.remedy(&end);
        if end.is_known || end.word == "stopped" {
            drop(self.drive.release());
        }
        if end.is_known {
            report.close(&end, remedy)?;
            // Orders that last have no other end than being cancelled.
            let is_end = end.word == "cancelled" && self.order.verb().lasts();
            return Ok(if end.is_success || is_end { Outcome::Clean } else { Outcome::Found });
        }
        let closed = report.close(&end, None);
        let failure = Failure::new(match end.may_be_moving {
            true => format!("THE DRIVE AT NODE {node} {}", end.text),
            false => format!("node {node}: {}", end.text),
        });
        Err(match remedy {
            _ if end.word == "failed" && self.enabled && closed.is_ok() => {
                failure.help(format!("it has been enabled: `lexican drive {node} disable`"))
            }
            Some(remedy) => failure.help(remedy),
            None => failure,
        })
    }

    /// The remedy, as commands where possible.
    fn remedy(&self, end: &SafeEnd) -> Option<String> {
        let order = |step: &Step| format!("`lexican drive {} {}`", self.args.node, step.word());
        let text = end.remedy.clone()?;
        if end.steps.is_empty() || end.may_be_moving {
            return Some(text);
        }
        let orders = end.steps.iter().map(order).collect::<Vec<_>>().join(" or ");
        let also = if end.steps.contains(&Step::Enable) { "; so does --enable" } else { "" };
        Some(format!("{text}: {orders} with the same --bus and --device{also}"))
    }
}
