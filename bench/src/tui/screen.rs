//! The terminal's face as a state machine: keys and answers go in, commands come out, and it draws itself.

use std::io::Write;

use ratatui::Frame;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph, Wrap};

use super::text::{Language, Text};
use super::{bus, devices, drives, nodes, objects, pdos, plots, trace};
use crate::command::{Answer, Command, Refused};
use crate::view::{self, View};

/// How many lines at the foot of the screen say what was refused, and why.
const MOST_LINES: u16 = 4;

/// The rooms of the bench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Room {
    #[default]
    Nodes,
    Objects,
    Pdos,
    Trace,
    Plots,
    Drives,
    Bus,
    Devices,
}

impl Room {
    const ALL: [Room; 8] =
        [Room::Nodes, Room::Objects, Room::Pdos, Room::Trace, Room::Plots, Room::Drives, Room::Bus, Room::Devices];

    const fn title(self) -> Text {
        match self {
            Room::Nodes => Text::Nodes,
            Room::Objects => Text::Objects,
            Room::Pdos => Text::Pdos,
            Room::Trace => Text::Trace,
            Room::Plots => Text::Plots,
            Room::Drives => Text::Drives,
            Room::Bus => Text::Bus,
            Room::Devices => Text::Devices,
        }
    }

    const fn help(self) -> Text {
        match self {
            Room::Nodes => Text::HelpNodes,
            Room::Objects => Text::HelpObjects,
            Room::Pdos => Text::HelpPdos,
            Room::Trace => Text::HelpTrace,
            Room::Plots => Text::HelpPlots,
            Room::Drives => Text::HelpDrives,
            Room::Bus => Text::HelpBus,
            Room::Devices => Text::HelpDevices,
        }
    }
}

/// What a key asks for.
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// To leave.
    Leave,
    /// To carry a command out.
    Ask(Purpose, Command),
}

/// What an answer is for.
#[derive(Clone, Debug, PartialEq)]
pub enum Purpose {
    /// To be said.
    Say,
    /// To say whether all drives have stopped.
    Stop,
    /// To be shown: the PDOs of this node that were written.
    Mapped(u8),
    /// To be shown: the entries of this node.
    Objects(u8),
    /// The PDOs of this node.
    Pdos(u8),
    /// What was seen of the entries in the PDOs of this node.
    Seen(u8),
    /// Rows of the trace.
    Trace,
    /// Curves.
    Plots,
    /// A file of this name; that of the answer if it is empty.
    File(String),
}

/// A question in the last line.
struct Prompt {
    title: Text,
    /// What it is about: `5 feeder 6081:00`.
    of: String,
    typed: String,
    then: Then,
}

type Change = Box<dyn FnOnce(&mut Screen, String) -> Result<(), String>>;

/// What becomes of the answer to a question.
enum Then {
    /// It knows what it is about: the selected row may be another one by then.
    Ask(Box<dyn FnOnce(String) -> Result<Action, String>>),
    Change(Change),
}

/// The terminal's face.
#[derive(Default)]
pub struct Screen {
    pub(super) language: Language,
    pub(super) face: u32,
    pub(super) room: Room,
    /// The selected node, and the selected row of each room.
    pub(super) node: Option<u8>,
    pub(super) rows: [usize; 8],
    prompt: Option<Prompt>,
    /// What was said last, and whether it is an error.
    said: Option<(bool, String)>,
    /// Why a stop has failed: it stays until somebody has seen it.
    alarm: Option<String>,
    /// The number of the last job whose end was seen.
    seen_job: u32,
    has_help: bool,
    pub(super) objects: objects::State,
    pub(super) pdos: pdos::State,
    pub(super) trace: trace::State,
    pub(super) plots: plots::State,
}

impl Screen {
    /// A face that has this number.
    #[must_use]
    pub fn new(face: u32, language: Language) -> Self {
        Screen { language, face, ..Screen::default() }
    }

    /// Handles a key.
    pub fn handle_key(&mut self, key: KeyEvent, view: &View) -> Option<Action> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        if key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL) {
            return Some(Action::Leave);
        }
        // Whatever else is shown: this stops. A space may belong to what is typed.
        if key.code == KeyCode::F(12) || (key.code == KeyCode::Char(' ') && self.prompt.is_none()) {
            (self.prompt, self.has_help, self.alarm) = (None, false, None);
            self.said = Some((false, self.text(Text::Stopping).to_owned()));
            return Some(Action::Ask(Purpose::Stop, Command::StopAll));
        }
        // Both together are AltGr on some terminals. Some send Ctrl-H for Backspace.
        let is_chord = key.modifiers.contains(KeyModifiers::CONTROL) != key.modifiers.contains(KeyModifiers::ALT);
        let code = match key.code {
            KeyCode::Char('h') if key.modifiers == KeyModifiers::CONTROL => KeyCode::Backspace,
            KeyCode::Char(_) if is_chord => return None,
            code => code,
        };
        if self.prompt.is_some() {
            return self.answer(code);
        }
        if std::mem::take(&mut self.has_help) {
            return None;
        }
        let last = Room::ALL.len() - 1;
        let place = self.room as usize;
        match code {
            KeyCode::Char('q') => return Some(Action::Leave),
            KeyCode::Char('?') => self.has_help = true,
            KeyCode::Esc => self.dismiss(view),
            KeyCode::Tab => self.room = Room::ALL[if place == last { 0 } else { place + 1 }],
            KeyCode::BackTab => self.room = Room::ALL[if place == 0 { last } else { place - 1 }],
            KeyCode::Char(digit @ '1'..='8') => self.room = Room::ALL[digit as usize - '1' as usize],
            KeyCode::Char('h') if view.hands.holder == Some(self.face) => return say(Command::ReleaseHands),
            KeyCode::Char(hands @ ('h' | 'H')) => return say(Command::TakeHands { force: hands == 'H' }),
            KeyCode::Char('[') => self.select_node(view, -1),
            KeyCode::Char(']') => self.select_node(view, 1),
            KeyCode::Char('l') if view.log.is_some() => {
                let stands = view.log.as_ref().is_some_and(|log| log.speed == 0.0);
                return say(Command::Play { speed: if stands { 1.0 } else { 0.0 } });
            }
            KeyCode::Left | KeyCode::Right if view.log.is_some() => {
                let log = view.log.as_ref()?;
                let step = log.seconds / 50.0 * if code == KeyCode::Left { -1.0 } else { 1.0 };
                return say(Command::Seek { seconds: (log.position + step).clamp(0.0, log.seconds) });
            }
            other => return self.handle_in_room(other, view),
        }
        None
    }

    /// What was pasted is text, and no keys: a paste orders nothing.
    pub fn paste(&mut self, text: &str) {
        if let Some(prompt) = &mut self.prompt {
            prompt.typed.extend(text.chars().filter(|character| !character.is_control()));
        }
    }

    /// Somebody has seen what is said, from the last on.
    fn dismiss(&mut self, view: &View) {
        if self.said.take().is_none() && self.alarm.take().is_none() {
            self.seen_job = view.jobs.iter().map(|job| job.number).max().unwrap_or_default();
        }
    }

    fn handle_in_room(&mut self, code: KeyCode, view: &View) -> Option<Action> {
        if self.room == Room::Trace {
            return trace::handle_key(self, code, view);
        }
        let count = self.row_count(view);
        let row = &mut self.rows[self.room as usize];
        match code {
            KeyCode::Up => *row = row.saturating_sub(1),
            KeyCode::Down => *row = (*row + 1).min(count.saturating_sub(1)),
            KeyCode::PageUp => *row = row.saturating_sub(10),
            KeyCode::PageDown => *row = (*row + 10).min(count.saturating_sub(1)),
            KeyCode::Home => *row = 0,
            KeyCode::End => *row = count.saturating_sub(1),
            other => {
                return match self.room {
                    Room::Nodes => nodes::handle_key(self, other, view),
                    Room::Objects => objects::handle_key(self, other, view),
                    Room::Pdos => pdos::handle_key(self, other, view),
                    Room::Plots => plots::handle_key(self, other, view),
                    Room::Drives => drives::handle_key(self, other, view),
                    Room::Devices => devices::handle_key(self, other, view),
                    Room::Bus => bus::handle_key(self, other, view),
                    Room::Trace => None,
                };
            }
        }
        if self.room == Room::Nodes {
            self.node = view.nodes.get(self.rows[0]).map(|node| node.id);
        }
        None
    }

    fn row_count(&self, view: &View) -> usize {
        match self.room {
            Room::Nodes => view.nodes.len(),
            Room::Objects => objects::shown(self, view).count(),
            Room::Pdos => self.node(view).map_or(0, |node| self.pdos.of(node.id).len()),
            Room::Drives => view.drives.len(),
            Room::Bus => view.bus.ids.len(),
            Room::Devices => devices::rows(view).count(),
            Room::Trace | Room::Plots => 0,
        }
    }

    fn select_node(&mut self, view: &View, by: isize) {
        let place = view.nodes.iter().position(|node| Some(node.id) == self.node).unwrap_or(0);
        let count = view.nodes.len().max(1) as isize;
        let place = (place as isize + by).rem_euclid(count) as usize;
        self.node = view.nodes.get(place).map(|node| node.id);
        self.rows = [0; 8];
        self.rows[0] = place;
    }

    /// A key while a question is asked.
    fn answer(&mut self, code: KeyCode) -> Option<Action> {
        let prompt = self.prompt.as_mut()?;
        match code {
            KeyCode::Esc => self.prompt = None,
            KeyCode::Backspace => drop(prompt.typed.pop()),
            KeyCode::Char(character) => prompt.typed.push(character),
            KeyCode::Enter => {
                let Prompt { typed, then, .. } = self.prompt.take()?;
                match then {
                    Then::Ask(ask) => match ask(typed) {
                        Ok(action) => return Some(action),
                        Err(why) => self.said = Some((true, why)),
                    },
                    Then::Change(change) => {
                        if let Err(why) = change(self, typed) {
                            self.said = Some((true, why));
                        }
                    }
                }
            }
            _ => {}
        }
        None
    }

    /// Asks in the last line for what a command about something needs.
    pub(super) fn ask(
        &mut self,
        title: Text,
        of: String,
        then: impl FnOnce(String) -> Result<Action, String> + 'static,
    ) -> Option<Action> {
        self.prompt = Some(Prompt { title, of, typed: String::new(), then: Then::Ask(Box::new(then)) });
        None
    }

    /// Asks in the last line for what changes the screen alone.
    pub(super) fn change(
        &mut self,
        title: Text,
        then: impl FnOnce(&mut Screen, String) -> Result<(), String> + 'static,
    ) -> Option<Action> {
        let then = Then::Change(Box::new(then));
        self.prompt = Some(Prompt { title, of: String::new(), typed: String::new(), then });
        None
    }

    /// What the room needs to be shown: asked again when the answer to the last one is there.
    #[must_use]
    pub fn wants(&self, view: &View) -> Option<(Purpose, Command)> {
        let node = self.node.or_else(|| view.nodes.first().map(|node| node.id));
        match self.room {
            Room::Objects => Some((Purpose::Objects(node?), Command::Objects { node: node? })),
            Room::Pdos if self.pdos.node != node => Some((Purpose::Pdos(node?), Command::Pdos { node: node? })),
            Room::Pdos => Some((Purpose::Seen(node?), Command::Seen { node: node?, addresses: self.pdos.addresses() })),
            Room::Trace => Some((Purpose::Trace, self.trace.request())),
            Room::Plots => Some((Purpose::Plots, self.plots.request(view.time))),
            _ => None,
        }
    }

    /// Takes the answer to a command.
    pub fn take(&mut self, purpose: Purpose, result: Result<Answer, Refused>) {
        match (purpose, result) {
            (Purpose::Objects(node), Ok(Answer::Objects(objects))) => self.objects.set(node, objects),
            (Purpose::Objects(node), Err(_)) => self.objects.set(node, Vec::new()),
            (Purpose::Pdos(node), Ok(Answer::Pdos(pdos))) => self.pdos.set(node, pdos),
            (Purpose::Pdos(node), Err(refused)) => {
                self.pdos.set(node, Vec::new());
                self.said = Some((true, words(&refused)));
            }
            (Purpose::Seen(node), Ok(Answer::Values(values))) => self.pdos.see(node, &values),
            // It says nothing that the reading of the PDOs does not say.
            (Purpose::Seen(_), _) => {}
            (Purpose::Trace, Ok(Answer::Frames(frames))) => self.trace.take(frames),
            (Purpose::Plots, Ok(Answer::Curves(curves))) => self.plots.take(curves),
            (Purpose::File(path), Ok(Answer::File { name, bytes })) => {
                let path = if path.is_empty() { name } else { path };
                // It may be the very log that is shown.
                let file = std::fs::File::create_new(&path);
                self.said = Some(match file.and_then(|mut file| file.write_all(&bytes)) {
                    Ok(()) => (false, format!("{path} {}", self.text(Text::Written))),
                    Err(error) => (true, format!("{path}: {error}")),
                });
            }
            (Purpose::Stop, Ok(_)) => self.said = Some((false, self.text(Text::Stopped).to_owned())),
            (Purpose::Stop, Err(refused)) => {
                self.said = None;
                self.alarm = Some(format!("{}: {}", self.text(Text::StopFailed), words(&refused)));
            }
            (Purpose::Mapped(node), Ok(Answer::Pdos(pdos))) => {
                self.pdos.replace(node, pdos);
                self.said = Some((false, self.text(Text::Written).to_owned()));
            }
            (_, Ok(answer)) => self.said = Some((false, self.sentence(answer))),
            (_, Err(refused)) => self.said = Some((true, words(&refused))),
        }
    }

    fn sentence(&self, answer: Answer) -> String {
        match answer {
            Answer::Values(values) => {
                let values = values.iter().map(|value| format!("{} = {}", value.address, value.text));
                values.collect::<Vec<_>>().join(", ")
            }
            Answer::Objections(objections) if objections.is_empty() => self.text(Text::Fits).to_owned(),
            Answer::Objections(objections) => objections.join("; "),
            Answer::Differences(found) => {
                let differences =
                    found.iter().map(|it| format!("{} {}: {} / {}", it.address, it.name, it.here, it.there));
                let text = differences.collect::<Vec<_>>().join("; ");
                if text.is_empty() { "0".to_owned() } else { text }
            }
            _ => self.text(Text::Done).to_owned(),
        }
    }

    pub(super) fn text(&self, text: Text) -> &'static str {
        text.of(self.language)
    }

    /// The selected node, or the first one.
    pub(super) fn node<'v>(&self, view: &'v View) -> Option<&'v view::Node> {
        let selected = view.nodes.iter().find(|node| Some(node.id) == self.node);
        selected.or_else(|| view.nodes.first())
    }

    pub(super) fn row(&self) -> usize {
        self.rows[self.room as usize]
    }

    pub(super) fn row_mut(&mut self) -> &mut usize {
        &mut self.rows[self.room as usize]
    }

    /// Goes to a row of the trace.
    pub(super) fn show_row(&mut self, number: u64) {
        self.room = Room::Trace;
        self.trace.hold_at(number);
    }

    /// Goes to another room.
    pub(super) fn enter(&mut self, room: Room) {
        self.room = room;
    }

    /// Draws it all.
    pub fn draw(&self, frame: &mut Frame<'_>, view: &View) {
        let (said, alarm) = (self.foot(), self.alarm(view));
        let height = |line: &Line<'_>| lines_of(&line.to_string(), frame.area().width.into()).min(MOST_LINES);
        let [head, body, jobs, alarms, foot, keys] = Layout::vertical([
            Constraint::Length(2),
            Constraint::Min(5),
            Constraint::Length(u16::from(self.job(view).is_some() || view.log.is_some())),
            Constraint::Length(alarm.as_ref().map_or(0, height)),
            Constraint::Length(height(&said)),
            Constraint::Length(1),
        ])
        .areas(frame.area());
        self.draw_head(frame, head, view);
        match self.room {
            Room::Nodes => nodes::draw(self, frame, body, view),
            Room::Objects => objects::draw(self, frame, body, view),
            Room::Pdos => pdos::draw(self, frame, body, view),
            Room::Trace => trace::draw(self, frame, body, view),
            Room::Plots => plots::draw(self, frame, body, view),
            Room::Drives => drives::draw(self, frame, body, view),
            Room::Bus => bus::draw(self, frame, body, view),
            Room::Devices => devices::draw(self, frame, body, view),
        }
        self.draw_job(frame, jobs, view);
        if let Some(alarm) = alarm {
            frame.render_widget(Paragraph::new(alarm).wrap(Wrap { trim: false }), alarms);
        }
        frame.render_widget(Paragraph::new(said).wrap(Wrap { trim: false }), foot);
        let stop = self.text(if self.prompt.is_some() { Text::StopTyping } else { Text::Stop });
        let stop = Span::styled(format!(" {stop} "), Style::new().fg(Color::White).bg(Color::Red).bold());
        let line = Line::from(vec![stop, Span::raw(format!("  {}", self.text(Text::Help)))]);
        frame.render_widget(line, keys);
        if self.has_help {
            self.draw_help(frame);
        }
    }

    fn draw_head(&self, frame: &mut Frame<'_>, area: Rect, view: &View) {
        let [tabs, state] = Layout::vertical([Constraint::Length(1); 2]).areas(area);
        let mut spans = Vec::new();
        for (room, number) in Room::ALL.into_iter().zip(1..) {
            let style = if room == self.room { Modifier::REVERSED | Modifier::BOLD } else { Modifier::empty() };
            spans.push(Span::styled(format!(" {number} {} ", self.text(room.title())), style));
        }
        frame.render_widget(Line::from(spans), tabs);
        let (hands, style) = match view.hands.holder {
            None => (self.text(Text::HandsFree), Style::new()),
            Some(face) if face == self.face => (self.text(Text::HandsHere), Style::new().bold().yellow()),
            Some(_) => (self.text(Text::HandsThere), Style::new().magenta()),
        };
        let load = view.bus.load_percent.map_or_else(String::new, |load| format!("  {load:.0} %"));
        let is_active = view.bus.state == "error active";
        let state_style = if is_active { Style::new() } else { Style::new().red().bold() };
        let line = Line::from(vec![
            Span::styled(format!(" {}  ", view.bus.name), Modifier::BOLD),
            Span::styled(view.bus.state.clone(), state_style),
            Span::raw(format!("  {}/s{load}  ", view.bus.frames_per_second)),
            Span::styled(hands, style),
        ]);
        frame.render_widget(line, state);
    }

    /// The job under way, else the last one whose end nobody has seen.
    fn job<'v>(&self, view: &'v View) -> Option<&'v view::Job> {
        let under_way = view.jobs.iter().find(|job| job.is_success.is_none());
        let ended = || view.jobs.iter().max_by_key(|job| job.number).filter(|job| job.number > self.seen_job);
        under_way.or_else(ended)
    }

    fn draw_job(&self, frame: &mut Frame<'_>, area: Rect, view: &View) {
        if let Some(job) = self.job(view) {
            let percent = job.done.map_or_else(String::new, |done| format!("{:3.0} % ", done * 100.0));
            let line = match job.is_success {
                None => Line::from(format!(" {percent}{}: {}", job.name, job.text)).cyan(),
                Some(true) => Line::from(format!(" ✓ {}: {}", job.name, job.text)).green(),
                Some(false) => Line::from(format!(" ✗ {}: {}", job.name, job.text)).red(),
            };
            frame.render_widget(line, area);
        } else if let Some(log) = &view.log {
            let width = usize::from(area.width.saturating_sub(30));
            let place = (log.position / log.seconds.max(1e-9) * width as f64) as usize;
            let bar: String =
                (0..width).map(|at| if at == place.min(width.saturating_sub(1)) { '●' } else { '─' }).collect();
            frame.render_widget(Line::from(format!(" {:>9.3} / {:<9.3} s {bar}", log.position, log.seconds)), area);
        }
    }

    /// A stop that has failed, or a drive that may be moving: it is shown in every room.
    fn alarm(&self, view: &View) -> Option<Line<'static>> {
        let moving =
            || view.drives.iter().find_map(|drive| drive.ending.as_ref().filter(|ending| ending.may_be_moving));
        let text = self.alarm.clone().or_else(|| moving().map(|ending| ending.text.clone()))?;
        Some(Line::from(format!(" !! {text}")).bold().red().reversed())
    }

    fn foot(&self) -> Line<'static> {
        match (&self.prompt, &self.said) {
            (Some(Prompt { title, of, typed, .. }), _) => {
                let of = if of.is_empty() { String::new() } else { format!("{of}: ") };
                Line::from(format!(" {of}{}: {typed}▏", self.text(*title))).bold()
            }
            (None, Some((true, text))) => Line::from(format!(" ! {text}")).red(),
            (None, Some((false, text))) => Line::from(format!(" {text}")).green(),
            (None, None) => Line::from(format!(" {}", self.text(self.room.help()))).dim(),
        }
    }

    fn draw_help(&self, frame: &mut Frame<'_>) {
        let area = frame.area().centered(Constraint::Percentage(90), Constraint::Percentage(80));
        let mut lines = vec![Line::from(self.text(Text::HelpAll)), Line::default()];
        for room in Room::ALL {
            lines.push(Line::from(self.text(room.title())).bold());
            lines.push(Line::from(self.text(room.help())));
        }
        let help = Paragraph::new(lines).wrap(Wrap { trim: false }).block(Block::bordered().title(" ? "));
        frame.render_widget(Clear, area);
        frame.render_widget(help, area);
    }
}

/// How many lines a text takes, wrapped at words.
fn lines_of(text: &str, width: usize) -> u16 {
    let (mut lines, mut used, width) = (1, 0, width.max(1));
    for (word, place) in text.split(' ').zip(0..) {
        let length = word.chars().count();
        let space = usize::from(place > 0);
        if space > 0 && used + space + length > width {
            (lines, used) = (lines + 1, length);
        } else {
            used += space + length;
        }
        // A word may be longer than a line.
        while used > width {
            (lines, used) = (lines + 1, used - width);
        }
    }
    lines
}

/// Asks for a command whose answer is only said.
pub(super) fn say(command: Command) -> Option<Action> {
    Some(Action::Ask(Purpose::Say, command))
}

fn words(refused: &Refused) -> String {
    match &refused.remedy {
        Some(remedy) => format!("{} ({remedy})", refused.why),
        None => refused.why.clone(),
    }
}

/// The first of the rows that fit into so many lines, so that the selected one is among them.
pub(super) fn first_shown(selected: usize, lines: usize) -> usize {
    selected.saturating_sub(lines.saturating_sub(1))
}
