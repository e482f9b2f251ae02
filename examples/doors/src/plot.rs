//! A picture of the positions through each interface, and of their differences.

use lexican_pictures::{self as pictures, Curve, INK, ORANGE, Panel, Picture, SKY};

use crate::travel::{Run, TARGET};

/// Later curves are narrower, so that curves at the same place remain visible.
const STYLES: [(&str, f64); 3] = [(SKY, 12.0), (ORANGE, 6.0), (INK, 2.0)];

pub(crate) fn svg(runs: &[Run; 3]) -> String {
    let positions = runs.iter().zip(STYLES).map(|(run, (color, width))| Curve {
        color: Some(color),
        width,
        ..Curve::new(run.door, run.positions.clone())
    });
    let differences = runs.iter().zip(STYLES).skip(1).map(|(run, (color, _))| Curve {
        color: Some(color),
        ..Curve::new(run.door, run.differences(&runs[0]).collect())
    });
    pictures::svg(&[Picture {
        title: format!("One program moves the AG02 to {TARGET}"),
        subtitle: "Through each interface the drive moves in the same way, as the program reads it".to_owned(),
        axis: "time since the order [s]".to_owned(),
        span: 0.0..runs.iter().map(Run::took_s).fold(0.0, f64::max),
        panels: vec![
            Panel { height: 260.0, ..Panel::curves("position [increments]", positions.collect()) },
            Panel::curves("ahead of CANopen [increments]", differences.collect()),
        ],
        events: Vec::new(),
    }])
}
