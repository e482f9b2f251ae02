//! The transfers that every contender makes, and the check that its bytes arrive.

use std::hint::black_box;

use crate::measure;

pub(super) const ROUNDS: usize = 200;

/// A kind of transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// An UNSIGNED32 of so many objects, from 2000h on.
    Expedited { objects: u16 },
    /// So many bytes, by segments.
    Segmented { len: usize },
    /// So many bytes, by blocks of 127 segments, with CRC.
    Block { len: usize },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    Read,
    Write,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Case {
    pub(super) direction: Direction,
    pub(super) kind: Kind,
}

impl Case {
    pub(super) fn name(self) -> String {
        let direction = if self.direction == Direction::Read { "read" } else { "write" };
        match self.kind {
            Kind::Expedited { objects } => format!("u32 {direction}, {objects} objects"),
            Kind::Segmented { len } => format!("{len} bytes {direction}, segmented"),
            Kind::Block { len } => format!("{len} bytes {direction}, block"),
        }
    }

    pub(super) fn bytes(self) -> usize {
        match self.kind {
            Kind::Expedited { .. } => 4,
            Kind::Segmented { len } | Kind::Block { len } => len,
        }
    }
}

/// A contender in both directions. What is read must be what was written.
pub(super) trait Transfer {
    /// Reads an entry, sub-index 0.
    fn read(&mut self, index: u16, len: usize) -> Vec<u8>;
    fn write(&mut self, index: u16, data: &[u8]);
    /// Frames so far, in both directions.
    fn frames(&self) -> u64;
}

/// Checks that the bytes arrive, and counts the frames of one transfer.
pub(super) fn check(case: Case, transfer: &mut dyn Transfer) -> u64 {
    let (indices, len) = match case.kind {
        Kind::Expedited { objects } => (0x2000..0x2000 + objects, 4),
        Kind::Segmented { len } | Kind::Block { len } => (bytes_index(len)..bytes_index(len) + 1, len),
    };
    for index in indices.clone() {
        transfer.write(index, &pattern(len, index));
    }
    for index in indices.clone() {
        assert_eq!(transfer.read(index, len), pattern(len, index), "{index:04X} as it was written");
    }
    let before = transfer.frames();
    match case.direction {
        Direction::Read => drop(transfer.read(indices.start, len)),
        Direction::Write => transfer.write(indices.start, &pattern(len, indices.start)),
    }
    transfer.frames() - before
}

/// Which object holds so many bytes.
pub(super) fn bytes_index(len: usize) -> u16 {
    match len {
        32 => 0x4000,
        1200 => 0x4001,
        _ => 0x4002,
    }
}

/// Bytes that look like any.
pub(super) fn pattern(len: usize, seed: u16) -> Vec<u8> {
    measure::scatter();
    let mut state = u32::from(seed) + 1;
    let mut byte = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..len).map(|_| byte()).collect()
}

/// The indices of many objects, far apart, in an order in which each comes once before any comes again.
pub(super) struct Indices {
    objects: u16,
    at: u16,
}

impl Indices {
    pub(super) fn new(objects: u16) -> Self {
        Indices { objects, at: 0 }
    }

    pub(super) fn next(&mut self) -> u16 {
        // A prime that divides neither number of objects.
        self.at = (self.at + 617) % self.objects;
        black_box(0x2000 + self.at)
    }
}
