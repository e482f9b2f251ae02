//! A simulated drive at the end of a line, in virtual time: bytes take as long as their baud rate says.

use std::collections::VecDeque;
use std::io;

use lexican_runtime::{Duration, Instant};

use super::SerialDrive;
use crate::client::Settings;
use crate::line::Line;

/// A line with a simulated drive at its end.
#[derive(Clone, Debug)]
pub struct VirtualLine {
    drive: SerialDrive,
    settings: Settings,
    reaction: Duration,
    now: Instant,
    to_drive: VecDeque<(Instant, u8)>,
    to_client: VecDeque<(Instant, u8)>,
}

impl VirtualLine {
    /// A line at 9600 baud without an echo.
    #[must_use]
    pub fn new(drive: SerialDrive) -> Self {
        VirtualLine::with_settings(drive, Settings::default())
    }

    /// A line at another baud rate, or with an echo.
    #[must_use]
    pub fn with_settings(drive: SerialDrive, settings: Settings) -> Self {
        let (now, reaction) = (Instant::ZERO, Duration::ZERO);
        VirtualLine { drive, settings, reaction, now, to_drive: VecDeque::new(), to_client: VecDeque::new() }
    }

    /// The drive, or its adapter, begins its answers after this time.
    #[must_use]
    pub fn with_reaction(self, reaction: Duration) -> Self {
        VirtualLine { reaction, ..self }
    }

    /// The drive.
    #[must_use]
    pub fn drive(&self) -> &SerialDrive {
        &self.drive
    }

    /// Acts on the drive, at the present time.
    pub fn with_drive<T>(&mut self, call: impl FnOnce(&mut SerialDrive, Instant) -> T) -> T {
        let result = call(&mut self.drive, self.now);
        self.answer();
        result
    }

    /// Adds bytes that the drive has not sent, such as noise.
    pub fn disturb(&mut self, bytes: &[u8]) {
        put(&mut self.to_client, self.now, &self.settings, bytes);
    }

    fn answer(&mut self) {
        while let Some(telegram) = self.drive.poll_transmit() {
            put(&mut self.to_client, self.now + self.reaction, &self.settings, telegram.as_bytes());
        }
    }
}

/// Puts bytes one after another on a line.
fn put(line: &mut VecDeque<(Instant, u8)>, now: Instant, settings: &Settings, bytes: &[u8]) {
    let begin = line.back().map_or(now, |(last, _)| now.max(*last));
    line.extend(bytes.iter().enumerate().map(|(at, byte)| (begin + settings.on_line(at + 1), *byte)));
}

impl Line for VirtualLine {
    fn now(&self) -> Instant {
        self.now
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        put(&mut self.to_drive, self.now, &self.settings, bytes);
        if self.settings.echo {
            put(&mut self.to_client, self.now, &self.settings, bytes);
        }
        Ok(())
    }

    fn receive(&mut self, until: Instant, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let came = self.to_client.iter().take_while(|(at, _)| *at <= self.now).count().min(buffer.len());
            if came > 0 {
                buffer.iter_mut().zip(self.to_client.drain(..came)).for_each(|(place, (_, byte))| *place = byte);
                return Ok(came);
            }
            let (byte, deadline) = (first(&self.to_drive), self.drive.poll_timeout());
            let Some(next) = self.next_event().filter(|at| *at <= until) else {
                self.now = self.now.max(until);
                return Ok(0);
            };
            self.now = self.now.max(next);
            if deadline == Some(next) {
                self.drive.handle_timeout(self.now);
            } else if byte == Some(next) {
                let arrived = self.to_drive.pop_front().map(|(_, byte)| byte);
                self.drive.handle_bytes(self.now, arrived.as_slice());
            }
            self.answer();
        }
    }

    fn is_real_time(&self) -> bool {
        false
    }

    fn next_event(&self) -> Option<Instant> {
        [first(&self.to_drive), self.drive.poll_timeout(), first(&self.to_client)].into_iter().flatten().min()
    }
}

/// When the next byte has arrived.
fn first(line: &VecDeque<(Instant, u8)>) -> Option<Instant> {
    line.front().map(|(at, _)| *at)
}
