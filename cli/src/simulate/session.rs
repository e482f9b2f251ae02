//! Runs a device on its bus, with commands from stdin.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;

use lexican_runtime::host::{BusUrl, Link, LinkError, Node, Notice, Participant};
use lexican_runtime::{CobId, Duration, Frame, Instant};
use serde_json::json;

use super::args::{Args, Place};
use super::control::{self, Command};
use super::device::Simulated;
use super::input::is_listening;
use super::report::Report;
use crate::bus::object::resolve;
use crate::bus::serial_terminal::SerialTerminal;
use crate::device::Loaded;
use crate::output::{Failure, missing_frames, warn};
use crate::values::DeviceValues;
use crate::values::report::ValueReport;

/// How often stdin and Ctrl-C are checked: that much later than it is written, a line takes effect.
const LOOK: Duration = Duration::from_millis(10);
/// The most lines that are carried out between two frames.
const LINES: usize = 64;

/// The bus of other commands, if this one uses a terminal of another simulation.
const OTHER_TERMINAL: &str = "another terminal of the simulation that made it (--bus pty:4 makes four)";
/// The bus of other commands, if this one uses an adapter.
const OTHER_ADAPTER: &str = "another adapter on the same bus";

pub(super) struct Session<'a> {
    participant: Participant<Box<dyn Link + Send>, Reporting<'a>>,
    /// The serial interface of the device, if that is what it is on.
    serial: Option<SerialTerminal>,
    loaded: &'a Loaded,
    /// To parse and print values.
    values: DeviceValues<'a>,
    /// The last reported error about the file of stored parameters.
    trouble: Option<String>,
}

/// A device whose events are printed.
struct Reporting<'a> {
    device: Simulated,
    report: Report<'a>,
    /// Why stdout cannot be written.
    broken: Option<io::Error>,
}

impl Reporting<'_> {
    fn note(&mut self, printed: io::Result<()>) {
        if let Err(error) = printed {
            self.broken.get_or_insert(error);
        }
    }

    fn follow(&mut self, now: Instant) {
        let printed = self.report.follow(now, self.device.node_id(), self.device.nmt_state());
        self.note(printed);
    }
}

impl Node for Reporting<'_> {
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

impl<'a> Session<'a> {
    pub(super) fn new(
        (link, serial): (Box<dyn Link + Send>, Option<SerialTerminal>),
        device: Simulated,
        loaded: &'a Loaded,
        report: Report<'a>,
    ) -> Self {
        let reporting = Reporting { device, report, broken: None };
        let values = DeviceValues::new(&loaded.device);
        Session { participant: Participant::new(link, reporting), serial, loaded, values, trouble: None }
    }

    fn device(&mut self) -> &mut Simulated {
        &mut self.participant.node().device
    }

    fn report(&mut self) -> &mut Report<'a> {
        &mut self.participant.node().report
    }

    /// Prints what is served on which bus, and how to try it.
    pub(super) fn introduce(&mut self, urls: &[String], args: &Args) -> Result<(), Failure> {
        let now = self.participant.now();
        let (name, entries) = (self.loaded.input.eds.name(), self.loaded.device.entries().count());
        let node = self.device().node_id();
        self.report().follow(now, node, None)?;
        if args.json {
            let fields = json!({ "device": name, "entries": entries, "buses": urls });
            return Ok(self.report().event(now, "serving", "serving", fields)?);
        }
        self.report().event(now, "serving", &format!("serving on {}", urls.join(" and ")), json!({}))?;
        let mut stderr = anstream::stderr().lock();
        let who = node.map_or_else(|| "no node-ID yet".to_owned(), |node| format!("node {node}"));
        let _ = writeln!(stderr, "{who}: {name}, {entries} entries: {}", self.device().abilities());
        // A serial port serves one program, which is this one.
        let others = match &args.bus {
            Place::Url(BusUrl::Slcan { port, .. }) => {
                let other = if port.starts_with("/dev/pts/") { OTHER_TERMINAL } else { OTHER_ADAPTER };
                let _ = writeln!(stderr, "{port} serves only this command; BUS below is {other}");
                &["BUS".to_owned()]
            }
            _ => urls,
        };
        if let (Some(first), Some(last)) = (others.first(), others.last()) {
            let device = args.device.name();
            let lines = match node {
                Some(_) if self.serial.is_some() => [
                    format!("read --bus \"{first}\" 6064"),
                    format!("check --bus \"{first}\""),
                    format!("monitor --bus \"{first}\""),
                ],
                Some(node) => [
                    format!("monitor --bus {last} --device {node}={device}"),
                    format!("scan --bus {first}"),
                    format!("read --bus {first} --node {node} --device {device} 1000 1018:01"),
                ],
                None => [
                    format!("monitor --bus {last}"),
                    format!("lss find --bus {first}"),
                    format!("lss node-id --bus {first} --unconfigured 5"),
                ],
            };
            let _ = writeln!(stderr, "in other terminals:");
            for line in lines {
                let _ = writeln!(stderr, "    lexican {line}");
            }
        }
        if std::io::stdin().is_terminal() && is_listening() {
            let _ = writeln!(stderr, "here: help lists the commands; Ctrl-C ends");
        }
        Ok(())
    }

    /// Runs the device until the end, Ctrl-C or `quit`.
    pub(super) fn serve(
        &mut self,
        end: Option<Instant>,
        interrupted: &AtomicBool,
        lines: &Receiver<String>,
    ) -> Result<(), Failure> {
        loop {
            let now = self.participant.now();
            if interrupted.load(Ordering::Relaxed) || end.is_some_and(|end| now >= end) {
                return Ok(());
            }
            for line in lines.try_iter().take(LINES) {
                if !self.command(now, &line)? {
                    return Ok(());
                }
                self.participant.node().follow(now);
            }
            let look = if self.serial.is_some() { Duration::ZERO } else { LOOK };
            let until = end.map_or(now + look, |end| end.min(now + look));
            match self.participant.run(until) {
                Ok(Some(Notice::State(state))) => {
                    let now = self.participant.now();
                    let fields = json!({ "state": state.to_string() });
                    self.report().event(now, "bus", &format!("the bus is {state}"), fields)?;
                }
                Ok(Some(Notice::Gap(frames))) => {
                    let now = self.participant.now();
                    self.report().event(now, "gap", &missing_frames(frames), json!({ "frames": frames }))?;
                }
                Ok(Some(Notice::Refused(error))) => warn(error),
                Ok(None) => {}
                Err(LinkError::Ended) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            if let Some(error) = self.participant.node().broken.take() {
                return Err(error.into());
            }
            if let Some(serial) = &mut self.serial {
                let bytes = serial.receive();
                let now = self.participant.now();
                serial.send(&self.participant.node().device.serial(now, &bytes))?;
            }
            for fault in self.device().take_misconfigured() {
                let now = self.participant.now();
                self.report().misconfigured(now, &fault)?;
            }
            let trouble = self.device().trouble();
            if trouble != self.trouble {
                trouble.iter().for_each(warn);
                self.trouble = trouble;
            }
        }
    }

    /// Carries out a line; returns whether to go on.
    fn command(&mut self, now: Instant, line: &str) -> Result<bool, Failure> {
        let command = match control::parse(line) {
            Ok(Some(command)) => command,
            Ok(None) => return Ok(true),
            Err(error) => return self.answer(now, Err(error)),
        };
        let done = |()| String::new();
        let answer = match command {
            Command::Quit => return Ok(false),
            Command::Help => Ok(control::HELP.to_owned()),
            Command::Status => Ok(self.status(now)),
            Command::Get(object) => self.get(now, &object),
            Command::Set(object, value) => self.set(now, &object, &value),
            Command::Emcy { code, register, msef } => self.device().emergency(code, register, msef).map(done),
            Command::EmcyClear => self.device().clear_errors().map(done),
            Command::Power(power) => {
                self.device().set_power(now, power);
                Ok(String::new())
            }
            Command::Input(line) => self.device().input(now, &line).map(|()| line),
        };
        self.answer(now, answer)
    }

    fn answer(&mut self, now: Instant, answer: Result<String, String>) -> Result<bool, Failure> {
        match answer {
            // The device reports the effect itself.
            Ok(text) if text.is_empty() => {}
            Ok(text) => self.report().event(now, "answer", &text, json!({}))?,
            Err(error) => self.report().event(now, "error", &format!("error: {error}"), json!({ "text": error }))?,
        }
        Ok(true)
    }

    fn get(&mut self, now: Instant, object: &str) -> Result<String, String> {
        let address = resolve(Some(&self.loaded.device), object).map_err(|failure| failure.to_string())?;
        let value = self.device().value(now, address).map_err(|code| format!("{address}: {code}"))?;
        Ok(ValueReport::of_bytes(Some(&self.values), address, &value).equation())
    }

    fn set(&mut self, now: Instant, object: &str, text: &str) -> Result<String, String> {
        let address = resolve(Some(&self.loaded.device), object).map_err(|failure| failure.to_string())?;
        let data = self.values.encode(address, text)?;
        self.device().set_value(now, address, &data).map_err(|code| format!("{address}: {code}"))?;
        let report = ValueReport::of_bytes(Some(&self.values), address, &data);
        report.value.iter().for_each(|value| self.values.set(address, value));
        Ok(report.equation())
    }

    fn status(&mut self, now: Instant) -> String {
        let counts = self.report().counts;
        let device = self.device();
        let who = device.node_id().map_or_else(|| "no node-ID".to_owned(), |node| format!("node {node}"));
        let state = device.nmt_state().map_or_else(|| "not on the bus".to_owned(), |state| state.to_string());
        format!(
            "{who}: {state}{}; {} frames received, {} sent, {} writes, {} refusals",
            device.state(now),
            counts.received,
            counts.sent,
            counts.writes,
            counts.refusals
        )
    }

    pub(super) fn sum_up(&mut self, began: Instant) -> Result<(), Failure> {
        let now = self.participant.now();
        let counts = self.report().counts;
        let fields = json!({
            "seconds": now.since(began).as_secs_f64(),
            "received": counts.received,
            "sent": counts.sent,
            "writes": counts.writes,
            "refusals": counts.refusals,
        });
        let text = format!("after {:.0} s, {}", now.since(began).as_secs_f64(), self.status(now));
        Ok(self.report().event(now, "summary", &text, fields)?)
    }
}
