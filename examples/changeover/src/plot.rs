//! The positions of all drives over time as a picture: a panel for each unit.

use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

use crate::recipe::Unit;
use crate::report::{Report, Row};

type Error = DrawingAreaErrorKind<std::io::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The backend draws at whole pixels; drawing larger and showing smaller keeps the curves smooth.
const SCALE: u32 = 8;
// The layout, in drawn pixels.
const WIDTH: u32 = 1100 * SCALE;
const HEAD: u32 = 60 * SCALE;
const PANEL: u32 = 360 * SCALE;
/// The names of the curves, to the right of them.
const NAMES: u32 = 220 * SCALE;
const LINE: i32 = 22 * SCALE as i32;

/// The picture as an SVG document.
pub(crate) fn svg(report: &Report) -> Result<String, Error> {
    let mut units: Vec<Unit> = report.drives.iter().map(|row| row.unit).collect();
    units.sort_unstable();
    units.dedup();
    let height = HEAD + PANEL * units.len() as u32;
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (WIDTH, height)).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, panels) = root.split_vertically(HEAD);
        head.draw(&Text::new(report.recipe.clone(), (LINE, LINE / 2), font(22)))?;
        head.draw(&Text::new(report.summary.clone(), (LINE, LINE * 7 / 4), font(15)))?;
        for (unit, panel) in units.iter().zip(panels.split_evenly((units.len(), 1))) {
            draw(&panel, report, *unit)?;
        }
        root.present()?;
    }
    let (drawn, shown) = (size(WIDTH, height), size(WIDTH / SCALE, height / SCALE));
    Ok(text.replacen(&drawn, &shown, 1))
}

/// The drives with this unit.
fn draw(area: &Area<'_>, report: &Report, unit: Unit) -> Result<(), Error> {
    let rows: Vec<&Row> = report.drives.iter().filter(|row| row.unit == unit).collect();
    let end = report.drives.iter().flat_map(|row| &row.course).map(|point| point.0).fold(0.1, f64::max);
    let positions = || rows.iter().flat_map(|row| &row.course).map(|point| point.1);
    let (low, high) = (positions().fold(0.0, f64::min), positions().fold(0.0, f64::max));
    let air = ((high - low) * 0.05).max(0.1);
    let (diagram, names) = area.split_horizontally(WIDTH - NAMES);
    let mut chart = ChartBuilder::on(&diagram)
        .margin(12 * SCALE)
        .x_label_area_size(40 * SCALE)
        .y_label_area_size(64 * SCALE)
        .build_cartesian_2d(0.0..end, low - air..high + air)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.15).stroke_width(SCALE))
        .axis_style(BLACK.stroke_width(SCALE))
        .label_style(font(13))
        .x_desc("time since the release [s]")
        .y_desc(format!("position [{}]", unit.symbol()))
        .draw()?;
    let curves = rows.iter().enumerate().map(|(number, row)| {
        // A drive stays where it was seen last.
        let last = row.course.last().map(|(_, position)| (end, *position));
        let points: Vec<_> = row.course.iter().copied().chain(last).collect();
        (row.name.as_str(), Palette99::pick(number).to_rgba(), points)
    });
    let stop = report
        .stop
        .iter()
        .filter_map(|stop| stop.at_s)
        .map(|at_s| ("all are stopped", BLACK.mix(0.6), vec![(at_s, low - air), (at_s, high + air)]));
    for (number, (name, color, points)) in curves.chain(stop).enumerate() {
        let (style, y) = (color.stroke_width(2 * SCALE), LINE * (number as i32 + 1));
        chart.draw_series(LineSeries::new(points, style))?;
        names.draw(&PathElement::new([(0, y + LINE / 3), (LINE, y + LINE / 3)], style))?;
        names.draw(&Text::new(name.to_owned(), (LINE * 3 / 2, y), font(14)))?;
    }
    Ok(())
}

fn font(size: u32) -> TextStyle<'static> {
    ("sans-serif", size * SCALE).into()
}

/// How the document gives its size.
fn size(width: u32, height: u32) -> String {
    format!("width=\"{width}\" height=\"{height}\" viewBox")
}
