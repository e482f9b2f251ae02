//! Properties of trajectories, whatever the algorithm.

use lexican_runtime::Instant;
use simulator::trajectory::{Profile, State, Trajectory};

const PROFILE: Profile = Profile { speed: 100.0, acceleration: 200.0, deceleration: 50.0 };

fn at_ms(ms: u64) -> Instant {
    Instant::from_micros(ms * 1000)
}

fn state(position: f64, velocity: f64) -> State {
    State { position, velocity }
}

#[track_caller]
fn passes_through(way: &Trajectory, rows: &[(u64, f64, f64)]) {
    for &(ms, position, velocity) in rows {
        let found = way.at(at_ms(ms));
        let close = (found.position - position).abs() < 1e-3 && (found.velocity - velocity).abs() < 1e-3;
        assert!(close, "{found:?} at {ms} ms, not {position} with {velocity}/s");
    }
}

/// Half a second to 100/s over 25, then 225 at this velocity, then two seconds to rest over 100.
#[test]
fn it_accelerates_travels_and_brakes_as_its_profile_says() {
    for sign in [1.0, -1.0] {
        let way = Trajectory::through(at_ms(1000), state(10.0, 0.0), &[10.0 + sign * 350.0], PROFILE);
        let rows = [(0, 0.0, 0.0), (1000, 0.0, 0.0), (1250, 6.25, 50.0), (1500, 25.0, 100.0), (3000, 175.0, 100.0)];
        let later = [(3750, 250.0, 100.0), (4750, 325.0, 50.0), (5750, 350.0, 0.0), (9000, 350.0, 0.0)];
        let rows: Vec<_> = rows.into_iter().chain(later).collect();
        passes_through(&way, &rows.iter().map(|row| (row.0, 10.0 + sign * row.1, sign * row.2)).collect::<Vec<_>>());
        assert_eq!((way.end(), way.rest_position()), (Some(at_ms(5750)), Some(10.0 + sign * 350.0)));
    }
}

/// Too short to reach 100/s: to 40/s in 0.2 s over 4, to rest in 0.8 s over 16.
#[test]
fn a_short_way_has_a_lower_peak() {
    let way = Trajectory::through(at_ms(0), state(0.0, 0.0), &[20.0], PROFILE);
    passes_through(&way, &[(200, 4.0, 40.0), (600, 16.0, 20.0), (1000, 20.0, 0.0)]);
    assert_eq!(way.end(), Some(at_ms(1000)));
}

#[test]
fn a_way_begins_with_the_velocity_that_the_axis_has() {
    // Slower than the profile: accelerates to 100/s. 75/s is reached 0.25 s and 21.875 later.
    let way = Trajectory::through(at_ms(0), state(0.0, 50.0), &[300.0], PROFILE);
    passes_through(&way, &[(250, 18.75, 100.0)]);
    // Faster: brakes to 100/s with the deceleration, in one second over 125.
    let way = Trajectory::through(at_ms(0), state(0.0, 150.0), &[400.0], PROFILE);
    passes_through(&way, &[(1000, 125.0, 100.0), (2750, 300.0, 100.0), (4750, 400.0, 0.0)]);
    // Away from the target: first to rest over 100.
    let way = Trajectory::through(at_ms(0), state(0.0, -100.0), &[60.0], PROFILE);
    passes_through(&way, &[(2000, -100.0, 0.0), (2500, -75.0, 100.0)]);
    // Too fast to stop there: to rest behind it, and back. From 100/s it takes 100, 20 too many.
    let way = Trajectory::through(at_ms(0), state(0.0, 100.0), &[80.0], PROFILE);
    passes_through(&way, &[(2000, 100.0, 0.0), (2200, 96.0, -40.0), (3000, 80.0, 0.0)]);
    // Just slow enough: it only brakes.
    let way = Trajectory::through(at_ms(0), state(0.0, 100.0), &[100.0], PROFILE);
    passes_through(&way, &[(1000, 75.0, 50.0), (2000, 100.0, 0.0)]);
    assert_eq!(way.end(), Some(at_ms(2000)));
}

#[test]
fn each_leg_has_its_profile_and_ends_at_rest() {
    let slow = Profile { speed: 10.0, acceleration: 10.0, deceleration: 10.0 };
    let way = Trajectory::legs(at_ms(0), state(0.0, 0.0), &[(20.0, PROFILE), (0.0, slow)]);
    passes_through(&way, &[(1000, 20.0, 0.0), (2000, 15.0, -10.0), (3000, 5.0, -10.0), (4000, 0.0, 0.0)]);
    assert_eq!(way.arrival_at(20.0), Some(at_ms(1000)));
    assert_eq!((way.arrival_at(0.0), way.arrival_at(5.0)), (Some(at_ms(0)), None));
    let there = Trajectory::through(at_ms(5), state(7.0, 0.0), &[7.0], PROFILE);
    assert_eq!((there.end(), there.rest_position()), (Some(at_ms(5)), Some(7.0)));
}

#[test]
fn a_run_changes_its_velocity_with_the_acceleration_or_the_deceleration() {
    let run = |velocity: f64, sign: f64, speed: f64| {
        Trajectory::run(at_ms(0), state(0.0, velocity), sign, Profile { speed, ..PROFILE })
    };
    passes_through(&run(0.0, -1.0, 100.0), &[(250, -6.25, -50.0), (500, -25.0, -100.0), (1500, -125.0, -100.0)]);
    passes_through(&run(100.0, 1.0, 50.0), &[(500, 43.75, 75.0), (1000, 75.0, 50.0)]);
    passes_through(&run(-50.0, 1.0, 100.0), &[(1000, -25.0, 0.0), (1500, 0.0, 100.0)]);
    passes_through(&run(50.0, -1.0, 100.0), &[(1000, 25.0, 0.0), (1500, 0.0, -100.0)]);
    assert_eq!((run(0.0, 1.0, 100.0).end(), run(0.0, 1.0, 100.0).rest_position()), (None, None));
    let ramp = Trajectory::ramp(at_ms(0), state(0.0, 100.0), -100.0, 100.0);
    passes_through(&ramp, &[(1000, 50.0, 0.0), (2000, 0.0, -100.0), (3000, -100.0, -100.0)]);
    passes_through(&Trajectory::steady(at_ms(0), state(5.0, -20.0)), &[(0, 5.0, -20.0), (1000, -15.0, -20.0)]);
    passes_through(&Trajectory::rest(at_ms(0), 5.0), &[(0, 5.0, 0.0), (1000, 5.0, 0.0)]);
}

#[test]
fn a_limit_is_passed_once_and_stops_the_way_behind_it() {
    let way = Trajectory::run(at_ms(1000), state(0.0, 0.0), 1.0, PROFILE);
    assert_eq!(way.passes(25.0, 1.0), Some(at_ms(1500)), "at the end of the ramp");
    assert_eq!(way.passes(6.25, 1.0), Some(at_ms(1250)), "on the ramp");
    assert_eq!(way.passes(125.0, 1.0), Some(at_ms(2500)), "behind it");
    assert_eq!(way.passes(0.0, 1.0), Some(at_ms(1000)), "from the beginning");
    assert_eq!(way.passes(-1.0, 1.0), Some(at_ms(1000)), "it starts beyond");
    assert_eq!(way.passes(-1.0, -1.0), None);
    let stopped = way.clone().stopping_behind(125.0, 1.0, 100.0);
    passes_through(&stopped, &[(1500, 25.0, 100.0), (2500, 125.0, 100.0), (3000, 162.5, 50.0), (3500, 175.0, 0.0)]);
    assert_eq!((stopped.end(), stopped.rest_position()), (Some(at_ms(3500)), Some(175.0)));
    assert_eq!(way.clone().stopping_behind(-5.0, -1.0, 100.0), way, "a limit that is never passed");
    // Towards the limit and back before it: no segment passes it.
    let back = Trajectory::through(at_ms(0), state(0.0, 0.0), &[20.0, -20.0], PROFILE);
    assert_eq!(back.passes(20.5, 1.0), None);
    assert_eq!(back.passes(-16.0, -1.0), Some(Instant::from_micros(2_014_214)), "on the way back");
}

#[test]
fn the_next_change_is_found_to_the_microsecond() {
    let way = Trajectory::through(at_ms(1000), state(0.0, 0.0), &[350.0], PROFILE);
    let beyond = |position: f64| move |state: State| state.position >= position;
    for (position, ms) in [(6.25, 1250), (25.0, 1500), (175.0, 3000), (325.0, 4750)] {
        let found = way.next_change(at_ms(0), beyond(position)).unwrap();
        assert!(found.since(at_ms(ms)).as_micros() <= 1 && found >= at_ms(ms), "{position} at {found}");
    }
    assert_eq!(way.next_change(at_ms(0), beyond(351.0)), None);
    assert_eq!(way.next_change(at_ms(4000), beyond(25.0)), None, "it is over");
    let stands = |state: State| state.velocity == 0.0;
    assert_eq!(way.next_change(at_ms(2000), stands), Some(at_ms(5750)));
    assert_eq!(way.next_change(at_ms(6000), stands), None);
    let endless = Trajectory::steady(at_ms(0), state(0.0, 1.0));
    let day = 24 * 3600 * 1000;
    assert_eq!(endless.next_change(at_ms(0), beyond(10.0 * 24.0 * 3600.0)), Some(at_ms(10 * day)));
    assert_eq!(endless.next_change(at_ms(0), beyond(13.0 * 24.0 * 3600.0)), None, "that is too far");
}
