//! The tab with a node's PDOs, as bytes and bits.

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Row};

use super::action::{Action, Purpose};
use super::list::{Columns, Listed, WRONG};
use super::prompt::Field;
use super::text::Text;
use super::ui::Ui;
use crate::request::Request;
use crate::view::{Pdo, Value, View};

/// The colours of objects, used in turn.
const COLORS: [Color; 6] = [Color::Cyan, Color::Yellow, Color::Green, Color::Magenta, Color::Blue, Color::Red];

/// The PDOs of a node, and a mapping being edited.
#[derive(Default)]
pub(super) struct State {
    pub(super) node: Option<u8>,
    pdos: Vec<Pdo>,
    draft: Option<Draft>,
}

/// A mapping that is not written yet.
#[derive(Clone)]
struct Draft {
    pdo: String,
    objects: Vec<String>,
    transmission: Option<String>,
}

impl State {
    pub(super) fn set(&mut self, node: u8, pdos: Vec<Pdo>) {
        *self = State { node: Some(node), pdos, draft: None };
    }

    /// The PDOs, if they are of this node.
    pub(super) fn of(&self, node: u8) -> &[Pdo] {
        if self.node == Some(node) { &self.pdos } else { &[] }
    }

    /// Replaces PDOs of a node that were written.
    pub(super) fn replace(&mut self, node: u8, new: Vec<Pdo>) {
        if self.node != Some(node) {
            return;
        }
        self.draft = None;
        for new in new {
            if let Some(old) = self.pdos.iter_mut().find(|old| old.name == new.name) {
                *old = new;
            }
        }
    }

    /// The addresses of all mapped objects.
    pub(super) fn addresses(&self) -> Vec<String> {
        self.pdos.iter().flat_map(|pdo| &pdo.fields).map(|field| field.address.clone()).collect()
    }

    /// Updates values of mapped objects.
    pub(super) fn see(&mut self, node: u8, values: &[Value]) {
        if self.node != Some(node) {
            return;
        }
        for field in self.pdos.iter_mut().flat_map(|pdo| &mut pdo.fields) {
            if let Some(value) = values.iter().find(|value| value.address == field.address) {
                field.text = Some(value.text.clone());
            }
        }
    }

    /// Adds the typed object to the mapping of a PDO.
    pub(super) fn add_object(&mut self, place: usize, object: String) {
        if let Some(draft) = self.draft(place) {
            draft.objects.push(object);
        }
    }

    pub(super) fn set_timing(&mut self, place: usize, timing: String) {
        if let Some(draft) = self.draft(place) {
            draft.transmission = Some(timing);
        }
    }

    /// The mapping of a PDO being edited; starts with the present one.
    fn draft(&mut self, place: usize) -> Option<&mut Draft> {
        let pdo = self.pdos.get(place)?;
        if self.draft.as_ref().is_none_or(|draft| draft.pdo != pdo.name) {
            let objects = pdo.fields.iter().map(|field| field.address.clone()).collect();
            self.draft = Some(Draft { pdo: pdo.name.clone(), objects, transmission: None });
        }
        self.draft.as_mut()
    }
}

pub(super) fn handle_key(ui: &mut Ui, state: &mut State, code: KeyCode, view: &View) -> Option<Action> {
    let node = ui.node(view)?.id;
    let row = ui.row();
    match code {
        KeyCode::Char(_) | KeyCode::Delete | KeyCode::Backspace | KeyCode::Enter
            if code != KeyCode::Char('r') && state.of(node).is_empty() =>
        {
            None
        }
        KeyCode::Char('r') => Some(Action::Ask(Purpose::Pdos(node), Request::Pdos { node })),
        KeyCode::Char('a') => ui.ask_for(Field::Object),
        KeyCode::Char('t') => ui.ask_for(Field::Timing),
        KeyCode::Delete | KeyCode::Backspace => {
            state.draft(row)?.objects.pop();
            None
        }
        KeyCode::Char('c') | KeyCode::Enter => {
            let draft = state.draft(row)?;
            let Draft { pdo, objects, transmission } = draft.clone();
            let check = code == KeyCode::Char('c');
            Some(Action::Ask(Purpose::Mapped(node), Request::MapPdo { node, pdo, objects, transmission, check }))
        }
        _ => None,
    }
}

pub(super) fn draw(ui: &Ui, state: &State, frame: &mut Frame<'_>, area: Rect, view: &View) -> Vec<Listed> {
    let [list, detail] = Layout::horizontal([Constraint::Length(34), Constraint::Min(40)]).areas(area);
    let pdos = ui.node(view).map_or(&[][..], |node| state.of(node.id));
    let columns = Columns {
        head: [""; 4],
        widths: [Constraint::Length(7), Constraint::Length(5), Constraint::Length(10), Constraint::Fill(1)],
    };
    let listed = columns.draw(frame, list, Some(ui.row()), pdos.iter(), |pdo| {
        let rate = view.bus.ids.iter().find(|rate| rate.id == pdo.id);
        let rate = format!("{:>8.1}/s", rate.map_or(0.0, |rate| rate.per_second));
        let row = |mark| Row::new([pdo.name.clone(), format!("{}h", pdo.id), rate, mark]);
        match (&pdo.conflict, pdo.is_on) {
            (Some(_), _) => row(WRONG.to_owned()).red(),
            (None, true) => row(String::new()),
            (None, false) => row(ui.text(Text::Off).to_owned()).dim(),
        }
    });
    if let Some(pdo) = pdos.get(ui.row()) {
        let block = Block::bordered().title(format!(" {} ", pdo.name));
        let inner = block.inner(detail);
        frame.render_widget(block, detail);
        frame.render_widget(Paragraph::new(lines(ui, state, pdo)), inner);
    }
    vec![listed]
}

fn lines(ui: &Ui, state: &State, pdo: &Pdo) -> Vec<Line<'static>> {
    let mut lines = vec![Line::from(format!("{}h  {}", pdo.id, pdo.transmission))];
    let timer = pdo.event_timer_ms.filter(|ms| *ms > 0).map(|ms| format!("event timer {ms} ms"));
    lines.extend(timer.map(Line::from));
    lines.extend(pdo.conflict.clone().map(|conflict| Line::from(format!("{WRONG} {conflict}")).red()));
    lines.push(Line::from(ruler()).dim());
    lines.push(picture(pdo));
    for (field, place) in pdo.fields.iter().zip(0..) {
        let color = COLORS[place % COLORS.len()];
        let bits =
            format!("{:>3}-{:<3}", field.first_bit, u16::from(field.first_bit) + u16::from(field.bits).max(1) - 1);
        let text = field.text.clone().unwrap_or_default();
        lines.push(Line::from(vec![
            Span::styled(format!("{} ", letter(place)), Style::new().fg(color).bold()),
            Span::raw(format!("{bits} {} {} ", field.address, field.name)),
            Span::styled(text, Modifier::BOLD),
        ]));
    }
    if let Some(draft) = state.draft.as_ref().filter(|draft| draft.pdo == pdo.name) {
        let timing = draft.transmission.as_ref().map_or_else(String::new, |timing| format!(", {timing}"));
        lines.push(Line::default());
        lines.push(Line::from(format!("{}: {}{timing}", ui.text(Text::Carries), draft.objects.join(" "))).yellow());
    }
    lines
}

/// The line with byte numbers.
fn ruler() -> String {
    (0..8).map(|byte| format!("{byte:<9}")).collect()
}

/// A letter for each bit, from bit 0 on.
fn picture(pdo: &Pdo) -> Line<'static> {
    let mut spans = Vec::new();
    for bit in 0..64u16 {
        let covers = |field: &crate::view::PdoField| {
            let first = u16::from(field.first_bit);
            (first..first + u16::from(field.bits)).contains(&bit)
        };
        spans.push(match pdo.fields.iter().position(covers) {
            Some(place) => Span::styled(letter(place).to_string(), Style::new().fg(COLORS[place % COLORS.len()])),
            None => Span::raw("."),
        });
        if bit % 8 == 7 {
            spans.push(Span::raw(" "));
        }
    }
    Line::from(spans)
}

fn letter(place: usize) -> char {
    (b'a' + (place % 26) as u8) as char
}
