//! A simulated drive at the end of a line, and the client at the other.
#![allow(dead_code, reason = "not every test needs all of it")]

mod connection;

use lexican_runtime::Duration;
use siko_ag02::sim::inputs::Inputs;
use siko_serial::Settings;
use siko_serial::answer::Answer;
use siko_serial::command::Command;
use siko_serial::error::ErrorNumber;
use siko_serial::sim::{SerialDrive, VirtualLine};

pub(crate) use connection::{Connection, Error};

pub(crate) struct Bench {
    pub(crate) drive: Connection<VirtualLine>,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Bench::with(SerialDrive::default(), Settings::default())
    }

    pub(crate) fn with(drive: SerialDrive, settings: Settings) -> Self {
        Bench { drive: Connection::new(VirtualLine::with_settings(drive, settings), settings) }
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
