//! A line in virtual time. Stations that send at once garble each other's bytes, as on a real line.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::vec::Vec;

use profirust::phy::ProfibusPhy;
use profirust::{Baudrate, time};

use crate::fdl::CHARACTER_BITS;

/// A station's end of a line.
#[derive(Debug)]
pub struct VirtualLine {
    shared: Arc<Mutex<Shared>>,
    station: usize,
    /// Bytes that have come and have not been taken.
    received: Vec<u8>,
}

#[derive(Debug)]
struct Shared {
    now: time::Instant,
    bit_rate: Baudrate,
    stations: Vec<End>,
}

/// The bytes on their way to a station.
#[derive(Debug)]
struct End {
    /// Bytes, each with the time when it is complete.
    arriving: VecDeque<(time::Instant, u8)>,
    sends_until: time::Instant,
}

impl End {
    const NEW: End = End { arriving: VecDeque::new(), sends_until: time::Instant::ZERO };
}

impl VirtualLine {
    /// The first end of a line at time zero.
    #[must_use]
    pub fn new(bit_rate: Baudrate) -> Self {
        let shared = Shared { now: time::Instant::ZERO, bit_rate, stations: Vec::from([End::NEW]) };
        VirtualLine { shared: Arc::new(Mutex::new(shared)), station: 0, received: Vec::new() }
    }

    /// Another end of the same line.
    #[must_use]
    pub fn another_end(&self) -> Self {
        let mut shared = self.lock();
        shared.stations.push(End::NEW);
        let station = shared.stations.len() - 1;
        VirtualLine { shared: Arc::clone(&self.shared), station, received: Vec::new() }
    }

    /// The time on the line.
    #[must_use]
    pub fn now(&self) -> time::Instant {
        self.lock().now
    }

    /// Lets time pass.
    pub fn advance(&self, span: time::Duration) {
        self.lock().now += span;
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        // Nothing in here panics half-way.
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shared {
    fn send(&mut self, from: usize, bytes: &[u8]) {
        let character = |number| self.now + self.bit_rate.bits_to_time(number * CHARACTER_BITS);
        let mut at = self.now;
        let ends: Vec<_> = self.stations.iter().map(|end| end.sends_until).collect();
        for (byte, number) in bytes.iter().zip(1..) {
            let begins = core::mem::replace(&mut at, character(number));
            for (number, end) in self.stations.iter_mut().enumerate().filter(|(number, _)| *number != from) {
                let collides = ends.iter().enumerate().any(|(other, until)| other != number && *until > begins);
                // The bytes of others that are on the line at the same time are garbled, too.
                let meets = |(complete, _): &&mut (time::Instant, u8)| *complete > begins && *complete <= at;
                end.arriving.iter_mut().filter(|_| collides).filter(meets).for_each(|(_, byte)| *byte = !*byte);
                end.arriving.push_back((at, if collides { !*byte } else { *byte }));
            }
        }
        self.stations[from].sends_until = at;
    }
}

impl ProfibusPhy for VirtualLine {
    fn poll_transmission(&mut self, _: time::Instant) -> bool {
        let shared = self.lock();
        shared.stations[self.station].sends_until > shared.now
    }

    fn transmit_data<F, R>(&mut self, _: time::Instant, write: F) -> R
    where
        F: FnOnce(&mut [u8]) -> (usize, R),
    {
        let mut buffer = [0; 256];
        let (len, result) = write(&mut buffer);
        self.lock().send(self.station, &buffer[..len]);
        result
    }

    fn receive_data<F, R>(&mut self, _: time::Instant, take: F) -> R
    where
        F: FnOnce(&[u8]) -> (usize, R),
    {
        let mut shared = self.lock();
        let now = shared.now;
        let mut arrived = Vec::new();
        let arriving = &mut shared.stations[self.station].arriving;
        while let Some((_, byte)) = arriving.front().filter(|(at, _)| *at <= now) {
            arrived.push(*byte);
            arriving.pop_front();
        }
        drop(shared);
        self.received.extend(arrived);
        let (taken, result) = take(&self.received);
        self.received.drain(..taken);
        result
    }
}

#[cfg(test)]
mod tests {
    use std::vec;

    use super::*;

    fn takes(line: &mut VirtualLine) -> Vec<u8> {
        let now = line.now();
        line.receive_data(now, |bytes| (bytes.len(), bytes.to_vec()))
    }

    fn sends(line: &mut VirtualLine, bytes: &[u8]) {
        let now = line.now();
        line.transmit_data(now, |buffer| {
            buffer[..bytes.len()].copy_from_slice(bytes);
            (bytes.len(), ())
        });
    }

    #[test]
    fn bytes_take_their_time_and_do_not_come_back() {
        let mut one = VirtualLine::new(Baudrate::B500000);
        let (mut two, mut three) = (one.another_end(), one.another_end());
        sends(&mut one, &[1, 2, 3]);
        // Two characters of 22 us.
        one.advance(time::Duration::from_micros(44));
        let now = one.now();
        assert!(one.poll_transmission(now) && !two.poll_transmission(now));
        assert_eq!([takes(&mut two), takes(&mut one)], [vec![1, 2], vec![]]);
        one.advance(time::Duration::from_micros(22));
        assert!(!one.poll_transmission(now));
        assert_eq!([takes(&mut two), takes(&mut three)], [vec![3], vec![1, 2, 3]]);
        // Bytes that are not taken stay.
        sends(&mut two, &[4, 5]);
        one.advance(time::Duration::from_micros(44));
        assert_eq!(one.receive_data(now, |bytes| (1, bytes.len())), 2);
        assert_eq!(takes(&mut one), [5]);
    }

    #[test]
    fn two_that_send_at_once_garble_what_they_send_meanwhile() {
        let mut one = VirtualLine::new(Baudrate::B500000);
        let (mut two, mut three) = (one.another_end(), one.another_end());
        sends(&mut one, &[1, 2, 3]);
        one.advance(time::Duration::from_micros(44));
        sends(&mut two, &[7, 8]);
        one.advance(time::Duration::from_micros(44));
        assert_eq!(takes(&mut three), [1, 2, !3, !7, 8]);
        // Each hears the other one only.
        assert_eq!([takes(&mut two), takes(&mut one)], [vec![1, 2, 3], vec![7, 8]]);
    }
}
