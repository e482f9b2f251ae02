//! Masters and slaves at a serial port, or at any other byte stream, in real time.

#[cfg(feature = "serialport")]
use std::boxed::Box;
use std::io::{ErrorKind, Read, Write};
use std::time::Instant as Wall;
use std::vec::Vec;

use lexican_runtime::{Duration, Instant};
use profirust::Baudrate;
use profirust::dp::{Peripheral, PeripheralEvent, PeripheralHandle, PeripheralOptions};
use profirust::fdl::{Parameters, ParametersBuilder};
use profirust::phy::ProfibusPhy;
use profirust::time;

use crate::dp::Lengths;
use crate::fdl::CHARACTER_BITS;
use crate::master::{MASTER, Master, Segment};
use crate::slave::{Application, Slave};

/// A line of `profirust` at a port that is set to its bit rate, with eight data bits, even parity and one stop bit. A
/// read has to return at once, with the bytes that have come, or with [`ErrorKind::WouldBlock`] or
/// [`ErrorKind::TimedOut`].
///
/// A telegram counts as sent when its bits have had time for it. The fill level of the adapter is not asked for, since
/// not every driver knows it. The slot time has to cover the delays of adapter and operating system.
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

    /// The error that ended the port, such as an unplugged adapter; the line is then silent.
    pub fn failed(&self) -> Option<ErrorKind> {
        self.failed
    }

    fn fail(&mut self, error: &std::io::Error) {
        if !passes(error) {
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
            // A telegram that the port does not take counts as lost on the line.
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

/// A master at a port, in real time, whatever time it is polled with.
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

/// Parameters for a master at a USB adapter: a slot of 8 ms, or of 30 ms up to 19.2 kbit/s, as `profirust` recommends;
/// three retries; and slaves that give the master up after half a second of silence. For up to 500 kbit/s.
#[must_use]
pub fn parameters(bit_rate: Baudrate) -> Parameters {
    let slot = Duration::from_millis(if bit_rate.to_rate() <= 19_200 { 30 } else { 8 });
    let bits = bit_rate.to_rate() * slot.as_micros() / 1_000_000;
    let mut parameters = ParametersBuilder::new(MASTER, bit_rate);
    parameters.slot_bits(u16::try_from(bits).unwrap_or(u16::MAX)).max_retry_limit(3);
    parameters.watchdog_timeout(time::Duration::from_millis(500)).highest_station_address(3);
    parameters.build()
}

#[cfg(feature = "serialport")]
impl SerialSegment<Box<dyn serialport::SerialPort>> {
    /// A master at a port of the operating system, such as `/dev/ttyUSB0`, with an RS-485 adapter that switches its
    /// direction by itself.
    pub fn open(path: &str, parameters: Parameters) -> std::io::Result<Self> {
        let bit_rate = u32::try_from(parameters.baudrate.to_rate()).unwrap_or(u32::MAX);
        let port = serialport::new(path, bit_rate).parity(serialport::Parity::Even).timeout(core::time::Duration::ZERO);
        Ok(SerialSegment::new(port.open()?, parameters))
    }
}

/// Runs a slave at a port in real time, while `goes_on` returns true. The port's time-out limits how late its deadlines
/// are handled.
#[expect(clippy::disallowed_methods, reason = "a port is in real time")]
pub fn serve<T: Read + Write, A: Application>(
    slave: &mut Slave<A>,
    port: &mut T,
    mut goes_on: impl FnMut() -> bool,
) -> std::io::Result<()> {
    let began = Wall::now();
    let mut buffer = [0; 256];
    while goes_on() {
        let len = match port.read(&mut buffer) {
            Ok(len) => len,
            Err(error) if passes(&error) => 0,
            Err(error) => return Err(error),
        };
        let now = Instant::ZERO + began.elapsed().into();
        if len > 0 {
            slave.handle_bytes(now, &buffer[..len]);
        }
        slave.handle_timeout(now);
        if let Some(answer) = slave.poll_transmit(now) {
            port.write_all(answer)?;
        }
    }
    Ok(())
}

/// Whether the error only means that there is nothing to read yet.
fn passes(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
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
