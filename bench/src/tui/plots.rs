//! Curves.

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
    pub(super) curves: Vec<Curve>,
    span: f64,
}

impl Default for State {
    fn default() -> Self {
        State { curves: Vec::new(), span: 20.0 }
    }
}

impl State {
    /// How many seconds are shown.
    pub(super) fn span(&self) -> f64 {
        self.span
    }
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
    let from = (now - screen.plots.span).max(0.0);
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
        .bounds([from, now.max(from + 0.1)])
        .labels([Line::from(format!("{from:.1} s")), Line::from(format!("{now:.1} s"))]);
    let y = Axis::default()
        .title(unit.unwrap_or_default().to_owned())
        .bounds([low, high])
        .labels([Line::from(format!("{low:.2}")), Line::from(format!("{high:.2}"))]);
    frame.render_widget(Chart::new(datasets.collect()).x_axis(x).y_axis(y), area);
}
