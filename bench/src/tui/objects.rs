//! The objects of a node.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style, Stylize};
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph, Row, Table, TableState, Wrap};

use super::screen::{Action, Purpose, Screen, first_shown, say};
use super::text::Text;
use crate::command::{Command, Other};
use crate::view::{Object, View};

/// How often a watched entry is read.
const WATCHED_MS: u32 = 250;

/// How often a plotted entry is read.
const PLOTTED_MS: u32 = 50;

/// The entries of a node, and which of them are shown.
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
}

/// The entries that contain what is searched, in their names, addresses, values or groups.
pub(super) fn shown<'a>(screen: &'a Screen, view: &View) -> impl Iterator<Item = &'a Object> + use<'a> {
    let wanted = screen.objects.search.to_lowercase();
    // Those of the node before are no entries of this one.
    let are_of_node = screen.node(view).is_some_and(|node| node.id == screen.objects.node);
    screen.objects.objects.iter().filter(move |_| are_of_node).filter(move |object| {
        let value = object.value.as_ref().map_or("", |value| &value.text);
        [&*object.object, &object.name, &object.address, value, &object.group]
            .iter()
            .any(|text| text.to_lowercase().contains(&wanted))
    })
}

pub(super) fn handle_key(screen: &mut Screen, code: KeyCode, view: &View) -> Option<Action> {
    let (node, name) = screen.node(view).map(|node| (node.id, node.name.clone()))?;
    let selected = || shown(screen, view).nth(screen.row()).map(|object| object.address.clone());
    match code {
        KeyCode::Char('/') => screen.change(Text::AskSearch, |screen, typed| {
            screen.objects.search = typed;
            *screen.row_mut() = 0;
            Ok(())
        }),
        KeyCode::Enter => {
            let address = selected()?;
            screen.ask(Text::AskValue, format!("{node} {name} {address}"), move |text| {
                Ok(Action::Ask(Purpose::Say, Command::Write { node, address, text, force: false }))
            })
        }
        KeyCode::Char('r') => say(Command::Read { node, addresses: vec![selected()?] }),
        KeyCode::Char('R') => {
            let address = selected()?;
            let index = address.split(':').next()?.to_owned();
            say(Command::Read { node, addresses: vec![index] })
        }
        KeyCode::Char('w') => {
            let address = selected()?;
            let is_watched = view.watched.iter().any(|watched| watched.node == node && watched.address == address);
            say(if is_watched {
                Command::Unwatch { node, address }
            } else {
                Command::Watch { node, address, every_ms: WATCHED_MS }
            })
        }
        KeyCode::Char('g') => say(Command::Plot { node, signals: vec![selected()?], every_ms: PLOTTED_MS }),
        KeyCode::Char('d') => say(Command::Compare { node, with: Other::Defaults }),
        KeyCode::Char('b') => Some(Action::Ask(Purpose::File(String::new()), Command::Backup { node })),
        KeyCode::Char('u') => screen.ask(Text::AskFile, format!("{node} {name}"), move |path| {
            let dcf = std::fs::read_to_string(path.trim()).map_err(|error| format!("{}: {error}", path.trim()))?;
            Ok(Action::Ask(Purpose::Say, Command::Restore { node, dcf }))
        }),
        _ => None,
    }
}

pub(super) fn draw(screen: &Screen, frame: &mut Frame<'_>, area: Rect, view: &View) {
    let watched = view.watched.len().min(6) as u16;
    let [list, detail, below] = Layout::vertical([
        Constraint::Min(5),
        Constraint::Length(6),
        Constraint::Length(if watched > 0 { watched + 1 } else { 0 }),
    ])
    .areas(area);
    let objects: Vec<_> = shown(screen, view).collect();
    let head = [Text::Address, Text::Name, Text::Value, Text::Default, Text::Limits, Text::Access];
    let lines = usize::from(list.height.saturating_sub(1));
    let first = first_shown(screen.row(), lines);
    let rows = objects.iter().skip(first).take(lines).map(|object| {
        let value = object.value.as_ref();
        let differs = value.is_some_and(|value| object.default.as_ref().is_some_and(|default| *default != value.text));
        Row::new([
            object.address.clone(),
            title(object),
            value.map_or_else(String::new, |value| value.text.clone()),
            object.default.clone().unwrap_or_default(),
            limits(object),
            object.access.clone(),
        ])
        .style(if differs { Style::new().bold() } else { Style::new() })
    });
    let widths = [
        Constraint::Length(8),
        Constraint::Fill(3),
        Constraint::Fill(2),
        Constraint::Fill(1),
        Constraint::Fill(1),
        Constraint::Length(7),
    ];
    let table = Table::new(rows, widths)
        .header(Row::new(head.map(|text| screen.text(text))).bold())
        .row_highlight_style(Modifier::REVERSED);
    let selected = Some(screen.row() - first).filter(|_| !objects.is_empty());
    frame.render_stateful_widget(table, list, &mut TableState::new().with_selected(selected));
    if objects.is_empty() {
        let empty = if screen.objects.search.is_empty() { screen.text(Text::NoSheet) } else { "0" };
        frame.render_widget(Line::from(empty).dim(), list.centered_vertically(Constraint::Length(1)));
    }

    let node = screen.node(view).map_or_else(String::new, |node| format!(" {} {} ", node.id, node.name));
    let block = Block::bordered().title(node);
    let text = objects.get(screen.row()).map(|object| details(screen, object)).unwrap_or_default();
    frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: false }).block(block), detail);
    draw_watched(screen, frame, below, view);
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

fn details(screen: &Screen, object: &Object) -> Vec<Line<'static>> {
    let mut lines = vec![Line::from(format!("{}  {}  {}", title(object), object.data_type, object.group)).bold()];
    if !object.choices.is_empty() {
        lines.push(Line::from(format!("{}: {}", screen.text(Text::Choices), object.choices.join(", "))));
    }
    lines.extend(object.help.clone().map(Line::from));
    if let Some(value) = &object.value {
        lines.push(Line::from(format!("{} [{}] {:.3} s", value.text, value.raw, value.at)));
    }
    lines
}

fn draw_watched(screen: &Screen, frame: &mut Frame<'_>, area: Rect, view: &View) {
    let rows = view.watched.iter().map(|watched| {
        let (low, high) =
            watched.bounds.map_or_else(Default::default, |(low, high)| (low.to_string(), high.to_string()));
        let value = watched.value.as_ref().map_or_else(String::new, |value| value.text.clone());
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
    frame.render_widget(Table::new(rows, widths).header(Row::new(head.map(|text| screen.text(text))).bold()), area);
}
