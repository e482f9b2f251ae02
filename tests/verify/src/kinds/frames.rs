//! Frames byte for byte: exchanged with the drive in the order in which the manual prints them, or brought about by programs.

use std::collections::VecDeque;

use lexican_runtime::Frame;
use lexican_runtime::wire::sdo::{ClientRequest, ServerResponse};

use crate::bench::{Bench, Simulator, once};
use crate::checker::{Against, Checker};
use crate::drive::Case;
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

/// A chapter, whether its order counts, and what goes over the bus while a program does what the chapter does.
pub(crate) type Example = (&'static str, bool, fn() -> Vec<Frame>);

/// Compares `frames.csv`: every frame of a chapter goes over the bus, or is the one of `made` with its number. The latter
/// has what no program brings about, and what is right where the manual is wrong.
pub(crate) fn examples<S: Simulator>(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    chapters: &[Example],
    made: fn() -> Vec<(&'static str, Frame)>,
) {
    let rows = case.manual.rows("frames.csv");
    let made = once::<S, _>((), made);
    let mut sent: Vec<(&str, bool, Vec<Frame>)> = chapters
        .iter()
        .enumerate()
        .map(|(at, (chapter, in_order, frames))| (*chapter, *in_order, once::<S, _>(at, frames)))
        .collect();
    for (row, number) in rows.iter().zip(1..) {
        checker.cell(row, "frame", Against::Manual, format!("F{number:03}"));
        let (id, data) = (hex(row.get("cob_id")).unwrap_or(0), bytes(row.get("data")).unwrap_or_default());
        checker.cell(row, "kind", Against::Code, kind(id, &data));
        if case.drive.exempt.row(row.file, &row.key) {
            continue;
        }
        let is_it = |frame: &Frame| frame.id().raw() == id && frame.data() == data;
        if let Some((_, frame)) = made.iter().find(|(name, _)| *name == row.key) {
            checker.cell(row, "cob_id", Against::Code, format!("{:03X}", frame.id().raw()));
            checker.cell(row, "data", Against::Code, print(frame.data()));
            continue;
        }
        let chapter = sent.iter_mut().filter(|(of, ..)| *of == row.get("chapter"));
        let place = chapter.into_iter().find_map(|(_, in_order, frames)| {
            let at = frames.iter().position(is_it)?;
            let first = if *in_order { 0 } else { at };
            frames.drain(first..=at);
            Some(())
        });
        for column in ["cob_id", "data"] {
            checker.that(row, column, Against::Code, place.is_some(), "not sent");
        }
    }
}

/// What a frame is by its identifier and, of SDO, by what the runtime reads.
fn kind(id: u32, data: &[u8]) -> String {
    let data: [u8; 8] = std::array::from_fn(|at| data.get(at).copied().unwrap_or(0));
    let known = match id {
        0 => "NMT",
        0x080 => "SYNC",
        0x081..=0x0FF => "EMCY",
        0x701..=0x77F => "boot-up",
        0x601..=0x67F => match ClientRequest::parse(&data) {
            Some(ClientRequest::InitiateUpload { .. }) => "upload request",
            Some(ClientRequest::InitiateDownload { .. }) => "download request",
            _ => "",
        },
        0x581..=0x5FF => match ServerResponse::parse(&data) {
            Some(ServerResponse::InitiateUpload { .. }) => "upload response",
            Some(ServerResponse::InitiateDownload { .. }) => "download response",
            Some(ServerResponse::Abort(_)) => "abort",
            _ => "",
        },
        _ if id & 0x80 == 0 => return format!("RPDO{}", (id >> 8) - 1),
        _ => return format!("TPDO{}", id >> 8),
    };
    known.into()
}
