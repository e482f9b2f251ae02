//! A simulated device whose events are printed, controlled by lines from stdin.

use std::io;

use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Frame, Instant};
use lexican_simulation::{Command, PlantDevice, SimulatedDevice};
use serde_json::json;

use super::report::Report;
use crate::output::{Failure, warn};

pub(super) struct Station<'a> {
    pub(super) about: &'a PlantDevice,
    pub(super) device: SimulatedDevice,
    pub(super) report: Report<'a>,
    /// The last reported error about the file of stored parameters.
    trouble: Option<String>,
    /// The error of writing to stdout.
    broken: Option<io::Error>,
}

impl<'a> Station<'a> {
    pub(super) fn new(about: &'a PlantDevice, device: SimulatedDevice, report: Report<'a>) -> Self {
        Station { about, device, report, trouble: None, broken: None }
    }

    fn note(&mut self, printed: io::Result<()>) {
        if let Err(error) = printed {
            self.broken.get_or_insert(error);
        }
    }

    /// Reports changes of node-ID and state.
    pub(super) fn follow(&mut self, now: Instant) {
        let printed = self.report.follow(now, self.device.node_id(), self.device.nmt_state());
        self.note(printed);
    }

    /// Reports entries that the device cannot serve; fails if stdout cannot be written.
    pub(super) fn check(&mut self, now: Instant) -> Result<(), Failure> {
        if let Some(error) = self.broken.take() {
            return Err(error.into());
        }
        for fault in self.device.take_misconfigured() {
            self.report.misconfigured(now, &fault)?;
        }
        let trouble = self.device.trouble().map(|error| format!("cannot write what the device stores: {error}"));
        if trouble != self.trouble {
            trouble.iter().for_each(warn);
            self.trouble = trouble;
        }
        Ok(())
    }

    /// Carries out a line. The answer is empty if the device reports the effect itself.
    pub(super) fn carry_out(&mut self, now: Instant, command: &Command) -> Result<String, String> {
        match command {
            Command::Status => Ok(self.status(now)),
            command => self.device.carry_out(now, command).map_err(|refusal| refusal.to_string()),
        }
    }

    pub(super) fn answer(&mut self, now: Instant, answer: Result<String, String>) -> io::Result<()> {
        match answer {
            Ok(text) if text.is_empty() => Ok(()),
            Ok(text) => self.report.event(now, "answer", &text, json!({})),
            Err(error) => self.report.event(now, "error", &format!("error: {error}"), json!({ "text": error })),
        }
    }

    pub(super) fn status(&self, now: Instant) -> String {
        let counts = self.report.counts;
        format!(
            "{}; {} frames received, {} sent, {} writes, {} refusals",
            self.device.status(now),
            counts.received,
            counts.sent,
            counts.writes,
            counts.refusals
        )
    }

    pub(super) fn sum_up(&self, now: Instant, began: Instant) -> io::Result<()> {
        let counts = self.report.counts;
        let fields = json!({
            "seconds": now.since(began).as_secs_f64(),
            "received": counts.received,
            "sent": counts.sent,
            "writes": counts.writes,
            "refusals": counts.refusals,
        });
        let text = format!("after {:.0} s, {}", now.since(began).as_secs_f64(), self.status(now));
        self.report.event(now, "summary", &text, fields)
    }
}

impl Node for Station<'_> {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let printed = self.report.received(now, frame);
        self.note(printed);
        self.device.handle_frame(now, frame);
        self.follow(now);
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.device.handle_timeout(now);
        self.follow(now);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let frame = self.device.poll_transmit(now);
        if let Some(frame) = &frame {
            let printed = self.report.sent(now, frame);
            self.note(printed);
        }
        self.follow(now);
        frame
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.device.poll_timeout()
    }
    fn concerns(&self) -> Vec<CobId> {
        self.device.concerns()
    }
    fn generation(&self) -> u32 {
        self.device.generation()
    }
}
