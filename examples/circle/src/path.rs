//! The circle as set-points for each cycle.

use std::f64::consts::TAU;

use clap::Args;
use lexican_driver::CancelHandle;
use lexican_driver::cyclic::{Path, Supply};
use lexican_runtime::Duration;

#[derive(Args, Clone, Copy)]
pub(crate) struct Circle {
    /// The radius, in increments
    #[arg(long, value_name = "INCREMENTS", default_value_t = 5000.0, value_parser = number)]
    pub(crate) radius: f64,

    /// How often to go round
    #[arg(long, value_name = "NUMBER", default_value_t = 1.0, value_parser = number)]
    turns: f64,

    /// How long that takes
    #[arg(long, default_value_t = 2.0, value_parser = number)]
    seconds: f64,
}

/// Limits numbers, so that all set-points fit objects of CiA 402.
fn number(text: &str) -> Result<f64, &'static str> {
    text.parse().ok().filter(|number| (0.01..=1e8).contains(number)).ok_or("it is a number from 0.01 to 100000000")
}

impl Circle {
    /// From the present positions, the lowest point of the circle, round and back to a standstill.
    pub(crate) fn path(
        self,
        start: [i32; 2],
        period: Duration,
        stop_at: Option<f64>,
        cancel: CancelHandle,
    ) -> impl Path {
        move |cycle: u64, set_points: &mut [i32]| {
            let time = cycle as f64 * period.as_secs_f64();
            if stop_at.is_some_and(|stop_at| time >= stop_at) {
                cancel.cancel();
            }
            let (sin, cos) = self.angle(time).sin_cos();
            set_points[0] = start[0] + (self.radius * sin).round() as i32;
            set_points[1] = start[1] + (self.radius * (1.0 - cos)).round() as i32;
            if time < self.seconds { Supply::Ready } else { Supply::End }
        }
    }

    /// The longest distance that an axis moves in one cycle.
    pub(crate) fn greatest_step(self, period: Duration) -> f64 {
        // In the middle, the angle changes 15/8 times as fast as on average.
        self.radius * TAU * self.turns / self.seconds * 15.0 / 8.0 * period.as_secs_f64()
    }

    /// The angle at a time; velocity and acceleration are 0 at both ends.
    fn angle(self, time: f64) -> f64 {
        let t = (time / self.seconds).min(1.0);
        TAU * self.turns * t.powi(3) * (10.0 + t * (6.0 * t - 15.0))
    }
}
