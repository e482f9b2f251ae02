//! The shell for tokio: a client on anything that reads and writes, such as a `tokio_serial::SerialStream`.

use lexican_driver::Direction;
use lexican_runtime::object::{Parameter, Readable, Value, Writable};
use lexican_runtime::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

use crate::answer::Answer;
use crate::client::{Client, Event, Settings, Trouble};
use crate::command::Command;
use crate::connection::Error;
use crate::parameter::{self, Row};

/// A drive at the other end of a line.
///
/// A future that is dropped leaves its command to its fate: the next one asks for the status first.
#[derive(Debug)]
pub struct Connection<S> {
    stream: S,
    client: Client,
    origin: tokio::time::Instant,
}

impl<S: AsyncRead + AsyncWrite + Unpin> Connection<S> {
    /// A drive at the other end of `stream`. It is asked for its status before the first command.
    pub fn new(stream: S, settings: Settings) -> Self {
        Connection { stream, client: Client::new(settings), origin: tokio::time::Instant::now() }
    }

    /// Sends a command and returns its answer; [`Answer::Done`] also for one that is not answered.
    ///
    /// # Errors
    ///
    /// As of the blocking [`Connection`](crate::Connection::request).
    pub async fn request(&mut self, command: Command) -> Result<Answer, Error> {
        self.client.abandon();
        self.client.request(command).map_err(Error::of)?;
        loop {
            if let Some(event) = self.turn(Instant::MAX).await? {
                return Error::outcome(event);
            }
        }
    }

    /// Reads a parameter, one of [`siko_ag02::od::serial`], as the type that its object has.
    ///
    /// # Errors
    ///
    /// As of the blocking [`Connection`](crate::Connection::read).
    pub async fn read<T: Value, A: Readable>(&mut self, parameter: Parameter<T, A, &'static str>) -> Result<T, Error> {
        let row = parameter.row();
        self.require(&row).await?;
        let number = self.number_of(&row).await?;
        parameter.decode(number).ok_or(Error::NoValue(row.name))
    }

    /// Writes a parameter.
    ///
    /// # Errors
    ///
    /// As of the blocking [`Connection`](crate::Connection::write).
    pub async fn write<T: Value, A: Writable>(
        &mut self,
        parameter: Parameter<T, A, &'static str>,
        value: T,
    ) -> Result<(), Error> {
        let row = parameter.row();
        let command = parameter.encode(value).and_then(|number| parameter::writing(&row, number));
        let command = command.ok_or(Error::NoNumber(row.name))?;
        self.require(&row).await?;
        self.request(command).await.map(|_| ())
    }

    /// Asks whether the number stands for this parameter now.
    async fn require(&mut self, row: &Row) -> Result<(), Error> {
        let Some((decides, holds)) = parameter::decided_by(row) else { return Ok(()) };
        let number = self.number_of(decides).await?;
        holds(number).then_some(()).ok_or(Error::Elsewhere(row.name))
    }

    async fn number_of(&mut self, row: &Row) -> Result<i64, Error> {
        let command = parameter::reading(row).ok_or(Error::NoValue(row.name))?;
        let answer = self.request(command).await?;
        parameter::answered(row, answer).ok_or(Error::Trouble(Trouble::Garbled))
    }

    /// Moves by inching operation 2 until [`Connection::stop_inching`], as long as futures of the connection are polled.
    pub fn start_inching(&mut self, direction: Direction) {
        self.client.start_inching(self.now(), direction);
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
    pub async fn wait(&mut self, span: Duration) -> Result<(), Error> {
        let until = self.now() + span;
        while self.now() < until {
            if let Some(Event::Failed(trouble)) = self.turn(until).await? {
                return Err(trouble.into());
            }
        }
        Ok(())
    }

    fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed().into()
    }

    async fn turn(&mut self, until: Instant) -> Result<Option<Event>, Error> {
        while let Some(telegram) = self.client.poll_transmit(self.now()) {
            self.stream.write_all(telegram.as_bytes()).await?;
            self.stream.flush().await?;
        }
        let until = self.client.poll_timeout().unwrap_or(Instant::MAX).min(until);
        let mut buffer = [0; 64];
        let span = until.since(self.now());
        let event = match tokio::time::timeout(span.into(), self.stream.read(&mut buffer)).await {
            Err(_) => None,
            Ok(Ok(0)) => return Err(std::io::Error::from(std::io::ErrorKind::UnexpectedEof).into()),
            Ok(len) => self.client.handle_bytes(self.now(), buffer.get(..len?).unwrap_or_default()),
        };
        let now = self.now();
        Ok(event.or_else(|| self.client.handle_timeout(now)))
    }
}
