//! A picture of the circle that the axes have followed.

use lexican_pictures::{self as pictures, Curve, GREY, Panel, Picture};

use crate::recorder::{Cycle, Recording};

pub(crate) fn svg(summary: String, recording: &Recording) -> String {
    let cycles = recording.cycles.get(2..).unwrap_or_default();
    let errors = |axis: usize| {
        over_time(recording, cycles, move |cycle| f64::from(cycle.positions[axis] - cycle.set_points[axis]))
    };
    let speeds = |axis: usize| {
        let step = |pair: &[Cycle]| {
            let way = f64::from(pair[1].positions[axis] - pair[0].positions[axis]);
            (recording.seconds(&pair[1]), way / pair[1].at.since(pair[0].at).as_secs_f64() / 1000.0)
        };
        cycles.windows(2).map(step).collect::<Vec<_>>()
    };
    let outside = over_time(recording, cycles, |cycle| recording.outside(cycle));
    let over_time = Picture {
        axis: "time since the first SYNC [s]".to_owned(),
        span: 0.0..cycles.last().map_or(0.1, |last| recording.seconds(last)),
        panels: vec![
            Panel::curves("velocity [1000 increments/s]", vec![Curve::new("x", speeds(0)), Curve::new("y", speeds(1))]),
            Panel::curves(
                "position error [increments]",
                vec![
                    Curve::new("x: position - set-point", errors(0)),
                    Curve::new("y: position - set-point", errors(1)),
                    Curve::new("distance from the circle", outside),
                ],
            ),
        ],
        ..Picture::default()
    };
    pictures::svg(&[circle(summary, recording, cycles), over_time])
}

fn circle(summary: String, recording: &Recording, cycles: &[Cycle]) -> Picture {
    let ideal = (0..=360).map(|degree| f64::from(degree).to_radians().sin_cos());
    let ideal = ideal.map(|(sin, cos)| (recording.radius * sin, recording.radius * cos)).collect();
    let followed = cycles.iter().map(|Cycle { positions: [x, y], .. }| ((*x).into(), (*y).into())).collect();
    let curves = vec![
        Curve { color: Some(GREY), width: 6.0, ..Curve::new("the circle", ideal) },
        Curve { color: Some(pictures::BLUE), ..Curve::new("as it was followed", followed) },
    ];
    let picture = Picture {
        title: "A circle of two axes".to_owned(),
        subtitle: summary,
        axis: "x [increments]".to_owned(),
        panels: vec![Panel { height: 420.0, ..Panel::curves("y [increments]", curves) }],
        ..Picture::default()
    };
    picture.to_scale(0.0)
}

fn over_time(recording: &Recording, cycles: &[Cycle], value: impl Fn(&Cycle) -> f64) -> Vec<(f64, f64)> {
    cycles.iter().map(|cycle| (recording.seconds(cycle), value(cycle))).collect()
}
