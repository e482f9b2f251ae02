//! Pictures over time as SVG: panels of curves and lanes with a common time axis, and numbered events through all of
//! them. Also pictures of a [`network`].
//!
//! Written as text without a plotting library: coordinates have a resolution of a tenth of a pixel, files are small,
//! and the same input always gives the same bytes.

mod draw;
pub mod network;
mod scale;

use std::ops::Range;

pub use draw::svg;
pub use scale::range;

/// The width of a panel, in pixels.
const ACROSS: f64 = 824.0;
/// The height of a lane, in pixels.
const LANE: f64 = 22.0;

/// The default colours of curves, in this order. They differ for readers with red-green colour blindness, too.
const PALETTE: [&str; 6] = [BLUE, ORANGE, GREEN, PURPLE, AMBER, SKY];
/// `#0072B2`
pub const BLUE: &str = "#0072B2";
/// `#008F68`
pub const GREEN: &str = "#008F68";
/// `#D55E00`
pub const ORANGE: &str = "#D55E00";
/// `#9A4C95`
pub const PURPLE: &str = "#9A4C95";
/// `#C98A00`
pub const AMBER: &str = "#C98A00";
/// `#56B4E9`
pub const SKY: &str = "#56B4E9";
/// `#8A949E`
pub const GREY: &str = "#8A949E";
/// `#222A33`
pub const INK: &str = "#222A33";

/// A picture with panels over a common axis.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Its first line.
    pub title: String,
    /// Its second line.
    pub subtitle: String,
    /// The title of the common axis, with its unit.
    pub axis: String,
    /// The range of the common axis.
    pub span: Range<f64>,
    /// From top to bottom.
    pub panels: Vec<Panel>,
    /// Ascending in time.
    pub events: Vec<Event>,
}

/// An event: a numbered line through all panels, with a text below them.
#[derive(Clone, Debug)]
pub struct Event {
    /// In seconds.
    pub at_s: f64,
    /// What.
    pub text: String,
}

/// A panel of a picture.
#[derive(Clone, Debug)]
pub struct Panel {
    /// With the unit.
    pub title: String,
    /// In pixels.
    pub height: f64,
    /// What is in it.
    pub content: Content,
}

/// What is in a panel.
#[derive(Clone, Debug)]
pub enum Content {
    /// Curves of numbers; the first one is drawn first.
    Curves(Vec<Curve>),
    /// Lanes with bars where something holds.
    Lanes(Vec<Lane>),
}

/// A curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The name in the legend; empty to leave the curve out.
    pub name: String,
    /// `None` for the next colour of the palette.
    pub color: Option<&'static str>,
    /// Whether it is a dashed line.
    pub dashed: bool,
    /// The width of the line, in pixels.
    pub width: f64,
    /// Points that are joined by lines.
    pub points: Vec<(f64, f64)>,
}

/// A lane, with bars for the times at which something holds.
#[derive(Clone, Debug)]
pub struct Lane {
    /// What holds.
    pub name: &'static str,
    /// The colour of its bars.
    pub color: &'static str,
    /// Beginning and end of each bar, in seconds.
    pub spans_s: Vec<(f64, f64)>,
}

impl Picture {
    /// Sets the span so that a unit has the same length on both axes of a panel of curves, and circles are round.
    #[must_use]
    pub fn to_scale(mut self, middle: f64) -> Picture {
        let upwards = self.panels.first().map_or(0.0, |panel| {
            let values = panel.values();
            (values.end - values.start) / panel.height
        });
        let half = upwards * ACROSS / 2.0;
        self.span = middle - half..middle + half;
        self
    }
}

impl Panel {
    /// A panel of curves with the usual height.
    #[must_use]
    pub fn curves(title: impl Into<String>, curves: Vec<Curve>) -> Panel {
        Panel { title: title.into(), height: 170.0, content: Content::Curves(curves) }
    }

    /// A panel of lanes below each other.
    #[must_use]
    pub fn lanes(title: impl Into<String>, lanes: Vec<Lane>) -> Panel {
        Panel { title: title.into(), height: lanes.len() as f64 * LANE, content: Content::Lanes(lanes) }
    }

    /// The range of the curves' values, with a margin.
    fn values(&self) -> Range<f64> {
        let curves = if let Content::Curves(curves) = &self.content { &curves[..] } else { &[] };
        range(curves.iter().flat_map(|curve| &curve.points).map(|point| point.1))
    }
}

impl Curve {
    /// A curve in the next colour.
    #[must_use]
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Curve {
        Curve { name: name.into(), color: None, dashed: false, width: 2.0, points }
    }

    /// A curve of targets: each holds until the next one, the last one until `end_s`.
    #[must_use]
    pub fn target(targets: &[(f64, f64)], end_s: f64) -> Curve {
        let mut points = held(targets);
        points.extend(targets.last().map(|&(_, last)| (end_s, last)));
        Curve { color: Some(ORANGE), dashed: true, width: 1.6, ..Curve::new("target", points) }
    }
}

impl Lane {
    /// A lane from observations in ascending time.
    #[must_use]
    pub fn new(name: &'static str, color: &'static str, seen: impl Iterator<Item = (f64, bool)>) -> Lane {
        let mut spans_s: Vec<(f64, f64)> = Vec::new();
        let mut was = false;
        for (at_s, is) in seen {
            match spans_s.last_mut().filter(|_| was) {
                Some((_, to)) => *to = at_s,
                None if is => spans_s.push((at_s, at_s)),
                None => {}
            }
            was = is;
        }
        Lane { name, color, spans_s }
    }
}

/// The points of a step curve: each value holds until the next one.
#[must_use]
pub fn held(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut steps: Vec<(f64, f64)> = Vec::with_capacity(points.len() * 2);
    for &(at, value) in points {
        if let Some(&(_, before)) = steps.last().filter(|(_, before)| *before != value) {
            steps.push((at, before));
        }
        steps.push((at, value));
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_holds_until_the_next_one() {
        let curve = Curve::target(&[(0.5, 5000.0), (10.5, -5000.0)], 20.0);
        assert_eq!(curve.points, [(0.5, 5000.0), (10.5, 5000.0), (10.5, -5000.0), (20.0, -5000.0)]);
        assert!(Curve::target(&[], 20.0).points.is_empty());
    }

    #[test]
    fn a_lane_is_from_the_first_look_to_the_first_without() {
        let seen = [false, true, true, false, true].into_iter().enumerate().map(|(at, is)| (at as f64, is));
        assert_eq!(Lane::new("moving", BLUE, seen).spans_s, [(1.0, 3.0), (4.0, 4.0)]);
    }

    #[test]
    fn what_is_to_scale_has_a_circle_that_is_round() {
        let circle = Curve::new("circle", vec![(-10.0, -10.0), (10.0, 10.0)]);
        let panel = Panel { height: 412.0, ..Panel::curves("y", vec![circle]) };
        let picture = Picture { panels: vec![panel], ..Picture::default() }.to_scale(3.0);
        let values = picture.panels[0].values();
        let across = (picture.span.end - picture.span.start) / (values.end - values.start);
        assert!((across - ACROSS / 412.0).abs() < 1e-9, "{across}");
        assert!((f64::midpoint(picture.span.start, picture.span.end) - 3.0).abs() < 1e-9);
    }
}
