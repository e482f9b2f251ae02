//! Simulated devices, and what can be done to them.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Rect};
use ratatui::style::{Modifier, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Row, Table, TableState};

use super::screen::{Action, Purpose, Screen, first_shown, say};
use super::text::Text;
use crate::command::Command;
use crate::view::{Input, Simulated, View};

/// The devices and their inputs, one after the other.
pub(super) fn rows(view: &View) -> impl Iterator<Item = (&Simulated, Option<&Input>)> {
    view.devices.iter().flat_map(|device| {
        let inputs = device.inputs.iter().map(move |input| (device, Some(input)));
        std::iter::once((device, None)).chain(inputs)
    })
}

pub(super) fn handle_key(screen: &mut Screen, code: KeyCode, view: &View) -> Option<Action> {
    let (device, input) = rows(view).nth(screen.row())?;
    match code {
        KeyCode::Char('p') => say(Command::Power { node: device.node, on: !device.is_on }),
        KeyCode::Enter => {
            let (node, input) = (device.node, input?.name.clone());
            screen.ask(Text::AskInput, format!("{node} {} {input}", device.name), move |typed| {
                Ok(Action::Ask(Purpose::Say, Command::Input { node, text: format!("{input} = {typed}") }))
            })
        }
        _ => None,
    }
}

pub(super) fn draw(screen: &Screen, frame: &mut Frame<'_>, area: Rect, view: &View) {
    if view.devices.is_empty() {
        frame.render_widget(Line::from(screen.text(Text::NoDevice)).dim(), area);
        return;
    }
    let lines = usize::from(area.height.saturating_sub(1));
    let first = first_shown(screen.row(), lines);
    let rows = rows(view).skip(first).take(lines).map(|(device, input)| match input {
        None => {
            let power = screen.text(if device.is_on { Text::On } else { Text::Off });
            let name = format!("{} {}", device.node, device.name);
            Row::new([name, format!("{} {power}", screen.text(Text::Power)), String::new()]).bold()
        }
        Some(input) => {
            let takes = if input.choices.is_empty() { input.help.clone() } else { input.choices.join(", ") };
            Row::new([format!("    {}", input.name), input.value.clone().unwrap_or_default(), takes])
        }
    });
    let widths = [Constraint::Fill(1), Constraint::Fill(1), Constraint::Fill(3)];
    let head = [Text::Inputs, Text::Value, Text::Choices];
    let table = Table::new(rows, widths)
        .header(Row::new(head.map(|text| screen.text(text))).bold())
        .row_highlight_style(Modifier::REVERSED);
    frame.render_stateful_widget(table, area, &mut TableState::new().with_selected(Some(screen.row() - first)));
}
