//! Frames byte for byte, exchanged with the drive in the order in which the manual prints them.

use std::collections::VecDeque;

use lexican_runtime::Frame;

use crate::bench::{Bench, Simulator};
use crate::checker::{Against, Checker};
use crate::manual::Row;
use crate::notation::{bytes, hex, print};

/// Sends each frame to the drive, and compares what it answers with the rows that follow. The columns `cob_id`, `data`
/// and `direction` are compared; what the rows mean is not.
pub(crate) fn exchange<S: Simulator>(checker: &mut Checker<'_>, rows: &[Row], bench: &mut Bench<S>) {
    let mut answers: VecDeque<Frame> = VecDeque::new();
    bench.hear(0);
    for (row, next) in rows.iter().zip(rows.iter().skip(1).map(Some).chain([None])) {
        checker.key(row);
        let answer = answers.pop_front();
        let direction = if answer.is_some() { "from drive" } else { "to drive" };
        checker.cell(row, "direction", Against::Drive, direction);
        let (id, data) = match answer {
            Some(frame) => (frame.id().raw(), frame.data().to_vec()),
            None => {
                let (id, mut data) = (hex(row.get("cob_id")).unwrap_or(0), bytes(row.get("data")).unwrap_or_default());
                // An SDO has eight bytes.
                if id == u32::from(Bench::<S>::own(0x600)) {
                    data.resize(8, 0);
                }
                bench.send(id as u16, &data);
                answers.extend(bench.hear(0));
                let is_answered = next.is_some_and(|next| next.get("direction") == "from drive");
                (if answers.is_empty() == is_answered { 0 } else { id }, data)
            }
        };
        checker.cell(row, "cob_id", Against::Drive, format!("{id:X}"));
        checker.cell(row, "data", Against::Drive, print(&data));
    }
    checker.require(answers.is_empty(), || format!("{} answers more than rows", answers.len()));
}
