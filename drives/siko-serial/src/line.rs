//! Lines that carry bytes. Time belongs to the line, so that a shell runs in real time on a port, and in virtual time on
//! a simulated one.

use std::io::{self, ErrorKind, Read, Write};

use lexican_runtime::Instant;

/// A serial line with the clock of its time.
pub trait Line {
    /// The time.
    fn now(&self) -> Instant;

    /// Sends bytes.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits for bytes, no longer than until `until`; returns how many have come.
    fn receive(&mut self, until: Instant, buffer: &mut [u8]) -> io::Result<usize>;

    /// Whether time passes as on the wall.
    fn is_real_time(&self) -> bool {
        true
    }

    /// When the next thing happens on a simulated line.
    fn next_event(&self) -> Option<Instant> {
        None
    }
}

/// A line over anything that reads and writes, in the machine's time.
///
/// A read has to end by itself, with [`ErrorKind::TimedOut`] or [`ErrorKind::WouldBlock`], after a few milliseconds
/// without a byte: deadlines are looked at between reads.
#[derive(Debug)]
pub struct Port<T> {
    stream: T,
    origin: std::time::Instant,
}

impl<T: Read + Write> Port<T> {
    /// A line over `stream`, from now on.
    #[expect(clippy::disallowed_methods, reason = "a line of a real port has the machine's time")]
    pub fn new(stream: T) -> Self {
        Port { stream, origin: std::time::Instant::now() }
    }

    /// What the line goes over.
    pub fn stream(&mut self) -> &mut T {
        &mut self.stream
    }
}

#[cfg(feature = "serialport")]
impl Port<Box<dyn serialport::SerialPort>> {
    /// Opens a port of the operating system, such as `/dev/ttyUSB0` or `COM3`: eight data bits, no parity, one stop bit,
    /// no handshake (chapter 6). What an earlier program has left unread is dropped.
    pub fn open(path: &str, baud: u32) -> io::Result<Self> {
        let port = serialport::new(path, baud).timeout(READ).open()?;
        port.clear(serialport::ClearBuffer::Input)?;
        Ok(Port::new(port))
    }
}

/// How long a read of a port waits: about the time of five bytes, by which a deadline can be missed.
#[cfg(feature = "serialport")]
const READ: std::time::Duration = std::time::Duration::from_millis(5);

impl<T: Read + Write> Line for Port<T> {
    fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed().into()
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)?;
        self.stream.flush()
    }

    fn receive(&mut self, until: Instant, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.stream.read(buffer) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(len) => return Ok(len),
                Err(error) if is_pause(&error) && self.now() < until => {}
                Err(error) if is_pause(&error) => return Ok(0),
                Err(error) => return Err(error),
            }
        }
    }
}

fn is_pause(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}
