//! Draws pictures as an SVG document.

use std::fmt::Write as _;
use std::ops::Range;

use crate::scale::{spread, thin, ticks};
use crate::{ACROSS, Content, Curve, Event, GREY, INK, LANE, Lane, PALETTE, Panel, Picture};

pub(crate) const MUTED: &str = "#5B6670";
pub(crate) const FAINT: &str = "#E3E7EB";
pub(crate) const PAPER: &str = "#F5F7F9";

// The layout, in pixels.
const LEFT: f64 = 112.0;
const RIGHT: f64 = LEFT + ACROSS;
const WIDTH: f64 = RIGHT + 24.0;
/// The height of title and subtitle.
const TITLE: f64 = 62.0;
/// The height of the event numbers above the first panel.
const EVENTS: f64 = 28.0;
/// The height of a panel's title and legend; a long legend adds rows below the title.
const HEAD: f64 = 22.0;
const LEGEND: f64 = 18.0;
const GAP: f64 = 16.0;
const AXIS: f64 = 44.0;
const EVENT_LINE: f64 = 20.0;
/// A white outline that makes letters readable in front of lines.
const HALO: &str = r##"stroke="#FFFFFF" stroke-width="4" paint-order="stroke""##;

/// One SVG document with the pictures below each other.
#[must_use]
pub fn svg(pictures: &[Picture]) -> String {
    let mut body = String::new();
    let mut height = 0.0;
    for picture in pictures {
        height = Layout { picture, top: height }.draw(&mut body);
    }
    document(&body, WIDTH, height)
}

/// An SVG document of this size.
pub(crate) fn document(body: &str, width: f64, height: f64) -> String {
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" style="max-width:100%;height:auto" font-family="Inter, 'Segoe UI', 'DejaVu Sans', Verdana, sans-serif" font-size="12">
<rect width="{width}" height="{height}" fill="#FFFFFF"/>
{body}</svg>
"##
    )
}

/// A picture with its position.
struct Layout<'a> {
    picture: &'a Picture,
    top: f64,
}

impl Layout<'_> {
    /// Draws it; returns its lower edge.
    fn draw(&self, out: &mut String) -> f64 {
        let Picture { title, subtitle, axis, span, panels, events } = self.picture;
        text(out, 24.0, self.top + 30.0, title, r#"font-size="17" font-weight="bold""#, INK);
        text(out, 24.0, self.top + 50.0, subtitle, r#"font-size="13""#, MUTED);
        let has_title = !title.is_empty() || !subtitle.is_empty();
        let marks = self.top + if has_title { TITLE } else { 0.0 };
        let first = marks + if events.is_empty() { 0.0 } else { EVENTS };
        let mut bottom = first - GAP;
        let tops: Vec<f64> = panels
            .iter()
            .map(|panel| {
                let top = bottom + GAP + head(panel);
                bottom = top + panel.height;
                top
            })
            .collect();
        let times = ticks(span, 12, true);
        for (panel, top) in panels.iter().zip(&tops) {
            let height = panel.height;
            let _ = writeln!(
                out,
                r#"<rect x="{LEFT}" y="{top:.1}" width="{ACROSS:.1}" height="{height:.1}" fill="{PAPER}"/>"#
            );
            for (at, _) in &times {
                line(out, (self.x(*at), *top), (self.x(*at), top + height), FAINT, "");
            }
        }
        self.draw_event_lines(out, marks, bottom);
        for (panel, top) in panels.iter().zip(&tops) {
            text(out, LEFT, top - head(panel) + HEAD - 7.0, &panel.title, &format!(r#"font-size="13" {HALO}"#), INK);
            match &panel.content {
                Content::Curves(curves) => self.draw_curves(out, panel, curves, *top),
                Content::Lanes(lanes) => self.draw_lanes(out, lanes, *top),
            }
        }
        line(out, (LEFT, bottom), (RIGHT, bottom), GREY, "");
        for (at, number) in &times {
            let x = self.x(*at);
            line(out, (x, bottom), (x, bottom + 5.0), GREY, "");
            text(out, x, bottom + 18.0, number, r#"text-anchor="middle""#, MUTED);
        }
        text(out, RIGHT, bottom + 34.0, axis, r#"text-anchor="end" font-size="13""#, INK);
        draw_events(out, events, bottom + AXIS + 8.0)
    }

    fn x(&self, at: f64) -> f64 {
        let Range { start, end } = self.picture.span;
        LEFT + (at - start) / (end - start) * ACROSS
    }

    fn draw_curves(&self, out: &mut String, panel: &Panel, curves: &[Curve], top: f64) {
        let values = panel.values();
        let y = |value: f64| top + panel.height - (value - values.start) / (values.end - values.start) * panel.height;
        for (value, number) in ticks(&values, (panel.height / 28.0) as usize, true) {
            let color = if value == 0.0 { GREY } else { FAINT };
            line(out, (LEFT, y(value)), (RIGHT, y(value)), color, "");
            text(out, LEFT - 8.0, y(value) + 4.0, &number, r#"text-anchor="end""#, MUTED);
        }
        let bottom_row = if head(panel) > HEAD { head(panel) - HEAD - LEGEND + 7.0 } else { 7.0 };
        for Key { number, left, row } in keys(&panel.title, curves).1 {
            let (curve, y) = (&curves[number], top - bottom_row + LEGEND * row as f64);
            line(out, (left, y - 4.0), (left + 26.0, y - 4.0), color(number, curve), &stroke(number, curve));
            text(out, left + 34.0, y, &curve.name, HALO, INK);
        }
        for (number, curve) in curves.iter().enumerate() {
            let points = thin(curve.points.iter().map(|&(at, value)| (self.x(at), y(value))));
            let points: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(
                out,
                r#"<polyline points="{}" fill="none" stroke="{}" {}/>"#,
                points.join(" "),
                color(number, curve),
                stroke(number, curve)
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

    /// Draws each event as a line through all panels, with its number above.
    fn draw_event_lines(&self, out: &mut String, top: f64, bottom: f64) {
        let events = &self.picture.events;
        let marks = spread(events.iter().map(|event| self.x(event.at_s)), LEFT..RIGHT);
        for (number, (event, mark)) in events.iter().zip(marks).enumerate() {
            let (x, y) = (self.x(event.at_s), top + 10.0);
            line(out, (x, top + EVENTS), (x, bottom), GREY, r#"stroke-dasharray="3 3""#);
            line(out, (mark, y), (x, top + EVENTS), GREY, "");
            bullet(out, mark, y, number + 1);
        }
    }
}

/// Lists the events, in two columns if the texts are short; returns the lower edge.
fn draw_events(out: &mut String, events: &[Event], top: f64) -> f64 {
    let longest = events.iter().map(|event| event.text.chars().count()).max().unwrap_or_default();
    let columns: &[f64] = if longest > 52 { &[LEFT] } else { &[LEFT, 540.0] };
    let rows = events.len().div_ceil(columns.len());
    for (number, event) in events.iter().enumerate() {
        let (left, y) = (columns[number / rows], top + EVENT_LINE * (number % rows) as f64);
        bullet(out, left + 9.0, y - 4.0, number + 1);
        text(out, left + 68.0, y, &format!("{:.2} s", event.at_s), r#"text-anchor="end""#, MUTED);
        text(out, left + 80.0, y, &event.text, "", INK);
    }
    top + EVENT_LINE * rows as f64
}

/// The name of a curve in the legend.
struct Key {
    number: usize,
    left: f64,
    row: usize,
}

/// The number of extra rows that the legend takes, and the positions of its names: to the right of the title, if they
/// fit. A single curve needs no legend.
fn keys(title: &str, curves: &[Curve]) -> (usize, Vec<Key>) {
    // An estimate on the safe side, since the font of the viewer is unknown.
    let letter = |letter: char| if letter.is_uppercase() { 8.6 } else { 6.7 };
    let width = |curve: &Curve| 34.0 + curve.name.chars().map(letter).sum::<f64>() + 14.0;
    let named = || curves.iter().enumerate().filter(|(_, curve)| curves.len() > 1 && !curve.name.is_empty());
    let all: f64 = named().map(|(_, curve)| width(curve)).sum();
    let has_room = all <= ACROSS - title.chars().count() as f64 * 7.5;
    let (mut left, mut row) = (if has_room { RIGHT + 14.0 - all } else { LEFT }, 0);
    let keys = named().map(|(number, curve)| {
        if !has_room && left > LEFT && left + width(curve) > RIGHT + 14.0 {
            (left, row) = (LEFT, row + 1);
        }
        let key = Key { number, left, row };
        left += width(curve);
        key
    });
    let keys: Vec<Key> = keys.collect();
    (if has_room { 0 } else { row + 1 }, keys)
}

/// The height of a panel's title and legend.
fn head(panel: &Panel) -> f64 {
    match &panel.content {
        Content::Curves(curves) => HEAD + LEGEND * keys(&panel.title, curves).0 as f64,
        Content::Lanes(_) => HEAD,
    }
}

fn color(number: usize, curve: &Curve) -> &'static str {
    curve.color.unwrap_or(PALETTE[number % PALETTE.len()])
}

/// After the last colour, curves are dashed, so that no two look the same.
fn stroke(number: usize, curve: &Curve) -> String {
    let dashes = [r#" stroke-dasharray="6 4""#, r#" stroke-dasharray="2 3""#];
    let dash = match number / PALETTE.len() {
        _ if curve.dashed => dashes[0],
        round if curve.color.is_none() && round > 0 => dashes[(round - 1) % 2],
        _ => "",
    };
    format!(r#"stroke-width="{}"{dash}"#, curve.width)
}

pub(crate) fn text(out: &mut String, x: f64, y: f64, text: &str, attributes: &str, color: &str) {
    if !text.is_empty() {
        // XML cannot express control characters.
        let text = text.replace(char::is_control, "?").replace('&', "&amp;").replace('<', "&lt;");
        let _ = writeln!(out, r#"<text x="{x:.1}" y="{y:.1}" fill="{color}" {attributes}>{text}</text>"#);
    }
}

pub(crate) fn line(out: &mut String, from: (f64, f64), to: (f64, f64), color: &str, attributes: &str) {
    let ((x1, y1), (x2, y2)) = (from, to);
    let _ =
        writeln!(out, r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" stroke="{color}" {attributes}/>"#);
}

fn bullet(out: &mut String, x: f64, y: f64, number: usize) {
    let _ = writeln!(out, r#"<circle cx="{x:.1}" cy="{y:.1}" r="9" fill="{INK}"/>"#);
    text(out, x, y + 4.0, &number.to_string(), r#"text-anchor="middle" font-size="11""#, "#FFFFFF");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(curves: usize) -> Picture {
        let curve = |number| Curve::new(format!("drive {number}, a long name"), vec![(0.0, 0.0), (1.0, 5.0)]);
        Picture {
            title: "Example <1> & \u{1}".to_owned(),
            axis: "time [s]".to_owned(),
            span: 0.0..1.0,
            panels: vec![Panel::curves("position [mm]", (0..curves).map(curve).collect())],
            events: vec![Event { at_s: 0.5, text: "stop".to_owned() }],
            ..Picture::default()
        }
    }

    #[test]
    fn pictures_are_one_document() {
        let text = svg(&[picture(1), picture(1)]);
        assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"));
        assert_eq!(text.matches("<svg").count(), 1);
        assert_eq!(text.matches("Example &lt;1> &amp; ?<").count(), 2);
        assert_eq!(text.matches("position [mm]").count(), 2);
    }

    #[test]
    fn a_long_legend_wraps_within_the_picture_and_no_two_curves_look_the_same() {
        let curves = match picture(12).panels.remove(0).content {
            Content::Curves(curves) => curves,
            Content::Lanes(_) => unreachable!(),
        };
        let (rows, keys) = keys("position [mm]", &curves);
        assert!(rows > 1 && keys.iter().all(|key| key.left >= LEFT && key.left < RIGHT - 100.0));
        assert!(keys.windows(2).all(|two| two[0].row < two[1].row || two[0].left + 100.0 < two[1].left));
        let mut looks: Vec<_> = curves.iter().enumerate().map(|(n, it)| (color(n, it), stroke(n, it))).collect();
        looks.sort();
        looks.dedup();
        assert_eq!(looks.len(), 12);
    }
}
