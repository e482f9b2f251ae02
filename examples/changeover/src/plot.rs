//! The positions of all drives over time as a picture: a panel for each unit.

use lexican_toolbox::chart::{self, Curve, Panel, Picture};

use crate::recipe::Unit;
use crate::report::{Report, Row};

/// The picture as an SVG document.
pub(crate) fn svg(report: &Report) -> Result<String, chart::Error> {
    let mut units: Vec<Unit> = report.drives.iter().map(|row| row.unit).collect();
    units.sort_unstable();
    units.dedup();
    chart::svg(&Picture {
        title: report.recipe.clone(),
        summary: report.summary.clone(),
        panels: units.into_iter().map(|unit| panel(report, unit)).collect(),
    })
}

/// The drives with this unit.
fn panel(report: &Report, unit: Unit) -> Panel {
    let rows: Vec<&Row> = report.drives.iter().filter(|row| row.unit == unit).collect();
    let end = report.drives.iter().flat_map(|row| &row.course).map(|point| point.0).fold(0.1, f64::max);
    let positions = chart::range(rows.iter().flat_map(|row| &row.course).map(|point| point.1), 0.0);
    let curves = rows.iter().map(|row| {
        // A drive stays where it was seen last.
        let last = row.course.last().map(|(_, position)| (end, *position));
        Curve::new(&row.name, row.course.iter().copied().chain(last).collect())
    });
    let stop = report.stop.iter().filter_map(|stop| stop.at_s);
    let stop = stop.map(|at_s| Curve::upright("all are stopped", at_s, &positions));
    Panel {
        height: 360,
        curves: curves.chain(stop).collect(),
        names: ["time since the release [s]".to_owned(), format!("position [{}]", unit.symbol())],
        ranges: [0.0..end, positions],
    }
}
