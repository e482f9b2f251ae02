//! What the example draws: the positions through CANopen, serial port and PROFIBUS lie on each other.

#[path = "../examples/three_doors/run.rs"]
mod run;

use run::{Run, TARGET};
use siko_ag02::driver::Outcome;

/// When it passes a position, seen from half way.
fn from_half_way(run: &Run, position: i32) -> f64 {
    let passes = |position| run.passes(position).unwrap_or_else(|| panic!("{} passes {position}", run.door));
    passes(f64::from(position)) - passes(f64::from(TARGET) / 2.0)
}

#[test]
fn the_travel_is_the_same_through_every_door() {
    let canopen = run::through_canopen().unwrap();
    let (profibus, traffic) = run::through_profibus().unwrap();
    assert!(traffic.exchanges > 0 && traffic.kbit_per_s == 1500 && !traffic.lasted.is_zero());
    for run in [&canopen, &run::through_serial().unwrap(), &profibus] {
        assert_eq!(run.outcome, Outcome::Reached { position: TARGET }, "{}", run.door);
        for position in (200..TARGET).step_by(200) {
            let late_s = from_half_way(run, position) - from_half_way(&canopen, position);
            assert!(late_s.abs() < 0.05, "{} passes {position} {late_s:.3} s late", run.door);
        }
        // The order takes its time on the line, and more on the serial one.
        let middle = f64::from(TARGET) / 2.0;
        let late_s = run.passes(middle).unwrap() - canopen.passes(middle).unwrap();
        assert!(late_s.abs() < 0.5, "{} begins {late_s:.3} s late", run.door);
        let longer_s = run.took.as_secs_f64() - canopen.took.as_secs_f64();
        assert!(longer_s.abs() < 0.5, "{} takes {longer_s:.3} s longer", run.door);
    }
}
