//! The frames of the bus, in words.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Row, Table};

use super::screen::{Action, Purpose, Screen};
use super::text::Text;
use crate::command::{Command, TraceFilter};
use crate::view::{Frames, View};

/// How many rows are asked for: as many as the largest terminal has.
const PAGE: u32 = 200;

/// How many rows a page key scrolls.
const SCROLL: usize = 20;

/// From which width on there is room for the bytes of a frame.
const WIDE: u16 = 110;

/// Where the trace stands, and which frames are shown.
#[derive(Default)]
pub(super) struct State {
    filter: TraceFilter,
    /// The number of the first row that is shown; the newest rows without it.
    held: Option<u64>,
    /// The row that somebody has come for.
    marked: Option<u64>,
    frames: Frames,
}

impl State {
    pub(super) fn request(&self) -> Command {
        // With as many rows before the first that is shown as after it: there is something to scroll to.
        let from = if self.held.is_some() { -i64::from(PAGE / 2) } else { -i64::from(PAGE) };
        Command::Trace { filter: self.filter.clone(), from, at: self.held, count: PAGE }
    }

    pub(super) fn take(&mut self, frames: Frames) {
        self.frames = frames;
    }

    /// Stands at a row, with some of those before it.
    pub(super) fn hold_at(&mut self, number: u64) {
        self.filter = TraceFilter::default();
        (self.held, self.marked) = (Some(number.saturating_sub(5)), Some(number));
    }

    /// Stands where it is.
    fn hold(&mut self) {
        let rows = &self.frames.rows;
        let first = rows.get(rows.len().saturating_sub(SCROLL)).map_or(0, |row| row.number);
        self.held.get_or_insert(first);
    }

    /// Goes so many of the loaded rows on; the next answer has those around it.
    fn scroll(&mut self, by: isize) {
        self.hold();
        let first = self.first().saturating_add_signed(by).min(self.frames.rows.len().saturating_sub(1));
        self.held = self.frames.rows.get(first).map(|row| row.number).or(self.held);
    }

    /// The place of the first row that is shown, when it is held.
    fn first(&self) -> usize {
        self.frames.rows.partition_point(|row| Some(row.number) < self.held)
    }

    /// The rows that fit into so many lines.
    fn shown(&self, lines: usize) -> &[crate::view::Row] {
        let rows = &self.frames.rows;
        let first = if self.held.is_some() { self.first() } else { rows.len().saturating_sub(lines) };
        &rows[first..rows.len().min(first + lines)]
    }
}

pub(super) fn handle_key(screen: &mut Screen, code: KeyCode, _: &View) -> Option<Action> {
    let state = &mut screen.trace;
    match code {
        KeyCode::Up => state.scroll(-1),
        KeyCode::Down => state.scroll(1),
        KeyCode::PageUp => state.scroll(-(SCROLL as isize)),
        KeyCode::PageDown => state.scroll(SCROLL as isize),
        KeyCode::Home => state.held = Some(0),
        KeyCode::End => state.held = None,
        KeyCode::Char('f') if state.held.is_some() => state.held = None,
        KeyCode::Char('f') => state.hold(),
        KeyCode::Char('t') => state.filter.transfers ^= true,
        KeyCode::Char('!') => state.filter.alarming ^= true,
        KeyCode::Char('0') => state.filter = TraceFilter::default(),
        KeyCode::Char('/') => {
            return screen.change(Text::AskFilter, |screen, typed| {
                screen.trace.filter.text = typed;
                Ok(())
            });
        }
        KeyCode::Char('s') => {
            return screen.change(Text::AskServices, |screen, typed| {
                screen.trace.filter.services = typed;
                Ok(())
            });
        }
        KeyCode::Char('n') => {
            return screen.change(Text::AskNodes, |screen, typed| {
                screen.trace.filter.nodes = typed;
                Ok(())
            });
        }
        KeyCode::Char('x') => {
            let filter = state.filter.clone();
            return screen.ask(Text::AskFormat, String::new(), |format| {
                Ok(Action::Ask(Purpose::File(String::new()), Command::Export { format, filter }))
            });
        }
        _ => {}
    }
    None
}

pub(super) fn draw(screen: &Screen, frame: &mut Frame<'_>, area: Rect, _: &View) {
    let [head, list] = Layout::vertical([Constraint::Length(1), Constraint::Min(3)]).areas(area);
    let state = &screen.trace;
    let follows = if state.held.is_some() { screen.text(Text::Stands) } else { screen.text(Text::Follows) };
    let rows = screen.text(Text::Rows);
    frame.render_widget(
        Line::from(format!(" {} {rows}, {follows}  {}", state.frames.matching, words(screen, &state.filter))).bold(),
        head,
    );
    let lines = usize::from(list.height.saturating_sub(1));
    let rows = state.shown(lines).iter().map(|row| {
        let mark = match row.alarming {
            _ if state.marked == Some(row.number) => "▶",
            true => "!",
            false => "",
        };
        Row::new([
            format!("{mark}{}", row.number),
            format!("{:.6}", row.time),
            row.id.clone(),
            row.data.clone(),
            row.node.map_or_else(String::new, |node| node.to_string()),
            row.service.clone(),
            row.text.clone(),
        ])
        .style(if row.alarming { Style::new().red() } else { Style::new() })
    });
    // The words are worth more than the bytes.
    let bytes = if list.width < WIDE { 0 } else { 23 };
    let widths = [
        Constraint::Length(8),
        Constraint::Length(12),
        Constraint::Length(4),
        Constraint::Length(bytes),
        Constraint::Length(3),
        Constraint::Length(13),
        Constraint::Fill(1),
    ];
    let head = [
        "#",
        screen.text(Text::Time),
        "ID",
        "",
        screen.text(Text::Id),
        screen.text(Text::Frame),
        screen.text(Text::Content),
    ];
    frame.render_widget(Table::new(rows, widths).header(Row::new(head).style(Modifier::BOLD)), list);
}

fn words(screen: &Screen, filter: &TraceFilter) -> String {
    let mut words = Vec::new();
    for (name, text) in [("nodes", &filter.nodes), ("services", &filter.services), ("text", &filter.text)] {
        words.extend((!text.is_empty()).then(|| format!("{name}={text}")));
    }
    words.extend(filter.transfers.then(|| "transfers".to_owned()));
    words.extend(filter.alarming.then(|| "!".to_owned()));
    if words.is_empty() { String::new() } else { format!("{}: {}", screen.text(Text::Filter), words.join(" ")) }
}
