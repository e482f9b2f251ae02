//! The tab with curves, with two cursors and a trigger.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::Row;
use ratatui::widgets::canvas::{Canvas, Context, Line as Stroke};

use super::action::{Action, Purpose, say};
use super::list::{Columns, Listed, ago};
use super::prompt::Field;
use super::text::Text;
use super::ui::Ui;
use crate::number;
use crate::request::Request;
use crate::view::{Curve, View};

/// The interval of reading a plotted entry.
const PLOTTED_MS: u32 = 50;

/// The share of the window before the trigger.
const BEFORE_TRIGGER: f64 = 0.2;

const COLORS: [Color; 6] = [Color::Cyan, Color::Yellow, Color::Green, Color::Magenta, Color::Blue, Color::Red];

/// The curves, and the window of time shown.
pub(super) struct State {
    curves: Vec<Curve>,
    span: f64,
    /// The beginning of the window; `None` to follow the newest points.
    held: Option<f64>,
    /// Whether all points of a held window have been received.
    is_complete: bool,
    /// The times of the cursors.
    cursors: [Option<f64>; 2],
    active: usize,
    trigger: Option<Trigger>,
}

/// A trigger, which holds the window when a curve crosses a level.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Trigger {
    /// The position of the curve.
    curve: usize,
    level: f64,
    is_rising: bool,
    /// The time since when it is armed.
    armed: f64,
}

impl Default for State {
    fn default() -> Self {
        State {
            curves: Vec::new(),
            span: 20.0,
            held: None,
            is_complete: false,
            cursors: [None; 2],
            active: 0,
            trigger: None,
        }
    }
}

impl State {
    pub(super) fn count(&self) -> usize {
        self.curves.len()
    }

    /// The beginning and end of the window.
    fn window(&self, now: f64) -> (f64, f64) {
        let from = self.held.unwrap_or(now - self.span).max(0.0);
        let to = self.held.map_or(now, |from| from + self.span);
        (from, to.max(from + 0.1))
    }

    /// The request for the points of the window, unless they have been received.
    pub(super) fn request(&self, now: f64) -> Option<Request> {
        let (since, _) = self.window(now);
        (self.held.is_none() || !self.is_complete).then_some(Request::Curves { since })
    }

    pub(super) fn take(&mut self, curves: Vec<Curve>) {
        self.curves = curves;
        let newest = self.newest();
        self.is_complete = self.held.is_some_and(|from| newest >= from + self.span);
        let Some(trigger) = self.trigger else { return };
        let at = self.curves.get(trigger.curve).and_then(|curve| trigger.crossing(&curve.points));
        // Wait for the rest of the window after the trigger.
        let Some(at) = at.filter(|at| newest >= at + self.span * (1.0 - BEFORE_TRIGGER)) else { return };
        self.held = Some((at - self.span * BEFORE_TRIGGER).max(0.0));
        (self.cursors, self.active, self.trigger) = ([Some(at), None], 0, None);
    }

    fn newest(&self) -> f64 {
        let last = self.curves.iter().filter_map(|curve| curve.points.last());
        last.map(|(at, _)| *at).fold(0.0, f64::max)
    }

    /// Arms the trigger with a level: `> 100`, `< 100`; disarms it with an empty text.
    pub(super) fn arm(&mut self, curve: usize, words: &str, now: f64) -> Result<(), String> {
        let words = words.trim();
        if words.is_empty() {
            self.trigger = None;
            return Ok(());
        }
        let is_rising = !words.starts_with('<');
        let level = words.trim_start_matches(['<', '>']).trim();
        let level = number::parse(level).map_err(|refused| super::notices::words(&refused))?;
        self.trigger = Some(Trigger { curve, level, is_rising, armed: now });
        self.follow();
        Ok(())
    }

    /// Follows the newest points.
    pub(super) fn follow(&mut self) {
        (self.held, self.is_complete) = (None, false);
    }

    /// Changes the length of the window.
    fn show(&mut self, span: f64) {
        (self.span, self.is_complete) = (span, false);
    }

    /// Selects a cursor for moving; a new one starts in the middle.
    fn choose_cursor(&mut self, cursor: usize, now: f64) {
        self.active = cursor;
        let (from, to) = self.window(now);
        self.cursors[cursor].get_or_insert((from + to) / 2.0);
    }

    fn move_cursor(&mut self, by: f64, now: f64) {
        let (from, to) = self.window(now);
        if let Some(at) = &mut self.cursors[self.active] {
            *at = (*at + by * (to - from)).clamp(from, to);
        }
    }
}

impl Trigger {
    /// The first time at which the curve crosses the level after the trigger was armed.
    fn crossing(&self, points: &[(f64, f64)]) -> Option<f64> {
        let after = points.partition_point(|(at, _)| *at <= self.armed).saturating_sub(1);
        points[after..].windows(2).find_map(|pair| {
            let [(earlier, from), (later, to)] = [pair[0], pair[1]];
            let crosses = if self.is_rising {
                from < self.level && to >= self.level
            } else {
                from > self.level && to <= self.level
            };
            let at = earlier + (later - earlier) * (self.level - from) / (to - from);
            (crosses && at >= self.armed).then_some(at)
        })
    }

    const fn sign(&self) -> char {
        if self.is_rising { '>' } else { '<' }
    }
}

/// The number at a time: that of the last point before it.
fn number_at(points: &[(f64, f64)], time: f64) -> Option<f64> {
    let after = points.partition_point(|(at, _)| *at <= time);
    Some(points[after.checked_sub(1)?].1)
}

pub(super) fn handle_key(ui: &mut Ui, state: &mut State, code: KeyCode, view: &View) -> Option<Action> {
    let export = |format: &str| {
        Some(Action::Ask(Purpose::File(String::new()), Request::ExportPlot { format: format.to_owned() }))
    };
    match code {
        KeyCode::Char('a') => {
            let (node, name) = ui.node(view).map(|node| (node.id, node.name.clone()))?;
            return ui.ask(Text::AskSignal, format!("{node} {name}"), move |signal| {
                let plot = Request::Plot { node, signals: vec![signal], every_ms: PLOTTED_MS };
                Ok(Action::Ask(Purpose::Say, plot))
            });
        }
        KeyCode::Char('c') => {
            *state = State { span: state.span, ..State::default() };
            return say(Request::ClearPlot { node: None });
        }
        KeyCode::Char('+') => state.show((state.span / 2.0).max(0.5)),
        KeyCode::Char('-') => state.show((state.span * 2.0).min(3600.0)),
        KeyCode::Char('f') if state.held.is_some() => state.follow(),
        KeyCode::Char('f') => state.held = Some(state.window(view.time).0),
        KeyCode::Char('i') => state.choose_cursor(0, view.time),
        KeyCode::Char('j') => state.choose_cursor(1, view.time),
        KeyCode::Char(',') => state.move_cursor(-0.01, view.time),
        KeyCode::Char('.') => state.move_cursor(0.01, view.time),
        KeyCode::Char('<') => state.move_cursor(-0.1, view.time),
        KeyCode::Char('>') => state.move_cursor(0.1, view.time),
        KeyCode::Char('0') => state.cursors = [None; 2],
        KeyCode::Char('t') if ui.row() < state.curves.len() => return ui.ask_for(Field::Trigger),
        KeyCode::Char('x') => return export("csv"),
        KeyCode::Char('v') => return export("svg"),
        _ => {}
    }
    None
}

/// Draws the list of curves, and a diagram for each unit.
pub(super) fn draw(ui: &Ui, state: &State, frame: &mut Frame<'_>, area: Rect, view: &View) -> Vec<Listed> {
    let curves = &state.curves;
    if curves.is_empty() {
        frame.render_widget(Line::from(ui.text(Text::NoCurve)).dim(), area);
        return Vec::new();
    }
    let [list, state_line, pictures] =
        Layout::vertical([Constraint::Length(curves.len().min(6) as u16), Constraint::Length(1), Constraint::Min(4)])
            .areas(area);
    let listed = draw_names(ui, state, frame, list, view.time);
    frame.render_widget(Line::from(how(ui, state)), state_line);
    let mut units: Vec<_> = curves.iter().map(|curve| curve.unit.as_deref()).collect();
    units.sort_unstable();
    units.dedup();
    let areas = Layout::vertical(units.iter().map(|_| Constraint::Fill(1))).split(pictures);
    for (unit, area) in units.into_iter().zip(&*areas) {
        draw_unit(state, frame, *area, view.time, unit);
    }
    vec![listed]
}

/// Draws the curves' names with their last numbers and those at the cursors.
fn draw_names(ui: &Ui, state: &State, frame: &mut Frame<'_>, area: Rect, now: f64) -> Listed {
    let columns = Columns {
        head: [""; 5],
        widths: [
            Constraint::Length(1),
            Constraint::Fill(3),
            Constraint::Fill(1),
            Constraint::Fill(1),
            Constraint::Fill(1),
        ],
    };
    columns.draw(frame, area, Some(ui.row()), state.curves.iter().zip(0..), |(curve, place)| {
        let ago = ago(curve.seen, now);
        let last = curve.points.last().map_or_else(String::new, |(_, number)| format!(" = {number}{ago}"));
        let [one, two] = state.cursors.map(|cursor| number_at(&curve.points, cursor?));
        let cell = |name: &str, number: Option<f64>| number.map_or_else(String::new, |it| format!("{name} {it}"));
        Row::new([
            letter(place).to_string(),
            format!("{} {}{last}", curve.node, curve.name),
            cell("1:", one),
            cell("2:", two),
            cell("2-1:", one.zip(two).map(|(one, two)| two - one)),
        ])
        .fg(color(place))
    })
}

/// The positions of the cursors and the state of the trigger, as text.
fn how(ui: &Ui, state: &State) -> String {
    let mut words = vec![ui.text(if state.held.is_some() { Text::Stands } else { Text::Follows }).to_owned()];
    let moved = |cursor| if state.active == cursor { "*" } else { "" };
    for (cursor, at) in state.cursors.iter().enumerate() {
        words.extend(at.map(|at| format!("{}{}: {at:.3} s", cursor + 1, moved(cursor))));
    }
    if let [Some(one), Some(two)] = state.cursors {
        words.push(format!("2-1: {:.3} s", two - one));
    }
    if let Some(trigger) = &state.trigger {
        let (sign, level, name) = (trigger.sign(), trigger.level, letter(trigger.curve));
        words.push(format!("{}: {name} {sign} {level}", ui.text(Text::Waits)));
    }
    format!(" {}", words.join("  "))
}

fn draw_unit(state: &State, frame: &mut Frame<'_>, area: Rect, now: f64, unit: Option<&str>) {
    let (from, to) = state.window(now);
    // Include the nearest points outside, towards which lines leave the window.
    let in_sight = |curve: &'_ Curve| {
        let first = curve.points.partition_point(|(at, _)| *at < from).saturating_sub(1);
        first..(curve.points.partition_point(|(at, _)| *at <= to) + 1).min(curve.points.len())
    };
    let shown: Vec<_> = state.curves.iter().enumerate().filter(|(_, curve)| curve.unit.as_deref() == unit).collect();
    let numbers = || shown.iter().flat_map(|(_, curve)| &curve.points[in_sight(curve)]).map(|(_, number)| *number);
    let (low, high) = (numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max));
    let (low, high) = if low < high {
        (low, high)
    } else if low.is_finite() {
        (low - 1.0, low + 1.0)
    } else {
        (0.0, 1.0)
    };
    let [above, times] = Layout::vertical([Constraint::Min(2), Constraint::Length(1)]).areas(area);
    let [labels, picture] = Layout::horizontal([Constraint::Length(11), Constraint::Min(10)]).areas(above);
    let unit = unit.unwrap_or_default();
    let at = |y: u16| Rect { y: labels.y + y.min(labels.height.saturating_sub(1)), height: 1, ..labels };
    frame.render_widget(Line::from(format!("{high:>10.2}")), at(0));
    frame.render_widget(Line::from(format!("{unit:>10}")), at(labels.height / 2));
    frame.render_widget(Line::from(format!("{low:>10.2}")), at(labels.height));
    let of_picture = Rect { x: picture.x, width: picture.width, ..times };
    frame.render_widget(Line::from(format!("{from:.1} s")), of_picture);
    frame.render_widget(Line::from(format!("{to:.1} s")).right_aligned(), of_picture);
    let paint = |context: &mut Context<'_>| {
        for (place, curve) in &shown {
            let color = color(*place);
            for pair in curve.points[in_sight(curve)].windows(2) {
                let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
                context.draw(&Stroke { x1, y1, x2, y2, color });
            }
        }
        for x in state.cursors.into_iter().flatten() {
            context.draw(&Stroke { x1: x, y1: low, x2: x, y2: high, color: Color::Gray });
        }
        let trigger = state.trigger.filter(|trigger| shown.iter().any(|(place, _)| *place == trigger.curve));
        if let Some(Trigger { level, .. }) = trigger {
            context.draw(&Stroke { x1: from, y1: level, x2: to, y2: level, color: Color::Gray });
        }
        for (place, curve) in &shown {
            let last = curve.points[in_sight(curve)].iter().rfind(|(at, _)| (from..=to).contains(at));
            if let Some((x, y)) = last {
                context.print(*x, *y, Span::styled(letter(*place).to_string(), Style::new().fg(color(*place)).bold()));
            }
        }
        for (cursor, x) in state.cursors.into_iter().enumerate() {
            if let Some(x) = x.filter(|x| (from..=to).contains(x)) {
                context.print(x, high, (cursor + 1).to_string());
            }
        }
        if let Some(trigger) = trigger {
            context.print(from, trigger.level, trigger.sign().to_string());
        }
    };
    let canvas = Canvas::default().marker(Marker::Braille).x_bounds([from, to]).y_bounds([low, high]).paint(paint);
    frame.render_widget(canvas, picture);
}

fn color(place: usize) -> Color {
    COLORS[place % COLORS.len()]
}

/// The letter of a curve, since not every terminal has colours.
fn letter(place: usize) -> char {
    (b'a' + (place % 26) as u8) as char
}
