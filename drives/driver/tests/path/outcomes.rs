//! Each reason to stop has its own outcome, and leaves all axes at rest.

use std::sync::{Arc, Mutex};

use lexican_driver::cyclic::{
    self, AxisSettings, Event, Follower, Queue, Report, SetUpError, Settings, Stop, Supply, SyncSource, follow,
};
use lexican_driver::{CancelHandle, Description};
use lexican_runtime::host::{BusState, Link, Node, StateMachine, VirtualBus};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};

use crate::axis::{Axis, Failing};
use crate::rig::{MOST, PERIOD, Rig, figure};

/// What happens at the 400th cycle: to the set-points, to the axes, or to the bus.
type Happen = fn(&mut [i32], &[Arc<Mutex<Axis>>], &VirtualBus);

/// Follows a figure of one second with three axes, and disturbs it.
fn disturbed(settings: Settings, happen: Happen) -> Report {
    let mut rig = Rig::new(3);
    let (axes, bus, mut figure) = (rig.axes.clone(), rig.bus.clone(), figure(1000));
    let path = move |cycle: u64, set_points: &mut [i32]| {
        let supply = figure(cycle, set_points);
        if cycle == 400 {
            happen(set_points, &axes, &bus);
        }
        supply
    };
    let report = rig.follow(path, settings);
    rig.check_at_rest(&report.to_string());
    report
}

#[track_caller]
fn check(happen: Happen, reason: &str, ends: [&str; 3]) {
    for stop in [Settings::default().stop, Stop::Quick] {
        let report = disturbed(Settings { stop, ..Settings::default() }, happen);
        let got: Vec<String> = report.axes.iter().map(|axis| axis.end.to_string()).collect();
        let because = report.reason.map(|reason| reason.to_string()).unwrap_or_default();
        assert_eq!((because.as_str(), got.as_slice()), (reason, &ends.map(String::from)[..]), "{stop:?}: {report}");
    }
}

const RESTS: &str = "at rest, SWITCH ON DISABLED";

#[test]
fn a_fault_stops_all_axes() {
    let ends = [RESTS, "at rest, in fault: 8700: SYNC", RESTS];
    check(|_, axes, _| axes[1].lock().unwrap().fail(0x8700), "node 2: in fault: 8700: SYNC", ends);
}

#[test]
fn an_axis_that_leaves_operation_enabled_stops_all_and_is_not_enabled_again() {
    let reason = "node 2: it has left OPERATION ENABLED for SWITCH ON DISABLED";
    check(|_, axes, _| axes[1].lock().unwrap().state = State::SwitchOnDisabled, reason, [RESTS; 3]);
}

#[test]
fn an_axis_that_stays_behind_is_a_following_error() {
    let reason = "node 2: a following error of 153";
    check(|_, axes, _| axes[1].lock().unwrap().failing = Failing::Stuck, reason, [RESTS; 3]);
}

#[test]
fn an_axis_that_says_that_it_does_not_follow_is_believed() {
    let reason = "node 2: it does not follow its set-points (status word 0027)";
    check(|_, axes, _| axes[1].lock().unwrap().failing = Failing::Ignoring, reason, [RESTS; 3]);
}

#[test]
fn a_silent_axis_is_sent_its_stop_all_the_same() {
    let reason = "node 2: its PDO has not come for 3 cycles";
    check(|_, axes, _| axes[1].lock().unwrap().failing = Failing::Silent, reason, [RESTS, "silent", RESTS]);
}

#[test]
fn an_axis_that_has_restarted_is_sent_nothing_more() {
    let reason = "node 2: it has restarted";
    check(|_, axes, _| axes[1].lock().unwrap().restart(), reason, [RESTS, "restarted", RESTS]);
}

#[test]
fn an_axis_that_exchanges_no_pdos_any_more_says_so() {
    let reason = "node 2: it is PreOperational, and exchanges no PDOs";
    check(|_, axes, _| axes[1].lock().unwrap().leave_operational(0x7F), reason, [RESTS, "silent", RESTS]);
}

/// The heartbeat was on its way when the axis was started.
#[test]
fn a_heartbeat_from_before_the_first_pdo_stops_nothing() {
    let mut rig = Rig::new(2);
    rig.bus.link().send(&Frame::from_array(CobId::of_node(0x700, NodeId::literal(2)), [0x7F])).unwrap();
    let report = rig.follow(figure(1000), Settings::default());
    assert_eq!((report.reason, report.cycles), (None, 1000), "{report}");
}

#[test]
fn an_axis_that_was_never_operational_keeps_all_from_moving() {
    let mut rig = Rig::new(2);
    rig.axis(1).leave_operational(0x7F);
    let report = rig.follow(figure(1000), Settings::default());
    let reason = report.reason.map(|reason| reason.to_string());
    assert_eq!(reason.as_deref(), Some("node 2: it is PreOperational, and exchanges no PDOs"), "{report}");
    assert_eq!((report.cycles, rig.axis(0).position), (0, 1000), "{report}");
    rig.check_at_rest("not operational");
}

#[test]
fn a_step_that_is_too_large_is_not_sent() {
    let reason = "node 2: a step from 2668 to 2713 is larger than 40";
    check(|set_points, _, _| set_points[1] += MOST as i32, reason, [RESTS; 3]);
}

#[test]
fn a_step_that_is_as_large_as_it_may_be_is_sent() {
    let mut rig = Rig::new(1);
    let path = |cycle: u64, set_points: &mut [i32]| {
        set_points[0] += MOST as i32;
        if cycle < 3 { Supply::Ready } else { Supply::End }
    };
    let report = rig.follow(path, Settings::default());
    assert_eq!((report.reason, report.axes[0].position), (None, 1000 + 3 * MOST as i32), "{report}");
}

/// With Disable voltage, an axis that brakes would coast.
#[test]
fn an_axis_that_brakes_by_itself_is_left_braking_until_all_stand() {
    let mut rig = Rig::new(2);
    let (words, braking) = (Arc::new(Mutex::new(Vec::new())), rig.axes[1].clone());
    let (heard, mut figure) = (Arc::clone(&words), figure(1000));
    rig.bus.observe(move |_, frame| {
        if frame.id() == CobId::of_node(0x300, NodeId::literal(2)) {
            heard.lock().unwrap().push(u16::from_le_bytes([frame.data()[0], frame.data()[1]]));
        }
    });
    let path = move |cycle: u64, set_points: &mut [i32]| {
        if cycle == 400 {
            braking.lock().unwrap().failing = Failing::Braking;
        }
        figure(cycle, set_points)
    };
    let report = rig.follow(path, Settings::default());
    let reason = report.reason.map(|reason| reason.to_string());
    assert_eq!(reason.as_deref(), Some("node 2: it has left OPERATION ENABLED for QUICK STOP ACTIVE"));
    let mut words = words.lock().unwrap().clone();
    words.dedup();
    // The axis is enabled; then quick stop, and finally Disable voltage.
    assert_eq!(words, [0x0000, 0x0006, 0x0007, 0x000F, 0x0002, 0x0000], "{words:04X?}");
}

#[test]
fn a_program_that_is_held_up_says_by_how_much() {
    let reason = "the program was late for its cycle by 4 ms";
    check(|_, _, bus| bus.advance(Duration::from_millis(5)), reason, [RESTS; 3]);
}

#[test]
fn a_bus_that_carries_no_frames_is_an_outcome_and_no_error() {
    // The axes stop by themselves, because no SYNC comes.
    let reason = "node 1: its PDO has not come for 3 cycles";
    check(|_, _, bus| bus.set_state(BusState::Off), reason, ["silent"; 3]);
}

#[test]
fn one_cycle_that_is_missed_is_tolerated() {
    let report = disturbed(Settings::default(), |_, _, bus| bus.advance(Duration::from_micros(2500)));
    assert_eq!((report.reason, report.cycles, report.missed), (None, 1000, 1), "{report}");
}

#[test]
fn a_path_is_followed_to_its_end() {
    let mut rig = Rig::new(6);
    let report = rig.follow(figure(2000), Settings::default());
    assert_eq!((report.reason, report.cycles, report.missed), (None, 2000, 0), "{report}");
    for (axis, number) in report.axes.iter().zip(1..) {
        assert_eq!((axis.position, axis.missing, axis.late), (number * 1000, 0, 0), "{report}");
        assert!(axis.following_error == 0, "{report}");
    }
    rig.check_at_rest("the end");
}

/// The ramp stays on the path, and all axes slow down together.
#[test]
fn a_stop_follows_the_path_and_a_quick_stop_does_not() {
    let mut rig = Rig::new(2);
    let cancel = CancelHandle::default();
    let handle = cancel.clone();
    // A circle, at constant speed from the first cycle on.
    let path = move |cycle: u64, set_points: &mut [i32]| {
        let (sin, cos) = (cycle as f64 / 100.0).sin_cos();
        set_points[0] = 1000 + (1000.0 * sin).round() as i32;
        set_points[1] = 3000 - (1000.0 * cos).round() as i32;
        if cycle == 300 {
            handle.cancel();
        }
        Supply::Ready
    };
    let mut follower = rig.follower(path, Settings::default());
    let places = Arc::new(Mutex::new(Vec::new()));
    let (seen, axes) = (Arc::clone(&places), rig.axes.clone());
    rig.bus.observe(move |_, frame| {
        if frame.id() == CobId::SYNC {
            let at = |number: usize| axes[number].try_lock().map(|axis| axis.position).unwrap_or_default();
            seen.lock().unwrap().push((at(0), at(1)));
        }
    });
    let report = follow(&mut rig.link, &mut follower, &cancel).unwrap();
    assert_eq!(report.reason.map(|reason| reason.to_string()).as_deref(), Some("cancelled"));
    for &(x, y) in places.lock().unwrap().iter() {
        let radius = f64::from(x - 1000).hypot(f64::from(y - 3000));
        assert!((radius - 1000.0).abs() < 1.5, "off the circle at {x}, {y}");
    }
    let jerk = rig.axes.iter().map(|axis| axis.lock().unwrap().largest_jerk).max();
    // From rest to 10 in one cycle at the beginning; the ramp takes 200 cycles for it.
    assert!(jerk <= Some(11), "{jerk:?}");
    rig.check_at_rest("cancelled");
}

#[test]
fn set_points_that_come_late_are_bridged_a_while_and_then_named() {
    let late = |for_cycles: u64| {
        let mut rig = Rig::new(1);
        let path = move |cycle: u64, set_points: &mut [i32]| {
            let slow = cycle.min(20) as i32;
            set_points[0] += slow;
            match cycle {
                100.. if cycle < 100 + for_cycles => Supply::Late,
                400.. => Supply::End,
                _ => Supply::Ready,
            }
        };
        let report = rig.follow(path, Settings::default());
        rig.check_at_rest("late");
        (report.reason.map(|reason| reason.to_string()), report.axes[0].position)
    };
    let straight = late(0);
    assert_eq!(late(2), straight, "goes on as in the cycle before");
    let (reason, position) = late(3);
    assert_eq!(reason.as_deref(), Some("the program had no set-points for 3 cycles"));
    assert!(position < straight.1, "{position}");
}

#[test]
fn a_queue_feeds_a_path_from_another_thread() {
    let mut rig = Rig::new(2);
    let (sender, receiver) = std::sync::mpsc::channel();
    for cycle in 0..100 {
        sender.send(vec![1000 + cycle, 2000 - cycle]).unwrap();
    }
    drop(sender);
    let report = rig.follow(Queue(receiver), Settings::default());
    let positions: Vec<i32> = report.axes.iter().map(|axis| axis.position).collect();
    assert_eq!((report.reason, positions), (None, vec![1099, 1901]));
}

#[test]
fn no_set_point_is_sent_beyond_the_limits() {
    let rig = Rig::new(1);
    let axis = cyclic::Axis::new(NodeId::literal(1), &Description::CIA_402, Rig::settings(), 1000).within(900, 1505);
    let path = |_: u64, set_points: &mut [i32]| {
        set_points[0] += 10;
        Supply::Ready
    };
    let mut follower = Follower::new(vec![axis], path, Settings::default()).unwrap();
    let report = follow(&mut rig.bus.link(), &mut follower, &CancelHandle::default()).unwrap();
    let reason = report.reason.map(|reason| reason.to_string());
    assert_eq!(reason.as_deref(), Some("node 1: the set-point 1510 is outside the limits, 900 to 1505"));
    // The part of the path for the ramp ends there.
    assert_eq!(report.axes[0].position, 1505);
    rig.check_at_rest("limits");
}

#[test]
fn an_axis_that_cannot_be_enabled_keeps_all_from_moving() {
    let mut rig = Rig::new(2);
    rig.axis(1).state = State::NotReadyToSwitchOn;
    let report = rig.follow(figure(1000), Settings::default());
    assert_eq!(
        (report.cycles, report.reason.map(|reason| reason.to_string()).as_deref()),
        (0, Some("node 2: it stays in NOT READY TO SWITCH ON"))
    );
    rig.check_at_rest("not enabled");
    assert_eq!((rig.axis(0).position, rig.axis(1).position), (1000, 2000));
}

/// Another producer of SYNC, for a while.
pub(crate) struct Producer {
    next: Instant,
    left: u32,
    due: bool,
}

impl Producer {
    pub(crate) fn attach(bus: &VirtualBus, left: u32) {
        bus.attach(Producer { next: bus.now() + PERIOD, left, due: false });
    }
}

impl Node for Producer {
    fn handle_frame(&mut self, _: Instant, _: &Frame) {}
    fn handle_timeout(&mut self, now: Instant) {
        if self.next <= now {
            self.due = true;
            self.left -= 1;
            self.next = now + PERIOD;
        }
    }
    fn poll_transmit(&mut self, _: Instant) -> Option<Frame> {
        std::mem::take(&mut self.due).then(|| Frame::from_array(CobId::SYNC, []))
    }
    fn poll_timeout(&self) -> Option<Instant> {
        (self.left > 0).then_some(self.next)
    }
}

#[test]
fn the_sync_of_another_node_is_followed_and_replaced_for_the_stop() {
    let settings = Settings { sync: SyncSource::Followed { id: CobId::SYNC }, ..Settings::default() };
    for (left, expected) in [(5000, None), (500, Some("no SYNC has come for 3 ms"))] {
        let mut rig = Rig::new(2);
        Producer::attach(&rig.bus, left);
        let report = rig.follow(figure(1000), settings);
        assert_eq!(report.reason.map(|reason| reason.to_string()).as_deref(), expected, "{report}");
        assert!(report.axes.iter().all(|axis| axis.end.to_string() == RESTS), "{report}");
    }
}

#[test]
fn frames_that_do_not_leave_in_time_are_named() {
    let rig = Rig::new(2);
    let mut follower = rig.follower(figure(1000), Settings::default());
    let mut now = Instant::ZERO;
    assert_eq!(follower.poll_transmit(now), None, "the first SYNC comes a period from now");
    // The link accepts no frame.
    let reason = loop {
        now = follower.poll_timeout().unwrap().max(now);
        if let Some(Event::Stopping(reason)) = follower.handle_timeout(now) {
            break reason;
        }
    };
    assert_eq!(reason.unwrap().to_string(), "the frames of a cycle had not left by the next one");
}

#[test]
fn a_path_that_panics_leaves_the_axes_with_a_quick_stop() {
    let mut rig = Rig::new(2);
    let mut figure = figure(1000);
    let path = move |cycle: u64, set_points: &mut [i32]| {
        assert!(cycle < 400, "a bug");
        figure(cycle, set_points)
    };
    let run = std::panic::AssertUnwindSafe(|| rig.follow(path, Settings::default()));
    assert!(std::panic::catch_unwind(run).is_err());
    rig.bus.advance(Duration::from_millis(1));
    assert_eq!([rig.axis(0).state, rig.axis(1).state], [State::QuickStopActive; 2]);
    rig.check_at_rest("panicked");
}

#[test]
fn axes_that_do_not_go_together_are_refused() {
    let [node, other] = [1, 2].map(NodeId::literal);
    let axis = |node, settings| cyclic::Axis::new(node, &Description::CIA_402, settings, 0);
    let check = |axes: Vec<cyclic::Axis>, error| {
        assert_eq!(Follower::new(axes, figure(1), Settings::default()).map(|_| ()), Err(error));
    };
    let settings = Rig::settings();
    let slow = AxisSettings { period: Duration::from_millis(2), ..settings };
    check(vec![], SetUpError::NoAxis);
    check(vec![axis(node, settings), axis(node, settings)], SetUpError::Twice(node));
    check(vec![axis(node, settings), axis(other, slow)], SetUpError::Period { node: other, period: slow.period });
}
