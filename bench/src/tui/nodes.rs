//! The tab with nodes.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph, Row, Wrap};

use super::action::{Action, Purpose, say};
use super::list::{Columns, Listed, WRONG, ago};
use super::tab::Tab;
use super::text::Text;
use super::trace;
use super::ui::Ui;
use crate::request::{Nmt, Request};
use crate::view::{Node, View};

pub(super) fn handle_key(ui: &mut Ui, trace: &mut trace::State, code: KeyCode, view: &View) -> Option<Action> {
    let node = ui.node(view);
    let id = node.map(|node| node.id);
    let nmt = |command| say(Request::Nmt { node: Some(id?), command });
    match code {
        KeyCode::Char('o') => nmt(Nmt::Start),
        KeyCode::Char('p') => nmt(Nmt::PreOperational),
        KeyCode::Char('x') => nmt(Nmt::Stop),
        KeyCode::Char('r') => nmt(Nmt::ResetNode),
        KeyCode::Char('c') => nmt(Nmt::ResetCommunication),
        KeyCode::Char('f') => say(Request::Scan),
        KeyCode::Char('a') => ui.ask(Text::AskId, String::new(), |typed| {
            let node = typed.trim().parse().map_err(|error| format!("{typed}: {error}"))?;
            Ok(Action::Ask(Purpose::Say, Request::Assign { node }))
        }),
        KeyCode::Char('d') => {
            let (node, name) = node.map(|node| (node.id, node.name.clone()))?;
            ui.ask(Text::AskSheet, format!("{node} {name}"), move |sheet| {
                Ok(Action::Ask(Purpose::Say, Request::SetSheet { node, sheet }))
            })
        }
        KeyCode::Char('e') => say(Request::FetchSheet { node: id? }),
        KeyCode::Char('g') => {
            let fault = node.and_then(|node| node.faults.first().or(node.history.first()))?.row;
            ui.tab = Tab::Trace;
            trace.show_row(fault);
            None
        }
        KeyCode::Enter => {
            ui.node = id;
            ui.tab = Tab::Objects;
            None
        }
        _ => None,
    }
}

pub(super) fn draw(ui: &Ui, frame: &mut Frame<'_>, area: Rect, view: &View) -> Vec<Listed> {
    let [list, detail] =
        Layout::vertical([Constraint::Length(view.nodes.len().clamp(1, 12) as u16 + 1), Constraint::Min(3)])
            .areas(area);
    let Some(node) = ui.node(view) else {
        frame.render_widget(Line::from(ui.text(Text::NoNode)).dim(), list);
        return Vec::new();
    };
    let columns = Columns::new([
        (ui.text(Text::Id), Constraint::Length(4)),
        (ui.text(Text::Name), Constraint::Fill(2)),
        (ui.text(Text::State), Constraint::Length(25)),
        (ui.text(Text::Heartbeat), Constraint::Length(9)),
        (ui.text(Text::Sheet), Constraint::Fill(2)),
        (ui.text(Text::Faults), Constraint::Fill(1)),
    ]);
    let listed = columns.draw(frame, list, Some(ui.row()), view.nodes.iter(), |node| row(node, view.time));
    let block = Block::bordered().title(format!(" {} {} ", node.id, node.name));
    let text = Paragraph::new(details(ui, node)).wrap(Wrap { trim: false }).block(block);
    frame.render_widget(text, detail);
    vec![listed]
}

fn row(node: &Node, now: f64) -> Row<'static> {
    let state = node.state.as_deref().unwrap_or("?");
    let state = match node.silent_seconds {
        Some(seconds) => format!("{WRONG}{state} (-{seconds:.1} s)"),
        None => format!("{state}{}", ago(node.seen, now)),
    };
    let faults = node.faults.iter().map(|fault| format!("{WRONG}{}", fault.code));
    let is_wrong = !node.faults.is_empty() || node.silent_seconds.is_some();
    Row::new([
        node.id.to_string(),
        node.name.clone(),
        state,
        node.heartbeat_ms.map_or_else(String::new, |ms| format!("{ms:.0} ms")),
        node.sheet.clone().unwrap_or_default(),
        faults.collect::<Vec<_>>().join(" "),
    ])
    .style(if is_wrong { Style::new().red() } else { Style::new() })
}

fn details(ui: &Ui, node: &Node) -> Vec<Line<'static>> {
    let mut lines = Vec::new();
    let title = |text| Line::from(ui.text(text)).bold();
    if node.faults.is_empty() {
        lines.push(Line::from(ui.text(Text::NoFaults)).green());
    } else {
        lines.push(title(Text::Faults));
        lines.extend(
            node.faults.iter().map(|fault| Line::from(format!("{WRONG} {}h {}", fault.code, fault.text)).red()),
        );
    }
    let known = ["vendor", "product", "revision", "serial"].into_iter().zip(node.identity);
    let known: Vec<_> = known.filter_map(|(name, number)| Some(format!("{name} {:X}h", number?))).collect();
    lines.push(Line::from(format!("{}: {}", ui.text(Text::Identity), known.join(", "))));
    if node.stores_sheet {
        lines.push(Line::from(ui.text(Text::StoresSheet)));
    }
    if let Some(ms) = node.sdo_ms {
        lines.push(Line::from(format!("SDO: {ms:.1} ms")));
    }
    if !node.lacks.is_empty() {
        lines.push(title(Text::Lacks));
        lines.extend(node.lacks.iter().map(|lack| {
            if lack.is_needed {
                Line::from(format!("{WRONG} {}", lack.text)).red()
            } else {
                Line::from(format!("  {}", lack.text))
            }
        }));
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
