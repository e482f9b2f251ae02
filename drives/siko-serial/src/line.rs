//! Lines that carry bytes. Each line has its own clock, so that the same code runs in real time on a port, and in
//! virtual time on a simulated line.

use std::io::{self, ErrorKind, Read, Write};

use lexican_runtime::Instant;

/// A serial line with its clock.
pub trait Line {
    /// The time on the line.
    fn now(&self) -> Instant;

    /// Sends bytes.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits for bytes until `until`; returns how many have come.
    fn receive(&mut self, until: Instant, buffer: &mut [u8]) -> io::Result<usize>;

    /// Whether the clock runs in real time.
    fn is_real_time(&self) -> bool {
        true
    }

    /// The time of the next event on a simulated line.
    fn next_event(&self) -> Option<Instant> {
        None
    }
}

/// A line over anything that reads and writes, in real time.
///
/// A read has to return after a few milliseconds without a byte, with [`ErrorKind::TimedOut`] or
/// [`ErrorKind::WouldBlock`], since deadlines are checked between reads.
#[derive(Debug)]
pub struct Port<T> {
    stream: T,
    origin: std::time::Instant,
}

impl<T: Read + Write> Port<T> {
    /// A line over `stream`, whose clock starts at 0.
    #[expect(clippy::disallowed_methods, reason = "a line of a real port has the machine's time")]
    pub fn new(stream: T) -> Self {
        Port { stream, origin: std::time::Instant::now() }
    }

    /// The stream below.
    pub fn stream(&mut self) -> &mut T {
        &mut self.stream
    }
}

#[cfg(feature = "serialport")]
impl Port<Box<dyn serialport::SerialPort>> {
    /// Opens a port of the operating system, such as `/dev/ttyUSB0` or `COM3`: eight data bits, no parity, one stop
    /// bit, no handshake (chapter 6). Bytes from an earlier program are dropped.
    pub fn open(path: &str, baud: u32) -> io::Result<Self> {
        let port = serialport::new(path, baud).timeout(READ).open()?;
        port.clear(serialport::ClearBuffer::Input)?;
        Ok(Port::new(port))
    }
}

/// How long a read of a port waits, and how late a deadline may be: about the time of five bytes.
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
