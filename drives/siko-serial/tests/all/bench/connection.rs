//! A program at the other end of a line from the drive: one command after the other, each until its answer.

use std::io;

use lexican_driver::Direction;
use lexican_runtime::{Duration, Instant};
use siko_serial::answer::Answer;
use siko_serial::client::{Client, Event, Trouble};
use siko_serial::command::Command;
use siko_serial::error::ErrorNumber;
use siko_serial::{Line, Settings};

/// Why a command has failed.
#[derive(Debug)]
pub(crate) enum Error {
    Line(io::Error),
    Trouble(Trouble),
    Refused(ErrorNumber),
}

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
