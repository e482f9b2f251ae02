//! Paths, lost frames and power cuts with simulated servos of CiA 402.

use std::sync::{Arc, Mutex};

use lexican_driver::cyclic::{AxisSettings, End, Follower, Reason, Settings, Stop, Supply, follow};
use lexican_driver::sequence::{Recovered, Recovery};
use lexican_driver::{CancelHandle, Drive, Error, Mode, Outcome};
use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, NodeId};

use crate::rig::PERIOD;
use crate::servo::{MACHINE, Servo, Supplied, axes, bus};

pub(crate) const SETTINGS: AxisSettings = AxisSettings::new(Mode::CyclicPosition, PERIOD, 40);
const RECOVERY: Recovery = Recovery::within(Duration::from_secs(5));

/// A path from rest to rest and back in this many cycles, one axis further than the other. The largest step is 38.
pub(crate) fn there_and_back(cycles: u64) -> impl FnMut(u64, &mut [i32]) -> Supply {
    move |cycle, set_points| {
        let turn = std::f64::consts::TAU * cycle.min(cycles) as f64 / cycles as f64;
        for (number, set_point) in (1..).zip(set_points) {
            *set_point = (f64::from(number) * cycles as f64 * (1.0 - turn.cos())).round() as i32;
        }
        if cycle <= cycles { Supply::Ready } else { Supply::End }
    }
}

/// Checks that all shafts stand, and that each is within the reach of the path and its ramp.
#[track_caller]
pub(crate) fn check_at_rest(bus: &VirtualBus, servos: &[Arc<Mutex<Supplied>>], what: &str) {
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
        let mut follower = Follower::new(axes, there_and_back(300), Settings::default()).unwrap();
        let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
        assert_eq!((report.reason, report.cycles), (None, 301), "{mode}: {report}");
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

/// How far a shaft coasts at most when its power fails.
const RUN_OUT: f64 = 0.1;

/// The operation during which the power fails.
type Operate = fn(&mut Drive<VirtualLink, Servo>) -> Result<(), Error>;

/// Cuts the power at each frame of an operation. The shaft then stands where it was; the operation, unless it was over,
/// ends in an error that names the cut; the drive is back, does not move when it is enabled, and moves when it is
/// ordered to. Returns the number of frames at which the power was cut.
#[track_caller]
fn check_power_cuts(operate: Operate) -> u64 {
    for frames in 0.. {
        let (bus, servos) = bus(1);
        let shaft = || servos[0].lock().unwrap().shaft(bus.now());
        servos[0].lock().unwrap().servo.set_inputs(bus.now(), |inputs| inputs.machine = MACHINE);
        let mut drive = Drive::<_, Servo>::connect_unprotected(bus.link(), NodeId::literal(1)).unwrap();
        servos[0].lock().unwrap().left = Some(frames);
        let result = operate(&mut drive);
        if servos[0].lock().unwrap().left.is_some() {
            result.unwrap();
            return frames;
        }
        let what = format!("after frame {frames}: {result:?}");
        assert!(matches!(result, Ok(()) | Err(Error::Restarted)), "{what}");
        bus.advance(Duration::from_secs(1));
        let stands_at = shaft();
        let cut_at = servos[0].lock().unwrap().cut_at.unwrap();
        assert!((stands_at - cut_at).abs() < RUN_OUT, "{what}: from {cut_at} to {stands_at}");
        let Recovered { now, .. } = drive.recover(&RECOVERY).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(now.state.map(|it| it.value), Some(State::SwitchOnDisabled), "{what}");
        drive.set_mode(Mode::Positioning).unwrap();
        drive.enable().unwrap();
        bus.advance(Duration::from_secs(1));
        assert_eq!(shaft(), stands_at, "{what}");
        let target = now.position.unwrap().value + 20;
        assert_eq!(drive.move_to(target).unwrap(), Outcome::Reached { position: target }, "{what}");
    }
    unreachable!("the operation ends")
}

fn home(drive: &mut Drive<VirtualLink, Servo>, method: i8) -> Result<(), Error> {
    drive.enable()?;
    drive.home(method).map(drop)
}

#[test]
fn a_power_cut_at_any_frame_of_an_operation_leaves_a_drive_that_comes_back_and_does_not_move() {
    let operations: [(&str, Operate); 8] = [
        ("enable", |drive| drive.enable()),
        ("move", |drive| {
            drive.enable()?;
            drive.move_to(100).map(drop)
        }),
        ("home here", |drive| home(drive, 35)),
        ("home at a switch", |drive| home(drive, 21)),
        ("home at a limit switch", |drive| home(drive, 17)),
        ("home at an index pulse", |drive| home(drive, 34)),
        ("home at an index pulse beside a limit switch", |drive| home(drive, 1)),
        ("set up", |drive| drive.prepare_cyclic(SETTINGS).map(drop)),
    ];
    for (name, operate) in operations {
        let cuts = check_power_cuts(operate);
        assert!(cuts > 10, "{name}");
    }
}

/// The power of one axis fails at each frame of a path, from its enabling to its release: either so briefly that it is
/// back during the stop, or for longer. The other axis stops. The one without power stands where it was, is set up
/// again, and stands until the next path.
#[test]
fn a_power_cut_at_any_frame_of_a_path_stops_all_axes_and_the_axis_is_set_up_again() {
    let settle = Duration::from_millis(30);
    let settings = Settings { stop: Stop::Ramp(Duration::from_millis(20)), settle, ..Settings::default() };
    let recovery = Recovery { cyclic: Some(SETTINGS), ..RECOVERY };
    let bring = |bus: &VirtualBus| -> Vec<_> {
        let bring = |node| Drive::<_, Servo>::connect_and_recover(bus.link(), node, &recovery).unwrap().1.axis.unwrap();
        [1, 2].map(NodeId::literal).map(bring).to_vec()
    };
    for off in [20, 300].map(Duration::from_millis) {
        for frames in 0.. {
            let (bus, servos) = bus(2);
            let shafts = || servos.iter().map(|servo| servo.lock().unwrap().shaft(bus.now())).collect::<Vec<f64>>();
            let axes = bring(&bus);
            (servos[1].lock().unwrap().left, servos[1].lock().unwrap().off) = (Some(frames), off);
            let mut follower = Follower::new(axes, there_and_back(12), settings).unwrap();
            let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
            let what = format!("after frame {frames}: {report}");
            let named = |reason| match reason {
                Reason::PdoMissing { node, .. } | Reason::Restarted { node } => node == NodeId::literal(2),
                _ => false,
            };
            assert!(report.reason.is_none_or(named), "{what}");
            assert_eq!(report.axes[0].end, End::AtRest(State::SwitchOnDisabled), "{what}");
            bus.advance(Duration::from_secs(1));
            check_at_rest(&bus, &servos, &what);
            let Some(cut_at) = servos[1].lock().unwrap().cut_at else {
                assert_eq!(report.reason, None, "{what}");
                assert!(frames > 100, "{frames}");
                break;
            };
            let before = shafts();
            assert!((before[1] - cut_at).abs() < RUN_OUT, "{what}: from {cut_at} to {before:?}");
            let again = bring(&bus);
            bus.advance(Duration::from_secs(1));
            assert_eq!(before, shafts(), "{what}");
            let mut follower = Follower::new(again, |_: u64, _: &mut [i32]| Supply::End, settings).unwrap();
            let report = follow(&mut bus.link(), &mut follower, &CancelHandle::default()).unwrap();
            assert_eq!(report.reason, None, "{what}: {report}");
            let after = shafts();
            let stayed = before.iter().zip(&after).all(|(before, after)| (before - after).abs() < RUN_OUT);
            assert!(stayed, "{what}: from {before:?} to {after:?}");
        }
    }
}
