//! `--bus pty`: a bus that needs nothing of the kernel but pseudo-terminals, each of which acts as a serial
//! adapter (slcan).
//!
//! Whoever opens one of them is on the bus, so that a monitor and a writing command can be there at once. Like an
//! adapter it carries frames only while its channel is open, so that nobody finds old frames in it.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration as StdDuration;

use lexican_runtime::host::slcan::{Decoder, Message, line};
use lexican_runtime::host::{Incoming, Link, LinkError};
use lexican_runtime::{Frame, Instant};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

use crate::output::Failure;

/// How often a terminal that nobody has open is looked at.
const LOOK: StdDuration = StdDuration::from_millis(100);

/// How many lines may wait for somebody who does not read them; what comes then is lost to him.
const WAITING_LINES: usize = 256;
/// How many lines may wait for us; then whoever sends more has to wait, as for a serial line that is full.
const HEARD_LINES: usize = 256;

/// The end of a line that says that a command was carried out.
const DONE: &str = "\r";
/// The answer to a frame that was sent.
const SENT: &str = "z\r";
/// A command that is none.
const REFUSED: &str = "\x07";

/// A bus of pseudo-terminals, and the participant who serves them.
pub(crate) struct Ptys {
    terminals: Vec<Terminal>,
    heard: Receiver<(usize, Heard)>,
    origin: std::time::Instant,
}

struct Terminal {
    path: String,
    lines: SyncSender<String>,
    /// Whether somebody has opened the channel.
    open: bool,
}

/// What comes out of a terminal.
enum Heard {
    /// A line without its end.
    Line(String),
    /// Nobody has it open any more.
    Gone,
}

impl Ptys {
    /// A bus with so many pseudo-terminals.
    #[expect(clippy::disallowed_methods, reason = "a link tells the machine's time, and this is one")]
    pub(crate) fn open(count: usize) -> Result<Self, Failure> {
        let (sender, heard) = sync_channel(HEARD_LINES);
        let terminals = (0..count).map(|number| Terminal::open(number, &sender)).collect::<Result<_, _>>()?;
        Ok(Ptys { terminals, heard, origin: std::time::Instant::now() })
    }

    /// What to name them on a command line.
    pub(crate) fn urls(&self) -> Vec<String> {
        self.terminals.iter().map(|terminal| format!("slcan:{}", terminal.path)).collect()
    }

    /// Takes what a terminal says; a frame is for everybody.
    fn take(&mut self, number: usize, heard: Heard) -> Option<Frame> {
        let terminal = self.terminals.get_mut(number)?;
        let line = match heard {
            Heard::Gone => {
                terminal.open = false;
                return None;
            }
            Heard::Line(line) => line,
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
            // All is well on this bus.
            Some(b'F') => "F00\r",
            Some(b'V') => "V0101\r",
            Some(b'N') => "N0000\r",
            // What we have said ourselves: a system that resets a terminal when its last user leaves, as macOS
            // does, echoes until the next one has set it up.
            Some(b'z' | b'^') => return None,
            None | Some(b'S' | b's' | b'M' | b'm' | b'Z' | b'X') => DONE,
            Some(_) => REFUSED,
        };
        terminal.say(answer);
        None
    }

    fn frame(&mut self, number: usize, text: &str) -> Option<Frame> {
        let mut decoder = Decoder::default();
        let message = text.bytes().chain([b'\r']).find_map(|byte| decoder.take(byte));
        let from = self.terminals.get_mut(number)?;
        let Some(Message::Frame(frame)) = message.filter(|_| from.open) else {
            from.say(REFUSED);
            return None;
        };
        from.say(SENT);
        self.tell(&frame, Some(number));
        Some(frame)
    }

    /// Lets everybody hear a frame but who sent it.
    fn tell(&mut self, frame: &Frame, sender: Option<usize>) {
        let text = line(frame) + DONE;
        let others = self.terminals.iter_mut().enumerate().filter(|(number, it)| it.open && Some(*number) != sender);
        others.for_each(|(_, terminal)| terminal.say(&text));
    }
}

impl Terminal {
    fn open(number: usize, heard: &SyncSender<(usize, Heard)>) -> Result<Self, Failure> {
        let failed = |error| Failure::new(format_args!("cannot open a pseudo-terminal: {error}"));
        let (writer, path) = terminal().map_err(failed)?;
        let reader = writer.try_clone().map_err(failed)?;
        let (lines, queue) = sync_channel::<String>(WAITING_LINES);
        let heard = heard.clone();
        std::thread::spawn(move || read(reader, number, &heard));
        std::thread::spawn(move || write(writer, &queue));
        Ok(Terminal { path, lines, open: false })
    }

    /// Says something to whoever has it open.
    fn say(&self, text: &str) {
        // Who does not read misses what there is no room for.
        let _ = self.lines.try_send(text.to_owned());
    }
}

/// Makes a pseudo-terminal; returns our end of it, and the path of the other one. That is not kept open, so that
/// reading reports when its last user leaves.
fn terminal() -> io::Result<(File, String)> {
    let pair = nix::pty::openpty(None, None)?;
    let mut settings = tcgetattr(&pair.slave)?;
    cfmakeraw(&mut settings);
    tcsetattr(&pair.slave, SetArg::TCSANOW, &settings)?;
    let path = nix::unistd::ttyname(&pair.slave)?;
    Ok((pair.master.into(), path.to_string_lossy().into_owned()))
}

/// Cuts what comes into lines, until nobody wants them any more.
#[expect(clippy::disallowed_methods, reason = "a terminal that nobody has open can only be looked at again")]
fn read(mut terminal: File, number: usize, heard: &SyncSender<(usize, Heard)>) {
    let (mut buffer, mut line, mut gone) = ([0; 256], String::new(), true);
    loop {
        match terminal.read(&mut buffer) {
            Ok(len @ 1..) => {
                gone = false;
                for byte in buffer.iter().take(len) {
                    match byte {
                        b'\r' => {
                            if heard.send((number, Heard::Line(std::mem::take(&mut line)))).is_err() {
                                return;
                            }
                        }
                        b'\n' => {}
                        // No line of the protocol is as long.
                        _ if line.len() > 64 => line.clear(),
                        byte => line.push(char::from(*byte)),
                    }
                }
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            // Only once all has been read that its last user has said. A poll reports the hang-up before that.
            _ => {
                line.clear();
                if !gone && heard.send((number, Heard::Gone)).is_err() {
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
        // Who has left hears nothing; the reader notices that.
        let _ = terminal.write_all(line.as_bytes());
    }
}

impl Link for Ptys {
    fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed().into()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.tell(frame, None);
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        loop {
            let remaining = until.since(self.now());
            match self.heard.recv_timeout(remaining.into()) {
                Ok((number, heard)) => {
                    if let Some(frame) = self.take(number, heard) {
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
    fn an_echo_of_an_answer_is_not_answered() {
        let (lines, answers) = sync_channel(8);
        let mut ptys = Ptys::open(0).unwrap();
        ptys.terminals.push(Terminal { path: String::new(), lines, open: true });
        for (line, answer) in
            [("z", None), ("^G", None), ("O", Some(DONE)), ("t1230", Some(SENT)), ("?", Some(REFUSED))]
        {
            ptys.take(0, Heard::Line(line.to_owned()));
            assert_eq!(answers.try_recv().ok().as_deref(), answer, "{line}");
        }
    }

    #[test]
    fn a_user_who_leaves_at_once_is_heard_to_the_end() {
        let mut ptys = Ptys::open(1).unwrap();
        let frame = Frame::from_array(CobId::SYNC, [1]);
        // The first one leaves while nobody looks at the terminal, the next one while it is being read.
        for _ in 0..20 {
            let mut user = serialport::new(&ptys.terminals[0].path, 115_200).open_native().unwrap();
            user.write_all(format!("O\r{}\rC\r", line(&frame)).as_bytes()).unwrap();
            drop(user);
            let until = ptys.now() + Duration::from_secs(60);
            assert_eq!(ptys.receive(until).unwrap(), Some(Incoming::Frame(frame)));
        }
    }

    #[test]
    fn who_sends_more_than_is_taken_has_to_wait() {
        const LINES: usize = 4096;
        let ptys = Ptys::open(1).unwrap();
        let path = &ptys.terminals[0].path;
        let mut flood = serialport::new(path, 115_200).timeout(StdDuration::from_millis(500)).open_native().unwrap();
        // Nobody takes any of them.
        let sent = (0..LINES).take_while(|_| flood.write_all(&b"t123811223344556677\r".repeat(16)).is_ok()).count();
        assert!(sent < LINES, "all were kept");
        drop(ptys);
    }
}
