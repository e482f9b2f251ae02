//! Runs the simulated devices on their bus, and carries out commands from stdin.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;

use lexican_runtime::host::{Link, LinkError, Notice, Participant};
use lexican_runtime::{Duration, Instant};
use lexican_simulation::Segment;
use lexican_simulation::command::{self, Command, CommandError, addressee};
use serde_json::{Value as Json, json};

use super::args::{Args, Place};
use super::input::is_listening;
use super::report::print;
use super::station::Station;
use crate::bus::kind::{Kind, Simulated};
use crate::bus::serial_terminal::SerialTerminal;
use crate::output::{Failure, fields, missing_frames, warn};

/// The commands on stdin that are not about a device, as help.
const HELP: &str = "\
quit                         ends, as Ctrl-C does
with several devices, each line begins with the node-ID or the name of one: 5: get 6041, feeder: blocked = true";

/// The interval of checking stdin and Ctrl-C; a line takes effect with at most this delay.
const LOOK: Duration = Duration::from_millis(10);
/// The most lines that are carried out between two frames.
const LINES: usize = 64;

/// What other commands use as bus if this one uses a terminal of another simulation.
const OTHER_TERMINAL: &str = "another terminal of the simulation that made it (--bus pty:4 makes four)";
/// What other commands use as bus if this one uses an adapter.
const OTHER_ADAPTER: &str = "another adapter on the same bus";

pub(super) struct Session<'a> {
    participant: Participant<Box<dyn Link + Send>, Segment<Station<'a>>>,
    /// The other interface of the single device, if it is used.
    serial: Option<SerialTerminal>,
    json: bool,
}

impl<'a> Session<'a> {
    pub(super) fn new(
        (link, serial): (Box<dyn Link + Send>, Option<SerialTerminal>),
        plant: Segment<Station<'a>>,
        json: bool,
    ) -> Self {
        Session { participant: Participant::new(link, plant), serial, json }
    }

    fn stations(&mut self) -> impl Iterator<Item = &mut Station<'a>> {
        self.participant.node().nodes_mut()
    }

    /// The single device.
    fn only(&mut self) -> Option<&mut Station<'a>> {
        let mut stations = self.stations();
        let first = stations.next();
        if stations.next().is_some() { None } else { first }
    }

    /// Reports an event of the single device, or of all.
    fn event(&mut self, event: &str, text: &str, more: Json) -> Result<(), Failure> {
        let (now, json) = (self.participant.now(), self.json);
        match self.only() {
            Some(station) => station.report.event(now, event, text, more)?,
            None => print(json, now, event, ("", text), fields(more))?,
        }
        Ok(())
    }

    /// Prints what is simulated on which bus, and how to try it.
    pub(super) fn introduce(&mut self, urls: &[String], args: &Args) -> Result<(), Failure> {
        let now = self.participant.now();
        let mut known = Vec::new();
        for station in self.stations() {
            let (name, entries) = (station.about.sheet.input.eds.name(), station.about.sheet.device.entries().count());
            let node = station.device.node_id();
            station.report.follow(now, node, None)?;
            if args.json {
                let fields = json!({ "device": name, "entries": entries, "buses": urls });
                station.report.event(now, "serving", "serving", fields)?;
            } else {
                let abilities = station.device.abilities();
                known.push((
                    node,
                    station.about.device.clone(),
                    format!("{}: {name}, {entries} entries: {abilities}", station.report.who()),
                ));
            }
        }
        if args.json {
            return Ok(());
        }
        self.event("serving", &format!("serving on {}", urls.join(" and ")), json!({}))?;
        let mut stderr = anstream::stderr().lock();
        for (_, _, text) in &known {
            let _ = writeln!(stderr, "{text}");
        }
        // A serial port serves one program, and this is it.
        let others = match &args.bus {
            Place::Url(url) if matches!(Kind::of(url).simulated, Simulated::Alone) => {
                let port = url.place();
                let other = if port.starts_with("/dev/pts/") { OTHER_TERMINAL } else { OTHER_ADAPTER };
                let _ = writeln!(stderr, "{port} serves only this command; BUS below is {other}");
                &["BUS".to_owned()]
            }
            _ => urls,
        };
        if let (Some(first), Some(last)) = (others.first(), others.last()) {
            let nodes = known.iter().filter_map(|(node, device, _)| Some((node.as_ref()?, device)));
            let monitor: String = nodes.clone().map(|(node, device)| format!(" --device {node}={device}")).collect();
            let lines = match nodes.clone().next() {
                Some(_) if self.serial.is_some() => [
                    format!("read --bus \"{first}\" 6064"),
                    format!("check --bus \"{first}\""),
                    format!("monitor --bus \"{first}\""),
                ],
                Some((node, device)) => [
                    format!("monitor --bus {last}{monitor}"),
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

    /// Runs the devices until the end, Ctrl-C or `quit`.
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
                self.stations().for_each(|station| station.follow(now));
            }
            // A drive at another interface waits for its bytes below.
            let look = if self.serial.is_some() { Duration::ZERO } else { LOOK };
            let until = end.map_or(now + look, |end| end.min(now + look));
            match self.participant.run(until) {
                Ok(Some(Notice::State(state))) => {
                    let fields = json!({ "state": state.to_string() });
                    self.event("bus", &format!("the bus is {state}"), fields)?;
                }
                Ok(Some(Notice::Gap(frames))) => {
                    self.event("gap", &missing_frames(frames), json!({ "frames": frames }))?;
                }
                Ok(Some(Notice::Refused(error))) => warn(error),
                Ok(None) => {}
                Err(LinkError::Ended) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            if let Some(serial) = &mut self.serial {
                let bytes = serial.receive();
                let now = self.participant.now();
                for station in self.participant.node().nodes_mut() {
                    serial.send(&station.device.answer(now, &bytes))?;
                }
            }
            let now = self.participant.now();
            self.stations().try_for_each(|station| station.check(now))?;
        }
    }

    /// Carries out a line; returns whether to go on.
    fn command(&mut self, now: Instant, line: &str) -> Result<bool, Failure> {
        let (who, rest) = addressee(line);
        let command = match (rest.trim(), command::parse(rest)) {
            ("quit" | "exit", _) => return Ok(false),
            ("help" | "?", _) => {
                self.event("answer", &format!("{}\n{HELP}", command::HELP), json!({}))?;
                return Ok(true);
            }
            (_, Ok(None)) => return Ok(true),
            (_, Ok(Some(command))) => Ok(command),
            (_, Err(error @ CommandError::Unknown(_))) => Err(format!("{error}; help lists them")),
            (_, Err(error)) => Err(error.to_string()),
        };
        let station = match who {
            Some(who) => self.stations().find(|station| station.device.is_called(who)),
            None => self.only(),
        };
        match (command, station) {
            (command, Some(station)) => {
                let answer = command.and_then(|command| station.carry_out(now, &command));
                station.answer(now, answer)?;
            }
            (Ok(Command::Status), None) if who.is_none() => {
                for station in self.stations() {
                    let status = station.status(now);
                    station.answer(now, Ok(status))?;
                }
            }
            (_, None) => {
                let known: Vec<String> = self.stations().map(|station| station.report.who()).collect();
                let known = known.join(", ");
                let error = match who {
                    Some(who) => format!("no device is {who}; there are {known}"),
                    None => format!("of which device? A line begins with its node-ID or name; there are {known}"),
                };
                self.event("error", &format!("error: {error}"), json!({ "text": error }))?;
            }
        }
        Ok(true)
    }

    pub(super) fn sum_up(&mut self, began: Instant) -> Result<(), Failure> {
        let now = self.participant.now();
        Ok(self.stations().try_for_each(|station| station.sum_up(now, began))?)
    }
}
