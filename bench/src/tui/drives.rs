//! The drives of the bus: their state machines, where they are, and orders to them.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, List, ListState, Paragraph, Wrap};

use super::screen::{Action, Purpose, Screen, say};
use super::text::Text;
use crate::command::{Command, Order};
use crate::view::{Drive, View};

/// The states of CiA 402 on the way to OPERATION ENABLED.
const WAY: [&str; 4] = ["SWITCH ON DISABLED", "READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"];

/// The states beside it.
const BESIDE: [&str; 4] = ["NOT READY TO SWITCH ON", "QUICK STOP ACTIVE", "FAULT REACTION ACTIVE", "FAULT"];

pub(super) fn handle_key(screen: &mut Screen, code: KeyCode, view: &View) -> Option<Action> {
    let Drive { node, name, .. } = view.drives.get(screen.row())?;
    let (node, of) = (*node, format!("{node} {name}"));
    let plain = |order| say(Command::Drive { node, order, value: None });
    let ask = |title, order| {
        screen.ask(title, of, move |typed| {
            Ok(Action::Ask(Purpose::Say, Command::Drive { node, order, value: Some(typed) }))
        })
    };
    match code {
        KeyCode::Char('e') => plain(Order::Enable),
        KeyCode::Char('d') => plain(Order::Disable),
        KeyCode::Char('f') => plain(Order::ResetFault),
        KeyCode::Char('k') => plain(Order::Stop),
        KeyCode::Char('K') => plain(Order::QuickStop),
        KeyCode::Char('m') => ask(Text::AskPosition, Order::MoveTo),
        KeyCode::Char('s') => ask(Text::AskDistance, Order::Step),
        KeyCode::Char('v') => ask(Text::AskVelocity, Order::Run),
        KeyCode::Char('o') => ask(Text::AskMethod, Order::Home),
        _ => None,
    }
}

pub(super) fn draw(screen: &Screen, frame: &mut Frame<'_>, area: Rect, view: &View) {
    if view.drives.is_empty() {
        frame.render_widget(Line::from(screen.text(Text::NoDrive)).dim(), area);
        return;
    }
    let [list, detail] =
        Layout::vertical([Constraint::Length(view.drives.len().min(6) as u16), Constraint::Min(10)]).areas(area);
    let items = view.drives.iter().map(|drive| {
        let state = drive.state.as_deref().unwrap_or("?");
        let position = number(drive.position, drive.position_unit.as_deref());
        let velocity = number(drive.velocity, drive.velocity_unit.as_deref());
        Line::from(format!("{:>3} {:<20} {state:<22} {position:>16} {velocity:>14}", drive.node, drive.name))
    });
    let items = List::new(items).highlight_style(Modifier::REVERSED);
    frame.render_stateful_widget(items, list, &mut ListState::default().with_selected(Some(screen.row())));
    if let Some(drive) = view.drives.get(screen.row()) {
        let block = Block::bordered().title(format!(" {} {} ", drive.node, drive.name));
        let text = Paragraph::new(lines(screen, drive)).wrap(Wrap { trim: false }).block(block);
        frame.render_widget(text, detail);
    }
}

fn number(number: Option<f64>, unit: Option<&str>) -> String {
    number.map_or_else(|| "?".to_owned(), |number| format!("{number} {}", unit.unwrap_or_default()))
}

fn lines(screen: &Screen, drive: &Drive) -> Vec<Line<'static>> {
    let mut lines: Vec<_> = WAY.into_iter().zip(BESIDE).map(|states| machine(drive, states.into())).collect();
    lines.push(Line::default());
    let value = |text, value: String| Line::from(format!("{:<18} {value}", screen.text(text)));
    lines.push(value(Text::Position, number(drive.position, drive.position_unit.as_deref())));
    lines.push(value(Text::Velocity, number(drive.velocity, drive.velocity_unit.as_deref())));
    if drive.target.is_some() {
        lines.push(value(Text::Target, number(drive.target, drive.position_unit.as_deref())));
    }
    lines.extend(drive.mode.clone().map(|mode| value(Text::Mode, mode)));
    if let Some(order) = &drive.order {
        lines.push(Line::from(order.clone()).yellow().bold());
    }
    if let Some(ending) = &drive.ending {
        let mark = if ending.is_success { "" } else { "! " };
        let text = format!("{} {mark}{}", screen.text(Text::Ended), ending.text);
        let line = Line::from(text);
        lines.push(match (ending.may_be_moving, ending.is_success) {
            (true, _) => line.bold().red().reversed(),
            (false, true) => line.green(),
            (false, false) => line.red(),
        });
        lines.extend(ending.remedy.clone().map(|remedy| Line::from(format!("  {remedy}"))));
    }
    match drive.obstacles.as_deref() {
        None => {}
        Some([]) => lines.push(Line::from(screen.text(Text::Ready)).dim()),
        Some(obstacles) => {
            lines.push(Line::from(screen.text(Text::Obstacles)));
            lines.extend(obstacles.iter().map(|obstacle| Line::from(format!("  {obstacle}")).red()));
        }
    }
    lines
}

/// Two states beside each other: the present one stands out, those that it may be ordered to are in brackets.
fn machine(drive: &Drive, states: [&str; 2]) -> Line<'static> {
    let spans = states.map(|state| {
        let is_allowed = drive.allowed.iter().any(|allowed| allowed == state);
        let is_present = drive.state.as_deref() == Some(state);
        let text = match (is_present, is_allowed) {
            (true, _) => format!("▶{state}◀"),
            (false, true) => format!("[{state}]"),
            (false, false) => format!(" {state} "),
        };
        let style = match (is_present, is_allowed) {
            (true, _) if state.starts_with("FAULT") => Style::new().red().bold(),
            (true, _) => Style::new().green().bold(),
            (false, true) => Style::new(),
            (false, false) => Style::new().dim(),
        };
        Span::styled(format!("{text:<26}"), style)
    });
    Line::from(spans.to_vec())
}
