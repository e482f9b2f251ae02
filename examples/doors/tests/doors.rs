//! The same travel through each interface. `cargo xtask bless` takes over the picture in `docs/` and the report in the README.

#[path = "../../golden.rs"]
mod golden;
#[path = "../src/travel.rs"]
mod travel;

use std::process::Command;

use siko_ag02::driver::Outcome;

/// In increments: what an order takes on the slowest line, 0.1 s at 30 rev/min.
const MOST: f64 = 80.0;

#[test]
fn the_same_motion_answers_behind_every_door() {
    let runs = travel::through_each_door().unwrap();
    for run in &runs {
        assert_eq!(run.outcome, Outcome::Reached { position: travel::TARGET }, "{}", run.door);
        assert!(run.positions.len() > 20 && run.took_s() > 1.0 && !run.traffic.is_empty(), "{}", run.door);
        for (at_s, difference) in run.differences(&runs[0]) {
            assert!(difference.abs() <= MOST, "{}: {difference} increments at {at_s} s", run.door);
        }
        // It begins later, and is not slower.
        let even = || run.differences(&runs[0]).filter(|(at_s, _)| (1.0..3.0).contains(at_s)).map(|(_, ahead)| ahead);
        let (least, most) = (even().fold(f64::MAX, f64::min), even().fold(f64::MIN, f64::max));
        assert!((0.0..3.0).contains(&(most - least)), "{}: {least} to {most}", run.door);
    }
}

#[test]
fn the_golden_report_and_picture_are_those_of_the_program() {
    golden::check("doors", 1, |args| {
        let output = Command::new(env!("CARGO_BIN_EXE_doors")).args(args).output().expect("the program was built");
        String::from_utf8(output.stdout).expect("the program prints UTF-8")
    });
}
