//! The picture of a run: position and velocity over time, with the commands that caused them.

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// The motion in one example.
pub(crate) struct Course {
    /// What stands above it.
    pub(crate) title: String,
    /// The motion, ascending in time; at least two samples.
    pub(crate) samples: Vec<Sample>,
    /// The orders to the drive, ascending in time.
    pub(crate) commands: Vec<Command>,
    /// What it should reach since when (in seconds), ascending in time.
    pub(crate) targets: Vec<(f64, Target)>,
}

/// The motion at one moment.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) at_s: f64,
    pub(crate) position_increments: f64,
    pub(crate) velocity_rpm: f64,
}

/// What the drive should reach.
#[derive(Clone, Copy)]
pub(crate) enum Target {
    /// In increments.
    Position(i32),
    /// In rev/min.
    Velocity(i32),
}

/// An order to the drive.
pub(crate) struct Command {
    pub(crate) at_s: f64,
    pub(crate) label: String,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Error = DrawingAreaErrorKind<std::io::Error>;

/// The backend draws at whole pixels; drawing larger and showing smaller keeps the curves smooth.
const SCALE: i32 = 4;

// The layout, in shown pixels. The examples stand below each other.
const WIDTH: i32 = 1200;
const MARGIN: i32 = 24;
const HEADER: i32 = 92;
const LEGEND_Y: i32 = 64;
/// The height of one example; below are heights within it.
const COURSE: i32 = 690;
const LABELS_Y: i32 = 36;
const POSITION_Y: i32 = 160;
const VELOCITY_Y: i32 = 424;
const END_Y: i32 = COURSE - 30;
/// Where the numbers of the axes stand.
const LEFT_AXIS: i32 = 76;
const BOTTOM_AXIS: i32 = 28;
const TIME_AXIS: i32 = 50;

const INK: RGBColor = RGBColor(0x22, 0x2A, 0x33);
const FAINT: RGBColor = RGBColor(0xE3, 0xE7, 0xEB);
const PAPER: RGBColor = RGBColor(0xF0, 0xF3, 0xF6);
const MARK: RGBColor = RGBColor(0x8A, 0x94, 0x9E);
const POSITION: RGBColor = RGBColor(0x00, 0x72, 0xB2);
const VELOCITY: RGBColor = RGBColor(0x00, 0x8F, 0x68);
const TARGET: RGBColor = RGBColor(0xD5, 0x5E, 0x00);

/// The picture as an SVG document.
pub(crate) fn svg(title: &str, courses: &[Course]) -> Result<String, Error> {
    let height = HEADER + courses.len() as i32 * COURSE;
    let mut text = String::new();
    {
        let size = ((WIDTH * SCALE) as u32, (height * SCALE) as u32);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE)?;
        root.draw(&Text::new(title.to_owned(), at(MARGIN, 20), font(21.0).style(FontStyle::Bold).color(&INK)))?;
        draw_legend(&root)?;
        for (row, course) in courses.iter().enumerate() {
            let top = HEADER + row as i32 * COURSE;
            draw_course(&root.clone().shrink(at(0, top), at(WIDTH, COURSE)), course)?;
        }
        root.present()?;
    }
    let drawn = format!("width=\"{}\" height=\"{}\" viewBox", WIDTH * SCALE, height * SCALE);
    Ok(text.replacen(&drawn, &format!("width=\"{WIDTH}\" height=\"{height}\" viewBox"), 1))
}

fn draw_legend(root: &Area<'_>) -> Result<(), Error> {
    let mut x = MARGIN;
    for (name, color, width, dashed) in [
        ("position", POSITION, 2, false),
        ("velocity", VELOCITY, 2, false),
        ("target", TARGET, 2, true),
        ("command sent", MARK, 1, true),
    ] {
        draw_line(root, [at(x, LEGEND_Y), at(x + 34, LEGEND_Y)], color, width, dashed)?;
        let style = font(14.0).color(&INK).pos(Pos::new(HPos::Left, VPos::Center));
        root.draw(&Text::new(name, at(x + 42, LEGEND_Y), style))?;
        x += 42 + 9 * name.len() as i32 + 30;
    }
    let swatch = [at(x, LEGEND_Y - 7), at(x + 34, LEGEND_Y + 7)];
    root.draw(&Rectangle::new(swatch, band_color().filled()))?;
    let style = font(14.0).color(&INK).pos(Pos::new(HPos::Left, VPos::Center));
    root.draw(&Text::new("several, one after the other", at(x + 42, LEGEND_Y), style))?;
    Ok(())
}

/// From the first to the last of the commands that one label says; the curves show through it.
fn band_color() -> RGBAColor {
    MARK.mix(0.25)
}

fn draw_course(area: &Area<'_>, course: &Course) -> Result<(), Error> {
    let style = font(17.0).style(FontStyle::Bold).color(&INK).pos(Pos::new(HPos::Left, VPos::Center));
    area.draw(&Text::new(course.title.clone(), at(MARGIN, 12), style))?;

    let samples = &course.samples;
    let position = Panel {
        value: "position [increments]",
        time: None,
        color: POSITION,
        actual: samples.iter().map(|sample| (sample.at_s, sample.position_increments)).collect(),
        target: steps(course, |target| match target {
            Target::Position(increments) => Some(increments),
            Target::Velocity(_) => None,
        }),
    };
    let velocity = Panel {
        value: "velocity [rev/min]",
        time: Some("time on the bus [s]"),
        color: VELOCITY,
        actual: samples.iter().map(|sample| (sample.at_s, sample.velocity_rpm)).collect(),
        target: steps(course, |target| match target {
            Target::Position(_) => None,
            Target::Velocity(rpm) => Some(rpm),
        }),
    };
    let span = time_span(course);
    let part = |top, bottom| area.clone().shrink(at(MARGIN, top), at(WIDTH - 2 * MARGIN, bottom - top));
    position.draw(&part(POSITION_Y, VELOCITY_Y), span)?;
    let time_axis = velocity.draw(&part(VELOCITY_Y, END_Y), span)?;
    draw_commands(area, course, time_axis)
}

/// The time of the first and of the last sample, with some air.
fn time_span(course: &Course) -> (f64, f64) {
    let first = course.samples.first().map_or(0.0, |sample| sample.at_s);
    let last = course.samples.last().map_or(1.0, |sample| sample.at_s).max(first + 1e-3);
    let air = (last - first) * 0.02;
    (first - air, last + air)
}

/// A target holds until the next one, and the last one to the end.
fn steps(course: &Course, value: impl Fn(Target) -> Option<i32>) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for &(at_s, target) in &course.targets {
        let Some(value) = value(target) else { continue };
        points.extend(points.last().map(|&(_, before)| (at_s, before)));
        points.push((at_s, value.into()));
    }
    let end_s = course.samples.last().map_or(0.0, |sample| sample.at_s);
    points.extend(points.last().map(|&(_, last)| (end_s, last)));
    points
}

/// How time becomes pixels. Diagrams that stand below each other have the same.
#[derive(Clone, Copy)]
struct TimeAxis {
    /// Where the diagram begins, in drawn pixels.
    left: i32,
    from_s: f64,
    per_second: f64,
}

impl TimeAxis {
    /// In shown pixels of the example.
    fn pixel(self, at_s: f64) -> i32 {
        MARGIN + (self.left + ((at_s - self.from_s) * self.per_second).round() as i32) / SCALE
    }
}

/// One diagram: a curve, and the one it should follow.
struct Panel {
    value: &'static str,
    time: Option<&'static str>,
    color: RGBColor,
    actual: Vec<(f64, f64)>,
    target: Vec<(f64, f64)>,
}

impl Panel {
    /// Draws the diagram.
    fn draw(&self, area: &Area<'_>, (from, to): (f64, f64)) -> Result<TimeAxis, Error> {
        let (low, high) = self.value_span();
        let bottom_axis = if self.time.is_some() { TIME_AXIS } else { BOTTOM_AXIS };
        let mut chart = ChartBuilder::on(area)
            .set_label_area_size(LabelAreaPosition::Left, LEFT_AXIS * SCALE)
            .set_label_area_size(LabelAreaPosition::Bottom, bottom_axis * SCALE)
            .build_cartesian_2d(from..to, low..high)?;
        self.draw_mesh(&mut chart, to - from)?;

        let root = area.strip_coord_spec();
        let base = root.get_base_pixel();
        let pixel = |point: &(f64, f64)| {
            let (x, y) = chart.backend_coord(point);
            (x - base.0, y - base.1)
        };
        draw_line(&root, thin(self.actual.iter().map(pixel)), self.color, 2, false)?;
        draw_line(&root, thin(self.target.iter().map(pixel)), TARGET, 2, true)?;
        let (left, right) = (pixel(&(from, low)).0, pixel(&(to, low)).0);
        Ok(TimeAxis { left, from_s: from, per_second: f64::from(right - left) / (to - from) })
    }

    fn draw_mesh(&self, chart: &mut Chart<'_, '_>, span_s: f64) -> Result<(), Error> {
        let decimals = usize::from(span_s < 12.0);
        let seconds = |seconds: &f64| format!("{seconds:.decimals$}");
        let mut mesh = chart.configure_mesh();
        mesh.light_line_style(TRANSPARENT)
            .bold_line_style(FAINT.stroke_width(SCALE as u32))
            .axis_style(MARK.stroke_width(SCALE as u32))
            .label_style(font(13.0).color(&INK))
            .axis_desc_style(font(14.0).color(&INK))
            .x_labels(15)
            .y_labels(12)
            .x_label_formatter(&seconds)
            .y_label_formatter(&|value| signed(*value))
            .y_desc(self.value)
            .x_desc(self.time.unwrap_or_default());
        mesh.draw()
    }

    fn value_span(&self) -> (f64, f64) {
        let values = || self.actual.iter().chain(&self.target).map(|point| point.1);
        let low = values().fold(0.0, f64::min);
        let high = values().fold(0.0, f64::max);
        let air = ((high - low) * 0.08).max(1.0);
        (low - air, high + air)
    }
}

/// `+5000`, `0`, `-72`.
fn signed(value: f64) -> String {
    if value.abs() < 0.5 { "0".to_owned() } else { format!("{value:+.0}") }
}

/// Draws the commands as lines through both diagrams, and what they say above them.
fn draw_commands(area: &Area<'_>, course: &Course, time_axis: TimeAxis) -> Result<(), Error> {
    for label in labels(&course.commands, |command| time_axis.pixel(command.at_s), MARGIN, WIDTH - MARGIN) {
        let bottom = LABELS_Y + LINE_HEIGHT * label.texts.len() as i32 + 8;
        let corners = [at(label.left, LABELS_Y), at(label.left + label.width, bottom)];
        area.draw(&Rectangle::new(corners, PAPER.filled()))?;
        for (row, text) in label.texts.iter().enumerate() {
            let place = at(label.left + 7, LABELS_Y + 6 + LINE_HEIGHT * row as i32);
            area.draw(&Text::new((*text).to_owned(), place, font(LABEL_FONT).color(&INK)))?;
        }
        let foot = label.left + label.width / 2;
        draw_line(area, [at(foot, bottom), at(foot, POSITION_Y - 14), at(label.x, POSITION_Y)], MARK, 1, false)?;
        for (top, bottom) in [(POSITION_Y, VELOCITY_Y - BOTTOM_AXIS), (VELOCITY_Y, END_Y - TIME_AXIS)] {
            let band = [at(label.x, top), at(label.end.max(label.x + 1), bottom)];
            area.draw(&Rectangle::new(band, band_color().filled()))?;
            draw_line(area, [at(label.x, top), at(label.x, bottom)], MARK, 1, true)?;
        }
    }
    Ok(())
}

const LINE_HEIGHT: i32 = 16;
const LABEL_FONT: f64 = 12.0;
/// A guess on the safe side: the font that shows the picture is not known here.
const LETTER_WIDTH: f64 = 0.58 * LABEL_FONT;

/// Commands so close together that one label says them all; all in shown pixels.
struct Label<'a> {
    /// Where the first command is.
    x: i32,
    /// Where the last one is.
    end: i32,
    left: i32,
    width: i32,
    texts: Vec<&'a str>,
}

/// The labels of all commands between two edges. Where there is not room enough, more commands share one.
fn labels<'a>(commands: &'a [Command], pixel: impl Fn(&Command) -> i32, left: i32, right: i32) -> Vec<Label<'a>> {
    let mut distance = 8;
    loop {
        let labels = group(commands, &pixel, distance);
        let needed: i32 = labels.iter().map(|label| label.width + GAP).sum();
        if needed <= right - left + GAP || labels.len() <= 1 {
            return place(labels, left, right);
        }
        distance += 8;
    }
}

const GAP: i32 = 8;

fn group<'a>(commands: &'a [Command], pixel: impl Fn(&Command) -> i32, distance: i32) -> Vec<Label<'a>> {
    let mut labels: Vec<Label<'a>> = Vec::new();
    for command in commands {
        let x = pixel(command);
        match labels.last_mut().filter(|label| x - label.end < distance) {
            Some(label) => {
                label.texts.push(&command.label);
                label.end = x;
            }
            None => labels.push(Label { x, end: x, left: 0, width: 0, texts: vec![&command.label] }),
        }
    }
    for label in &mut labels {
        let longest = label.texts.iter().map(|text| text.chars().count()).max().unwrap_or(0);
        label.width = 14 + (longest as f64 * LETTER_WIDTH) as i32;
        label.left = label.x - label.width / 2;
    }
    labels
}

/// Moves labels sideways until none covers another: to the right first, then back from the edge.
fn place(mut labels: Vec<Label<'_>>, left: i32, right: i32) -> Vec<Label<'_>> {
    let mut free = left;
    for label in &mut labels {
        label.left = label.left.max(free);
        free = label.left + label.width + GAP;
    }
    let mut free = right;
    for label in labels.iter_mut().rev() {
        label.left = label.left.min(free - label.width);
        free = label.left - GAP;
    }
    labels
}

/// Drops points between which the line is the same: a rest of a minute is two points.
fn thin(points: impl Iterator<Item = (i32, i32)>) -> Vec<(i32, i32)> {
    let mut kept: Vec<(i32, i32)> = Vec::new();
    for point in points {
        if let [.., (_, before), (x, last)] = kept.as_mut_slice()
            && *before == *last
            && *last == point.1
        {
            *x = point.0;
        } else {
            kept.push(point);
        }
    }
    kept
}

fn draw_line(
    area: &Area<'_>,
    points: impl IntoIterator<Item = (i32, i32)>,
    color: RGBColor,
    width: i32,
    dashed: bool,
) -> Result<(), Error> {
    let style = color.stroke_width((width * SCALE) as u32);
    let points: Vec<_> = points.into_iter().collect();
    if dashed {
        area.draw(&DashedPathElement::new(points, 7 * SCALE, 5 * SCALE, style))
    } else {
        area.draw(&PathElement::new(points, style))
    }
}

/// A place in shown pixels.
fn at(x: i32, y: i32) -> (i32, i32) {
    (x * SCALE, y * SCALE)
}

/// A font of `size` shown pixels. The backend shows a font at 1/1.24 of its size.
fn font(size: f64) -> FontDesc<'static> {
    let family = FontFamily::Name("Inter, 'Segoe UI', 'DejaVu Sans', Verdana, sans-serif");
    FontDesc::new(family, size * 1.24 * f64::from(SCALE), FontStyle::Normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(at_s: f64, label: &str) -> Command {
        Command { at_s, label: label.to_owned() }
    }

    /// Up to `top` in ten seconds, and rest there for ten more.
    fn course() -> Course {
        let sample = |at_s: f64| Sample {
            at_s,
            position_increments: 500.0 * at_s.min(10.0),
            velocity_rpm: if at_s < 10.0 { 30.0 } else { 0.0 },
        };
        let commands = vec![
            command(0.0, "NMT: enter OPERATIONAL"),
            command(0.01, "RPDO1: shutdown"),
            command(0.02, "RPDO1: switch on"),
            command(0.5, "RPDO3: travel to position +5000"),
            command(10.0, "RPDO1: clear new setpoint"),
            command(10.5, "RPDO3: travel to position -5000"),
            command(20.0, "NMT: enter PRE-OPERATIONAL"),
        ];
        Course {
            title: "Example <1>".to_owned(),
            samples: (0..2000).map(|n| sample(f64::from(n) / 100.0)).collect(),
            commands,
            targets: vec![(0.5, Target::Position(5000)), (10.5, Target::Position(-5000))],
        }
    }

    #[test]
    fn a_target_holds_until_the_next_one() {
        let points = steps(&course(), |target| match target {
            Target::Position(increments) => Some(increments),
            Target::Velocity(_) => None,
        });
        assert_eq!(points, [(0.5, 5000.0), (10.5, 5000.0), (10.5, -5000.0), (19.99, -5000.0)]);
        assert!(steps(&course(), |_| None).is_empty());
    }

    #[test]
    fn the_picture_is_one_document_with_both_examples() {
        let text = svg("Title", &[course(), course()]).unwrap();
        assert!(text.starts_with("<svg width=\"1200\""), "{}", &text[..100]);
        assert_eq!(text.matches("<svg").count(), 1);
        assert!(text.trim_end().ends_with("</svg>"));
        assert_eq!(text.matches("Example &lt;1&gt;").count(), 2);
        assert_eq!(text.matches("velocity [rev/min]").count(), 2);
    }

    #[test]
    fn labels_do_not_cover_each_other_nor_leave_the_picture() {
        let commands = course().commands;
        let labels = labels(&commands, |command| 100 + (command.at_s * 45.0) as i32, 20, 1100);
        assert_eq!(labels.iter().map(|label| label.texts.len()).collect::<Vec<_>>(), [3, 1, 1, 1, 1]);
        for pair in labels.windows(2) {
            assert!(pair[0].left + pair[0].width < pair[1].left);
        }
        assert!(labels[0].left >= 20);
        assert!(labels.last().map(|label| label.left + label.width) <= Some(1100));
    }

    #[test]
    fn commands_share_labels_where_room_is_short() {
        let commands: Vec<_> = (0..40).map(|n| command(f64::from(n), "RPDO1: shutdown")).collect();
        let labels = labels(&commands, |command| (command.at_s * 25.0) as i32, 0, 1000);
        assert!(labels.last().map(|label| label.left + label.width) <= Some(1000));
        assert_eq!(labels.iter().map(|label| label.texts.len()).sum::<usize>(), 40);
    }

    #[test]
    fn a_rest_is_two_points() {
        let points = [(0, 5), (1, 5), (2, 5), (3, 6), (4, 6), (5, 6), (6, 7)];
        assert_eq!(thin(points.into_iter()), [(0, 5), (2, 5), (3, 6), (5, 6), (6, 7)]);
    }
}
