//! Paths, lost frames and power cuts with simulated servos of CiA 402.

use std::sync::{Arc, Mutex};

use lexican_driver::cyclic::{AxisSettings, Follower, Settings, Supply, follow};
use lexican_driver::sequence::{Recovered, Recovery};
use lexican_driver::{CancelHandle, Drive, Error, Mode, Outcome};
use lexican_runtime::host::{Fate, VirtualBus, VirtualLink};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, NodeId};

use crate::rig::PERIOD;
use crate::servo::{Servo, Supplied, axes, bus};

const SETTINGS: AxisSettings = AxisSettings::new(Mode::CyclicPosition, PERIOD, 40);
const RECOVERY: Recovery = Recovery::within(Duration::from_secs(5));

const CYCLES: u64 = 300;

/// From rest to rest and back, one axis further than the other; the largest step is 38.
fn there_and_back(cycle: u64, set_points: &mut [i32]) -> Supply {
    let turn = std::f64::consts::TAU * cycle.min(CYCLES) as f64 / CYCLES as f64;
    for (number, set_point) in (1..).zip(set_points) {
        *set_point = (f64::from(number) * 300.0 * (1.0 - turn.cos())).round() as i32;
    }
    if cycle <= CYCLES { Supply::Ready } else { Supply::End }
}

/// All shafts stand, and none is where it has not been sent: within what the path and its ramp reach.
#[track_caller]
fn check_at_rest(bus: &VirtualBus, servos: &[Arc<Mutex<Supplied>>], what: &str) {
    let shafts = || servos.iter().map(|servo| servo.lock().unwrap().shaft(bus.now())).collect::<Vec<f64>>();
    let before = shafts();
    bus.advance(Duration::from_millis(500));
    assert_eq!(before, shafts(), "{what}");
    for (number, shaft) in (1..).zip(before) {
        assert!((-250.0..=f64::from(number) * 600.0 + 250.0).contains(&shaft), "{what}: {number} at {shaft}");
    }
}

#[test]
fn servos_follow_in_each_mode_of_positions() {
    for (mode, count) in [(Mode::CyclicPosition, 6), (Mode::InterpolatedPosition, 2)] {
        let (bus, servos) = bus(count);
        let axes = axes(&bus, count, AxisSettings { mode, ..SETTINGS });
        let mut follower = Follower::new(axes, there_and_back, Settings::default()).unwrap();
        let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
        assert_eq!((report.reason, report.cycles), (None, CYCLES + 1), "{mode}: {report}");
        assert!(report.axes.iter().all(|axis| axis.position == 0 && axis.following_error == 0), "{mode}: {report}");
        check_at_rest(&bus, &servos, "the end");
    }
}

#[test]
fn servos_follow_velocities_from_rest_to_rest() {
    let (bus, servos) = bus(2);
    let axes = axes(&bus, 2, AxisSettings { max_step: 100, ..AxisSettings::new(Mode::CyclicVelocity, PERIOD, 100) });
    let path = |cycle: u64, set_points: &mut [i32]| {
        let ramp = 50 * cycle.min(300 - cycle.min(300)).min(100) as i32;
        set_points.copy_from_slice(&[ramp, -ramp]);
        if cycle <= 300 { Supply::Ready } else { Supply::End }
    };
    let mut follower = Follower::new(axes, path, Settings::default()).unwrap();
    let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
    assert_eq!(report.reason, None, "{report}");
    let shafts = [0, 1].map(|axis| servos[axis].lock().unwrap().shaft(bus.now()));
    // 5000 units/s for 0.2 s.
    assert!((990.0..1010.0).contains(&shafts[0]) && (-1010.0..-990.0).contains(&shafts[1]), "{shafts:?}");
}

/// Every 131st frame is lost: 10 cycles of 13 frames, and one, so that each kind of frame is. That each single one may be
/// lost, the axes of `lost_frames` show, which cost less.
#[test]
fn servos_go_on_without_a_frame_now_and_then() {
    let (bus, servos) = bus(6);
    let axes = axes(&bus, 6, SETTINGS);
    bus.set_fate(|number, _| if number % 131 == 0 { Fate::Lose } else { Fate::Deliver });
    let mut follower = Follower::new(axes, there_and_back, Settings::default()).unwrap();
    let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
    assert_eq!((report.reason, report.cycles), (None, CYCLES + 1), "{report}");
    assert!(report.axes.iter().all(|axis| axis.position == 0 && axis.following_error < 120), "{report}");
    assert!(report.axes.iter().any(|axis| axis.missing > 0), "{report}");
    check_at_rest(&bus, &servos, &report.to_string());
}

/// What is done when the power fails.
type Operate = fn(&mut Drive<VirtualLink, Servo>) -> Result<(), Error>;

/// Cuts the power at each frame of an operation. The operation then ends, the drive is back, does not move when it is enabled,
/// and moves when it is ordered to.
#[track_caller]
fn check_power_cuts(operate: Operate) -> u64 {
    for frames in 0.. {
        let (bus, servos) = bus(1);
        let shaft = || servos[0].lock().unwrap().shaft(bus.now());
        let mut drive = Drive::<_, Servo>::connect(bus.link(), NodeId::literal(1)).unwrap();
        servos[0].lock().unwrap().left = Some(frames);
        let result = operate(&mut drive);
        if servos[0].lock().unwrap().left.is_some() {
            result.unwrap();
            return frames;
        }
        let what = format!("after frame {frames}: {result:?}");
        bus.advance(Duration::from_secs(1));
        let stands_at = shaft();
        let Recovered { now, .. } = drive.recover(&RECOVERY).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(now.state, Some(State::SwitchOnDisabled), "{what}");
        drive.set_mode(Mode::Positioning).unwrap();
        drive.enable().unwrap();
        bus.advance(Duration::from_secs(1));
        assert_eq!(shaft(), stands_at, "{what}");
        let target = now.position.unwrap() + 200;
        assert_eq!(drive.move_to(target).unwrap(), Outcome::Reached { position: target }, "{what}");
    }
    unreachable!("the operation ends")
}

#[test]
fn a_power_cut_at_any_frame_of_an_operation_leaves_a_drive_that_comes_back_and_does_not_move() {
    let operations: [(&str, Operate); 4] = [
        ("enable", |drive| drive.enable()),
        ("move", |drive| {
            drive.enable()?;
            drive.move_to(500).map(drop)
        }),
        ("home", |drive| {
            drive.enable()?;
            drive.home(35).map(drop)
        }),
        ("set up", |drive| drive.prepare_cyclic(SETTINGS).map(drop)),
    ];
    for (name, operate) in operations {
        assert!(check_power_cuts(operate) > 10, "{name}");
    }
}

/// The power of one axis fails in a path. All others stop; the axis comes back as it was set up, and stands until the next
/// path.
#[test]
fn a_power_cut_in_a_path_stops_all_axes_and_the_axis_is_set_up_again() {
    // From the setting up, through enabling and following, to the release.
    for frames in (0..3_000).step_by(373) {
        let (bus, servos) = bus(3);
        servos[1].lock().unwrap().left = Some(frames);
        let mut link = bus.link();
        let settings = SETTINGS;
        let recovery = Recovery { cyclic: Some(settings), ..RECOVERY };
        let bring = |link: &mut VirtualLink| -> Vec<_> {
            let mut axes = Vec::new();
            for node in (1..=3).map(NodeId::literal) {
                let (_, recovered) = Drive::<_, Servo>::connect_and_recover(&mut *link, node, &recovery).unwrap();
                axes.push(recovered.axis.unwrap());
            }
            axes
        };
        let mut follower = Follower::new(bring(&mut link), there_and_back, Settings::default()).unwrap();
        let report = follow(&mut link, &mut follower, &CancelHandle::default()).unwrap();
        let what = format!("after frame {frames}: {report}");
        bus.advance(Duration::from_secs(1));
        check_at_rest(&bus, &servos, &what);
        let before: Vec<f64> = servos.iter().map(|servo| servo.lock().unwrap().shaft(bus.now())).collect();
        let again = bring(&mut link);
        bus.advance(Duration::from_secs(1));
        let after: Vec<f64> = servos.iter().map(|servo| servo.lock().unwrap().shaft(bus.now())).collect();
        assert_eq!(before, after, "{what}");
        let mut follower = Follower::new(again, |_: u64, _: &mut [i32]| Supply::End, Settings::default()).unwrap();
        let report = follow(&mut link, &mut follower, &CancelHandle::default()).unwrap();
        if servos[1].lock().unwrap().left.is_some() {
            assert_eq!(report.reason, None, "{what}: {report}");
        }
        check_at_rest(&bus, &servos, &what);
    }
}
