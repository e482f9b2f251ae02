//! The tab with drives: state machines, positions, orders.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Row, Wrap};

use super::action::{Action, Purpose};
use super::list::{ALARM, Columns, Listed, WRONG, age, ago};
use super::text::Text;
use super::ui::Ui;
use crate::orders::ORDERS;
use crate::request::Request;
use crate::view::{Drive, View};

/// The states of CiA 402 on the way to OPERATION ENABLED.
const WAY: [&str; 4] = ["SWITCH ON DISABLED", "READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"];

/// The states beside that way.
const BESIDE: [&str; 4] = ["NOT READY TO SWITCH ON", "QUICK STOP ACTIVE", "FAULT REACTION ACTIVE", "FAULT"];

pub(super) fn handle_key(ui: &mut Ui, code: KeyCode, view: &View) -> Option<Action> {
    let Drive { node, name, .. } = view.drives.get(ui.row())?;
    let (node, of) = (*node, format!("{node} {name}"));
    let row = ORDERS.iter().find(|row| code == KeyCode::Char(row.key))?;
    let (order, purpose) = (row.verb, if row.verb.is_stop() { Purpose::StopDrive } else { Purpose::Say });
    match row.prompt {
        None => Some(Action::Ask(purpose, Request::Drive { node, order, value: None })),
        Some(titles) => ui.ask_in_words(titles[ui.language as usize], of, move |typed| {
            Ok(Action::Ask(purpose, Request::Drive { node, order, value: Some(typed) }))
        }),
    }
}

pub(super) fn draw(ui: &Ui, frame: &mut Frame<'_>, area: Rect, view: &View) -> Vec<Listed> {
    if view.drives.is_empty() {
        frame.render_widget(Line::from(ui.text(Text::NoDrive)).dim(), area);
        return Vec::new();
    }
    let [list, detail] =
        Layout::vertical([Constraint::Length(view.drives.len().min(6) as u16), Constraint::Min(10)]).areas(area);
    let columns = Columns {
        head: [""; 5],
        widths: [
            Constraint::Length(3),
            Constraint::Fill(1),
            Constraint::Length(30),
            Constraint::Length(16),
            Constraint::Length(14),
        ],
    };
    let listed = columns.draw(frame, list, Some(ui.row()), view.drives.iter(), |drive| {
        let state = drive.state.as_deref().unwrap_or("?");
        let mark = if state.starts_with("FAULT") { WRONG } else { "" };
        let ago = ago(drive.seen, view.time);
        let style = if ago.is_empty() { Style::new() } else { Style::new().dim() };
        Row::new([
            format!("{:>3}", drive.node),
            drive.name.clone(),
            format!("{mark}{state}{ago}"),
            format!("{:>16}", number(drive.position, drive.position_unit.as_deref())),
            format!("{:>14}", number(drive.velocity, drive.velocity_unit.as_deref())),
        ])
        .style(style)
    });
    if let Some(drive) = view.drives.get(ui.row()) {
        let block = Block::bordered().title(format!(" {} {} ", drive.node, drive.name));
        let text = Paragraph::new(lines(ui, drive, view.time)).wrap(Wrap { trim: false }).block(block);
        frame.render_widget(text, detail);
    }
    vec![listed]
}

fn number(number: Option<f64>, unit: Option<&str>) -> String {
    number.map_or_else(|| "?".to_owned(), |number| format!("{number} {}", unit.unwrap_or_default()))
}

fn lines(ui: &Ui, drive: &Drive, now: f64) -> Vec<Line<'static>> {
    let mut lines: Vec<_> = WAY.into_iter().zip(BESIDE).map(|states| machine(drive, states.into())).collect();
    let age = age(drive.seen, now);
    let old = age.map(|age| Line::from(format!("{WRONG}{} {age:.1} s", ui.text(Text::LastSeen))).red().bold());
    lines.push(old.unwrap_or_default());
    if let Some(unconfirmed) = &drive.unconfirmed {
        let text = format!("{ALARM} {} {:.1} s", ui.text(Text::Unconfirmed), now - unconfirmed.since);
        lines.push(Line::from(text).bold().red().reversed());
        lines.extend(unconfirmed.why.clone().map(|why| Line::from(format!("  {why}"))));
    }
    let value = |text, value: String| Line::from(format!("{:<18} {value}", ui.text(text)));
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
        let line = |mark: &str| Line::from(format!("{} {mark} {}", ui.text(Text::Ended), ending.text));
        lines.push(match (ending.may_be_moving, ending.is_success) {
            (true, _) => line(ALARM).bold().red().reversed(),
            // The reference point may be lost meanwhile.
            (false, true) if age.is_some() => line("✓").dim(),
            (false, true) => line("✓").green(),
            (false, false) => line(WRONG).red(),
        });
        lines.extend(ending.remedy.clone().map(|remedy| Line::from(format!("  {remedy}"))));
    }
    match drive.obstacles.as_deref() {
        None => {}
        Some([]) => lines.push(Line::from(ui.text(Text::Ready)).dim()),
        Some(obstacles) => {
            lines.push(Line::from(ui.text(Text::Obstacles)));
            lines.extend(obstacles.iter().map(|obstacle| Line::from(format!("{WRONG} {obstacle}")).red()));
        }
    }
    lines
}

/// Two states side by side: the current one highlighted, states that can be ordered in brackets.
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
            (true, _) if drive.seen.is_some_and(|seen| seen.is_old) => Style::new().dim(),
            (true, _) if state.starts_with("FAULT") => Style::new().red().bold(),
            (true, _) => Style::new().green().bold(),
            (false, true) => Style::new(),
            (false, false) => Style::new().dim(),
        };
        Span::styled(format!("{text:<26}"), style)
    });
    Line::from(spans.to_vec())
}
