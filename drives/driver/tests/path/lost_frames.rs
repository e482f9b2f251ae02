//! Every frame of a run lost once.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use lexican_driver::cyclic::{Report, Settings, Tolerance};
use lexican_runtime::host::Fate;
use lexican_runtime::{CobId, Frame};

use crate::rig::{Rig, figure};

/// How many frames a cycle of six axes has: SYNC, and two for each.
const CYCLE: u64 = 13;

/// How many cycles lie between two losses.
const APART: u64 = 10;

/// Six axes follow a figure of a second, and all frames whose number leaves `rest` are lost.
fn run(settings: Settings, lost: impl Fn(u64, &Frame) -> bool + Send + 'static) -> (Report, u64) {
    let mut rig = Rig::new(6);
    let count = Arc::new(AtomicU64::new(0));
    let frames = Arc::clone(&count);
    rig.bus.set_fate(move |number, frame| {
        frames.store(number + 1, Ordering::Relaxed);
        if lost(number, frame) { Fate::Lose } else { Fate::Deliver }
    });
    let report = rig.follow(figure(1000), settings);
    let frames = count.load(Ordering::Relaxed);
    rig.check_at_rest(&report.to_string());
    (report, frames)
}

/// One that is lost at a time makes no difference to where the axes go: each one of a second of path is lost once, in runs
/// that lose every 131st.
#[test]
fn every_single_frame_may_be_lost() {
    let every = APART * CYCLE + 1;
    for rest in 0..every {
        let (report, frames) = run(Settings::default(), move |number, _| number % every == rest);
        assert!(frames > 1000 * CYCLE, "{frames}");
        assert_eq!((report.reason, report.cycles), (None, 1000), "every {every}th, from {rest} on: {report}");
        for (axis, number) in report.axes.iter().zip(1..) {
            assert_eq!(axis.position, number * 1000, "from {rest} on: {report}");
            assert!(axis.following_error < 60, "from {rest} on: {report}");
        }
    }
}

/// Where none may be lost, a lost one has a name, or makes no difference.
#[test]
fn without_tolerance_a_lost_frame_is_named() {
    let tolerance = Tolerance { cycles: 0, pdos: 0, set_points: 0 };
    let settings = Settings { tolerance, ..Settings::default() };
    let reasons = Arc::new(Mutex::new(Vec::new()));
    for number in 400 * CYCLE..401 * CYCLE {
        let (names, lost) = (Arc::clone(&reasons), move |at, _: &Frame| at == number);
        let (report, _) = run(settings, move |at, frame| {
            if lost(at, frame) {
                names.lock().unwrap().push(frame.id());
            }
            lost(at, frame)
        });
        let id = *reasons.lock().unwrap().last().expect("the frame was sent");
        let expected = match id.raw() {
            0x080 => Some("node 1: its PDO has not come for 1 cycles".to_owned()),
            tpdo @ 0x381..=0x386 => Some(format!("node {}: its PDO has not come for 1 cycles", tpdo - 0x380)),
            _ => None,
        };
        assert_eq!(report.reason.map(|reason| reason.to_string()), expected, "{id:?}: {report}");
    }
    let mut ids = reasons.lock().unwrap().clone();
    ids.sort_by_key(|id| id.raw());
    ids.dedup();
    assert_eq!((ids.len(), ids.first()), (13, Some(&CobId::SYNC)), "each of a cycle");
}
