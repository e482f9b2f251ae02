//! The nodes of the bus.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph, Row, Table, TableState, Wrap};

use super::screen::{Action, Purpose, Room, Screen, say};
use super::text::Text;
use crate::command::{Command, Nmt};
use crate::view::{Node, View};

pub(super) fn handle_key(screen: &mut Screen, code: KeyCode, view: &View) -> Option<Action> {
    let node = screen.node(view);
    let id = node.map(|node| node.id);
    let nmt = |command| say(Command::Nmt { node: Some(id?), command });
    match code {
        KeyCode::Char('o') => nmt(Nmt::Start),
        KeyCode::Char('p') => nmt(Nmt::PreOperational),
        KeyCode::Char('x') => nmt(Nmt::Stop),
        KeyCode::Char('r') => nmt(Nmt::ResetNode),
        KeyCode::Char('c') => nmt(Nmt::ResetCommunication),
        KeyCode::Char('f') => say(Command::Scan),
        KeyCode::Char('a') => screen.ask(Text::AskId, String::new(), |typed| {
            let node = typed.trim().parse().map_err(|error| format!("{typed}: {error}"))?;
            Ok(Action::Ask(Purpose::Say, Command::Assign { node }))
        }),
        KeyCode::Char('d') => {
            let (node, name) = node.map(|node| (node.id, node.name.clone()))?;
            screen.ask(Text::AskSheet, format!("{node} {name}"), move |sheet| {
                Ok(Action::Ask(Purpose::Say, Command::SetSheet { node, sheet }))
            })
        }
        KeyCode::Char('g') => {
            let fault = node.and_then(|node| node.faults.first().or(node.history.first()))?.row;
            screen.show_row(fault);
            None
        }
        KeyCode::Enter => {
            screen.node = id;
            screen.enter(Room::Objects);
            None
        }
        _ => None,
    }
}

pub(super) fn draw(screen: &Screen, frame: &mut Frame<'_>, area: Rect, view: &View) {
    let [list, detail] =
        Layout::vertical([Constraint::Length(view.nodes.len().clamp(1, 12) as u16 + 1), Constraint::Min(3)])
            .areas(area);
    if view.nodes.is_empty() {
        frame.render_widget(Line::from(screen.text(Text::NoNode)).dim(), list);
        return;
    }
    let head = [Text::Id, Text::Name, Text::State, Text::Heartbeat, Text::Sheet, Text::Faults];
    let rows = view.nodes.iter().map(|node| {
        let state = node.state.clone().unwrap_or_else(|| "?".to_owned());
        let state = match node.silent_seconds {
            Some(seconds) => format!("{state} (-{seconds:.1} s)"),
            None => state,
        };
        let faults: Vec<_> = node.faults.iter().map(|fault| fault.code.as_str()).collect();
        let is_wrong = !node.faults.is_empty() || node.silent_seconds.is_some();
        Row::new([
            format!("{}{}", if is_wrong { "!" } else { "" }, node.id),
            node.name.clone(),
            state,
            node.heartbeat_ms.map_or_else(String::new, |ms| format!("{ms:.0} ms")),
            node.sheet.clone().unwrap_or_default(),
            faults.join(" "),
        ])
        .style(if is_wrong { Style::new().red() } else { Style::new() })
    });
    let widths = [
        Constraint::Length(4),
        Constraint::Fill(2),
        Constraint::Length(25),
        Constraint::Length(9),
        Constraint::Fill(2),
        Constraint::Fill(1),
    ];
    let selected = screen.node(view).and_then(|node| view.nodes.iter().position(|known| known.id == node.id));
    let table = Table::new(rows, widths)
        .header(Row::new(head.map(|text| screen.text(text))).bold())
        .row_highlight_style(Modifier::REVERSED);
    frame.render_stateful_widget(table, list, &mut TableState::new().with_selected(selected));
    if let Some(node) = screen.node(view) {
        let block = Block::bordered().title(format!(" {} {} ", node.id, node.name));
        let text = Paragraph::new(details(screen, node)).wrap(Wrap { trim: false }).block(block);
        frame.render_widget(text, detail);
    }
}

fn details(screen: &Screen, node: &Node) -> Vec<Line<'static>> {
    let mut lines = Vec::new();
    let title = |text| Line::from(screen.text(text)).bold();
    if node.faults.is_empty() {
        lines.push(Line::from(screen.text(Text::NoFaults)).green());
    } else {
        lines.push(title(Text::Faults));
        lines.extend(node.faults.iter().map(|fault| Line::from(format!("  {}h {}", fault.code, fault.text)).red()));
    }
    let known = ["vendor", "product", "revision", "serial"].into_iter().zip(node.identity);
    let known: Vec<_> = known.filter_map(|(name, number)| Some(format!("{name} {:X}h", number?))).collect();
    lines.push(Line::from(format!("{}: {}", screen.text(Text::Identity), known.join(", "))));
    if let Some(ms) = node.sdo_ms {
        lines.push(Line::from(format!("SDO: {ms:.1} ms")));
    }
    if !node.history.is_empty() {
        lines.push(title(Text::History));
        let fault =
            |fault: &crate::view::Fault| Line::from(format!("  {:>9.3} s  {}h {}", fault.at, fault.code, fault.text));
        lines.extend(node.history.iter().map(fault));
    }
    if !node.changes.is_empty() {
        lines.push(title(Text::Changes));
        lines.extend(node.changes.iter().map(|change| Line::from(format!("  {change}"))));
    }
    lines
}
