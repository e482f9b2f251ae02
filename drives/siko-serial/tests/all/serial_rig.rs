//! A simulated drive at one end of a line, and the client at the other.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::cmp::Ordering;
use std::io;

use lexican_driver::Direction;
use lexican_runtime::host::Node;
use lexican_runtime::{CobId, Duration, Frame, Instant};
use siko_ag02::sim::inputs::{Inputs, Shaft};
use siko_serial::answer::Answer;
use siko_serial::client::{Client, Event, Trouble};
use siko_serial::command::Command;
use siko_serial::error::ErrorNumber;
use siko_serial::sim::{SerialDrive, VirtualLine};
use siko_serial::{Line, Settings};

pub(crate) struct Rig {
    pub(crate) drive: Connection<VirtualLine>,
}

impl Rig {
    pub(crate) fn new() -> Self {
        Rig::with(SerialDrive::default(), Settings::default())
    }

    pub(crate) fn with(drive: SerialDrive, settings: Settings) -> Self {
        Rig { drive: Connection::new(VirtualLine::with_settings(drive, settings), settings) }
    }

    #[track_caller]
    pub(crate) fn done(&mut self, command: Command) {
        assert_eq!(self.drive.request(command).unwrap(), Answer::Done, "{command:?}");
    }

    #[track_caller]
    pub(crate) fn refuses(&mut self, command: Command, number: ErrorNumber) {
        match self.drive.request(command) {
            Err(Error::Refused(refused)) => assert_eq!(refused, number, "{command:?}"),
            other => panic!("{command:?}: {other:?}"),
        }
    }

    #[track_caller]
    pub(crate) fn number(&mut self, command: Command) -> i32 {
        self.drive.number(command).unwrap()
    }

    /// The letters that answer `J1`.
    #[track_caller]
    pub(crate) fn request(&mut self, command: Command) -> [u8; 10] {
        match self.drive.request(command).unwrap() {
            Answer::Letters(letters) => letters,
            other => panic!("{other:?}"),
        }
    }

    #[track_caller]
    pub(crate) fn is(&mut self, pattern: &str) -> bool {
        is(self.drive.status().unwrap(), pattern)
    }

    /// Carries out a script, whose steps are separated by semicolons. A telegram must be carried out or, as in `M?08`,
    /// refused with that error. `Z=100`, `Z>100` and `Z<100` compare the number in the answer, `J1:E---------` its
    /// letters. The other words are below.
    #[track_caller]
    pub(crate) fn plays(&mut self, script: &str) {
        for step in script.split(';').map(str::trim).filter(|step| !step.is_empty()) {
            match step.split_whitespace().collect::<Vec<_>>().as_slice() {
                ["shows", status @ ..] => assert!(self.is(&pattern(status)), "{step} in {script}"),
                ["comes-to", status @ ..] => self.reaches(&pattern(status)),
                ["wait", ms] => self.pass(Duration::from_millis(ms.parse().unwrap())),
                ["inch", "up"] => self.drive.start_inching(Direction::Positive),
                ["inch", "down"] => self.drive.start_inching(Direction::Negative),
                ["inch", "no-more"] => self.drive.stop_inching(),
                ["sensor", how] => self.world(|inputs| inputs.sensor_fails = *how == "fails"),
                ["shaft", how] => {
                    self.world(|inputs| inputs.shaft = if *how == "blocked" { Shaft::Blocked } else { Shaft::Free });
                }
                ["enable", how] => self.world(|inputs| inputs.enable = *how == "on"),
                ["switch", number] => {
                    let at = number.parse::<usize>().unwrap() - 1;
                    self.world(|inputs| inputs.limit_switches[at] = true);
                }
                ["attainable", rpm] => self.world(|inputs| inputs.attainable_rpm = Some(rpm.parse().unwrap())),
                ["nmt", command] => self.nmt(u8::from_str_radix(command, 16).unwrap()),
                [telegram] => self.exchanges(telegram),
                _ => panic!("there is no step {step:?}"),
            }
        }
    }

    /// A telegram and its answer.
    #[track_caller]
    fn exchanges(&mut self, text: &str) {
        let at = text.find(['?', '=', '<', '>', ':']).unwrap_or(text.len());
        let (telegram, expected) = text.split_at(at);
        let command = Command::parse(telegram.as_bytes()).unwrap();
        let Some((sign, expected)) = expected.split_at_checked(1) else { return self.done(command) };
        let number: Option<i32> = expected.parse().ok();
        match sign {
            "?" => self.refuses(command, ErrorNumber::new(number.unwrap() as u8).unwrap()),
            ":" => assert_eq!(self.request(command), expected.as_bytes(), "{text}"),
            _ => {
                let found = self.number(command);
                let order = if sign == "<" {
                    Ordering::Less
                } else if sign == ">" {
                    Ordering::Greater
                } else {
                    Ordering::Equal
                };
                assert_eq!(found.cmp(&number.unwrap()), order, "{text}: {found}");
            }
        }
    }

    /// Sends the drive a frame over its bus.
    pub(crate) fn frame(&mut self, id: CobId, data: &[u8]) {
        self.drive.line().with_drive(|drive, now| {
            let drive = drive.drive_mut();
            while drive.poll_transmit(now).is_some() {}
            drive.handle_frame(now, &Frame::new(id, data).unwrap());
        });
    }

    fn nmt(&mut self, command: u8) {
        self.frame(CobId::NMT, &[command, 0]);
    }

    /// Waits until a status matches a pattern of a flow chart.
    #[track_caller]
    pub(crate) fn reaches(&mut self, pattern: &str) {
        let reached = self.drive.await_status(Duration::from_secs(60), |word| is(word, pattern)).unwrap();
        let word = self.drive.status().unwrap();
        assert!(reached.is_some(), "{word:016b} instead of {pattern}");
    }

    pub(crate) fn pass(&mut self, span: Duration) {
        self.drive.wait(span).unwrap();
    }

    /// The true position of the drive.
    pub(crate) fn position(&mut self) -> i32 {
        self.drive.line().with_drive(|drive, now| drive.drive().position(now))
    }

    pub(crate) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        self.drive.line().with_drive(|drive, now| drive.drive_mut().set_inputs(now, change));
    }
}

/// Resolves a box of figures 4 and 6 by name; returns a pattern as it is.
fn pattern(words: &[&str]) -> String {
    match words {
        ["travelling"] => "x1xx 10x0 0001 0000",
        ["interrupted"] => "x10x 00x0 0000 0000",
        ["arrived"] => "000x 0000 0000 1000",
        ["over"] => "000x 0000 0000 x000",
        ["inching"] => "x0xx 1000 0001 0000",
        ["fault"] => "xxxx xxx1 1xxx xxxx",
        ["turning"] => "00xx 1000 0001 1000",
        ["standing"] => "00xx 0000 x000 x000",
        ["released"] => "xxxx xxxx 1xxx xxxx",
        ["controlled"] => "xxxx xxxx 0xxx xxxx",
        _ => return words.concat(),
    }
    .to_owned()
}

/// Whether a word matches a pattern of 0, 1 and x.
pub(crate) fn is(word: u16, pattern: &str) -> bool {
    let digits: Vec<char> = pattern.chars().filter(|digit| !digit.is_whitespace()).collect();
    assert_eq!(digits.len(), 16);
    digits.iter().rev().enumerate().all(|(bit, digit)| *digit == 'x' || (*digit == '1') == (word >> bit & 1 == 1))
}

/// Why a command has failed.
#[derive(Debug)]
pub(crate) enum Error {
    Line(io::Error),
    Trouble(Trouble),
    Refused(ErrorNumber),
}

/// A program that sends commands one by one, each after the answer to the previous one.
pub(crate) struct Connection<L> {
    line: L,
    client: Client,
}

impl<L: Line> Connection<L> {
    pub(crate) fn new(line: L, settings: Settings) -> Self {
        Connection { line, client: Client::new(settings) }
    }

    pub(crate) fn line(&mut self) -> &mut L {
        &mut self.line
    }

    pub(crate) fn request(&mut self, command: Command) -> Result<Answer, Error> {
        self.client.abandon();
        self.client.request(command).unwrap();
        loop {
            match self.turn(Instant::MAX)? {
                None => {}
                Some(Event::Answered(answer)) => return answer.accepted().map_err(Error::Refused),
                Some(Event::Sent) => return Ok(Answer::Done),
                Some(Event::Failed(trouble)) => return Err(Error::Trouble(trouble)),
            }
        }
    }

    pub(crate) fn number(&mut self, command: Command) -> Result<i32, Error> {
        self.request(command)?.number().ok_or(Error::Trouble(Trouble::Garbled))
    }

    pub(crate) fn status(&mut self) -> Result<u16, Error> {
        match self.request(Command::Status)? {
            Answer::Status(word) => Ok(word),
            _ => Err(Error::Trouble(Trouble::Garbled)),
        }
    }

    /// Reads the status every 20 ms until it is as `wanted`; `None` if that does not happen within `span`.
    pub(crate) fn await_status(&mut self, span: Duration, wanted: impl Fn(u16) -> bool) -> Result<Option<u16>, Error> {
        let until = self.line.now() + span;
        loop {
            let word = self.status()?;
            if wanted(word) {
                return Ok(Some(word));
            }
            if self.line.now() >= until {
                return Ok(None);
            }
            self.wait(Duration::from_millis(20))?;
        }
    }

    pub(crate) fn start_inching(&mut self, direction: Direction) {
        self.client.start_inching(self.line.now(), direction);
    }

    pub(crate) fn stop_inching(&mut self) {
        self.client.stop_inching();
    }

    /// Waits, while inching goes on.
    pub(crate) fn wait(&mut self, span: Duration) -> Result<(), Error> {
        let until = self.line.now() + span;
        while self.line.now() < until {
            if let Some(Event::Failed(trouble)) = self.turn(until)? {
                return Err(Error::Trouble(trouble));
            }
        }
        Ok(())
    }

    /// Sends all that is due, and waits for bytes or a deadline.
    fn turn(&mut self, until: Instant) -> Result<Option<Event>, Error> {
        while let Some(telegram) = self.client.poll_transmit(self.line.now()) {
            self.line.send(telegram.as_bytes()).map_err(Error::Line)?;
        }
        let until = self.client.poll_timeout().unwrap_or(Instant::MAX).min(until);
        let mut buffer = [0; 64];
        let len = self.line.receive(until, &mut buffer).map_err(Error::Line)?;
        let now = self.line.now();
        let event = self.client.handle_bytes(now, &buffer[..len]);
        Ok(event.or_else(|| self.client.handle_timeout(now)))
    }
}
