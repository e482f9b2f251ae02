//! One program through each interface of the AG02: the same outcome, and positions that lie on each other.

#[allow(dead_code, reason = "not every picture has all of it")]
#[path = "../../siko-ag03-1/examples/motion_plots/chart.rs"]
mod chart;
#[allow(dead_code, reason = "not every test looks at all of it")]
#[path = "../examples/doors/travel.rs"]
mod travel;

use siko_ag02::driver::Outcome;

/// In increments: at 30 rev/min, 40 are 50 ms.
const MOST: f64 = 40.0;

#[test]
fn the_same_motion_answers_behind_every_door() {
    let runs = travel::through_each_door().unwrap();
    let can = &runs[0];
    for run in &runs {
        assert_eq!(run.outcome, Outcome::Reached { position: travel::TARGET }, "{}", run.door);
        for &(at, position) in &run.positions {
            let expected = interpolate(&can.positions, at);
            assert!((position - expected).abs() <= MOST, "{}: {position} instead of {expected} at {at} s", run.door);
        }
    }
}

fn interpolate(curve: &[(f64, f64)], at: f64) -> f64 {
    let next = curve.iter().position(|(time, _)| *time >= at).unwrap_or(curve.len() - 1).max(1);
    let ((from, low), (to, high)) = (curve[next - 1], curve[next]);
    low + (high - low) * ((at - from) / (to - from)).clamp(0.0, 1.0)
}

/// The line is not the bottleneck: at 19,200 bit/s it is idle most of the time.
#[test]
fn a_travel_leaves_room_on_the_line() {
    let cost = travel::line_of_a_travel().unwrap();
    assert!(cost.busy_s < cost.span_s, "{} bytes in {} telegrams", cost.bytes, cost.telegrams);
}

#[test]
fn the_picture_in_docs_is_the_one_that_the_example_draws() {
    let drawn = travel::picture(&travel::through_each_door().unwrap()).svg();
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/doors.svg");
    if std::env::var_os("LEXICAN_BLESS").is_some() {
        std::fs::write(&path, &drawn).unwrap();
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(stored == drawn, "it is stale: cargo run -p lexican-siko-serial --example doors");
}
