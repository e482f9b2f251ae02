//! Curves.

use std::fmt::Write as _;

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Chart, Dataset, GraphType};

use super::screen::{Action, Purpose, Screen, say};
use super::text::Text;
use crate::command::Command;
use crate::view::{Curve, View};

/// How often a plotted entry is read.
const PLOTTED_MS: u32 = 50;

const COLORS: [Color; 6] = [Color::Cyan, Color::Yellow, Color::Green, Color::Magenta, Color::Blue, Color::Red];

/// The curves, and how much of them is shown.
pub(super) struct State {
    curves: Vec<Curve>,
    span: f64,
    /// The time at the right edge; without it, the present.
    held: Option<f64>,
    /// Where values are read off.
    cursor: Option<f64>,
    /// From where the cursor is measured.
    mark: Option<f64>,
    trigger: Option<Trigger>,
}

/// What the first curve has to do for the picture to stand.
#[derive(Clone, Copy)]
struct Trigger {
    level: f64,
    rises: bool,
    /// What was before does not count.
    armed: f64,
}

impl Default for State {
    fn default() -> Self {
        State { curves: Vec::new(), span: 20.0, held: None, cursor: None, mark: None, trigger: None }
    }
}

impl State {
    /// The times at the edges.
    fn window(&self, now: f64) -> (f64, f64) {
        let end = self.held.unwrap_or(now);
        let from = (end - self.span).max(0.0);
        (from, end.max(from + 0.1))
    }

    pub(super) fn request(&self, now: f64) -> Command {
        Command::Curves { since: self.window(now).0 }
    }

    pub(super) fn take(&mut self, curves: Vec<Curve>) {
        self.curves = curves;
        let Some(trigger) = self.trigger else { return };
        let points = self.curves.first().map_or(&[][..], |curve| &curve.points);
        let crosses = |pair: &&[(f64, f64)]| {
            let [(_, before), (at, after)] = **pair else { return false };
            let (low, high) = if trigger.rises { (before, after) } else { (after, before) };
            at > trigger.armed && low < trigger.level && trigger.level <= high
        };
        if let Some([_, (at, _)]) = points.windows(2).find(crosses) {
            // With a quarter of what was before.
            self.held = Some(at + 0.75 * self.span);
            (self.cursor, self.trigger) = (Some(*at), None);
        }
    }

    fn move_cursor(&mut self, by: f64, now: f64) {
        let (from, end) = self.window(now);
        // The picture would run away under the cursor.
        self.held = Some(end);
        self.cursor = Some((self.cursor.unwrap_or((from + end) / 2.0) + by * self.span / 100.0).clamp(from, end));
    }

    /// `rising 100`, `falling -5`; nothing switches it off.
    fn arm(&mut self, typed: &str, now: f64) -> Result<(), String> {
        self.trigger = match typed.split_once(' ').map(|(edge, level)| (edge, level.trim().parse())) {
            _ if typed.trim().is_empty() => None,
            Some((edge @ ("rising" | "falling"), Ok(level))) => {
                self.held = None;
                Some(Trigger { level, rises: edge == "rising", armed: now })
            }
            _ => return Err(format!("{typed:?} is none of: rising 100, falling -5")),
        };
        Ok(())
    }
}

/// The value of a curve at a time: that of the last point until then.
fn value_at(curve: &Curve, time: f64) -> Option<f64> {
    let after = curve.points.partition_point(|(at, _)| *at <= time);
    curve.points.get(after.checked_sub(1)?).map(|(_, number)| *number)
}

pub(super) fn handle_key(screen: &mut Screen, code: KeyCode, view: &View) -> Option<Action> {
    let export = |format: &str| {
        Some(Action::Ask(Purpose::File(String::new()), Command::ExportPlot { format: format.to_owned() }))
    };
    match code {
        KeyCode::Char('a') => {
            let (node, name) = screen.node(view).map(|node| (node.id, node.name.clone()))?;
            screen.ask(Text::AskSignal, format!("{node} {name}"), move |signal| {
                let plot = Command::Plot { node, signals: vec![signal], every_ms: PLOTTED_MS };
                Ok(Action::Ask(Purpose::Say, plot))
            })
        }
        KeyCode::Char('c') => say(Command::ClearPlot { node: None }),
        KeyCode::Char('+') => {
            screen.plots.span = (screen.plots.span / 2.0).max(0.5);
            None
        }
        KeyCode::Char('-') => {
            screen.plots.span = (screen.plots.span * 2.0).min(3600.0);
            None
        }
        KeyCode::Char(',' | '.') => {
            screen.plots.move_cursor(if code == KeyCode::Char(',') { -1.0 } else { 1.0 }, view.time);
            None
        }
        KeyCode::Char('m') => {
            screen.plots.mark = screen.plots.cursor;
            None
        }
        KeyCode::Char('f') => {
            let span = screen.plots.span;
            let curves = std::mem::take(&mut screen.plots.curves);
            screen.plots = State { span, curves, ..State::default() };
            None
        }
        KeyCode::Char('t') => {
            let now = view.time;
            screen.change(Text::AskTrigger, move |screen, typed| screen.plots.arm(&typed, now))
        }
        KeyCode::Char('x') => export("csv"),
        KeyCode::Char('v') => export("svg"),
        _ => None,
    }
}

/// A chart for each unit.
pub(super) fn draw(screen: &Screen, frame: &mut Frame<'_>, area: Rect, view: &View) {
    let curves = &screen.plots.curves;
    let mut units: Vec<_> = curves.iter().map(|curve| curve.unit.as_deref()).collect();
    units.sort_unstable();
    units.dedup();
    if units.is_empty() {
        frame.render_widget(Line::from(screen.text(Text::NoCurve)).dim(), area);
        return;
    }
    let state = &screen.plots;
    let read_off = u16::from(state.cursor.is_some() || state.trigger.is_some());
    let [area, below] = Layout::vertical([Constraint::Fill(1), Constraint::Length(read_off)]).areas(area);
    frame.render_widget(Line::from(words(screen)).bold(), below);
    let areas = Layout::vertical(units.iter().map(|_| Constraint::Fill(1))).split(area);
    for (unit, area) in units.into_iter().zip(&*areas) {
        let of_unit: Vec<_> = curves.iter().filter(|curve| curve.unit.as_deref() == unit).collect();
        draw_unit(screen, frame, *area, view.time, unit, &of_unit);
    }
}

fn draw_unit(screen: &Screen, frame: &mut Frame<'_>, area: Rect, now: f64, unit: Option<&str>, curves: &[&Curve]) {
    let numbers = || curves.iter().flat_map(|curve| &curve.points).map(|(_, number)| *number);
    let (low, high) = (numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max));
    let (low, high) = if low < high {
        (low, high)
    } else if low.is_finite() {
        (low - 1.0, low + 1.0)
    } else {
        (0.0, 1.0)
    };
    let (from, end) = screen.plots.window(now);
    let lines = [(screen.plots.cursor, Color::White), (screen.plots.mark, Color::DarkGray)];
    let lines = lines.map(|(at, color)| (at.map(|at| [(at, low), (at, high)]), color));
    let cursors = lines.iter().filter_map(|(points, color)| {
        let line = Dataset::default().marker(Marker::Dot).graph_type(GraphType::Line).style(Style::new().fg(*color));
        Some(line.data(points.as_ref()?))
    });
    let datasets = curves.iter().zip(COLORS.iter().cycle()).map(|(curve, color)| {
        let last = curve.points.last().map_or_else(String::new, |(_, number)| format!(" = {number}"));
        Dataset::default()
            .name(format!("{} {}{last}", curve.node, curve.name))
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(*color))
            .data(&curve.points)
    });
    let x = Axis::default()
        .bounds([from, end])
        .labels([Line::from(format!("{from:.1} s")), Line::from(format!("{end:.1} s"))]);
    let y = Axis::default()
        .title(unit.unwrap_or_default().to_owned())
        .bounds([low, high])
        .labels([Line::from(format!("{low:.2}")), Line::from(format!("{high:.2}"))]);
    frame.render_widget(Chart::new(datasets.chain(cursors).collect()).x_axis(x).y_axis(y), area);
}

/// What the cursor reads off, or what is waited for.
fn words(screen: &Screen) -> String {
    let state = &screen.plots;
    if let Some(Trigger { level, rises, .. }) = state.trigger {
        let edge = if rises { "rising" } else { "falling" };
        return format!(" {} {edge} {level}", screen.text(Text::Waits));
    }
    let Some(cursor) = state.cursor else { return String::new() };
    let mut words = format!(" {cursor:.3} s");
    if let Some(mark) = state.mark {
        let _ = write!(words, " (Δ {:.3} s)", cursor - mark);
    }
    for curve in &state.curves {
        let Some(value) = value_at(curve, cursor) else { continue };
        let unit = curve.unit.as_deref().unwrap_or_default();
        let _ = write!(words, "   {} {} = {value} {unit}", curve.node, curve.name);
        if let Some(before) = state.mark.and_then(|mark| value_at(curve, mark)) {
            let _ = write!(words, " (Δ {})", value - before);
        }
    }
    words
}
