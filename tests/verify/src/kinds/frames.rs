//! Frames byte for byte: exchanged with the drive in the order of the manual, or caused by programs.

use std::collections::VecDeque;

use lexican_conform::{Asked, Step, StepReport, Verdict, ask};
use lexican_runtime::wire::sdo::{ClientRequest, ServerResponse};
use lexican_runtime::{Duration, Frame};

use crate::checker::{Against, Checker};
use crate::drive::Case;
use crate::manual::{Row, cells};
use crate::notation::{bytes, hex, print};
use crate::rig::{Rig, Simulator, once};

/// Sends each frame to the drive, and compares the answers with the rows that follow. The columns `cob_id`, `data` and
/// `direction` are compared; the meaning of a row is not.
pub(crate) fn exchange<S: Simulator>(checker: &mut Checker<'_>, rows: &[Row], rig: &mut Rig<S>) {
    let mut answers: VecDeque<Frame> = VecDeque::new();
    rig.hear(0);
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
                if id == u32::from(Rig::<S>::own(0x600)) {
                    data.resize(8, 0);
                }
                rig.send(id as u16, &data);
                answers.extend(rig.hear(0));
                let is_answered = next.is_some_and(|next| next.get("direction") == "from drive");
                (if answers.is_empty() == is_answered { 0 } else { id }, data)
            }
        };
        checker.cell(row, "cob_id", Against::Drive, format!("{id:X}"));
        checker.cell(row, "data", Against::Drive, print(&data));
        if row.has("condition") {
            let known = row.get("condition").is_empty() || is_any_value(row);
            checker.that(row, "condition", Against::Manual, known, "no such condition");
        }
    }
    checker.require(answers.is_empty(), || format!("{} answers more than rows", answers.len()));
}

/// A chapter, whether its order matters, and a function that returns the frames while a program does what the chapter
/// does.
pub(crate) type Example = (&'static str, bool, fn() -> Vec<Frame>);

/// Compares what the manager of an example sends: each frame of a chapter is sent by the program, or is the one of
/// `made` with its number. `made` has the frames that no program sends, and the right ones where the manual is wrong.
pub(crate) fn sent<S: Simulator>(
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
        let (id, data) = printed(row);
        checker.cell(row, "kind", Against::Code, kind(id, &data));
        if is_of_drive(id) {
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

/// Compares what the drive of an example answers. It is sent every printed frame of the manager, or the right one in
/// its place, in the order of the manual. The column `condition` says where the answer depends on time or on the world;
/// what depends on the world is up to [`Asked::world`].
pub(crate) fn answered<S: Simulator, A: Asked>(
    checker: &mut Checker<'_>,
    case: &Case<'_>,
    made: fn() -> Vec<(&'static str, Frame)>,
    start: fn(&str) -> A,
) {
    let rows = case.manual.rows("frames.csv");
    let found = once::<S, _>(cells(rows), || answers(rows, &made(), start));
    for (row, (step, report)) in rows.iter().zip(found) {
        let known = !matches!(report.outcome, Err(Verdict::NotApplicable(_)));
        checker.that(row, "condition", Against::Manual, known, "no such condition");
        if report.is_sent {
            continue;
        }
        let Some(frame) = report.seen else {
            for column in ["cob_id", "data"] {
                checker.that(row, column, Against::Drive, false, "nothing");
            }
            continue;
        };
        checker.cell(row, "cob_id", Against::Drive, format!("{:03X}", frame.id().raw()));
        checker.that(row, "data", Against::Drive, step.has_data_like(&frame), print(frame.data()));
    }
}

/// For each row, its step, and the result.
fn answers<A: Asked>(rows: &[Row], made: &[(&'static str, Frame)], start: fn(&str) -> A) -> Vec<(Step, StepReport)> {
    let mut found = Vec::new();
    for chapter in rows.chunk_by(|a, b| a.get("chapter") == b.get("chapter")) {
        let steps: Vec<Step> = chapter.iter().map(|row| step(row, made)).collect();
        let mut asked = start(chapter.first().map_or("", |row| row.get("chapter")));
        // A frame takes no time on this bus.
        let reports = ask(&mut asked, &steps, Duration::ZERO, true);
        found.extend(steps.into_iter().zip(reports));
    }
    found
}

/// Whether another device may have another value than the manual's example.
fn is_any_value(row: &Row) -> bool {
    row.get("condition") == "any value"
}

/// A row as a step of the rig. A row that cannot be parsed becomes a step that no rig knows.
fn step(row: &Row, made: &[(&'static str, Frame)]) -> Step {
    // The simulated drive is compared with the printed value all the same; errata say why its own differs.
    let cell = |column: &str| if column == "condition" && is_any_value(row) { "" } else { row.get(column) };
    let parsed = Step::parse(0, cell).or_else(|_| Step::parse(0, |_| ""));
    let mut step = parsed.expect("an empty row is a wait");
    if let Some((_, frame)) = made.iter().find(|(name, _)| *name == row.key) {
        step.send_instead(frame);
    }
    step
}

fn printed(row: &Row) -> (u32, Vec<u8>) {
    (hex(row.get("cob_id")).unwrap_or(0), bytes(row.get("data")).unwrap_or_default())
}

/// Whether drives send frames with this identifier.
fn is_of_drive(id: u32) -> bool {
    id > 0x80 && (id >> 7 & 1 == 1 || id >= 0x700)
}

/// The kind of a frame by its identifier and, for SDO, by what the runtime reads in it.
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
