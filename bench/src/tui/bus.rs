//! The tab with statistics of the bus.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Gauge, Row};

use super::action::{Action, say};
use super::list::{Columns, Listed, WRONG};
use super::tab::Tab;
use super::text::Text;
use super::trace;
use super::ui::Ui;
use crate::request::Request;
use crate::view::{Bus, Rate, Trouble, View};

/// The load from which on frames of low priority wait for long.
const FULL: f64 = 70.0;

/// The number of rows: troubles, then COB-IDs.
pub(super) fn row_count(view: &View) -> usize {
    view.bus.troubles.len() + view.bus.ids.len()
}

pub(super) fn handle_key(ui: &mut Ui, trace: &mut trace::State, code: KeyCode, view: &View) -> Option<Action> {
    if code == KeyCode::Char('a') {
        return say(Request::Acknowledge);
    }
    if matches!(code, KeyCode::Enter | KeyCode::Char('g'))
        && let Some(row) = view.bus.troubles.get(ui.row())?.row
    {
        ui.tab = Tab::Trace;
        trace.show_row(row);
    }
    None
}

pub(super) fn draw(ui: &Ui, frame: &mut Frame<'_>, area: Rect, view: &View) -> Vec<Listed> {
    let Bus { troubles, ids, .. } = &view.bus;
    let shown = troubles.len().clamp(1, 6) as u16;
    let [gauge, above, list] =
        Layout::vertical([Constraint::Length(1), Constraint::Length(shown + 1), Constraint::Min(4)]).areas(area);
    draw_load(ui, frame, gauge, &view.bus);
    let (head, below) = (Rect { height: 1, ..above }, Rect { y: above.y + 1, height: shown, ..above });
    frame.render_widget(Line::from(ui.text(Text::Troubles)).bold(), head);
    let columns = Columns { head: [""; 2], widths: [Constraint::Length(11), Constraint::Fill(1)] };
    // The row within both lists: troubles first, then COB-IDs.
    let selected = ui.row();
    let in_troubles = Some(selected).filter(|row| *row < troubles.len());
    let trouble = |it: &Trouble| {
        let leads = it.row.map_or_else(String::new, |row| format!("  (#{row})"));
        let row = Row::new([format!("{WRONG}{:>8.1} s", it.since), format!("{}{leads}", it.text)]);
        if it.is_over { row.yellow() } else { row.red() }
    };
    let above = columns.draw(frame, below, in_troubles, troubles.iter(), trouble);
    if troubles.is_empty() {
        frame.render_widget(Line::from(ui.text(Text::NoTroubles)).green(), below);
    }
    let columns = Columns::new([
        ("COB-ID", Constraint::Length(8)),
        (ui.text(Text::Frame), Constraint::Fill(2)),
        (ui.text(Text::Id), Constraint::Length(4)),
        ("#", Constraint::Fill(1)),
        (ui.text(Text::PerSecond), Constraint::Fill(1)),
        (ui.text(Text::Jitter), Constraint::Fill(1)),
        (ui.text(Text::Share), Constraint::Length(7)),
    ]);
    let in_ids = selected.checked_sub(troubles.len()).filter(|row| *row < ids.len());
    let listed = columns.draw(frame, list, in_ids, ids.iter(), rate);
    vec![above, Listed { first: listed.first + troubles.len(), ..listed }]
}

fn draw_load(ui: &Ui, frame: &mut Frame<'_>, area: Rect, bus: &Bus) {
    let load = bus.load_percent.unwrap_or_default().clamp(0.0, 100.0);
    let peak = bus.load_percent_peak.map_or_else(String::new, |peak| format!(", {} {peak:.0} %", ui.text(Text::Peak)));
    let (color, mark) = if load > FULL { (Color::Red, WRONG) } else { (Color::Green, "") };
    let known = bus.load_percent.map_or_else(|| "?".to_owned(), |load| format!("{load:.1} %{peak}"));
    let label = format!("{mark}{} {known}, {}/s", ui.text(Text::Load), bus.frames_per_second);
    frame.render_widget(Gauge::default().ratio(load / 100.0).label(label).gauge_style(Style::new().fg(color)), area);
}

fn rate(rate: &Rate) -> Row<'static> {
    Row::new([
        rate.id.clone(),
        rate.name.clone(),
        rate.node.map_or_else(String::new, |node| node.to_string()),
        rate.frames.to_string(),
        format!("{:.0}", rate.per_second),
        rate.jitter_ms.map_or_else(String::new, |jitter| format!("{jitter:.2}")),
        format!("{:.0} %", rate.share_percent),
    ])
}
