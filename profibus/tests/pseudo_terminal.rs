//! The slave in real time: a segment at one end of a pseudo-terminal, the slave at the other.
#![cfg(unix)]

#[path = "all/support.rs"]
mod support;

use std::io::{ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration as StdDuration;

use lexican_profibus::bus::{Bus, Notice};
use lexican_profibus::dp::Lengths;
use lexican_profibus::serial_line::{self, SerialSegment};
use lexican_profibus::{BitRate, Slave, State};
use lexican_runtime::Duration;
use profirust::Baudrate;
use profirust::dp::PeripheralOptions;
use profirust::fdl::ParametersBuilder;
use serialport::{SerialPort, TTYPort};
use support::{Echo, IDENTITY};

/// A slave at a terminal, until `is_over`.
fn serve(mut port: TTYPort, is_over: &AtomicBool) -> Slave<Echo> {
    port.set_timeout(StdDuration::from_millis(1)).expect("a time-out can be set");
    let slave = Slave::new(7, IDENTITY, BitRate(19_200), Echo::default());
    let mut slave = slave.with_idle(Duration::from_millis(50));
    serial_line::serve(&mut slave, &mut port, || !is_over.load(Ordering::Relaxed)).expect("the terminal is there");
    slave
}

/// 19,200 bit/s, and a slot of 2,000 bits (104 ms) for what the operating system does in between. A thread polls the
/// master, so that data is exchanged also while nothing waits for it.
#[test]
fn data_is_exchanged_over_a_pseudo_terminal() {
    let (there, mut here) = TTYPort::pair().expect("the system has pseudo-terminals");
    here.set_timeout(StdDuration::ZERO).expect("a time-out can be set");
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let ends = scope.spawn(|| serve(there, &is_over));
        let mut builder = ParametersBuilder::new(2, Baudrate::B19200);
        let parameters = builder.slot_bits(2000).highest_station_address(3).build();
        let bus = Bus::new(SerialSegment::new(here, parameters));
        bus.keep(Duration::from_millis(1)).expect("there are threads");
        let options = PeripheralOptions {
            ident_number: IDENTITY.ident,
            user_parameters: Some(&[]),
            config: Some(IDENTITY.configuration),
            ..PeripheralOptions::default()
        };
        let mut station = bus.station(7, options, Lengths { inputs: 4, outputs: 4 }).expect("an address");
        station.set_outputs(&[1, 2, 3, 4]);
        // A machine under load takes its time; one that takes a minute has lost the telegrams.
        let end = station.now() + Duration::from_secs(60);
        let answered = std::iter::from_fn(|| match station.wait(end).expect("the terminal is there") {
            Some(Notice::Exchanged(exchange)) => Some(exchange.received == [0xFE, 0xFD, 0xFC, 0xFB]),
            Some(Notice::Lost) => Some(false),
            None => None,
        })
        .any(|answered| answered);
        is_over.store(true, Ordering::Relaxed);
        let slave = ends.join().expect("the slave ends");
        assert!(answered, "after a minute");
        assert_eq!((slave.state(), slave.application().last()), (State::DataExchange, &[1, 2, 3, 4][..]));
    });
}

/// An adapter that is unplugged ends the segment, and nothing waits for it.
#[test]
fn a_port_that_fails_ends_its_segment() {
    struct Gone;
    impl Read for Gone {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            Err(ErrorKind::BrokenPipe.into())
        }
    }
    impl Write for Gone {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(ErrorKind::BrokenPipe.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let bus = Bus::new(SerialSegment::new(Gone, ParametersBuilder::new(2, Baudrate::B19200).build()));
    bus.keep(Duration::from_millis(1)).expect("there are threads");
    let mut station =
        bus.station(7, PeripheralOptions::default(), Lengths { inputs: 0, outputs: 0 }).expect("an address");
    let end = station.now() + Duration::from_secs(60);
    assert_eq!(station.wait(end), Err(ErrorKind::BrokenPipe));
}
