//! The driver over PROFIBUS in real time: a master at one end of a pseudo-terminal, the simulated drive at the other.
#![cfg(unix)]

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
use siko_profibus::{AG02, Door, line};

const NODE: NodeId = NodeId::literal(5);

fn travel(link: impl Link) -> Result<Outcome, Error> {
    let mut drive = Drive::connect_unprotected(link, NODE)?;
    drive.enable()?;
    let outcome = drive.move_to(200)?;
    drive.disable()?;
    Ok(outcome)
}

/// A machine under load may take longer than the drive's watchdog allows: then it is tried again, for a minute.
#[test]
fn a_drive_travels_over_a_pseudo_terminal() {
    let (mut there, mut here) = TTYPort::pair().expect("the system has pseudo-terminals");
    there.set_timeout(StdDuration::from_millis(1)).expect("a time-out can be set");
    here.set_timeout(StdDuration::ZERO).expect("a time-out can be set");
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let slave = Slave::new(NODE.get(), AG02.identity, BitRate(500_000), Door::new(Instant::ZERO, &AG02, 5));
            let mut slave = slave.with_idle(Duration::from_millis(2));
            // The other end may be closed first, which ends it, too.
            let _ = serial_line::serve(&mut slave, &mut there, || !is_over.load(Ordering::Relaxed));
        });
        let bus = Bus::new(SerialSegment::new(here, serial_line::parameters(Baudrate::B500000)));
        bus.keep(Duration::from_micros(500)).expect("there are threads");
        let mut link = line::link(&bus, &AG02, NODE);
        let end = link.now() + Duration::from_secs(60);
        let travelled = loop {
            let travelled = travel(&mut link);
            if travelled.is_ok() || link.now() >= end {
                break travelled;
            }
        };
        is_over.store(true, Ordering::Relaxed);
        assert_eq!(travelled.expect("it has had a minute"), Outcome::Reached { position: 200 });
    });
}
