//! Serial adapters with the Lawicel protocol (slcan), and pseudo-terminals that act like one.
//!
//! It works on Linux, macOS and Windows, and needs only a serial port of the kernel. A peer on a pseudo-terminal may
//! answer no command: the link waits for answers for a short time, and works without them.

mod codec;
mod error;

use std::borrow::ToOwned;
use std::io::{self, Read, Write};
use std::string::String;
use std::vec::Vec;

#[cfg(windows)]
use serialport::COMPort as Port;
#[cfg(unix)]
use serialport::TTYPort as Port;
use serialport::{ClearBuffer, SerialPort};

pub use codec::{BIT_RATES, Decoder, Message, line};
pub use error::SlcanError;

use super::clock::{Clock, pause};
#[cfg(unix)]
use super::link::Descriptor;
use super::link::PATIENCE;
use super::{BusState, Incoming, Link, LinkError};
use crate::{Duration, Frame, Instant};

/// The default speed of the serial line, in bit/s. USB adapters accept any.
pub const BAUD: u32 = 115_200;

/// How long an adapter may take to answer a command.
const ANSWER: Duration = Duration::from_millis(200);

/// After this silence, an adapter that has answered has no more answers, and one that has not will not answer.
const QUIET: Duration = Duration::from_millis(50);

/// How often a link tries to open an adapter that is gone.
const LOOK: Duration = Duration::from_millis(250);

/// How often an adapter is asked for its state while its bus is not error active.
const INQUIRY: Duration = Duration::from_millis(500);

/// The settings of an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The bit rate of the CAN bus in bit/s, one of [`BIT_RATES`]; `None` leaves it to the adapter.
    pub bit_rate: Option<u32>,
    /// The speed of the serial line in bit/s; macOS needs 0 for a pseudo-terminal.
    pub baud: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { bit_rate: None, baud: BAUD }
    }
}

/// A [`Link`] through a serial adapter.
pub struct Slcan {
    path: String,
    settings: Settings,
    /// `None` while the adapter is gone.
    port: Option<Port>,
    /// The port as [`Link::descriptor`] returns it.
    #[cfg(unix)]
    descriptor: Option<Descriptor>,
    clock: Clock,
    decoder: Decoder,
    /// Bytes that were read and not yet decoded.
    input: Input,
    /// A frame that came while an answer was expected.
    early: Option<Frame>,
    /// The rest of a line that the port has not accepted yet: it must be completed before the next one.
    unsent: Vec<u8>,
    state: BusState,
    /// The state that [`Link::receive`] last reported.
    reported: BusState,
    /// When to try next to open the adapter, or to ask for its state.
    ask: Instant,
}

impl Slcan {
    /// Opens an adapter such as `/dev/ttyACM0` or `COM3`, sets its bit rate and opens its channel.
    pub fn open(path: &str, settings: Settings) -> Result<Self, SlcanError> {
        let mut link = Slcan {
            path: path.to_owned(),
            settings,
            port: None,
            #[cfg(unix)]
            descriptor: None,
            clock: Clock::new(),
            decoder: Decoder::default(),
            input: Input::EMPTY,
            early: None,
            unsent: Vec::new(),
            state: BusState::Active,
            reported: BusState::Active,
            ask: Instant::ZERO,
        };
        link.connect()?;
        Ok(link)
    }

    fn connect(&mut self) -> Result<(), SlcanError> {
        let speed = match self.settings.bit_rate {
            None => None,
            Some(rate) => match BIT_RATES.iter().position(|known| *known == rate) {
                Some(number) => Some(std::format!("S{number}")),
                None => return Err(SlcanError::BitRate(rate)),
            },
        };
        let port = serialport::new(&*self.path, self.settings.baud).dtr_on_open(true).open_native();
        let port = port.map_err(|error| SlcanError::refusal(&self.path, error))?;
        #[cfg(unix)]
        {
            let again = port.try_clone_native().map_err(|error| SlcanError::refusal(&self.path, error))?;
            self.descriptor = Some(std::sync::Arc::new(again));
        }
        self.port = Some(port);
        self.unsent.clear();
        self.input = Input::EMPTY;
        self.decoder.reset();
        let answers = self.synchronise().map_err(|error| SlcanError::Io { path: self.path.clone(), error })?;
        let patience = if answers { ANSWER } else { QUIET };
        for command in speed.as_deref().into_iter().chain(["O"]) {
            if self.command(command, patience)? == Some(Message::Refused) {
                return Err(SlcanError::Refused { path: self.path.clone(), command: command.to_owned() });
            }
        }
        Ok(())
    }

    /// Closes the channel, and drops all input until the adapter is silent, so that the next answer belongs to the next
    /// command. Returns whether the adapter answers.
    fn synchronise(&mut self) -> io::Result<bool> {
        if let Some(port) = &self.port {
            port.clear(ClearBuffer::Input)?;
        }
        // The empty lines end an incomplete command of an earlier user, as the CANUSB manual advises. An open channel
        // refuses to be set up, and a closed one refuses `C`.
        self.write(b"\r\r\rC\r")?;
        let begin = self.now();
        let (mut until, mut answers) = (begin + ANSWER, false);
        // Limited, since a peer may never be silent.
        while self.now() < begin + ANSWER + ANSWER
            && let Some(message) = self.message(until)?
        {
            answers |= matches!(message, Message::Done | Message::Refused);
            until = self.now() + QUIET;
        }
        Ok(answers)
    }

    /// Sends a command and waits for its answer. A frame shows that the channel is open, and also ends the wait.
    fn command(&mut self, command: &str, patience: Duration) -> Result<Option<Message>, SlcanError> {
        let failed = |path: &str, error| SlcanError::Io { path: path.to_owned(), error };
        self.write(std::format!("{command}\r").as_bytes()).map_err(|error| failed(&self.path, error))?;
        let until = self.now() + patience;
        loop {
            match self.message(until).map_err(|error| failed(&self.path, error))? {
                Some(answer @ (Message::Done | Message::Refused)) => return Ok(Some(answer)),
                Some(Message::Frame(frame)) => {
                    self.early = Some(frame);
                    return Ok(None);
                }
                Some(_) => {}
                None => return Ok(None),
            }
        }
    }

    /// The next message of the adapter, at the latest at `until`.
    fn message(&mut self, until: Instant) -> io::Result<Option<Message>> {
        self.message_at(self.now(), until)
    }

    fn message_at(&mut self, now: Instant, until: Instant) -> io::Result<Option<Message>> {
        let mut remaining = until.since(now);
        loop {
            while let Some(byte) = self.input.next() {
                if let Some(message) = self.decoder.take(byte) {
                    return Ok(Some(message));
                }
            }
            let Some(port) = &mut self.port else { return Err(io::ErrorKind::NotConnected.into()) };
            port.set_timeout(timeout(remaining))?;
            match port.read(&mut self.input.bytes) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(len) => self.input.fill(len),
                Err(error) if is_pause(&error) => {
                    self.input.fill(0);
                    if !remaining.is_zero() {
                        remaining = until.since(self.now());
                    }
                    if remaining.is_zero() {
                        return Ok(None);
                    }
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Writes a line, after the rest of the previous one.
    fn write(&mut self, line: &[u8]) -> io::Result<()> {
        self.write_within(PATIENCE, line)
    }

    fn write_within(&mut self, patience: Duration, line: &[u8]) -> io::Result<()> {
        self.flush_unsent(patience)?;
        self.unsent.extend_from_slice(line);
        match self.flush_unsent(patience) {
            // The line has begun, so it must be completed before the next one.
            Err(error) if is_pause(&error) && self.unsent.len() < line.len() => Ok(()),
            Err(error) => {
                self.unsent.clear();
                Err(error)
            }
            Ok(()) => Ok(()),
        }
    }

    fn flush_unsent(&mut self, patience: Duration) -> io::Result<()> {
        if self.unsent.is_empty() {
            return Ok(());
        }
        let (mut remaining, mut until) = (patience, None);
        loop {
            let Some(port) = &mut self.port else { return Err(io::ErrorKind::NotConnected.into()) };
            port.set_timeout(timeout(remaining))?;
            match port.write(&self.unsent) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(len) => drop(self.unsent.drain(..len)),
                Err(error) if is_pause(&error) && !remaining.is_zero() => {}
                Err(error) => return Err(error),
            }
            if self.unsent.is_empty() {
                return Ok(());
            }
            let now = self.clock.now();
            remaining = until.get_or_insert(now + patience).since(now);
        }
    }

    /// Closes the port of an adapter that is gone. The link will try to open it again.
    fn lose(&mut self) {
        self.port = None;
        #[cfg(unix)]
        {
            self.descriptor = None;
        }
        self.unsent.clear();
        self.state = BusState::Removed;
        self.ask = self.now() + LOOK;
    }

    /// Tries to open an adapter that is gone, or asks for the state of a bus that is not error active. Returns
    /// whether one of them was due.
    fn inquire(&mut self, now: Instant) -> bool {
        if self.state == BusState::Active || now < self.ask {
            return false;
        }
        if self.port.is_some() {
            self.ask_state();
        } else if self.connect().is_ok() {
            self.state = BusState::Active;
        } else {
            self.lose();
        }
        true
    }

    fn ask_state(&mut self) {
        self.ask = self.now() + INQUIRY;
        let asked = self.write(b"F\r");
        self.notice(asked);
    }

    /// An error of the port means that the adapter is gone, unless it is a time-out.
    fn notice(&mut self, outcome: io::Result<()>) {
        if outcome.is_err_and(|error| !is_pause(&error)) {
            self.lose();
        }
    }

    fn send_within(&mut self, patience: Duration, frame: &Frame) -> Result<(), LinkError> {
        if !self.state.carries_frames() {
            return Err(LinkError::NoBus(self.state));
        }
        let mut text = line(frame);
        text.push('\r');
        match self.write_within(patience, text.as_bytes()) {
            Ok(()) => Ok(()),
            Err(error) if is_pause(&error) => Err(LinkError::Full),
            Err(_) => {
                self.lose();
                Err(LinkError::NoBus(self.state))
            }
        }
    }

    fn handle(&mut self, message: Message) -> Option<Frame> {
        match message {
            Message::Frame(frame) => return Some(frame),
            Message::State(state) => self.state = state,
            // Something is wrong with the bus. The request for its state may be refused, too, so it is not repeated at
            // once.
            Message::Refused if self.state == BusState::Active && self.now() >= self.ask => self.ask_state(),
            Message::Refused | Message::Done | Message::Other => {}
        }
        None
    }
}

impl Link for Slcan {
    fn is_real_time(&self) -> bool {
        true
    }

    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.send_within(PATIENCE, frame)
    }

    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.send_within(Duration::ZERO, frame)
    }

    #[cfg(unix)]
    fn descriptor(&self) -> Option<Descriptor> {
        self.descriptor.clone()
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        self.receive_at(self.now(), until)
    }

    fn receive_at(&mut self, now: Instant, until: Instant) -> Result<Option<Incoming>, LinkError> {
        if let Some(frame) = self.early.take() {
            return Ok(Some(Incoming::Frame(frame)));
        }
        let mut now = now;
        loop {
            if self.inquire(now) {
                now = self.now();
            }
            // The rest of a line must not wait until the next frame is sent.
            let flushed = self.flush_unsent(Duration::ZERO);
            self.notice(flushed);
            if self.state != self.reported {
                self.reported = self.state;
                return Ok(Some(Incoming::State(self.state)));
            }
            let mut wake = if self.state == BusState::Active { until } else { until.min(self.ask) };
            if !self.unsent.is_empty() {
                wake = wake.min(now + Duration::from_millis(1));
            }
            if self.port.is_none() {
                pause(wake.since(now));
            } else {
                match self.message_at(now, wake) {
                    Ok(Some(message)) => match self.handle(message) {
                        Some(frame) => return Ok(Some(Incoming::Frame(frame))),
                        // The same read may have returned more bytes, which the descriptor does not report.
                        None => {
                            now = self.now();
                            continue;
                        }
                    },
                    Ok(None) => {}
                    Err(_) => self.lose(),
                }
            }
            if until > now {
                now = self.now();
            }
            if self.state == self.reported && until <= now {
                return Ok(None);
            }
        }
    }

    fn is_drained(&self) -> bool {
        self.early.is_none() && self.input.is_drained() && self.state == self.reported
    }
}

/// Closes the channel, so that the adapter no longer acknowledges frames.
impl Drop for Slcan {
    fn drop(&mut self) {
        // There is no caller to report an error to.
        let _ = self.write(b"C\r");
    }
}

/// The last bytes read.
struct Input {
    bytes: [u8; 256],
    next: usize,
    len: usize,
}

impl Input {
    const EMPTY: Input = Input { bytes: [0; 256], next: 0, len: 0 };

    fn fill(&mut self, len: usize) {
        self.next = 0;
        self.len = len;
    }

    fn next(&mut self) -> Option<u8> {
        let byte = *self.bytes.get(..self.len)?.get(self.next)?;
        self.next += 1;
        Some(byte)
    }

    /// Whether the last read has emptied the port, and all its bytes are decoded.
    fn is_drained(&self) -> bool {
        self.next == self.len && self.len < self.bytes.len()
    }
}

/// Windows counts in milliseconds, and takes zero for "no time-out" (`COMMTIMEOUTS`).
fn timeout(span: Duration) -> core::time::Duration {
    if cfg!(windows) { span.max(Duration::from_millis(1)).into() } else { span.into() }
}

fn is_pause(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::CobId;

    /// A link to a terminal, and the terminal's other end.
    fn link() -> (Slcan, Port, Port) {
        let (far, near) = Port::pair().unwrap();
        let link = Slcan::open(&near.name().unwrap(), Settings { bit_rate: None, baud: 0 }).unwrap();
        (link, far, near)
    }

    #[test]
    fn frames_read_with_an_acknowledgement_are_returned_at_once() {
        let (mut link, mut far, _near) = link();
        far.write_all(b"z\rt0801FF\rz\rt0801FE\r").unwrap();
        let frames = [0xFF, 0xFE].map(|byte| Frame::from_array(CobId::SYNC, [byte]));
        // A shell receives until nothing is returned, and then waits for the port.
        for frame in frames {
            let now = link.now();
            assert_eq!(link.receive(now).unwrap(), Some(Incoming::Frame(frame)));
        }
        let now = link.now();
        assert_eq!(link.receive(now).unwrap(), None);
    }
}
