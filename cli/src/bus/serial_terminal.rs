//! `simulate --bus serial` and `--bus profibus`: a pseudo-terminal as the other interface of a simulated drive.

#[cfg(unix)]
pub(crate) use unix::{Alone, SerialTerminal};

/// Pseudo-terminals do not exist on other systems.
#[cfg(not(unix))]
pub(crate) enum SerialTerminal {}

#[cfg(not(unix))]
impl SerialTerminal {
    pub(crate) fn receive(&mut self) -> Vec<u8> {
        match *self {}
    }

    pub(crate) fn send(&mut self, _: &[u8]) -> std::io::Result<()> {
        match *self {}
    }
}

#[cfg(unix)]
mod unix {
    use std::fs::File;
    use std::io::{self, ErrorKind, Read, Write};
    use std::os::fd::OwnedFd;
    use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
    use std::time::Duration;

    use lexican_runtime::host::{Incoming, Link, LinkError};
    use lexican_runtime::{Frame, Instant};

    use crate::bus::pty::pair;
    use crate::output::Failure;

    /// How long the session waits for bytes; a deadline of the drive may be this late.
    const PATIENCE: Duration = Duration::from_millis(1);
    /// The most chunks of bytes that wait to be handled or to be read. A program that sends more is blocked, and
    /// responses to a program that does not read are lost, as on a line without handshake.
    const PIECES: usize = 64;

    pub(crate) struct SerialTerminal {
        answers: SyncSender<Vec<u8>>,
        path: String,
        bytes: Receiver<Vec<u8>>,
        /// Kept open, so that reading does not fail between two programs.
        _other_end: OwnedFd,
    }

    impl SerialTerminal {
        pub(crate) fn open() -> Result<Self, Failure> {
            let failed = |error| Failure::new(format_args!("cannot open a pseudo-terminal: {error}"));
            let (terminal, path, other_end) = pair().map_err(failed)?;
            let mut reader = terminal.try_clone().map_err(failed)?;
            let (sender, bytes) = sync_channel(PIECES);
            std::thread::spawn(move || {
                let mut buffer = [0; 64];
                while let Ok(len @ 1..) = reader.read(&mut buffer) {
                    if sender.send(buffer.iter().take(len).copied().collect()).is_err() {
                        return;
                    }
                }
            });
            let (answers, queue) = sync_channel(PIECES);
            std::thread::spawn(move || write(terminal, &queue));
            Ok(SerialTerminal { answers, path, bytes, _other_end: other_end })
        }

        /// The path of the end for other programs.
        pub(crate) fn path(&self) -> &str {
            &self.path
        }

        /// The bytes received, after waiting shortly for some.
        pub(crate) fn receive(&mut self) -> Vec<u8> {
            self.bytes.recv_timeout(PATIENCE).unwrap_or_default()
        }

        pub(crate) fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            match self.answers.try_send(bytes.to_vec()) {
                Ok(()) | Err(TrySendError::Full(_)) => Ok(()),
                Err(TrySendError::Disconnected(_)) => Err(ErrorKind::BrokenPipe.into()),
            }
        }
    }

    /// The CAN bus of such a drive, in real time: no other node is on it.
    pub(crate) struct Alone(std::time::Instant);

    impl Alone {
        #[expect(clippy::disallowed_methods, reason = "a link has the clock of the machine")]
        pub(crate) fn new() -> Self {
            Alone(std::time::Instant::now())
        }
    }

    impl Link for Alone {
        fn now(&self) -> Instant {
            Instant::ZERO + self.0.elapsed().into()
        }

        fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
            Ok(())
        }

        #[expect(clippy::disallowed_methods, reason = "nothing else wakes it")]
        fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
            std::thread::sleep(until.since(self.now()).into());
            Ok(None)
        }
    }

    /// Writes until the terminal is closed.
    fn write(mut terminal: File, answers: &Receiver<Vec<u8>>) {
        while let Ok(bytes) = answers.recv() {
            if terminal.write_all(&bytes).is_err() {
                return;
            }
        }
    }

    #[cfg(test)]
    mod tests {
        use super::*;
        use std::fs::OpenOptions;

        /// The responses exceed the terminal's buffer many times.
        #[test]
        fn a_program_that_does_not_read_holds_nothing_up() {
            let mut terminal = SerialTerminal::open().unwrap_or_else(|_| panic!("the system has pseudo-terminals"));
            let mut program = OpenOptions::new().read(true).write(true).open(terminal.path()).unwrap();
            for _ in 0..5000 {
                terminal.send(b"+0001000>\r").unwrap();
            }
            // The drive still receives, and the program gets responses again once it reads.
            program.write_all(b"R").unwrap();
            assert!((0..1000).any(|_| terminal.receive() == b"R"));
            let mut answers = [0; 100];
            program.read_exact(&mut answers).unwrap();
            assert!(answers.starts_with(b"+0001000>\r+0001000>\r"));
        }
    }
}
