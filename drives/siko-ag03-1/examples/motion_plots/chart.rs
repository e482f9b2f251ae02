//! A picture of something over time, as SVG: panels of curves and of lanes above each other, with one time axis.
//!
//! Written as text and not by a plotting library: coordinates of a tenth of a pixel, small files, and not a byte
//! that differs from run to run.

use std::fmt::Write as _;

/// Colours, any two of which differ for readers who see red and green alike.
pub(crate) const BLUE: &str = "#0072B2";
pub(crate) const GREEN: &str = "#008F68";
pub(crate) const ORANGE: &str = "#D55E00";
pub(crate) const PURPLE: &str = "#9A4C95";
pub(crate) const AMBER: &str = "#C98A00";
const INK: &str = "#222A33";
const MUTED: &str = "#5B6670";
const MARK: &str = "#8A949E";
const FAINT: &str = "#E3E7EB";
const PAPER: &str = "#F5F7F9";

// The layout, in pixels.
const WIDTH: f64 = 960.0;
const LEFT: f64 = 112.0;
const RIGHT: f64 = WIDTH - 24.0;
const TOP: f64 = 62.0;
/// Numbers of events stand above the first panel.
const EVENTS: f64 = 28.0;
/// The title of a panel and its legend stand above it.
const HEAD: f64 = 22.0;
const CURVES: f64 = 170.0;
const LANE: f64 = 22.0;
const GAP: f64 = 16.0;
const TIME_AXIS: f64 = 44.0;
const EVENT_LINE: f64 = 20.0;
/// Where the list of events has its columns.
const EVENT_COLUMNS: [f64; 2] = [LEFT, 540.0];
/// Letters that stand out from lines behind them.
const HALO: &str = r##"stroke="#FFFFFF" stroke-width="4" paint-order="stroke""##;

/// A picture.
pub(crate) struct Picture {
    pub(crate) title: String,
    pub(crate) subtitle: String,
    /// From when to when, in seconds.
    pub(crate) span_s: (f64, f64),
    pub(crate) panels: Vec<Panel>,
    /// What happened, ascending in time.
    pub(crate) events: Vec<Event>,
}

/// Something that happened.
#[derive(Clone)]
pub(crate) struct Event {
    pub(crate) at_s: f64,
    pub(crate) text: String,
}

/// One diagram.
pub(crate) struct Panel {
    /// What it shows, with its unit.
    pub(crate) title: &'static str,
    pub(crate) content: Content,
}

pub(crate) enum Content {
    /// Numbers over time.
    Curves(Vec<Curve>),
    /// What is so, and what is not so, over time.
    Lanes(Vec<Lane>),
}

/// A number over time.
pub(crate) struct Curve {
    pub(crate) name: String,
    pub(crate) color: &'static str,
    pub(crate) dashed: bool,
    pub(crate) points: Vec<(f64, f64)>,
}

/// Something that is so from time to time.
pub(crate) struct Lane {
    pub(crate) name: &'static str,
    pub(crate) color: &'static str,
    /// From when to when, in seconds.
    pub(crate) spans_s: Vec<(f64, f64)>,
}

impl Picture {
    /// The picture as an SVG document.
    pub(crate) fn svg(&self) -> String {
        let mut out = String::new();
        let panels: f64 = self.panels.iter().map(|panel| HEAD + panel.height() + GAP).sum();
        let bottom = TOP + EVENTS + panels - GAP;
        let height = bottom + TIME_AXIS + EVENT_LINE * self.events.len().div_ceil(2) as f64 + 8.0;
        let _ = writeln!(
            out,
            r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" style="max-width:100%;height:auto" font-family="Inter, 'Segoe UI', 'DejaVu Sans', Verdana, sans-serif" font-size="12">"#
        );
        let _ = writeln!(out, r##"<rect width="{WIDTH}" height="{height}" fill="#FFFFFF"/>"##);
        text(&mut out, 24.0, 30.0, &self.title, r#"font-size="17" font-weight="bold""#, INK);
        text(&mut out, 24.0, 50.0, &self.subtitle, r#"font-size="13""#, MUTED);
        let tops = self.panels.iter().scan(TOP + EVENTS, |next, panel| {
            let top = *next + HEAD;
            *next = top + panel.height() + GAP;
            Some(top)
        });
        let tops: Vec<f64> = tops.collect();
        for (panel, top) in self.panels.iter().zip(&tops) {
            self.draw_ground(&mut out, panel, *top);
        }
        self.draw_event_lines(&mut out, bottom);
        for (panel, top) in self.panels.iter().zip(&tops) {
            self.draw(&mut out, panel, *top);
        }
        self.draw_time_axis(&mut out, bottom);
        self.draw_events(&mut out, bottom);
        out.push_str("</svg>\n");
        out
    }

    fn x(&self, at_s: f64) -> f64 {
        let (from, to) = self.span_s;
        LEFT + (at_s - from) / (to - from) * (RIGHT - LEFT)
    }

    fn draw_ground(&self, out: &mut String, panel: &Panel, top: f64) {
        let (width, height) = (RIGHT - LEFT, panel.height());
        let _ =
            writeln!(out, r#"<rect x="{LEFT}" y="{top:.1}" width="{width:.1}" height="{height:.1}" fill="{PAPER}"/>"#);
        for at_s in ticks(self.span_s.0, self.span_s.1, 12) {
            line(out, (self.x(at_s), top), (self.x(at_s), top + height), FAINT, "");
        }
    }

    fn draw(&self, out: &mut String, panel: &Panel, top: f64) {
        text(out, LEFT, top - 7.0, panel.title, &format!(r#"font-size="13" {HALO}"#), INK);
        match &panel.content {
            Content::Curves(curves) => self.draw_curves(out, curves, top),
            Content::Lanes(lanes) => self.draw_lanes(out, lanes, top),
        }
    }

    fn draw_curves(&self, out: &mut String, curves: &[Curve], top: f64) {
        let (low, high) = span(curves);
        let y = |value: f64| top + CURVES - (value - low) / (high - low) * CURVES;
        for value in ticks(low, high, 6) {
            let color = if value == 0.0 { MARK } else { FAINT };
            line(out, (LEFT, y(value)), (RIGHT, y(value)), color, "");
            text(out, LEFT - 8.0, y(value) + 4.0, &signed(value), r#"text-anchor="end""#, MUTED);
        }
        draw_legend(out, curves, top - 7.0);
        for curve in curves {
            let points = thin(curve.points.iter().map(|&(at_s, value)| (self.x(at_s), y(value))));
            let points: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(
                out,
                r#"<polyline points="{}" fill="none" stroke="{}" {}/>"#,
                points.join(" "),
                curve.color,
                curve.stroke()
            );
        }
    }

    fn draw_lanes(&self, out: &mut String, lanes: &[Lane], top: f64) {
        for (row, lane) in lanes.iter().enumerate() {
            let y = top + row as f64 * LANE;
            if row > 0 {
                line(out, (LEFT, y), (RIGHT, y), "#FFFFFF", r#"stroke-width="2""#);
            }
            for &(from, to) in &lane.spans_s {
                let (left, right) = (self.x(from), self.x(to));
                let _ = writeln!(
                    out,
                    r#"<rect x="{left:.1}" y="{:.1}" width="{:.1}" height="{:.1}" rx="2" fill="{}" fill-opacity="0.8"/>"#,
                    y + 5.0,
                    (right - left).max(1.0),
                    LANE - 10.0,
                    lane.color
                );
            }
            text(out, LEFT - 8.0, y + LANE / 2.0 + 4.0, lane.name, r#"text-anchor="end" font-size="11""#, MUTED);
        }
    }

    fn draw_time_axis(&self, out: &mut String, bottom: f64) {
        line(out, (LEFT, bottom), (RIGHT, bottom), MARK, "");
        for at_s in ticks(self.span_s.0, self.span_s.1, 12) {
            let x = self.x(at_s);
            line(out, (x, bottom), (x, bottom + 5.0), MARK, "");
            text(out, x, bottom + 18.0, &plain(at_s), r#"text-anchor="middle""#, MUTED);
        }
        text(out, RIGHT, bottom + 34.0, "time [s]", r#"text-anchor="end" font-size="13""#, INK);
    }

    /// Each event as a line through all panels, with a number above.
    fn draw_event_lines(&self, out: &mut String, bottom: f64) {
        let marks = spread(self.events.iter().map(|event| self.x(event.at_s)));
        for (number, (event, mark)) in self.events.iter().zip(marks).enumerate() {
            let (x, y) = (self.x(event.at_s), TOP + 10.0);
            line(out, (x, TOP + EVENTS), (x, bottom), MARK, r#"stroke-dasharray="3 3""#);
            line(out, (mark, y), (x, TOP + EVENTS), MARK, "");
            bullet(out, mark, y, number + 1);
        }
    }

    /// What the numbers mean.
    fn draw_events(&self, out: &mut String, bottom: f64) {
        let rows = self.events.len().div_ceil(2);
        for (number, event) in self.events.iter().enumerate() {
            let left = EVENT_COLUMNS[number / rows];
            let y = bottom + TIME_AXIS + EVENT_LINE * (number % rows) as f64 + 8.0;
            bullet(out, left + 9.0, y - 4.0, number + 1);
            text(out, left + 68.0, y, &format!("{:.2} s", event.at_s), r#"text-anchor="end""#, MUTED);
            text(out, left + 80.0, y, &event.text, "", INK);
        }
    }
}

/// The names of the curves, to the right of a panel's title.
fn draw_legend(out: &mut String, curves: &[Curve], y: f64) {
    let named = || curves.iter().filter(|curve| !curve.name.is_empty());
    // A guess on the safe side: the font that shows the picture is not known here.
    let width = |curve: &Curve| 34.0 + curve.name.chars().count() as f64 * 6.7 + 14.0;
    let mut left = RIGHT + 14.0 - named().map(width).sum::<f64>();
    for curve in named() {
        line(out, (left, y - 4.0), (left + 26.0, y - 4.0), curve.color, curve.stroke());
        text(out, left + 34.0, y, &curve.name, HALO, INK);
        left += width(curve);
    }
}

impl Panel {
    fn height(&self) -> f64 {
        match &self.content {
            Content::Curves(_) => CURVES,
            Content::Lanes(lanes) => lanes.len() as f64 * LANE,
        }
    }
}

impl Curve {
    fn stroke(&self) -> &'static str {
        if self.dashed { r#"stroke-width="1.6" stroke-dasharray="6 4""# } else { r#"stroke-width="2""# }
    }
}

fn text(out: &mut String, x: f64, y: f64, text: &str, attributes: &str, color: &str) {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    let _ = writeln!(out, r#"<text x="{x:.1}" y="{y:.1}" fill="{color}" {attributes}>{text}</text>"#);
}

fn line(out: &mut String, from: (f64, f64), to: (f64, f64), color: &str, attributes: &str) {
    let ((x1, y1), (x2, y2)) = (from, to);
    let _ =
        writeln!(out, r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" stroke="{color}" {attributes}/>"#);
}

fn bullet(out: &mut String, x: f64, y: f64, number: usize) {
    let _ = writeln!(out, r#"<circle cx="{x:.1}" cy="{y:.1}" r="9" fill="{INK}"/>"#);
    text(out, x, y + 4.0, &number.to_string(), r#"text-anchor="middle" font-size="11""#, "#FFFFFF");
}

/// Round numbers between two others, about `count` of them.
fn ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    let least = (high - low) / count as f64;
    let power = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|step| *step >= least);
    let step = step.unwrap_or(10.0 * power);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(|number| number as f64 * step).collect()
}

/// All values, zero, and some air.
fn span(curves: &[Curve]) -> (f64, f64) {
    let values = || curves.iter().flat_map(|curve| &curve.points).map(|point| point.1);
    let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
    let air = ((high - low) * 0.08).max(0.5);
    (if low < 0.0 { low - air } else { low - air / 2.0 }, high + air)
}

/// `+5000`, `0`, `-72`.
fn signed(value: f64) -> String {
    if value.abs() < 1e-9 { "0".into() } else { format!("{value:+}") }
}

/// `2`, `2.5`.
fn plain(value: f64) -> String {
    format!("{}", (value * 1e6).round() / 1e6)
}

/// Numbers of events, so far apart that none covers another: to the right first, then back from the edge.
fn spread(places: impl Iterator<Item = f64>) -> Vec<f64> {
    const APART: f64 = 21.0;
    let mut places: Vec<f64> = places.collect();
    let mut free = LEFT;
    for place in &mut places {
        *place = place.max(free);
        free = *place + APART;
    }
    let mut free = RIGHT;
    for place in places.iter_mut().rev() {
        *place = place.min(free);
        free = *place - APART;
    }
    places
}

/// Drops points between which the line is the same, to a tenth of a pixel.
fn thin(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    // Points since the last one that was kept: all must lie on the line to the next.
    let mut between: Vec<(f64, f64)> = Vec::new();
    for point in points {
        if let Some(&from) = kept.last() {
            let on_line = |&(x, y): &(f64, f64)| {
                let share = if point.0 > from.0 { (x - from.0) / (point.0 - from.0) } else { 0.0 };
                (from.1 + share * (point.1 - from.1) - y).abs() < 0.1
            };
            if !between.iter().all(on_line) {
                kept.extend(between.last().copied());
                between.clear();
            }
        } else {
            kept.push(point);
        }
        between.push(point);
    }
    kept.extend(between.last().copied());
    kept
}
