//! Pictures: panels with curves, one below the other, as SVG.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

/// Why a picture cannot be drawn.
pub type Error = DrawingAreaErrorKind<std::io::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The backend draws at whole pixels; drawing larger and showing smaller keeps the curves smooth.
const SCALE: u32 = 8;
// The layout, in drawn pixels.
const WIDTH: u32 = 1100 * SCALE;
const HEAD: u32 = 60 * SCALE;
/// The names of the curves, to the right of them.
const NAMES: u32 = 220 * SCALE;
const LINE: i32 = 22 * SCALE as i32;
const MARGIN: u32 = 12 * SCALE;
/// The numbers and the name below, and to the left.
const BELOW: u32 = 40 * SCALE;
const LEFT: u32 = 64 * SCALE;

/// A picture.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Its first line.
    pub title: String,
    /// Its second line.
    pub summary: String,
    /// From top to bottom.
    pub panels: Vec<Panel>,
}

/// Curves in one system of coordinates.
#[derive(Clone, Debug)]
pub struct Panel {
    /// How high it is, in pixels.
    pub height: u32,
    /// What the axes mean, with units.
    pub names: [String; 2],
    /// From where to where the axes go.
    pub ranges: [Range<f64>; 2],
    /// The first one is drawn first.
    pub curves: Vec<Curve>,
}

/// A curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// What it is.
    pub name: String,
    /// Points that are joined by lines.
    pub points: Vec<(f64, f64)>,
    /// In grey; else each curve has its own colour.
    pub grey: bool,
    /// The colour that it has instead.
    pub color: Option<Rgb>,
    /// How wide the line is, in pixels.
    pub width: u32,
}

/// Red, green and blue.
pub type Rgb = [u8; 3];

impl Curve {
    /// A curve with a colour of its own.
    #[must_use]
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Curve {
        Curve { name: name.into(), points, grey: false, color: None, width: 2 }
    }

    /// A grey line from the bottom to the top of a panel.
    #[must_use]
    pub fn upright(name: impl Into<String>, x: f64, y: &Range<f64>) -> Curve {
        Curve { grey: true, ..Curve::new(name, vec![(x, y.start), (x, y.end)]) }
    }
}

impl Panel {
    /// Makes one unit as long across as upwards, so that a circle is round: widens the range of x.
    #[must_use]
    pub fn to_scale(mut self) -> Panel {
        let [x, y] = &mut self.ranges;
        let across = f64::from(WIDTH - NAMES - 2 * MARGIN - LEFT);
        let upwards = f64::from(self.height * SCALE - 2 * MARGIN - BELOW);
        let (middle, half) = (f64::midpoint(x.start, x.end), (y.end - y.start) * across / upwards / 2.0);
        *x = middle - half..middle + half;
        self
    }
}

/// From the lowest to the highest number, with air around them; `around` is in it in any case.
pub fn range(numbers: impl Iterator<Item = f64> + Clone, around: f64) -> Range<f64> {
    let (low, high) = (numbers.clone().fold(around, f64::min), numbers.fold(around, f64::max));
    let air = ((high - low) * 0.05).max(0.1);
    low - air..high + air
}

/// The picture as an SVG document.
///
/// # Errors
///
/// [`Error`]: the panels do not fit a picture.
pub fn svg(picture: &Picture) -> Result<String, Error> {
    let height = HEAD + SCALE * picture.panels.iter().map(|panel| panel.height).sum::<u32>();
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (WIDTH, height)).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, mut below) = root.split_vertically(HEAD);
        head.draw(&Text::new(picture.title.clone(), (LINE, LINE / 2), font(22)))?;
        head.draw(&Text::new(picture.summary.clone(), (LINE, LINE * 7 / 4), font(15)))?;
        for panel in &picture.panels {
            let area;
            (area, below) = below.split_vertically(panel.height * SCALE);
            draw(&area, panel)?;
        }
        root.present()?;
    }
    let (drawn, shown) = (size(WIDTH, height), size(WIDTH / SCALE, height / SCALE));
    Ok(text.replacen(&drawn, &shown, 1))
}

fn draw(area: &Area<'_>, panel: &Panel) -> Result<(), Error> {
    let (diagram, names) = area.split_horizontally(WIDTH - NAMES);
    let [x, y] = panel.ranges.clone();
    let mut chart = ChartBuilder::on(&diagram)
        .margin(MARGIN)
        .x_label_area_size(BELOW)
        .y_label_area_size(LEFT)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.15).stroke_width(SCALE))
        .axis_style(BLACK.stroke_width(SCALE))
        .label_style(font(13))
        .x_desc(panel.names[0].as_str())
        .y_desc(panel.names[1].as_str())
        .draw()?;
    for (number, curve) in panel.curves.iter().enumerate() {
        let color = match curve.color {
            Some([red, green, blue]) => RGBColor(red, green, blue).to_rgba(),
            None if curve.grey => BLACK.mix(0.6),
            None => Palette99::pick(number).to_rgba(),
        };
        let (style, y) = (color.stroke_width(curve.width * SCALE), LINE * (number as i32 + 1));
        chart.draw_series(LineSeries::new(curve.points.iter().copied(), style))?;
        names.draw(&PathElement::new([(0, y + LINE / 3), (LINE, y + LINE / 3)], style))?;
        names.draw(&Text::new(curve.name.clone(), (LINE * 3 / 2, y), font(14)))?;
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
