//! SDO transfers, client and server in one thread and without a bus, and frames that are not ours.
//!
//! Every frame passes through [`black_box`]: what one side emits is not known to the other when it is compiled, as
//! on a bus. Objects are asked in an order that no cache and no branch predictor can learn from few. Before it is
//! timed, every contender has to bring bytes to and fro unharmed.

mod canopen_rs;
mod canopen_sdo;
mod dispatch;
mod lexican;
mod zencan;

use std::hint::black_box;

use crate::measure::{self, Figure};
use crate::report::{self, Goals};

const ROUNDS: usize = 200;

/// How many copies of each contender there are.
///
/// Where memory lies matters to the processor: a load waits for a store before it whose address has the same low
/// twelve bits. One copy would have good or bad luck for a whole run; it was seen to take 1.7 times as long.
const COPIES: usize = 8;

/// A kind of transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// An UNSIGNED32 of so many objects, from 2000h on.
    Expedited { objects: u16 },
    /// So many bytes, by segments.
    Segmented { len: usize },
    /// So many bytes, by blocks of 127 segments, with CRC.
    Block { len: usize },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    Read,
    Write,
}

#[derive(Clone, Copy, Debug)]
struct Case {
    direction: Direction,
    kind: Kind,
}

impl Case {
    fn name(self) -> String {
        let direction = if self.direction == Direction::Read { "read" } else { "write" };
        match self.kind {
            Kind::Expedited { objects } => format!("u32 {direction}, {objects} objects"),
            Kind::Segmented { len } => format!("{len} bytes {direction}, segmented"),
            Kind::Block { len } => format!("{len} bytes {direction}, block"),
        }
    }

    fn bytes(self) -> usize {
        match self.kind {
            Kind::Expedited { .. } => 4,
            Kind::Segmented { len } | Kind::Block { len } => len,
        }
    }
}

const KINDS: [Kind; 6] = [
    Kind::Expedited { objects: 10 },
    Kind::Expedited { objects: 1000 },
    Kind::Segmented { len: 32 },
    Kind::Segmented { len: 1200 },
    Kind::Block { len: 1200 },
    Kind::Block { len: 65536 },
];

pub(crate) fn run() {
    let mut goals = Goals::default();
    let mut small_read = None;
    report::head("SDO, both sides in one thread");
    for kind in KINDS {
        for direction in [Direction::Read, Direction::Write] {
            let case = Case { direction, kind };
            let figures = measure(case);
            report::rows(&case.name(), case.bytes(), &figures);
            judge(case, &figures, &mut small_read, &mut goals);
        }
    }
    dispatch::run(&mut goals);
    goals.print();
}

fn measure(case: Case) -> Vec<Figure> {
    let contenders = || {
        let contenders = [
            Some(lexican::server(case)),
            Some(lexican::device(case)),
            canopen_sdo::contender(case),
            canopen_rs::contender(case),
            Some(zencan::contender(case)),
        ];
        contenders.into_iter().flatten().collect()
    };
    measure::race((0..COPIES).map(|_| contenders()).collect(), ROUNDS)
}

fn judge(case: Case, figures: &[Figure], small_read: &mut Option<f64>, goals: &mut Goals) {
    match (case.kind, case.direction) {
        (Kind::Expedited { objects: 10 }, Direction::Read) => {
            *small_read = report::ours(figures).map(|figure| figure.best_ns);
        }
        (Kind::Expedited { .. }, Direction::Read) => {
            if let (Some(small), Some(large)) = (*small_read, report::ours(figures)) {
                goals.at_most("u32 read: 1000 objects against 10", large.best_ns / small, 1.5, " times");
            }
            goals.fastest(&case.name(), figures);
        }
        (Kind::Expedited { .. }, Direction::Write) => {}
        _ => goals.fastest(&case.name(), figures),
    }
}

/// Both directions, for all who can. What is read must be what was written.
trait Transfer {
    /// Reads an entry, sub-index 0.
    fn read(&mut self, index: u16, len: usize) -> Vec<u8>;
    fn write(&mut self, index: u16, data: &[u8]);
    /// Frames so far, in both directions.
    fn frames(&self) -> u64;
}

/// Checks that the bytes arrive, and counts the frames of one transfer.
fn check(case: Case, transfer: &mut dyn Transfer) -> u64 {
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
fn bytes_index(len: usize) -> u16 {
    match len {
        32 => 0x4000,
        1200 => 0x4001,
        _ => 0x4002,
    }
}

/// Bytes that look like any.
fn pattern(len: usize, seed: u16) -> Vec<u8> {
    measure::scatter();
    let mut state = u32::from(seed) + 1;
    let mut byte = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..len).map(|_| byte()).collect()
}

/// The indices of many objects, each once before any comes again, far apart.
struct Indices {
    objects: u16,
    at: u16,
}

impl Indices {
    fn new(objects: u16) -> Self {
        Indices { objects, at: 0 }
    }

    fn next(&mut self) -> u16 {
        // A prime that divides neither number of objects.
        self.at = (self.at + 617) % self.objects;
        black_box(0x2000 + self.at)
    }
}
