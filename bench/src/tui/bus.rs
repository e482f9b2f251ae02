//! The bus by numbers.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Gauge, Paragraph, Row, Table, TableState};

use super::screen::{Action, Screen, first_shown};
use super::text::Text;
use crate::view::View;

/// From which load on frames of low priority wait for long.
const FULL: f64 = 70.0;

pub(super) fn handle_key(screen: &mut Screen, code: KeyCode, view: &View) -> Option<Action> {
    if let KeyCode::Char(digit @ 'a'..='f') = code {
        let row = view.bus.troubles.get(usize::from(digit as u8 - b'a'))?.row?;
        screen.show_row(row);
    }
    None
}

pub(super) fn draw(screen: &Screen, frame: &mut Frame<'_>, area: Rect, view: &View) {
    let bus = &view.bus;
    let troubles = bus.troubles.len().clamp(1, 6) as u16;
    let [gauge, below, list] =
        Layout::vertical([Constraint::Length(1), Constraint::Length(troubles + 1), Constraint::Min(4)]).areas(area);
    let load = bus.load_percent.unwrap_or_default().clamp(0.0, 100.0);
    let peak =
        bus.load_percent_peak.map_or_else(String::new, |peak| format!(", {} {peak:.0} %", screen.text(Text::Peak)));
    let color = if load > FULL { Color::Red } else { Color::Green };
    let label = match bus.load_percent {
        Some(load) => format!("{} {load:.1} %{peak}, {}/s", screen.text(Text::Load), bus.frames_per_second),
        None => format!("{} ?, {}/s", screen.text(Text::Load), bus.frames_per_second),
    };
    frame.render_widget(Gauge::default().ratio(load / 100.0).label(label).gauge_style(Style::new().fg(color)), gauge);
    let mut lines = vec![Line::from(screen.text(Text::Troubles)).bold()];
    if bus.troubles.is_empty() {
        lines.push(Line::from(screen.text(Text::NoTroubles)).green());
    }
    lines.extend(bus.troubles.iter().zip('a'..).map(|(it, key)| {
        let key = if it.row.is_some() { key } else { ' ' };
        Line::from(format!("!{key} {:>8.1} s  {}", it.since, it.text)).red()
    }));
    frame.render_widget(Paragraph::new(lines), below);
    let height = usize::from(list.height.saturating_sub(1));
    let first = first_shown(screen.row(), height);
    let rows = bus.ids.iter().skip(first).take(height).map(|rate| {
        Row::new([
            rate.id.clone(),
            rate.name.clone(),
            rate.node.map_or_else(String::new, |node| node.to_string()),
            rate.frames.to_string(),
            format!("{:.0}", rate.per_second),
            rate.jitter_ms.map_or_else(String::new, |jitter| format!("{jitter:.2}")),
            format!("{:.0} %", rate.share_percent),
        ])
    });
    let head = [
        "COB-ID",
        screen.text(Text::Frame),
        screen.text(Text::Id),
        "#",
        screen.text(Text::PerSecond),
        screen.text(Text::Jitter),
        screen.text(Text::Share),
    ];
    let widths = [
        Constraint::Length(8),
        Constraint::Fill(2),
        Constraint::Length(4),
        Constraint::Fill(1),
        Constraint::Fill(1),
        Constraint::Fill(1),
        Constraint::Length(7),
    ];
    let table = Table::new(rows, widths).header(Row::new(head).bold()).row_highlight_style(Modifier::REVERSED);
    frame.render_stateful_widget(table, list, &mut TableState::new().with_selected(Some(screen.row() - first)));
}
