//! A picture of the positions of all drives over time, with a panel for each unit.

use lexican_pictures::{self as pictures, Curve, Event, Panel, Picture};

use crate::recipe::Unit;
use crate::report::Report;

pub(crate) fn svg(report: &Report) -> String {
    let mut units: Vec<Unit> = report.drives.iter().map(|row| row.unit).collect();
    units.sort_unstable();
    units.dedup();
    let end = report.drives.iter().flat_map(|row| &row.course).map(|point| point.0).fold(0.1, f64::max);
    let panel = |unit: Unit| {
        let curves = report.drives.iter().filter(|row| row.unit == unit).map(|row| {
            // The last position is held until the end.
            let last = row.course.last().map(|(_, position)| (end, *position));
            Curve::new(&row.name, row.course.iter().copied().chain(last).collect())
        });
        Panel { height: 300.0, ..Panel::curves(format!("position [{}]", unit.symbol()), curves.collect()) }
    };
    let stop = report.stop.iter().filter_map(|stop| stop.at_s);
    pictures::svg(&[Picture {
        title: report.recipe.clone(),
        subtitle: report.summary.clone(),
        axis: "time since the release [s]".to_owned(),
        span: 0.0..end,
        panels: units.into_iter().map(panel).collect(),
        events: stop.map(|at_s| Event { at_s, text: "all are stopped".to_owned() }).collect(),
    }])
}
