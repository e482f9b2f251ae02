//! The tab with the trace.

use lexican_toolbox::log::Format;
use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::Row;

use super::action::{Action, Purpose};
use super::list::{Columns, Listed, WRONG};
use super::prompt::Field;
use super::text::Text;
use super::ui::Ui;
use crate::columns;
use crate::request::Request;
use crate::view::{Frames, TraceFilter, View};

/// How many rows are requested: as many as the largest terminal shows, and some above.
const PAGE: u32 = 300;

/// How many of these are above the screen, so that they are there when scrolling up.
const ABOVE: u32 = 100;

/// How many rows before a marked one are shown.
const BEFORE: u64 = 5;

/// The width of the terminal from which on the bytes of frames are shown.
const WIDE: u16 = 110;

/// The position in the trace, and the filter.
#[derive(Default)]
pub(super) struct State {
    filter: TraceFilter,
    /// The row number at the top, because positions change when old rows are dropped; `None` to follow the newest rows.
    held: Option<u64>,
    /// The row number that the user wants to see.
    marked: Option<u64>,
    frames: Frames,
}

impl State {
    pub(super) fn request(&self) -> Request {
        let from = self.held.map_or(-i64::from(PAGE), |_| -i64::from(ABOVE));
        Request::Trace { filter: self.filter.clone(), from, at: self.held, count: PAGE }
    }

    pub(super) fn take(&mut self, frames: Frames) {
        self.frames = frames;
    }

    /// Moves to a row, with some rows before it.
    pub(super) fn show_row(&mut self, number: u64) {
        self.filter = TraceFilter::default();
        self.held = Some(number.saturating_sub(BEFORE));
        self.marked = Some(number);
    }

    /// The number of rows received.
    pub(super) fn count(&self) -> usize {
        self.frames.rows.len()
    }

    /// Sets the filter.
    pub(super) fn set(&mut self, field: Field, typed: String) {
        match field {
            Field::Services => self.filter.services = typed,
            Field::Nodes => self.filter.nodes = typed,
            _ => self.filter.text = typed,
        }
    }

    /// The position of the first row shown among those received.
    fn top(&self, lines: usize) -> usize {
        let rows = &self.frames.rows;
        let held = self.held.map(|held| rows.partition_point(|row| row.number < held));
        // The log may have been moved to a time before the row.
        held.filter(|top| *top < rows.len()).unwrap_or(rows.len().saturating_sub(lines))
    }

    /// Holds the window, some rows further up or down.
    fn scroll(&mut self, by: isize, lines: usize) {
        let last = self.frames.rows.len().saturating_sub(1);
        let top = self.top(lines).saturating_add_signed(by).min(last);
        self.held = self.frames.rows.get(top).map(|row| row.number);
    }

    /// Marks a row on the screen.
    pub(super) fn mark(&mut self, row: usize, lines: usize) {
        self.scroll(0, lines);
        self.marked = self.frames.rows.get(row).map(|row| row.number);
    }
}

pub(super) fn handle_key(ui: &mut Ui, state: &mut State, code: KeyCode, view: &View) -> Option<Action> {
    let lines = ui.lines();
    match code {
        KeyCode::Up => state.scroll(-1, lines),
        KeyCode::Down => state.scroll(1, lines),
        KeyCode::PageUp => state.scroll(-(lines as isize), lines),
        KeyCode::PageDown => state.scroll(lines as isize, lines),
        KeyCode::Home => state.held = Some(view.trace.first),
        KeyCode::End => state.held = None,
        KeyCode::Char('f') if state.held.is_some() => state.held = None,
        KeyCode::Char('f') => state.scroll(0, lines),
        KeyCode::Char('t') => state.filter.transfers ^= true,
        KeyCode::Char('!') => state.filter.alarming ^= true,
        KeyCode::Char('0') => state.filter = TraceFilter::default(),
        KeyCode::Char('k') => {
            // Cycle through the machine's filters, then none.
            let kept = &view.kept.filters;
            let next = kept.iter().position(|(_, filter)| *filter == state.filter).map_or(0, |at| at + 1);
            state.filter = kept.get(next).map_or_else(TraceFilter::default, |(_, filter)| filter.clone());
        }
        KeyCode::Char('/') => return ui.ask_for(Field::Text),
        KeyCode::Char('s') => return ui.ask_for(Field::Services),
        KeyCode::Char('n') => return ui.ask_for(Field::Nodes),
        KeyCode::Char('x') => {
            let filter = state.filter.clone();
            return ui.ask(Text::AskFormat, Format::kinds(), |format| {
                Ok(Action::Ask(Purpose::File(String::new()), Request::Export { format, filter }))
            });
        }
        _ => {}
    }
    None
}

pub(super) fn draw(ui: &Ui, state: &State, frame: &mut Frame<'_>, area: Rect, view: &View) -> Vec<Listed> {
    let [head, list] = Layout::vertical([Constraint::Length(1), Constraint::Min(3)]).areas(area);
    let follows = ui.text(if state.held.is_some() { Text::Stands } else { Text::Follows });
    let (count, rows) = (state.frames.matching, ui.text(Text::Rows));
    let lost = state.marked.filter(|number| *number < view.trace.first);
    let lost = lost.map_or_else(String::new, |number| format!("  {WRONG} #{number} {}", ui.text(Text::Forgotten)));
    let filter = words(ui, &state.filter);
    frame.render_widget(Line::from(format!(" {count} {rows}, {follows}  {filter}{lost}")).bold(), head);
    // On a narrow terminal, texts are more useful than bytes.
    let is_shown = |name| name != "data" || list.width >= WIDE;
    let mut head = vec![""];
    let mut widths = vec![Constraint::Length(1)];
    for column in &columns::TRACE {
        head.push(column.titles[ui.language as usize]);
        let width = column.terminal.map(|width| if is_shown(column.name) { width } else { 0 });
        widths.push(width.map_or(Constraint::Fill(1), Constraint::Length));
    }
    let columns = Columns { head, widths };
    let lines = usize::from(list.height.saturating_sub(1));
    let top = state.top(lines);
    let shown = state.frames.rows.iter().skip(top);
    let marked = shown.clone().take(lines).position(|row| state.marked == Some(row.number));
    let listed = columns.draw(frame, list, marked, shown, |row| {
        let mark = if row.alarming { WRONG } else { "" }.to_owned();
        Row::new(std::iter::once(mark).chain(columns::TRACE.iter().map(|column| (column.text)(row))))
            .style(if row.alarming { Style::new().red() } else { Style::new() })
    });
    vec![Listed { first: top, ..listed }]
}

fn words(ui: &Ui, filter: &TraceFilter) -> String {
    let mut words = Vec::new();
    for (name, text) in [("nodes", &filter.nodes), ("services", &filter.services), ("text", &filter.text)] {
        words.extend((!text.is_empty()).then(|| format!("{name}={text}")));
    }
    words.extend(filter.transfers.then(|| "transfers".to_owned()));
    words.extend(filter.alarming.then(|| WRONG.to_owned()));
    if words.is_empty() { String::new() } else { format!("{}: {}", ui.text(Text::Filter), words.join(" ")) }
}
