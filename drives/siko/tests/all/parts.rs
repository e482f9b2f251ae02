//! Parts of the simulated drive on their own: DIP switches (2.4, 7.13, 7.15) and trajectories.

use lexican_runtime::{Instant, NodeId};
use siko_ag03_1::sim::trajectory::{Profile, State, Trajectory};
use siko_ag03_1::sim::{DipSwitches, NotSwitches, Restore, Termination};

#[test]
fn the_address_is_binary_and_all_off_means_1() {
    for (switches, node) in [(0, 1), (1, 1), (2, 2), (0x7C, 124), (0x7F, 127), (0x80, 1), (0x405, 5)] {
        assert_eq!(DipSwitches::new(switches).node().get(), node);
    }
    for node in NodeId::all() {
        assert_eq!(DipSwitches::for_node(node).node(), node);
    }
}

#[test]
fn both_switches_of_the_termination_are_needed() {
    let five = DipSwitches::for_node(NodeId::literal(5));
    assert_eq!(five.termination(), Termination::Deactivated);
    assert_eq!(five.with_termination(true).termination(), Termination::Active);
    for node in [5, 6].map(NodeId::literal) {
        let terminated = DipSwitches::for_node(node).with_termination(true);
        assert_eq!((terminated.node(), terminated.with_termination(false)), (node, DipSwitches::for_node(node)));
        assert_eq!(five.with_termination(true).with_node(node), terminated);
    }
    for half in [1 << 8, 1 << 9] {
        assert_eq!(DipSwitches::new(half).termination(), Termination::Incomplete);
    }
}

#[test]
fn factory_settings_want_switch_8_and_a_choice() {
    let five = DipSwitches::for_node(NodeId::literal(5)).with_termination(true);
    for restore in Restore::ALL {
        let set = five.with_restore(Some(restore));
        assert_eq!((set.restore(), set.termination()), (Some(restore), Termination::Active));
        let unset = set.with_restore(None);
        assert_eq!((unset.restore(), unset.termination()), (None, Termination::Active));
        assert_eq!(DipSwitches::new(set.bits()), set, "SW8 is one of the ten");
        assert_eq!(DipSwitches::new(u16::from(restore.sub_index())).restore(), None, "SW8 is OFF");
    }
    assert_eq!(DipSwitches::new(0x84).restore(), None, "there is no fourth choice");
}

#[test]
fn positions_are_written_from_the_first_switch_on() {
    let five = DipSwitches::for_node(NodeId::literal(5));
    assert_eq!(five.to_string(), "1010000000");
    assert_eq!("1010000 0 00".parse(), Ok(five));
    for text in ["", "101", "10100000000", "1010000002", "x010000000"] {
        assert_eq!(text.parse::<DipSwitches>(), Err(NotSwitches), "{text:?}");
    }
}

const PROFILE: Profile = Profile { speed: 800.0, acceleration: 3200.0, deceleration: 3200.0 };

fn at_ms(ms: u64) -> Instant {
    Instant::from_micros(ms * 1000)
}

#[test]
fn a_long_way_is_a_trapezoid() {
    // 5000 increments at 800/s with 3200/s2: 250 ms up (100), 6 s along (4800), 250 ms down (100).
    let way = Trajectory::through(Instant::ZERO, State::default(), &[5000.0], PROFILE);
    for (ms, position, velocity) in
        [(0, 0.0, 0.0), (125, 25.0, 400.0), (250, 100.0, 800.0), (3250, 2500.0, 800.0), (6375, 4975.0, 400.0)]
    {
        let state = way.at(at_ms(ms));
        assert!((state.position - position).abs() < 1e-6 && (state.velocity - velocity).abs() < 1e-6, "{state:?}");
    }
    assert_eq!(way.end(), Some(at_ms(6500)));
    assert_eq!(way.at(at_ms(6500)), State { position: 5000.0, velocity: 0.0 });
}

#[test]
fn a_short_way_is_a_triangle() {
    let way = Trajectory::through(Instant::ZERO, State::default(), &[-50.0], PROFILE);
    let peak = way.at(at_ms(125));
    assert!((peak.position + 25.0).abs() < 1e-9 && (peak.velocity + 400.0).abs() < 1e-9, "{peak:?}");
    assert_eq!(way.end(), Some(at_ms(250)));
}

#[test]
fn a_reversal_brakes_first() {
    let moving = State { position: 0.0, velocity: 800.0 };
    let way = Trajectory::through(Instant::ZERO, moving, &[-1000.0], PROFILE);
    assert_eq!(way.at(at_ms(250)).velocity.round(), 0.0);
    assert_eq!(way.at(at_ms(250)).position.round(), 100.0);
    assert_eq!(way.rest_position(), Some(-1000.0));
}

#[test]
fn a_limit_is_passed_by_the_braking_distance() {
    let way = Trajectory::ramp(Instant::ZERO, State::default(), 800.0, 3200.0).stopping_behind(1000.0, 1.0, 3200.0);
    assert!((way.rest_position().unwrap() - 1100.0).abs() < 1e-6);
    let short = Trajectory::through(Instant::ZERO, State::default(), &[900.0], PROFILE);
    assert_eq!(short.clone().stopping_behind(1000.0, 1.0, 3200.0), short, "a limit beyond the way changes nothing");
    for limit in [0.0, -0.3] {
        let way = Trajectory::ramp(Instant::ZERO, State::default(), 800.0, 3200.0);
        let way = way.stopping_behind(limit, 1.0, 3200.0);
        assert_eq!(way.rest_position(), Some(0.0), "who stands at the limit does not move");
    }
}

#[test]
fn changes_are_found_to_the_microsecond() {
    let way = Trajectory::through(Instant::ZERO, State::default(), &[5000.0], PROFILE);
    let above = |state: State| state.position >= 100.0;
    let at = way.next_change(Instant::ZERO, above).unwrap();
    assert!(above(way.at(at)) && !above(way.at(Instant::from_micros(at.as_micros() - 1))));
    assert_eq!(way.next_change(at, above), None);
    let moving = |state: State| state.velocity != 0.0;
    assert_eq!(way.next_change(at_ms(1), moving), Some(at_ms(6500)));
}
