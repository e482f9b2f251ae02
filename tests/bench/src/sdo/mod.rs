//! SDO transfers, client and server in one thread and without a bus, and frames that are not ours.
//!
//! Every frame passes through [`black_box`]: what one side emits is not known to the other when it is compiled, as
//! on a bus. Objects are asked in an order that no cache and no branch predictor can learn from few. Before it is
//! timed, every contender has to bring bytes to and fro unharmed.

mod canopen_rs;
mod canopen_sdo;
pub(crate) mod dispatch;
mod lexican;
mod transfer;
mod zencan;

use crate::measure::{self, Figure};
use crate::report::{self, Goals};
use transfer::{Case, Direction, Kind, ROUNDS};

/// How many copies of each contender there are.
///
/// Where memory lies matters to the processor: a load waits for a store before it whose address has the same low
/// twelve bits. One copy would have good or bad luck for a whole run; it was seen to take 1.7 times as long.
const COPIES: usize = 8;

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
