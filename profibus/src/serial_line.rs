//! A line at a serial port, or at anything else that bytes can be read from and written to, in real time.

use std::io::{ErrorKind, Read, Write};
use std::time::Instant as Wall;
use std::vec::Vec;

use lexican_runtime::Instant;
use profirust::Baudrate;
use profirust::dp::{Peripheral, PeripheralEvent, PeripheralHandle, PeripheralOptions};
use profirust::fdl::Parameters;
use profirust::phy::ProfibusPhy;
use profirust::time;

use crate::dp::Lengths;
use crate::fdl::CHARACTER_BITS;
use crate::master::{Master, Segment};

/// A line of `profirust` at a port, which is set up for its bit rate, with eight data bits, even parity and one stop bit. A
/// read returns what has come, or [`ErrorKind::WouldBlock`] or [`ErrorKind::TimedOut`] at once.
///
/// A telegram counts as sent when its bits have had the time for it: what waits in an adapter is not asked for, since
/// not every driver knows it. The slot time has to cover what adapter and operating system add.
#[derive(Debug)]
pub struct SerialLine<T> {
    port: T,
    bit_rate: Baudrate,
    received: Vec<u8>,
    sent: time::Instant,
    failed: Option<ErrorKind>,
}

impl<T: Read + Write> SerialLine<T> {
    /// A line at a port.
    pub fn new(port: T, bit_rate: Baudrate) -> Self {
        SerialLine { port, bit_rate, received: Vec::new(), sent: time::Instant::ZERO, failed: None }
    }

    /// What ended the port, such as an adapter that has been unplugged. The line is silent since.
    pub fn failed(&self) -> Option<ErrorKind> {
        self.failed
    }

    fn fail(&mut self, error: &std::io::Error) {
        if !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) {
            self.failed = Some(error.kind());
        }
    }
}

impl<T: Read + Write> ProfibusPhy for SerialLine<T> {
    fn poll_transmission(&mut self, now: time::Instant) -> bool {
        now < self.sent
    }

    fn transmit_data<F, R>(&mut self, now: time::Instant, write: F) -> R
    where
        F: FnOnce(&mut [u8]) -> (usize, R),
    {
        let mut buffer = [0; 256];
        let (len, result) = write(&mut buffer);
        if len > 0 {
            // A telegram that the port does not take is lost on the line.
            if let Err(error) = self.port.write_all(&buffer[..len]) {
                self.fail(&error);
            }
            self.sent = now + self.bit_rate.bits_to_time(len as u32 * CHARACTER_BITS);
        }
        result
    }

    fn receive_data<F, R>(&mut self, _: time::Instant, take: F) -> R
    where
        F: FnOnce(&[u8]) -> (usize, R),
    {
        let mut buffer = [0; 256];
        match self.port.read(&mut buffer) {
            Ok(len) => self.received.extend_from_slice(&buffer[..len]),
            Err(error) => self.fail(&error),
        }
        let (taken, result) = take(&self.received);
        self.received.drain(..taken);
        result
    }
}

/// A master at a port, in real time: it goes by the machine's clock, whatever time it is polled at.
#[derive(Debug)]
pub struct SerialSegment<T> {
    master: Master<SerialLine<T>>,
    began: Wall,
}

impl<T: Read + Write> SerialSegment<T> {
    /// A master at a port; `parameters` have its bit rate.
    #[expect(clippy::disallowed_methods, reason = "a port is in real time")]
    pub fn new(port: T, parameters: Parameters) -> Self {
        let line = SerialLine::new(port, parameters.baudrate);
        SerialSegment { master: Master::new(parameters, line), began: Wall::now() }
    }
}

impl<T: Read + Write> Segment for SerialSegment<T> {
    fn now(&self) -> Instant {
        Instant::ZERO + self.began.elapsed().into()
    }

    fn is_real_time(&self) -> bool {
        true
    }

    fn failed(&self) -> Option<ErrorKind> {
        self.master.line().failed()
    }

    fn add(&mut self, address: u8, options: PeripheralOptions<'static>, lengths: Lengths) -> PeripheralHandle {
        self.master.add(address, options, lengths)
    }

    fn peripheral(&mut self, handle: PeripheralHandle) -> &mut Peripheral<'static> {
        self.master.peripheral(handle)
    }

    fn poll(&mut self, _: Instant) -> Option<(PeripheralHandle, PeripheralEvent)> {
        let now = self.now().as_micros();
        self.master.poll(time::Instant::from_micros(i64::try_from(now).unwrap_or(i64::MAX)))
    }
}
