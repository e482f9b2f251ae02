//! The circle as it was followed, as a picture.

use lexican_toolbox::chart::{self, Curve, Panel, Picture};

use crate::recorder::{Cycle, Recording};

/// The picture as an SVG document.
pub(crate) fn svg(summary: String, recording: &Recording) -> Result<String, chart::Error> {
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
    chart::svg(&Picture {
        title: "A circle of two axes".to_owned(),
        summary,
        panels: vec![
            circle(recording, cycles),
            panel(260, "velocity [1000 increments/s]", vec![Curve::new("x", speeds(0)), Curve::new("y", speeds(1))]),
            panel(
                260,
                "position error [increments]",
                vec![
                    Curve::new("x: position - set-point", errors(0)),
                    Curve::new("y: position - set-point", errors(1)),
                    Curve::new(
                        "distance from the circle",
                        over_time(recording, cycles, |cycle| recording.outside(cycle)),
                    ),
                ],
            ),
        ],
    })
}

fn circle(recording: &Recording, cycles: &[Cycle]) -> Panel {
    let ideal = (0..=360).map(|degree| f64::from(degree).to_radians().sin_cos());
    let ideal = ideal.map(|(sin, cos)| (recording.radius * sin, recording.radius * cos)).collect();
    let followed: Vec<_> = cycles.iter().map(|Cycle { positions: [x, y], .. }| ((*x).into(), (*y).into())).collect();
    let y =
        chart::range(followed.iter().map(|point: &(f64, f64)| point.1).chain([recording.radius]), -recording.radius);
    let circle = Panel {
        height: 480,
        names: ["x [increments]".to_owned(), "y [increments]".to_owned()],
        ranges: [-recording.radius..recording.radius, y],
        curves: vec![
            Curve { grey: true, ..Curve::new("the circle", ideal) },
            Curve::new("as it was followed", followed),
        ],
    };
    circle.to_scale()
}

fn panel(height: u32, name: &str, curves: Vec<Curve>) -> Panel {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let end = points().map(|point| point.0).fold(0.1, f64::max);
    let ranges = [0.0..end, chart::range(points().map(|point| point.1), 0.0)];
    Panel { height, names: ["time since the first SYNC [s]".to_owned(), name.to_owned()], ranges, curves }
}

fn over_time(recording: &Recording, cycles: &[Cycle], value: impl Fn(&Cycle) -> f64) -> Vec<(f64, f64)> {
    cycles.iter().map(|cycle| (recording.seconds(cycle), value(cycle))).collect()
}
