//! The tab with a node's objects.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph, Row, Table, Wrap};

use super::action::{Action, Purpose, say};
use super::list::{Columns, Listed, ago};
use super::prompt::Field;
use super::text::Text;
use super::ui::Ui;
use crate::request::{Other, Request};
use crate::view::{Object, View};

/// The mark of a value that is not the default.
const DIFFERS: &str = "≠ ";

/// The mark of the reason why a value could not be read.
const FAILED: &str = "! ";

/// The interval of reading a watched entry.
const WATCHED_MS: u32 = 250;

/// The interval of reading a plotted entry.
const PLOTTED_MS: u32 = 50;

/// The entries of a node, and the search.
#[derive(Default)]
pub(super) struct State {
    node: u8,
    objects: Vec<Object>,
    search: String,
}

impl State {
    pub(super) fn set(&mut self, node: u8, objects: Vec<Object>) {
        (self.node, self.objects) = (node, objects);
    }

    pub(super) fn search(&mut self, search: String) {
        self.search = search;
    }
}

/// The entries whose name, address, value or group contains the searched text.
pub(super) fn shown<'a>(ui: &Ui, state: &'a State, view: &View) -> impl Iterator<Item = &'a Object> + use<'a> {
    let wanted = state.search.to_lowercase();
    // After the node has changed, entries of the last one are not shown.
    let are_of_node = ui.node(view).is_some_and(|node| node.id == state.node);
    state.objects.iter().filter(move |_| are_of_node).filter(move |object| {
        let value = object.value.as_ref().map_or("", |value| &value.text);
        [&*object.object, &object.name, &object.address, value, &object.group]
            .iter()
            .any(|text| text.to_lowercase().contains(&wanted))
    })
}

pub(super) fn handle_key(ui: &mut Ui, state: &State, code: KeyCode, view: &View) -> Option<Action> {
    let (node, name) = ui.node(view).map(|node| (node.id, node.name.clone()))?;
    let selected = || shown(ui, state, view).nth(ui.row()).map(|object| object.address.clone());
    match code {
        KeyCode::Char('/') => ui.ask_for(Field::Search),
        KeyCode::Enter => {
            let address = selected()?;
            ui.ask(Text::AskValue, format!("{node} {name} {address}"), move |text| {
                Ok(Action::Ask(Purpose::Say, Request::Write { node, address, text, force: false }))
            })
        }
        KeyCode::Char('r') => say(Request::Read { node, addresses: vec![selected()?] }),
        KeyCode::Char('R') => {
            let address = selected()?;
            let index = address.split(':').next()?.to_owned();
            say(Request::Read { node, addresses: vec![index] })
        }
        KeyCode::Char('w') => {
            let address = selected()?;
            let is_watched = view.watched.iter().any(|watched| watched.node == node && watched.address == address);
            say(if is_watched {
                Request::Unwatch { node, address }
            } else {
                Request::Watch { node, address, every_ms: WATCHED_MS }
            })
        }
        KeyCode::Char('g') => say(Request::Plot { node, signals: vec![selected()?], every_ms: PLOTTED_MS }),
        KeyCode::Char('d') => say(Request::Compare { node, with: Other::Defaults }),
        KeyCode::Char('b') => Some(Action::Ask(Purpose::File(String::new()), Request::Backup { node })),
        KeyCode::Char('u') => ui.ask(Text::AskFile, format!("{node} {name}"), move |path| {
            let dcf = std::fs::read_to_string(path.trim()).map_err(|error| format!("{}: {error}", path.trim()))?;
            Ok(Action::Ask(Purpose::Say, Request::Restore { node, dcf }))
        }),
        _ => None,
    }
}

pub(super) fn draw(ui: &Ui, state: &State, frame: &mut Frame<'_>, area: Rect, view: &View) -> Vec<Listed> {
    let watched = view.watched.len().min(6) as u16;
    let [list, detail, below] = Layout::vertical([
        Constraint::Min(5),
        Constraint::Length(6),
        Constraint::Length(if watched > 0 { watched + 1 } else { 0 }),
    ])
    .areas(area);
    let objects: Vec<_> = shown(ui, state, view).collect();
    let columns = Columns::new([
        (ui.text(Text::Address), Constraint::Length(8)),
        (ui.text(Text::Name), Constraint::Fill(3)),
        (ui.text(Text::Value), Constraint::Fill(2)),
        (ui.text(Text::Default), Constraint::Fill(1)),
        (ui.text(Text::Limits), Constraint::Fill(1)),
        (ui.text(Text::Access), Constraint::Length(7)),
    ]);
    let selected = Some(ui.row()).filter(|_| !objects.is_empty());
    let listed = columns.draw(frame, list, selected, objects.iter(), |object| {
        let value = object.value.as_ref();
        let differs = value.is_some_and(|value| object.default.as_ref().is_some_and(|default| *default != value.text));
        let mark = match value {
            Some(value) if value.is_error => FAILED,
            _ if differs => DIFFERS,
            _ => "",
        };
        Row::new([
            object.address.clone(),
            title(object),
            value.map_or_else(String::new, |value| format!("{mark}{}", value.text)),
            object.default.clone().unwrap_or_default(),
            limits(object),
            object.access.clone(),
        ])
        .style(if differs { Style::new().bold() } else { Style::new() })
    });
    if objects.is_empty() {
        let empty = if state.search.is_empty() { ui.text(Text::NoSheet) } else { "0" };
        frame.render_widget(Line::from(empty).dim(), list.centered_vertically(Constraint::Length(1)));
    }

    let node = ui.node(view).map_or_else(String::new, |node| format!(" {} {} ", node.id, node.name));
    let block = Block::bordered().title(node);
    let text = objects.get(ui.row()).map(|object| details(ui, object)).unwrap_or_default();
    frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: false }).block(block), detail);
    draw_watched(ui, frame, below, view);
    vec![listed]
}

fn title(object: &Object) -> String {
    if object.name == object.object { object.name.clone() } else { format!("{}, {}", object.object, object.name) }
}

fn limits(object: &Object) -> String {
    match (&object.low, &object.high) {
        (None, None) => String::new(),
        (low, high) => format!("{}..{}", low.as_deref().unwrap_or_default(), high.as_deref().unwrap_or_default()),
    }
}

fn details(ui: &Ui, object: &Object) -> Vec<Line<'static>> {
    let mut lines = vec![Line::from(format!("{}  {}  {}", title(object), object.data_type, object.group)).bold()];
    if !object.choices.is_empty() {
        lines.push(Line::from(format!("{}: {}", ui.text(Text::Choices), object.choices.join(", "))));
    }
    lines.extend(object.help.clone().map(Line::from));
    if let Some(value) = &object.value {
        lines.push(Line::from(format!("{} [{}] {:.3} s", value.text, value.raw, value.at)));
    }
    lines
}

fn draw_watched(ui: &Ui, frame: &mut Frame<'_>, area: Rect, view: &View) {
    let rows = view.watched.iter().map(|watched| {
        let (low, high) =
            watched.bounds.map_or_else(Default::default, |(low, high)| (low.to_string(), high.to_string()));
        let value = watched.value.as_ref().map_or_else(String::new, |value| value.text.clone());
        let value = value + &ago(watched.seen, view.time);
        Row::new([watched.node.to_string(), watched.address.clone(), watched.name.clone(), value, low, high])
    });
    let widths = [
        Constraint::Length(4),
        Constraint::Length(8),
        Constraint::Fill(2),
        Constraint::Fill(2),
        Constraint::Fill(1),
        Constraint::Fill(1),
    ];
    let head = [Text::Id, Text::Address, Text::Watched, Text::Value, Text::Lowest, Text::Highest];
    frame.render_widget(Table::new(rows, widths).header(Row::new(head.map(|text| ui.text(text))).bold()), area);
}
