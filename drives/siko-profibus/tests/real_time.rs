//! The driver over PROFIBUS in real time: a master at one end of a pseudo-terminal, the simulated drive at the other.
#![cfg(unix)]

use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration as StdDuration;

use lexican_profibus::bus::Bus;
use lexican_profibus::serial_line::{self, SerialSegment};
use lexican_profibus::{BitRate, Slave};
use lexican_runtime::host::Link;
use lexican_runtime::{Duration, Instant, NodeId};
use profirust::Baudrate;
use serialport::{SerialPort, TTYPort};
use siko_ag02::driver::{Drive, Error, Outcome};
use siko_profibus::{AG02, ProfibusDrive, line};

static DIES: AtomicBool = AtomicBool::new(false);
const NODE: NodeId = NodeId::literal(5);

fn travel(link: impl Link) -> Result<Outcome, Error> {
    let mut drive = Drive::connect_unprotected(link, NODE)?;
    drive.enable()?;
    let outcome = drive.move_to(200)?;
    drive.disable()?;
    Ok(outcome)
}

/// A port at which the thread that runs the line dies on command.
struct Mortal<'a> {
    port: TTYPort,
    dies: &'a AtomicBool,
}

impl Read for Mortal<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        assert!(!self.dies.load(Ordering::Relaxed), "as ordered");
        self.port.read(buffer)
    }
}

impl Write for Mortal<'_> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.port.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.port.flush()
    }
}

/// Travels for a minute, or until the drive is lost with the thread.
fn travel_without_a_line(link: impl Link, dies: &AtomicBool) -> Result<Outcome, Error> {
    let mut drive = Drive::connect_unprotected(link, NODE)?;
    drive.enable()?;
    drive.start_moving_to(100_000)?;
    drive.finish_watched(|_| dies.store(true, Ordering::Relaxed))
}

/// A busy machine may take longer than the drive's watchdog allows; the test is then repeated, for up to a minute.
#[test]
fn a_drive_travels_over_a_pseudo_terminal_and_is_lost_with_the_thread_that_runs_it() {
    let (mut there, mut here) = TTYPort::pair().expect("the system has pseudo-terminals");
    there.set_timeout(StdDuration::from_millis(1)).expect("a time-out can be set");
    here.set_timeout(StdDuration::ZERO).expect("a time-out can be set");
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let slave =
                Slave::new(NODE.get(), AG02.identity, BitRate(500_000), ProfibusDrive::new(Instant::ZERO, &AG02, 5));
            let mut slave = slave.with_idle(Duration::from_millis(2));
            // If the other end is closed first, this ends, too.
            let _ = serial_line::serve(&mut slave, &mut there, || !is_over.load(Ordering::Relaxed));
        });
        let bus = Bus::new(SerialSegment::new(
            Mortal { port: here, dies: &DIES },
            serial_line::parameters(Baudrate::B500000),
        ));
        bus.keep(Duration::from_micros(500)).expect("there are threads");
        let mut link = line::link(&bus, &AG02, NODE).expect("an address");
        let end = link.now() + Duration::from_secs(60);
        let travelled = loop {
            let travelled = travel(&mut link);
            if travelled.is_ok() || link.now() >= end {
                break travelled;
            }
        };
        let began = link.now();
        let lost = travel_without_a_line(&mut link, &DIES).map_err(Error::into_cause);
        let took = link.now() - began;
        is_over.store(true, Ordering::Relaxed);
        assert!(matches!(lost, Err(Error::Sdo(_))) && took < Duration::from_secs(20), "{lost:?} after {took}");
        assert_eq!(travelled.expect("it has had a minute"), Outcome::Reached { position: 200 });
    });
}
