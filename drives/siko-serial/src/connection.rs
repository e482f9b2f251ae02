//! The blocking shell: a client on a line.

use std::io;

use lexican_driver::Direction;
use lexican_runtime::object::{Parameter, Readable, Value, Writable};
use lexican_runtime::{Duration, Instant};

use crate::answer::Answer;
use crate::client::{Client, Event, NotTaken, Settings, Trouble};
use crate::command::Command;
use crate::error::ErrorNumber;
use crate::line::Line;
use crate::parameter::{self, Row};

/// Why a command has failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The line does not carry bytes.
    #[error("the serial line: {0}")]
    Line(#[from] io::Error),
    /// There is no answer.
    #[error("{0}")]
    Trouble(#[from] Trouble),
    /// The drive has refused it.
    #[error("the drive refuses: {0}")]
    Refused(ErrorNumber),
    /// The number has too many digits for the telegram; nothing has been sent.
    #[error("the number has too many digits")]
    TooManyDigits,
    /// The value is outside the limits of the data sheet, or the port has no number for it; nothing has been sent.
    #[error("{0}: the port has no number for this value")]
    NoNumber(&'static str),
    /// The drive has answered with a number that means no value of the parameter.
    #[error("{0}: the drive answers with a number that means nothing")]
    NoValue(&'static str),
    /// The number stands for another parameter in this operating mode.
    #[error("{0}: not in this operating mode")]
    Elsewhere(&'static str),
}

impl Error {
    /// What [`Client::request`] does not take; the shells abandon what is under way first.
    pub(crate) fn of(_: NotTaken) -> Self {
        Error::TooManyDigits
    }

    /// What becomes of a command.
    pub(crate) fn outcome(event: Event) -> Result<Answer, Error> {
        match event {
            Event::Answered(answer) => answer.accepted().map_err(Error::Refused),
            Event::Sent => Ok(Answer::Done),
            Event::Failed(trouble) => Err(trouble.into()),
        }
    }
}

/// A drive at the other end of a line. Every method blocks until it is over.
///
/// A connection that is dropped sends nothing: a travel goes on, and inching operation 2 ends, because its character is
/// not repeated.
#[derive(Debug)]
pub struct Connection<L> {
    line: L,
    client: Client,
}

impl<L: Line> Connection<L> {
    /// A drive at the other end of `line`. It is asked for its status before the first command.
    pub fn new(line: L, settings: Settings) -> Self {
        Connection { line, client: Client::new(settings) }
    }

    /// The line.
    pub fn line(&mut self) -> &mut L {
        &mut self.line
    }

    /// Sends a command and returns its answer; [`Answer::Done`] also for one that is not answered.
    ///
    /// # Errors
    ///
    /// The drive refuses it, or there is trouble: then it is not known whether the drive has carried it out, and reading
    /// again is safe, ordering again may not be.
    pub fn request(&mut self, command: Command) -> Result<Answer, Error> {
        self.client.abandon();
        self.client.request(command).map_err(Error::of)?;
        loop {
            if let Some(event) = self.turn(Instant::MAX)? {
                return Error::outcome(event);
            }
        }
    }

    /// Sends a command whose answer is a number, and returns that.
    ///
    /// # Errors
    ///
    /// As [`Connection::request`]; a command whose answer is none has [`Trouble::Garbled`].
    pub fn number(&mut self, command: Command) -> Result<i32, Error> {
        self.request(command)?.number().ok_or(Error::Trouble(Trouble::Garbled))
    }

    /// Reads a parameter, one of [`siko_ag02::od::serial`], as the type that its object has.
    ///
    /// # Errors
    ///
    /// As [`Connection::request`]; [`Error::Elsewhere`] of a setpoint in the other operating mode, and [`Error::NoValue`].
    pub fn read<T: Value, A: Readable>(&mut self, parameter: Parameter<T, A, &'static str>) -> Result<T, Error> {
        let row = parameter.row();
        self.require(&row)?;
        let number = self.number_of(&row)?;
        parameter.decode(number).ok_or(Error::NoValue(row.name))
    }

    /// Writes a parameter.
    ///
    /// # Errors
    ///
    /// As [`Connection::request`]; [`Error::Elsewhere`] of a setpoint in the other operating mode, and
    /// [`Error::NoNumber`].
    pub fn write<T: Value, A: Writable>(
        &mut self,
        parameter: Parameter<T, A, &'static str>,
        value: T,
    ) -> Result<(), Error> {
        let row = parameter.row();
        let command = parameter.encode(value).and_then(|number| parameter::writing(&row, number));
        let command = command.ok_or(Error::NoNumber(row.name))?;
        self.require(&row)?;
        self.request(command).map(|_| ())
    }

    /// Asks whether the number stands for this parameter now.
    fn require(&mut self, row: &Row) -> Result<(), Error> {
        let Some((decides, holds)) = parameter::decided_by(row) else { return Ok(()) };
        let number = self.number_of(decides)?;
        holds(number).then_some(()).ok_or(Error::Elsewhere(row.name))
    }

    fn number_of(&mut self, row: &Row) -> Result<i64, Error> {
        let command = parameter::reading(row).ok_or(Error::NoValue(row.name))?;
        let answer = self.request(command)?;
        parameter::answered(row, answer).ok_or(Error::Trouble(Trouble::Garbled))
    }

    /// The system status word (table 1), with the bits of [`siko::words::system`].
    ///
    /// # Errors
    ///
    /// As [`Connection::request`].
    pub fn status(&mut self) -> Result<u16, Error> {
        match self.request(Command::Status)? {
            Answer::Status(word) => Ok(word),
            _ => Err(Error::Trouble(Trouble::Garbled)),
        }
    }

    /// Asks for the status every 20 ms until it is as `wanted`, and returns it; none when it is not so within `span`.
    ///
    /// # Errors
    ///
    /// As [`Connection::request`].
    pub fn await_status(&mut self, span: Duration, wanted: impl Fn(u16) -> bool) -> Result<Option<u16>, Error> {
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

    /// Moves by inching operation 2 until [`Connection::stop_inching`], as long as methods of the connection are called:
    /// its character is sent by all that wait. The drive does not answer it, so its status shows whether it moves.
    pub fn start_inching(&mut self, direction: Direction) {
        self.client.start_inching(self.line.now(), direction);
    }

    /// Ends inching operation 2: the drive stops within 100 ms.
    pub fn stop_inching(&mut self) {
        self.client.stop_inching();
    }

    /// Waits, and goes on inching.
    ///
    /// # Errors
    ///
    /// The line fails, or the drive, before inching begins, does not answer.
    pub fn wait(&mut self, span: Duration) -> Result<(), Error> {
        let until = self.line.now() + span;
        while self.line.now() < until {
            if let Some(Event::Failed(trouble)) = self.turn(until)? {
                return Err(trouble.into());
            }
        }
        Ok(())
    }

    /// Sends what is to be sent, and waits for bytes or a deadline.
    fn turn(&mut self, until: Instant) -> Result<Option<Event>, Error> {
        while let Some(telegram) = self.client.poll_transmit(self.line.now()) {
            self.line.send(telegram.as_bytes())?;
        }
        let until = self.client.poll_timeout().unwrap_or(Instant::MAX).min(until);
        let mut buffer = [0; 64];
        let len = self.line.receive(until, &mut buffer)?;
        let now = self.line.now();
        let event = self.client.handle_bytes(now, buffer.get(..len).unwrap_or_default());
        Ok(event.or_else(|| self.client.handle_timeout(now)))
    }
}
