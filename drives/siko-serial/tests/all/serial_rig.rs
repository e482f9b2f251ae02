//! A simulated drive at the end of a line, and the client at the other.
#![allow(dead_code, reason = "not every test needs all of it")]

use std::io;

use lexican_driver::Direction;
use lexican_runtime::{Duration, Instant};
use siko_ag02::sim::inputs::Inputs;
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

    /// Waits for a pattern of a flow chart.
    #[track_caller]
    pub(crate) fn reaches(&mut self, pattern: &str) {
        let reached = self.drive.await_status(Duration::from_secs(60), |word| is(word, pattern)).unwrap();
        let word = self.drive.status().unwrap();
        assert!(reached.is_some(), "{word:016b} instead of {pattern}");
    }

    pub(crate) fn pass(&mut self, span: Duration) {
        self.drive.wait(span).unwrap();
    }

    /// Where the drive is, without asking it.
    pub(crate) fn position(&mut self) -> i32 {
        self.drive.line().with_drive(|drive, now| drive.drive().position(now))
    }

    pub(crate) fn world(&mut self, change: impl FnOnce(&mut Inputs)) {
        self.drive.line().with_drive(|drive, now| drive.drive_mut().set_inputs(now, change));
    }
}

/// Whether a word is as a pattern of 0, 1 and x.
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

/// A program that sends one command after the other, each until its answer.
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

    /// Asks for the status every 20 ms until it is as `wanted`; none when it is not so within `span`.
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

    /// Waits, and goes on inching.
    pub(crate) fn wait(&mut self, span: Duration) -> Result<(), Error> {
        let until = self.line.now() + span;
        while self.line.now() < until {
            if let Some(Event::Failed(trouble)) = self.turn(until)? {
                return Err(Error::Trouble(trouble));
            }
        }
        Ok(())
    }

    /// Sends what is to be sent, and waits for bytes or a deadline.
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
