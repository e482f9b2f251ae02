//! Runs in which each frame in turn is lost once.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use lexican_driver::CancelHandle;
use lexican_driver::cyclic::{Follower, Report, Settings, Stop, Supply, Tolerance, follow};
use lexican_runtime::host::{Fate, VirtualBus};
use lexican_runtime::{CobId, Duration, Frame};

use crate::rig::{Rig, figure};
use crate::servo;
use crate::servos::{SETTINGS, check_at_rest, there_and_back};

/// The number of frames in a cycle of six axes: SYNC, and two for each axis.
const CYCLE: u64 = 13;

/// Whether the frame with a number is lost.
type Lost = Box<dyn Fn(u64, &Frame) -> bool + Send>;

/// The numbers of the frames of a run.
#[derive(Clone, Default)]
struct Frames {
    all: Vec<u64>,
    lost: Vec<u64>,
}

/// Loses frames of six axes. The number of a frame consists of its cycle and its COB-ID, so it is the same in all runs,
/// even in those that lose a SYNC and so have fewer frames.
fn lose(bus: &VirtualBus, lost: Lost) -> Arc<Mutex<Frames>> {
    let frames = Arc::new(Mutex::new(Frames::default()));
    let (noted, mut syncs) = (Arc::clone(&frames), 0);
    bus.set_fate(move |_, frame| {
        let place = match frame.id().raw() {
            0x080 => 0,
            rpdo @ 0x301..=0x306 => rpdo - 0x300,
            tpdo @ 0x381..=0x386 => tpdo - 0x380 + 6,
            _ => return Fate::Deliver,
        };
        syncs += u64::from(place == 0);
        let number = CYCLE * (syncs - 1) + u64::from(place);
        let mut noted = noted.lock().unwrap();
        noted.all.push(number);
        if !lost(number, frame) {
            return Fate::Deliver;
        }
        noted.lost.push(number);
        Fate::Lose
    });
    frames
}

/// Loses each frame of a run once, from the enabling of the axes to their release: several in each run, one in every
/// `apart` cycles and one frame; and those near the end one by one, if no other run has lost them. A run must end as
/// one without losses, except that positions may differ by `but_for`. Returns the report of a run without losses.
#[track_caller]
fn lose_each_once(apart: u64, most_error: u32, but_for: u32, run: impl Fn(Lost) -> (Report, Frames)) -> Report {
    let (expected, Frames { all, .. }) = run(Box::new(|_, _| false));
    let mut spared: BTreeSet<u64> = all.into_iter().collect();
    let mut check = |what: &str, lost: Lost| {
        let (report, frames) = run(lost);
        let what = format!("{what}: {report}\nwithout a loss: {expected}");
        assert_eq!((report.reason, report.cycles), (expected.reason, expected.cycles), "{what}");
        for (axis, expected) in report.axes.iter().zip(&expected.axes) {
            assert_eq!(axis.end, expected.end, "{what}");
            assert!(axis.position.abs_diff(expected.position) <= but_for, "{what}");
            assert!(axis.following_error <= most_error, "{what}");
        }
        frames.lost.iter().for_each(|number| {
            spared.remove(number);
        });
        spared.last().copied()
    };
    let every = apart * CYCLE + 1;
    let mut left = None;
    for rest in 0..every {
        left = check(&format!("every {every}th, from {rest} on"), Box::new(move |at, _| at % every == rest));
    }
    while let Some(number) = left {
        left = check(&format!("frame {number}"), Box::new(move |at, _| at == number));
        assert_ne!(left, Some(number), "it is lost");
    }
    expected
}

/// Six axes follow a figure of one second.
fn run(settings: Settings, lost: Lost) -> (Report, Frames) {
    let mut rig = Rig::new(6);
    let frames = lose(&rig.bus, lost);
    let report = rig.follow(figure(1000), settings);
    rig.check_at_rest(&report.to_string());
    let frames = frames.lock().unwrap().clone();
    (report, frames)
}

#[test]
fn every_single_frame_may_be_lost() {
    let report = lose_each_once(10, 60, 0, |lost| run(Settings::default(), lost));
    assert_eq!((report.reason, report.cycles), (None, 1000), "{report}");
    assert!(report.axes.iter().zip(1..).all(|(axis, number)| axis.position == number * 1000), "{report}");
}

/// Six simulated servos at 1 ms. Six cycles after a loss, it has no effect on them or on the follower: the longest
/// memory is that of the last four set-points.
#[track_caller]
fn check_servos(stop: Stop, supplied: u64, but_for: u32) -> Report {
    lose_each_once(6, 120, but_for, |lost| {
        let (bus, servos) = servo::bus(6);
        let axes = servo::axes(&bus, 6, SETTINGS);
        let mut path = there_and_back(30);
        let path = move |cycle: u64, set_points: &mut [i32]| match path(cycle, set_points) {
            Supply::Ready if cycle >= supplied => Supply::Late,
            supply => supply,
        };
        let frames = lose(&bus, lost);
        let mut follower = Follower::new(axes, path, Settings { stop, ..Settings::default() }).unwrap();
        let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
        check_at_rest(&bus, &servos, &report.to_string());
        let frames = frames.lock().unwrap().clone();
        (report, frames)
    })
}

#[test]
fn every_single_frame_of_servos_may_be_lost_on_a_path_to_its_end() {
    let report = check_servos(Stop::Quick, u64::MAX, 0);
    assert_eq!((report.reason, report.cycles), (None, 31), "{report}");
    assert!(report.axes.iter().all(|axis| axis.position == 0 && axis.following_error == 0), "{report}");
}

#[test]
fn every_single_frame_of_servos_may_be_lost_on_a_path_that_is_stopped() {
    // A quick stop whose frame is lost is one cycle late.
    for (stop, but_for) in [(Stop::Ramp(Duration::from_millis(10)), 0), (Stop::Quick, 80)] {
        let report = check_servos(stop, 8, but_for);
        let reason = report.reason.map(|reason| reason.to_string());
        assert_eq!(reason.as_deref(), Some("the program had no set-points for 3 cycles"), "{stop:?}: {report}");
    }
}

/// Without tolerance, a lost frame is either named or makes no difference.
#[test]
fn without_tolerance_a_lost_frame_is_named() {
    let tolerance = Tolerance { cycles: 0, pdos: 0, set_points: 0 };
    let settings = Settings { tolerance, ..Settings::default() };
    let reasons = Arc::new(Mutex::new(Vec::new()));
    for number in 400 * CYCLE..401 * CYCLE {
        let names = Arc::clone(&reasons);
        let lost = move |at, frame: &Frame| {
            if at == number {
                names.lock().unwrap().push(frame.id());
            }
            at == number
        };
        let (report, _) = run(settings, Box::new(lost));
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
