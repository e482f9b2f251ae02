//! The tab with simulated devices and their inputs.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Rect};
use ratatui::style::Stylize;
use ratatui::text::Line;
use ratatui::widgets::Row;

use super::action::{Action, Purpose, say};
use super::list::{Columns, Listed};
use super::text::Text;
use super::ui::Ui;
use crate::request::Request;
use crate::view::{Input, Simulated, View};

/// The devices, each followed by its inputs.
pub(super) fn rows(view: &View) -> impl Iterator<Item = (&Simulated, Option<&Input>)> {
    view.devices.iter().flat_map(|device| {
        let inputs = device.inputs.iter().map(move |input| (device, Some(input)));
        std::iter::once((device, None)).chain(inputs)
    })
}

pub(super) fn handle_key(ui: &mut Ui, code: KeyCode, view: &View) -> Option<Action> {
    let (device, input) = rows(view).nth(ui.row())?;
    match code {
        KeyCode::Char('p') => say(Request::Power { node: device.node, on: !device.is_on }),
        KeyCode::Enter => {
            let (node, input) = (device.node, input?.name.clone());
            ui.ask(Text::AskInput, format!("{node} {} {input}", device.name), move |typed| {
                Ok(Action::Ask(Purpose::Say, Request::Input { node, text: format!("{input} = {typed}") }))
            })
        }
        _ => None,
    }
}

pub(super) fn draw(ui: &Ui, frame: &mut Frame<'_>, area: Rect, view: &View) -> Vec<Listed> {
    if view.devices.is_empty() {
        frame.render_widget(Line::from(ui.text(Text::NoDevice)).dim(), area);
        return Vec::new();
    }
    let head = [Text::Inputs, Text::Value, Text::Choices].map(|text| ui.text(text));
    let columns = Columns { head, widths: [Constraint::Fill(1), Constraint::Fill(1), Constraint::Fill(3)] };
    vec![columns.draw(frame, area, Some(ui.row()), rows(view), |(device, input)| match input {
        None => {
            let power = ui.text(if device.is_on { Text::On } else { Text::Off });
            let name = format!("{} {}", device.node, device.name);
            Row::new([name, format!("{} {power}", ui.text(Text::Power)), String::new()]).bold()
        }
        Some(input) => {
            let takes = if input.choices.is_empty() { input.help.clone() } else { input.choices.join(", ") };
            Row::new([format!("    {}", input.name), input.value.clone().unwrap_or_default(), takes])
        }
    })]
}
