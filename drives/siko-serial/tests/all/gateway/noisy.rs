//! A line that loses and alters bytes.

use std::io;

use lexican_runtime::Instant;
use siko_serial::Line;
use siko_serial::sim::VirtualLine;

/// Decides about a byte by its number, from 0 in both directions together; `None` loses it.
type Fate = Box<dyn FnMut(u64, u8) -> Option<u8> + Send>;

pub(crate) struct Noisy {
    pub(crate) line: VirtualLine,
    fate: Fate,
    bytes: u64,
}

impl Noisy {
    pub(crate) fn new(line: VirtualLine) -> Self {
        Noisy { line, fate: Box::new(|_, byte| Some(byte)), bytes: 0 }
    }

    pub(crate) fn set_fate(&mut self, fate: impl FnMut(u64, u8) -> Option<u8> + Send + 'static) {
        (self.fate, self.bytes) = (Box::new(fate), 0);
    }

    /// The number of bytes since the fate was set.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    fn decide(&mut self, byte: u8) -> Option<u8> {
        self.bytes += 1;
        (self.fate)(self.bytes - 1, byte)
    }
}

impl Line for Noisy {
    fn now(&self) -> Instant {
        self.line.now()
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let bytes: Vec<u8> = bytes.iter().filter_map(|byte| self.decide(*byte)).collect();
        self.line.send(&bytes)
    }

    fn receive(&mut self, until: Instant, buffer: &mut [u8]) -> io::Result<usize> {
        let len = self.line.receive(until, buffer)?;
        let kept: Vec<u8> = buffer[..len].iter().filter_map(|byte| self.decide(*byte)).collect();
        buffer[..kept.len()].copy_from_slice(&kept);
        Ok(kept.len())
    }

    fn is_real_time(&self) -> bool {
        false
    }

    fn next_event(&self) -> Option<Instant> {
        self.line.next_event()
    }
}
