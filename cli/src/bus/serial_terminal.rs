//! `simulate --bus serial`: a pseudo-terminal that is the serial interface of a simulated drive.

#[cfg(unix)]
pub(crate) use unix::SerialTerminal;

/// There is none on other systems.
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
    use std::io::{self, Read, Write};
    use std::os::fd::OwnedFd;
    use std::sync::mpsc::{Receiver, sync_channel};
    use std::time::Duration;

    use crate::bus::pty::pair;
    use crate::output::Failure;

    /// How long the session waits for bytes, by which a deadline of the drive can be late.
    const PATIENCE: Duration = Duration::from_millis(2);
    /// How many pieces of bytes wait to be handled; a program that sends more is blocked.
    const PIECES: usize = 64;

    pub(crate) struct SerialTerminal {
        terminal: File,
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
            Ok(SerialTerminal { terminal, path, bytes, _other_end: other_end })
        }

        /// The path of the other end, for other programs.
        pub(crate) fn path(&self) -> &str {
            &self.path
        }

        /// What has come, after a short wait.
        pub(crate) fn receive(&mut self) -> Vec<u8> {
            self.bytes.recv_timeout(PATIENCE).unwrap_or_default()
        }

        pub(crate) fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.terminal.write_all(bytes)
        }
    }
}
