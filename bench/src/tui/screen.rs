//! The screen as a state machine: keys and answers go in, requests come out.

use std::io::Write;

use ratatui::crossterm::event::{
    KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};
use ratatui::layout::Position;

use super::action::{Action, Purpose, say};
use super::notices::{Notices, words};
use super::prompt::{Field, Prompt, Then};
use super::tab::Tab;
use super::text::{Language, Text};
use super::ui::Ui;
use super::{bus, devices, drives, nodes, objects, pdos, plots, trace};
use crate::request::{Answer, Refused, Request};
use crate::view::View;

/// How many rows the mouse wheel scrolls.
const WHEEL: usize = 3;

/// The screen.
#[derive(Default)]
pub struct Screen {
    pub(super) ui: Ui,
    pub(super) notices: Notices,
    pub(super) has_help: bool,
    pub(super) objects: objects::State,
    pub(super) pdos: pdos::State,
    pub(super) trace: trace::State,
    pub(super) plots: plots::State,
}

impl Screen {
    /// The screen of the client with this number.
    #[must_use]
    pub fn new(client: u32, language: Language) -> Self {
        Screen { ui: Ui { language, client, ..Ui::default() }, ..Screen::default() }
    }

    /// Handles a key.
    pub fn handle_key(&mut self, key: KeyEvent, view: &View) -> Option<Action> {
        let action = self.press(key, view);
        // A held window lacks the points of a new curve.
        if let Some(Action::Ask(_, Request::Plot { .. })) = &action {
            self.plots.follow();
        }
        action
    }

    fn press(&mut self, key: KeyEvent, view: &View) -> Option<Action> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        self.ui.follow(view);
        if key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL) {
            return Some(Action::Leave);
        }
        // These keys stop, whatever is shown. In a prompt, the space belongs to the text.
        if key.code == KeyCode::F(12) || (key.code == KeyCode::Char(' ') && self.ui.prompt.is_none()) {
            (self.ui.prompt, self.has_help) = (None, false);
            self.notices.say(self.ui.text(Text::Stopping));
            return Some(Action::Ask(Purpose::Stop, Request::StopAll));
        }
        // Ctrl and Alt together are AltGr on some terminals. Some terminals send Ctrl-H for Backspace.
        let is_chord = key.modifiers.contains(KeyModifiers::CONTROL) != key.modifiers.contains(KeyModifiers::ALT);
        let code = match key.code {
            KeyCode::Char('h') if key.modifiers == KeyModifiers::CONTROL => KeyCode::Backspace,
            KeyCode::Char(_) if is_chord => return None,
            code => code,
        };
        if self.ui.prompt.is_some() {
            return self.answer(code, view);
        }
        if std::mem::take(&mut self.has_help) {
            return None;
        }
        let ui = &mut self.ui;
        match code {
            KeyCode::Char('q') => return Some(Action::Leave),
            KeyCode::Char('?') => self.has_help = true,
            KeyCode::Esc => self.notices.dismiss(view),
            KeyCode::Tab => ui.tab = ui.tab.further(1),
            KeyCode::BackTab => ui.tab = ui.tab.further(Tab::ALL.len() - 1),
            KeyCode::Char(digit @ '1'..='8') => ui.tab = Tab::ALL[digit as usize - '1' as usize],
            KeyCode::Char('h') if view.control.holder == Some(ui.client) => return say(Request::ReleaseControl),
            KeyCode::Char(control @ ('h' | 'H')) => return say(Request::TakeControl { force: control == 'H' }),
            KeyCode::F(5) => {
                let on = view.kept.recorded.is_none();
                return Some(Action::Ask(Purpose::File(String::new()), Request::Record { on }));
            }
            KeyCode::F(6) => {
                let kept = view.kept.clone();
                let names = [&kept.sequences[..], &kept.messages].concat().join(", ");
                return ui.ask(Text::AskSequence, names, move |typed| {
                    let name = typed.trim().to_owned();
                    let is_file = !kept.messages.contains(&name);
                    let text =
                        is_file.then(|| std::fs::read_to_string(&name).map_err(|error| format!("{name}: {error}")));
                    let text = text.transpose()?;
                    Ok(Action::Ask(Purpose::File(String::new()), Request::PlaySequence { name, text }))
                });
            }
            KeyCode::Char('[') => ui.select_node(view, -1),
            KeyCode::Char(']') => ui.select_node(view, 1),
            KeyCode::Char('l') if view.log.is_some() => {
                let stands = view.log.as_ref().is_some_and(|log| log.speed == 0.0);
                return say(Request::Play { speed: if stands { 1.0 } else { 0.0 } });
            }
            KeyCode::Left | KeyCode::Right if view.log.is_some() => {
                let log = view.log.as_ref()?;
                let step = log.seconds / 50.0 * if code == KeyCode::Left { -1.0 } else { 1.0 };
                return say(Request::Seek { seconds: (log.position + step).clamp(0.0, log.seconds) });
            }
            other => return self.handle_in_tab(other, view),
        }
        None
    }

    fn handle_in_tab(&mut self, code: KeyCode, view: &View) -> Option<Action> {
        let last = self.row_count(view).saturating_sub(1);
        let (ui, trace) = (&mut self.ui, &mut self.trace);
        let row = match code {
            _ if ui.tab == Tab::Trace => return trace::handle_key(ui, trace, code, view),
            KeyCode::Up => ui.row().saturating_sub(1),
            KeyCode::Down => ui.row() + 1,
            KeyCode::PageUp => ui.row().saturating_sub(ui.lines()),
            KeyCode::PageDown => ui.row() + ui.lines(),
            KeyCode::Home => 0,
            KeyCode::End => last,
            other => {
                return match ui.tab {
                    Tab::Nodes => nodes::handle_key(ui, trace, other, view),
                    Tab::Objects => objects::handle_key(ui, &self.objects, other, view),
                    Tab::Pdos => pdos::handle_key(ui, &mut self.pdos, other, view),
                    Tab::Plots => plots::handle_key(ui, &mut self.plots, other, view),
                    Tab::Drives => drives::handle_key(ui, other, view),
                    Tab::Bus => bus::handle_key(ui, trace, other, view),
                    Tab::Devices => devices::handle_key(ui, other, view),
                    Tab::Trace => None,
                };
            }
        };
        self.select(row.min(last), view);
        None
    }

    fn select(&mut self, row: usize, view: &View) {
        match self.ui.tab {
            Tab::Trace => self.trace.mark(row, self.ui.lines()),
            Tab::Nodes => self.ui.node = view.nodes.get(row).map(|node| node.id),
            Tab::Drives => self.ui.drive = view.drives.get(row).map(|drive| drive.node),
            _ => {}
        }
        self.ui.set_row(row);
    }

    fn row_count(&self, view: &View) -> usize {
        match self.ui.tab {
            Tab::Nodes => view.nodes.len(),
            Tab::Objects => objects::shown(&self.ui, &self.objects, view).count(),
            Tab::Pdos => self.ui.node(view).map_or(0, |node| self.pdos.of(node.id).len()),
            Tab::Plots => self.plots.count(),
            Tab::Drives => view.drives.len(),
            Tab::Bus => bus::row_count(view),
            Tab::Devices => devices::rows(view).count(),
            Tab::Trace => self.trace.count(),
        }
    }

    /// Handles the mouse, which selects and scrolls, but gives no orders.
    pub fn handle_mouse(&mut self, mouse: MouseEvent, view: &View) {
        // A prompt keeps the selection that it is about.
        if self.ui.prompt.is_some() {
            return;
        }
        self.ui.follow(view);
        match mouse.kind {
            MouseEventKind::Down(MouseButton::Left) if self.has_help => self.has_help = false,
            MouseEventKind::Down(MouseButton::Left) => self.click(Position::new(mouse.column, mouse.row), view),
            MouseEventKind::ScrollUp | MouseEventKind::ScrollDown => {
                let code = if mouse.kind == MouseEventKind::ScrollUp { KeyCode::Up } else { KeyCode::Down };
                for _ in 0..WHEEL {
                    self.handle_in_tab(code, view);
                }
            }
            _ => {}
        }
    }

    fn click(&mut self, at: Position, view: &View) {
        if at.y == 0 {
            let mut x = 0;
            let tab = Tab::ALL.into_iter().find(|tab| {
                x += self.tab(*tab).chars().count();
                usize::from(at.x) < x
            });
            self.ui.tab = tab.unwrap_or(self.ui.tab);
            return;
        }
        if let Some(listed) = self.ui.listed.iter().find(|listed| listed.area.contains(at)) {
            let row = listed.first + usize::from(at.y - listed.area.y);
            if row < self.row_count(view) {
                self.select(row, view);
            }
        }
    }

    /// The title of a tab in the first line.
    pub(super) fn tab(&self, tab: Tab) -> String {
        let marks = if tab == self.ui.tab { ['[', ']'] } else { [' ', ' '] };
        format!("{}{} {}{}", marks[0], tab as usize + 1, self.ui.text(tab.title()), marks[1])
    }

    /// Takes pasted text in a prompt; elsewhere it is ignored, since it was not typed as keys.
    pub fn paste(&mut self, text: &str) {
        if let Some(prompt) = &mut self.ui.prompt {
            prompt.paste(text);
        }
    }

    /// Handles a key in a prompt.
    fn answer(&mut self, code: KeyCode, view: &View) -> Option<Action> {
        let prompt = self.ui.prompt.as_mut()?;
        match code {
            KeyCode::Esc => self.ui.prompt = None,
            KeyCode::Backspace => drop(prompt.typed.pop()),
            KeyCode::Char(character) => prompt.typed.push(character),
            KeyCode::Enter => {
                let Prompt { typed, then, .. } = self.ui.prompt.take()?;
                let answered = match then {
                    Then::Ask(ask) => ask(typed).map(Some),
                    Then::Set(field) => self.set(field, typed, view).map(|()| None),
                };
                match answered {
                    Ok(action) => return action,
                    Err(why) => self.notices.complain(why),
                }
            }
            _ => {}
        }
        None
    }

    fn set(&mut self, field: Field, typed: String, view: &View) -> Result<(), String> {
        let row = self.ui.row();
        match field {
            Field::Search => {
                self.ui.set_row(0);
                self.objects.search(typed);
            }
            Field::Text | Field::Services | Field::Nodes => self.trace.set(field, typed),
            Field::Object => self.pdos.add_object(row, typed),
            Field::Timing => self.pdos.set_timing(row, typed),
            Field::Trigger => return self.plots.arm(row, &typed, view.time),
        }
        Ok(())
    }

    /// The request that the tab needs to be drawn; repeated when the last answer has come.
    #[must_use]
    pub fn wants(&self, view: &View) -> Option<(Purpose, Request)> {
        let node = self.ui.node.or_else(|| view.nodes.first().map(|node| node.id));
        match self.ui.tab {
            Tab::Pdos if self.pdos.node != node => Some((Purpose::Pdos(node?), Request::Pdos { node: node? })),
            Tab::Pdos => Some((Purpose::Seen(node?), Request::Seen { node: node?, addresses: self.pdos.addresses() })),
            Tab::Objects => Some((Purpose::Objects(node?), Request::Objects { node: node? })),
            Tab::Trace => Some((Purpose::Trace, self.trace.request())),
            Tab::Plots => Some((Purpose::Plots, self.plots.request(view.time)?)),
            _ => None,
        }
    }

    /// Handles the answer to a request.
    pub fn take(&mut self, purpose: Purpose, result: Result<Answer, Refused>) {
        let text = |text| self.ui.text(text);
        match (purpose, result) {
            (Purpose::Objects(node), Ok(Answer::Objects(objects))) => self.objects.set(node, objects),
            (Purpose::Objects(node), Err(_)) => self.objects.set(node, Vec::new()),
            (Purpose::Pdos(node), Ok(Answer::Pdos(pdos))) => self.pdos.set(node, pdos),
            (Purpose::Pdos(node), Err(refused)) => {
                self.pdos.set(node, Vec::new());
                self.notices.complain(words(&refused));
            }
            (Purpose::Seen(node), Ok(Answer::Values(values))) => self.pdos.see(node, &values),
            // Ignore it: reading the PDOs reports the same.
            (Purpose::Seen(_), _) => {}
            (Purpose::Trace, Ok(Answer::Frames(frames))) => self.trace.take(frames),
            (Purpose::Plots, Ok(Answer::Curves(curves))) => self.plots.take(curves),
            (Purpose::File(path), Ok(Answer::File { name, bytes })) => {
                let path = if path.is_empty() { unused(name) } else { path };
                // Never replace a file: it may be the log that is shown.
                let file = std::fs::File::create_new(&path);
                match file.and_then(|mut file| file.write_all(&bytes)) {
                    Ok(()) => self.notices.say(format!("{path} {}", text(Text::Written))),
                    Err(error) => self.notices.complain(format!("{path}: {error}")),
                }
            }
            (Purpose::Stop, Ok(_)) => self.notices.say_stopped(text(Text::Stopped)),
            (Purpose::Stop | Purpose::StopDrive, Err(refused)) => {
                self.notices.alarm(format!("{}: {}", text(Text::StopFailed), words(&refused)));
            }
            (Purpose::Mapped(node), Ok(Answer::Pdos(pdos))) => {
                self.pdos.replace(node, pdos);
                self.notices.say(text(Text::Written));
            }
            (_, Ok(answer)) => self.notices.say(self.sentence(answer)),
            (_, Err(refused)) => self.notices.complain(words(&refused)),
        }
    }

    fn sentence(&self, answer: Answer) -> String {
        match answer {
            Answer::Values(values) => {
                let values = values.iter().map(|value| format!("{} = {}", value.address, value.text));
                values.collect::<Vec<_>>().join(", ")
            }
            Answer::Objections(objections) if objections.is_empty() => self.ui.text(Text::Fits).to_owned(),
            Answer::Objections(objections) => objections.join("; "),
            Answer::Differences(found) => {
                let differences =
                    found.iter().map(|it| format!("{} {}: {} / {}", it.address, it.name, it.here, it.there));
                let text = differences.collect::<Vec<_>>().join("; ");
                if text.is_empty() { "0".to_owned() } else { text }
            }
            _ => self.ui.text(Text::Done).to_owned(),
        }
    }
}

/// A file name that is not used yet, because a recording cannot be fetched again.
fn unused(name: String) -> String {
    let mut numbered = (2..).map(|number| format!("{number}-{name}"));
    let is_there = |name: &str| std::path::Path::new(name).exists();
    if is_there(&name) { numbered.find(|name| !is_there(name)).unwrap_or_default() } else { name.clone() }
}
