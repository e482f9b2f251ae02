//! The positions through each interface, and how far they are from each other.

use lexican_toolbox::chart::{self, Curve, Panel, Picture, Rgb};

use crate::travel::{Run, TARGET};

/// Each curve is drawn over the one before, and is narrower: where all are seen, they lie on each other.
const STYLES: [(Rgb, u32); 3] = [([0x56, 0xB4, 0xE9], 12), ([0xD5, 0x5E, 0x00], 6), ([0, 0, 0], 2)];

/// The picture as an SVG document.
pub(crate) fn svg(runs: &[Run; 3]) -> Result<String, chart::Error> {
    let end = runs.iter().map(Run::took_s).fold(0.0, f64::max);
    let panel = |height, name: &str, around, curves: Vec<Curve>| {
        let values = chart::range(curves.iter().flat_map(|curve| &curve.points).map(|point| point.1), around);
        let names = ["time since the order [s]".to_owned(), name.to_owned()];
        Panel { height, names, ranges: [0.0..end, values], curves }
    };
    let positions = runs.iter().zip(STYLES).map(|(run, (color, width))| Curve {
        color: Some(color),
        width,
        ..Curve::new(run.door, run.positions.clone())
    });
    let differences = runs.iter().zip(STYLES).skip(1).map(|(run, (color, _))| Curve {
        color: Some(color),
        ..Curve::new(run.door, run.differences(&runs[0]).collect())
    });
    chart::svg(&Picture {
        title: format!("One program moves the AG02 to {TARGET}"),
        summary: "Through each interface the drive moves in the same way, as the program reads it".to_owned(),
        panels: vec![
            panel(360, "position [increments]", 0.0, positions.collect()),
            panel(220, "ahead of CANopen [increments]", 0.0, differences.collect()),
        ],
    })
}
