//! `--bus pty`: a bus of pseudo-terminals, each of which acts as a serial adapter (slcan), so no CAN driver is needed.
//!
//! Each terminal serves one program, so that several programs can share the bus. Like an adapter, a terminal passes on
//! frames only while its channel is open, so that no program receives old frames.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration as StdDuration;

use lexican_runtime::host::slcan::{Decoder, Message, line};
use lexican_runtime::host::{Incoming, Link, LinkError};
use lexican_runtime::{Frame, Instant};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

use crate::output::Failure;

/// The interval of checking a terminal that no program has open.
const LOOK: StdDuration = StdDuration::from_millis(100);

/// The most lines that wait for a program to read them; further ones are dropped.
const WAITING_LINES: usize = 256;
/// The most lines that wait to be handled; a program that sends more is blocked, as on a busy serial line.
const RECEIVED_LINES: usize = 256;

/// The response to a command that was carried out; also the end of a line.
const DONE: &str = "\r";
const SENT: &str = "z\r";
/// The response to an unknown command.
const REFUSED: &str = "\x07";

pub(crate) struct Ptys {
    terminals: Vec<Terminal>,
    received: Receiver<(usize, Received)>,
    origin: std::time::Instant,
}

struct Terminal {
    path: String,
    lines: SyncSender<String>,
    open: bool,
}

enum Received {
    /// Without its end.
    Line(String),
    /// The last program has closed the terminal.
    Closed,
}

impl Ptys {
    /// A bus of `count` pseudo-terminals.
    #[expect(clippy::disallowed_methods, reason = "a link has the clock of the machine")]
    pub(crate) fn open(count: usize) -> Result<Self, Failure> {
        let (sender, received) = sync_channel(RECEIVED_LINES);
        let terminals = (0..count).map(|number| Terminal::open(number, &sender)).collect::<Result<_, _>>()?;
        Ok(Ptys { terminals, received, origin: std::time::Instant::now() })
    }

    pub(crate) fn urls(&self) -> Vec<String> {
        self.terminals.iter().map(|terminal| format!("slcan:{}", terminal.path)).collect()
    }

    /// Handles an event of a terminal; returns the frame that it sends, if any.
    fn take(&mut self, number: usize, received: Received) -> Option<Frame> {
        let terminal = self.terminals.get_mut(number)?;
        let line = match received {
            Received::Closed => {
                terminal.open = false;
                return None;
            }
            Received::Line(line) => line,
        };
        let answer = match line.as_bytes().first() {
            Some(b't' | b'T' | b'r' | b'R') => return self.frame(number, &line),
            Some(b'O' | b'L') => {
                terminal.open = true;
                DONE
            }
            Some(b'C') => {
                terminal.open = false;
                DONE
            }
            // Status flags: no errors.
            Some(b'F') => "F00\r",
            Some(b'V') => "V0101\r",
            Some(b'N') => "N0000\r",
            // Echoes of our own lines: Linux and macOS reset a terminal when its last program leaves, and it then
            // echoes until the next program has set it up.
            Some(b'z' | b'^') => return None,
            None | Some(b'S' | b's' | b'M' | b'm' | b'Z' | b'X') => DONE,
            Some(_) => REFUSED,
        };
        terminal.send(answer);
        None
    }

    fn frame(&mut self, number: usize, text: &str) -> Option<Frame> {
        let mut decoder = Decoder::default();
        let message = text.bytes().chain([b'\r']).find_map(|byte| decoder.take(byte));
        let from = self.terminals.get_mut(number)?;
        let Some(Message::Frame(frame)) = message.filter(|_| from.open) else {
            from.send(REFUSED);
            return None;
        };
        from.send(SENT);
        self.broadcast(&frame, Some(number));
        Some(frame)
    }

    /// Sends a frame to all terminals except that of the sender.
    fn broadcast(&mut self, frame: &Frame, sender: Option<usize>) {
        let text = line(frame) + DONE;
        let others = self.terminals.iter_mut().enumerate().filter(|(number, it)| it.open && Some(*number) != sender);
        others.for_each(|(_, terminal)| terminal.send(&text));
    }
}

impl Terminal {
    fn open(number: usize, events: &SyncSender<(usize, Received)>) -> Result<Self, Failure> {
        let failed = |error| Failure::new(format_args!("cannot open a pseudo-terminal: {error}"));
        let (writer, path) = terminal().map_err(failed)?;
        let reader = writer.try_clone().map_err(failed)?;
        let (lines, queue) = sync_channel::<String>(WAITING_LINES);
        let events = events.clone();
        std::thread::spawn(move || read(reader, number, &events));
        std::thread::spawn(move || write(writer, &queue));
        Ok(Terminal { path, lines, open: false })
    }

    fn send(&self, text: &str) {
        // Drop the line if the program does not read.
        let _ = self.lines.try_send(text.to_owned());
    }
}

/// Creates a pseudo-terminal; returns this end and the path of the other end, which is not kept open, so that reading
/// fails when the last program leaves.
fn terminal() -> io::Result<(File, String)> {
    pair().map(|(terminal, path, _)| (terminal, path))
}

/// Creates a pseudo-terminal; returns both ends, with the path of the other end.
pub(super) fn pair() -> io::Result<(File, String, OwnedFd)> {
    let pair = nix::pty::openpty(None, None)?;
    let mut settings = tcgetattr(&pair.slave)?;
    cfmakeraw(&mut settings);
    tcsetattr(&pair.slave, SetArg::TCSANOW, &settings)?;
    let path = nix::unistd::ttyname(&pair.slave)?;
    Ok((pair.master.into(), path.to_string_lossy().into_owned(), pair.slave))
}

/// Reads lines until the bus is dropped.
#[expect(clippy::disallowed_methods, reason = "a terminal that no program has open can only be polled")]
fn read(mut terminal: File, number: usize, events: &SyncSender<(usize, Received)>) {
    let (mut buffer, mut line, mut gone) = ([0; 256], String::new(), true);
    loop {
        match terminal.read(&mut buffer) {
            Ok(len @ 1..) => {
                gone = false;
                for byte in buffer.iter().take(len) {
                    match byte {
                        b'\r' => {
                            if events.send((number, Received::Line(std::mem::take(&mut line)))).is_err() {
                                return;
                            }
                        }
                        b'\n' => {}
                        // Longer than any line of the protocol.
                        _ if line.len() > 64 => line.clear(),
                        byte => line.push(char::from(*byte)),
                    }
                }
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            // Reading fails only after all lines have been read; polling would report the hang-up earlier.
            _ => {
                line.clear();
                if !gone && events.send((number, Received::Closed)).is_err() {
                    return;
                }
                gone = true;
                std::thread::sleep(LOOK);
            }
        }
    }
}

fn write(mut terminal: File, lines: &Receiver<String>) {
    while let Ok(line) = lines.recv() {
        // Ignore an error: the reader notices when the program leaves.
        let _ = terminal.write_all(line.as_bytes());
    }
}

impl Link for Ptys {
    fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed().into()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.broadcast(frame, None);
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            let remaining = until.since(self.now());
            match self.received.recv_timeout(remaining.into()) {
                Ok((number, received)) => {
                    if let Some(frame) = self.take(number, received) {
                        return Ok(Some(Incoming::Frame(frame)));
                    }
                }
                Err(RecvTimeoutError::Timeout) => return Ok(None),
                Err(RecvTimeoutError::Disconnected) => return Err(LinkError::Closed),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use lexican_runtime::{CobId, Duration};

    use super::*;

    #[test]
    fn an_echo_gets_no_response() {
        let (lines, answers) = sync_channel(8);
        let mut ptys = Ptys::open(0).unwrap();
        ptys.terminals.push(Terminal { path: String::new(), lines, open: true });
        for (line, answer) in
            [("z", None), ("^G", None), ("O", Some(DONE)), ("t1230", Some(SENT)), ("?", Some(REFUSED))]
        {
            ptys.take(0, Received::Line(line.to_owned()));
            assert_eq!(answers.try_recv().ok().as_deref(), answer, "{line}");
        }
    }

    #[test]
    fn lines_before_a_hang_up_are_read() {
        let mut ptys = Ptys::open(1).unwrap();
        let frame = Frame::from_array(CobId::SYNC, [1]);
        // The first program leaves before the terminal is read, the others while it is read.
        for _ in 0..20 {
            let mut user = serialport::new(&ptys.terminals[0].path, 115_200).open_native().unwrap();
            user.write_all(format!("O\r{}\rC\r", line(&frame)).as_bytes()).unwrap();
            drop(user);
            let until = ptys.now() + Duration::from_secs(60);
            assert_eq!(ptys.receive(until).unwrap(), Some(Incoming::Frame(frame)));
        }
    }

    #[test]
    fn a_program_that_sends_too_much_is_blocked() {
        const LINES: usize = 4096;
        let ptys = Ptys::open(1).unwrap();
        let path = &ptys.terminals[0].path;
        let mut flood = serialport::new(path, 115_200).timeout(StdDuration::from_millis(500)).open_native().unwrap();
        let sent = (0..LINES).take_while(|_| flood.write_all(&b"t123811223344556677\r".repeat(16)).is_ok()).count();
        assert!(sent < LINES, "all were taken");
        drop(ptys);
    }
}
