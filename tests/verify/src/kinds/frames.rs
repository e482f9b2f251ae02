//! Frames byte for byte, exchanged with the drive in the order in which the manual prints them.

use std::collections::VecDeque;

use lexican_runtime::Frame;

use crate::bench::{Bench, Simulator};
use crate::checker::{Against, Checker};
use crate::manual::Row;
use crate::notation::{bytes, hex, print};

/// Sends each printed request of the SDO client, and compares the answer with the row that follows. `cob_id`, `data` and
/// `direction` are compared; what the rows mean is not.
pub(crate) fn sdo<S: Simulator>(checker: &mut Checker<'_>, rows: &[Row], bench: &mut Bench<S>) {
    let mut answers: VecDeque<Frame> = VecDeque::new();
    bench.hear(0);
    for row in rows {
        checker.key(row);
        let answer = answers.pop_front();
        let direction = if answer.is_some() { "from drive" } else { "to drive" };
        checker.cell(row, "direction", Against::Drive, direction);
        let (id, data) = match answer {
            Some(frame) => (frame.id().raw(), frame.data().to_vec()),
            None => {
                // An SDO has eight bytes.
                let mut data = bytes(row.get("data")).unwrap_or_default();
                data.resize(8, 0);
                let id = hex(row.get("cob_id")).unwrap_or(0);
                bench.send(id as u16, &data);
                answers.extend(bench.hear(0));
                (if answers.is_empty() { 0 } else { id }, data)
            }
        };
        checker.cell(row, "cob_id", Against::Drive, format!("{id:X}"));
        checker.cell(row, "data", Against::Drive, print(&data));
    }
    checker.require(answers.is_empty(), || format!("{} answers more than rows", answers.len()));
}
