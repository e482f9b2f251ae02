//! The slave in real time: the master of `profirust` at one end of a pseudo-terminal, the slave at the other.
#![cfg(unix)]

mod support;

use std::io::{ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration as StdDuration;

use lexican_profibus::{BitRate, Slave, State};
use lexican_runtime::{Duration, Instant};
use profirust::dp::{DpMaster, Peripheral, PeripheralOptions};
use profirust::fdl::{FdlActiveStation, ParametersBuilder};
use profirust::phy::ProfibusPhy;
use profirust::{Baudrate, time};
use serialport::{SerialPort, TTYPort};
use support::{Echo, IDENTITY};

/// A line of `profirust` at a terminal, which sends at once.
struct Line {
    port: TTYPort,
    received: Vec<u8>,
}

impl ProfibusPhy for Line {
    fn poll_transmission(&mut self, _: time::Instant) -> bool {
        false
    }

    fn transmit_data<F, R>(&mut self, _: time::Instant, write: F) -> R
    where
        F: FnOnce(&mut [u8]) -> (usize, R),
    {
        let mut buffer = [0; 256];
        let (len, result) = write(&mut buffer);
        self.port.write_all(&buffer[..len]).expect("a terminal takes some bytes");
        result
    }

    fn receive_data<F, R>(&mut self, _: time::Instant, take: F) -> R
    where
        F: FnOnce(&[u8]) -> (usize, R),
    {
        let mut buffer = [0; 256];
        let len = read(&mut self.port, &mut buffer);
        self.received.extend_from_slice(&buffer[..len]);
        let (taken, result) = take(&self.received);
        self.received.drain(..taken);
        result
    }
}

/// What has come within the time-out of the port.
fn read(port: &mut TTYPort, buffer: &mut [u8]) -> usize {
    match port.read(buffer) {
        Ok(len) => len,
        Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => 0,
        Err(error) => panic!("{error}"),
    }
}

#[expect(clippy::disallowed_methods, reason = "a terminal is in real time")]
fn clock() -> impl Fn() -> Duration {
    let begin = std::time::Instant::now();
    move || Duration::from_micros(begin.elapsed().as_micros() as u64)
}

/// 19,200 bit/s, and a slot of 2,000 bits (104 ms) for what the operating system does in between.
#[test]
fn data_is_exchanged_over_a_pseudo_terminal() {
    let (mut there, mut here) = TTYPort::pair().expect("the system has pseudo-terminals");
    for port in [&mut there, &mut here] {
        port.set_timeout(StdDuration::from_millis(1)).expect("a time-out can be set");
    }
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let ends = scope.spawn(|| {
            let slave = Slave::new(7, IDENTITY, BitRate(19_200), Echo::default());
            let mut slave = slave.with_idle(Duration::from_millis(50));
            let clock = clock();
            while !is_over.load(Ordering::Relaxed) {
                let mut buffer = [0; 256];
                let len = read(&mut there, &mut buffer);
                let now = Instant::ZERO + clock();
                if len > 0 {
                    slave.handle_bytes(now, &buffer[..len]);
                }
                slave.handle_timeout(now);
                if let Some(answer) = slave.poll_transmit(now) {
                    there.write_all(answer).expect("a terminal takes some bytes");
                }
            }
            slave
        });
        let mut builder = ParametersBuilder::new(2, Baudrate::B19200);
        let parameters = builder.slot_bits(2000).highest_station_address(3).build();
        let mut fdl = FdlActiveStation::new(parameters);
        let mut master = DpMaster::new(Vec::new());
        let options = PeripheralOptions {
            ident_number: IDENTITY.ident,
            user_parameters: Some(&[]),
            config: Some(IDENTITY.configuration),
            ..PeripheralOptions::default()
        };
        let handle = master.add(Peripheral::new(7, options, vec![0; 4], vec![1, 2, 3, 4]));
        fdl.set_online();
        master.enter_operate();
        let mut line = Line { port: here, received: Vec::new() };
        let clock = clock();
        // A machine under load takes its time; one that takes a minute has lost the telegrams.
        while clock() < Duration::from_secs(60) && master.get_mut(handle).pi_i() != [0xFE, 0xFD, 0xFC, 0xFB] {
            let now = time::Instant::from_micros(clock().as_micros() as i64);
            fdl.poll(now, &mut line, &mut master);
        }
        is_over.store(true, Ordering::Relaxed);
        let slave = ends.join().expect("the slave ends");
        assert_eq!(master.get_mut(handle).pi_i(), [0xFE, 0xFD, 0xFC, 0xFB]);
        assert_eq!((slave.state(), slave.application().last()), (State::DataExchange, &[1, 2, 3, 4][..]));
    });
}
