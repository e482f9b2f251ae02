//! The computer's side of a line: one command at a time, its answer, and recovery after trouble.
//!
//! Telegrams have no start mark and no checksum, commands have no end mark, and the manual names no time after which
//! the drive drops an incomplete command. So after any trouble, and before the first command, the client does not know
//! the state of the drive: it may wait for the rest of a command, or a late answer may be on its way. The client then
//! sends `R`, the status, and listens for as long as an answer can take. A drive that waits for digits refuses the
//! letter, so that no unintended command results. Once exactly the answer to one `R` has come, the next command is
//! sent. The longest command has ten bytes, so after [`PROBES`] attempts there is no drive.
//!
//! A damaged answer can be noticed, but not a digit that noise has turned into another digit, nor a damaged command:
//! where that matters, read a set-point back (`E0`) before `M`.

use lexican_driver::Direction;
use lexican_runtime::{Duration, Instant};

use crate::answer::{Answer, Reading, Reply};
use crate::command::Command;
use crate::telegram::Telegram;

/// How often the status is requested before the drive counts as silent: once for each byte of the longest command, and
/// once more.
pub const PROBES: u8 = 11;

/// The period of the character of inching operation 2. The drive stops after 100 ms without one.
pub const INCHING_PERIOD: Duration = Duration::from_millis(50);

/// Properties of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Bits per second. A byte takes ten: start bit, eight data bits, stop bit.
    pub baud: u32,
    /// The longest time until the drive begins to answer, including the delays of the adapter. The manual gives no
    /// number.
    pub reaction: Duration,
    /// Whether sent bytes are received again, as by a two-wire RS-485 adapter whose receiver stays on.
    pub echo: bool,
}

/// 9600 baud (chapter 6), 200 ms, no echo.
impl Default for Settings {
    fn default() -> Self {
        Settings { baud: 9600, reaction: Duration::from_millis(200), echo: false }
    }
}

impl Settings {
    /// How long this many bytes take.
    #[must_use]
    pub fn on_line(&self, bytes: usize) -> Duration {
        Duration::from_micros(bytes as u64 * 10_000_000 / u64::from(self.baud.max(1)))
    }

    /// The longest time from the first byte of a command to the end of its answer, if there is one.
    #[must_use]
    pub fn exchange(&self, command: usize, reply: Reply) -> Duration {
        if reply.is_empty() {
            return self.on_line(command);
        }
        // A refusal may be longer than the answer.
        self.on_line(command + reply.len().max(Reply::REFUSAL)) + self.reaction
    }
}

/// The outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The drive has answered.
    Answered(Answer),
    /// A command without an answer has been sent.
    Sent,
    /// There is no trustworthy answer.
    Failed(Trouble),
}

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// The answer is missing or incomplete. Whether the drive has carried the command out is not known.
    #[error("the drive has not answered in time")]
    TimedOut,
    /// Something else has come. Whether the drive has carried the command out is not known.
    #[error("the answer is damaged")]
    Garbled,
    /// The drive does not answer at all. The command has not been sent.
    #[error("no drive answers: is the line plugged in, is its baud rate 9600, and is the enable input active?")]
    Silent,
}

/// Why a command is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotTaken {
    /// Another one is under way.
    #[error("another command is under way")]
    Busy,
    /// Its number has too many digits for its telegram.
    #[error("the number has too many digits")]
    TooManyDigits,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Idle,
    /// A command is to be sent, or waits for its answer.
    Asking {
        until: Option<Instant>,
    },
    /// The status is to be requested, or its answer is awaited, before the command is sent.
    Probing {
        left: u8,
        until: Option<Instant>,
    },
    /// A refusal came, or any answer while the command was still being sent. It may answer a part of the command only,
    /// and then answers to the other parts follow.
    Holding {
        answer: Answer,
        until: Instant,
    },
    /// Something other than an answer came: waits until the line is quiet, or until the time for the answer is over.
    Discarding {
        quiet: Instant,
        until: Instant,
    },
}

/// The client, without I/O: bytes and times go in, bytes and events come out.
#[derive(Clone, Debug)]
pub struct Client {
    settings: Settings,
    state: State,
    /// The command under way.
    command: Command,
    telegram: Telegram,
    /// How many sent bytes are still to be echoed.
    echo: usize,
    /// The answer so far; when it is too long, only its beginning.
    input: Telegram,
    /// Until when the command itself is being sent: it cannot be answered before.
    sending: Instant,
    synchronised: bool,
    /// Inching operation 2, and when its next character is due.
    inching: Option<(Direction, Instant)>,
    /// Whether that character is under way.
    inches: bool,
}

impl Client {
    /// A client of a line.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Client {
            settings,
            state: State::Idle,
            command: Command::Status,
            telegram: Telegram::default(),
            echo: 0,
            input: Telegram::default(),
            sending: Instant::ZERO,
            synchronised: false,
            inching: None,
            inches: false,
        }
    }

    /// The properties of its line.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Takes a command, which [`Client::poll_transmit`] sends. One event follows.
    ///
    /// Errors: another one is under way, or its number is too long.
    pub fn request(&mut self, command: Command) -> Result<(), NotTaken> {
        if self.is_busy() {
            return Err(NotTaken::Busy);
        }
        let telegram = command.encode().ok_or(NotTaken::TooManyDigits)?;
        self.begin(command, telegram);
        Ok(())
    }

    /// Whether a command is under way, or a character of inching.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        !matches!(self.state, State::Idle)
    }

    /// Drops the command under way. Its answer may still come, so the status is requested before the next command,
    /// except after a character of inching, which has no answer.
    pub fn abandon(&mut self) {
        if self.is_busy() {
            self.state = State::Idle;
            self.synchronised &= self.inches;
        }
    }

    /// Moves by inching operation 2 from `now` on, until [`Client::stop_inching`]: its character is sent periodically
    /// between the commands. A command that is not answered therefore ends the motion, as any trouble does.
    pub fn start_inching(&mut self, now: Instant, direction: Direction) {
        self.inching = Some((direction, now));
    }

    /// Stops sending the character, so that the drive stops within 100 ms.
    pub fn stop_inching(&mut self) {
        self.inching = None;
    }

    /// Whether inching operation 2 is commanded.
    #[must_use]
    pub fn is_inching(&self) -> bool {
        self.inching.is_some()
    }

    /// The next bytes to send.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Telegram> {
        if let (State::Idle, Some((direction, due))) = (self.state, self.inching)
            && due <= now
        {
            let character = Command::Inch(direction);
            self.inching = Some((direction, now + INCHING_PERIOD));
            self.begin(character, character.encode()?);
            self.inches = true;
        }
        match self.state {
            State::Asking { until: None } => {
                let until = now + self.settings.exchange(self.telegram.as_bytes().len(), self.command.reply());
                self.state = State::Asking { until: Some(until) };
                Some(self.send(now, self.telegram))
            }
            State::Probing { left, until: None } => {
                let until = now + self.settings.exchange(1, Reply::Status);
                self.state = State::Probing { left, until: Some(until) };
                Some(self.send(now, Command::Status.encode()?))
            }
            _ => None,
        }
    }

    /// Takes bytes of the drive.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Option<Event> {
        // A command has one event; bytes after it do not belong to its answer.
        bytes.iter().fold(None, |event, byte| {
            let next = self.handle_byte(now, *byte);
            event.or(next)
        })
    }

    fn handle_byte(&mut self, now: Instant, byte: u8) -> Option<Event> {
        match self.state {
            // The manual contradicts itself about a CR after the answer to `W`.
            State::Idle if byte != b'\r' => self.synchronised = false,
            State::Idle | State::Asking { until: None } | State::Probing { until: None, .. } => {}
            State::Holding { until, .. } | State::Discarding { until, .. } => self.discard(now, until),
            State::Probing { .. } => {
                if !self.is_echo(byte) {
                    self.input = self.input.push(&[byte]);
                }
            }
            State::Asking { until: Some(until) } => {
                if self.is_echo(byte) {
                    return None;
                }
                let begins = self.input.as_bytes().is_empty();
                self.input = self.input.push(&[byte]);
                let reply = self.command.reply();
                match reply.read(self.input.as_bytes()) {
                    Reading::Begun => {}
                    Reading::Whole(answer) if now < self.sending || matches!(answer, Answer::Refused(_)) => {
                        self.state = State::Holding { answer, until: now.max(self.sending) + self.settings.on_line(2) };
                    }
                    Reading::Whole(answer) => return self.end(Event::Answered(answer)),
                    Reading::Foreign if begins && byte == b'\r' => self.input.clear(),
                    Reading::Foreign => self.discard(now, until),
                }
            }
        }
        None
    }

    /// To call once the time of [`Client::poll_timeout`] has come.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        match self.state {
            State::Asking { until: Some(until) } if until <= now => {
                if self.command.reply().is_empty() {
                    // A restarting drive does not listen.
                    self.synchronised = self.command != Command::Restart;
                    return self.end(Event::Sent);
                }
                self.end(Event::Failed(Trouble::TimedOut))
            }
            State::Probing { left, until: Some(until) } if until <= now => {
                let reading = Reply::Status.read(self.input.as_bytes());
                self.synchronised = matches!(reading, Reading::Whole(Answer::Status(_)));
                self.state = match left {
                    _ if self.synchronised => State::Asking { until: None },
                    0 => return self.end(Event::Failed(Trouble::Silent)),
                    _ => State::Probing { left: left - 1, until: None },
                };
                None
            }
            State::Holding { answer, until } if until <= now => self.end(Event::Answered(answer)),
            State::Discarding { quiet, until } if quiet.min(until) <= now => self.end(Event::Failed(Trouble::Garbled)),
            _ => None,
        }
    }

    /// When to call [`Client::handle_timeout`], or to send the next character of inching operation 2.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        match self.state {
            State::Idle => self.inching.map(|(_, due)| due),
            State::Asking { until } | State::Probing { until, .. } => until,
            State::Holding { until, .. } => Some(until),
            State::Discarding { quiet, until } => Some(quiet.min(until)),
        }
    }

    fn begin(&mut self, command: Command, telegram: Telegram) {
        (self.command, self.telegram, self.inches) = (command, telegram, false);
        self.state = match self.synchronised {
            true => State::Asking { until: None },
            false => State::Probing { left: PROBES - 1, until: None },
        };
    }

    fn send(&mut self, now: Instant, telegram: Telegram) -> Telegram {
        self.input.clear();
        // One byte less, to allow for clock tolerance.
        self.sending = now + self.settings.on_line(telegram.as_bytes().len().saturating_sub(1));
        self.echo = if self.settings.echo { telegram.as_bytes().len() } else { 0 };
        telegram
    }

    /// Whether a byte is the next one of the echo.
    fn is_echo(&mut self, byte: u8) -> bool {
        let probe = [b'R'];
        let sent = if matches!(self.state, State::Probing { .. }) { &probe[..] } else { self.telegram.as_bytes() };
        let returns = sent.len().checked_sub(self.echo).and_then(|at| sent.get(at)) == Some(&byte);
        self.echo -= usize::from(returns);
        returns
    }

    /// Something other than the answer has come.
    fn discard(&mut self, now: Instant, until: Instant) {
        self.state = State::Discarding { quiet: now + self.settings.on_line(Telegram::MOST), until };
    }

    /// Ends the command. A failed character of inching ends inching; a sent one gives no event.
    fn end(&mut self, event: Event) -> Option<Event> {
        self.state = State::Idle;
        if let Event::Failed(_) = event {
            self.synchronised = false;
            self.inching = None;
        }
        (!self.inches || event != Event::Sent).then_some(event)
    }
}
