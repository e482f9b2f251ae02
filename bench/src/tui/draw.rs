//! Draws the terminal.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph, Wrap};

use super::list::WRONG;
use super::prompt::Prompt;
use super::screen::Screen;
use super::tab::Tab;
use super::text::Text;
use super::{bus, devices, drives, nodes, objects, pdos, plots, trace};
use crate::view::{Log, View};

/// The most lines at the bottom of the screen for a message.
const MOST_LINES: u16 = 4;

/// The controller's state on a healthy bus.
const ACTIVE: &str = "error active";

impl Screen {
    /// Draws everything.
    pub fn draw(&mut self, frame: &mut Frame<'_>, view: &View) {
        self.ui.follow(view);
        self.notices.follow(&self.ui, view);
        let width = usize::from(frame.area().width);
        let mut said = self.notices.lasting(&self.ui, view);
        said.push(self.foot());
        let heights: Vec<_> = said.iter().map(|line| lines_of(&line.to_string(), width).min(MOST_LINES)).collect();
        let [head, body, log, foot, keys] = Layout::vertical([
            Constraint::Length(2),
            Constraint::Min(5),
            Constraint::Length(u16::from(view.log.is_some())),
            Constraint::Length(heights.iter().sum()),
            Constraint::Length(1),
        ])
        .areas(frame.area());
        self.draw_head(frame, head, view);
        let ui = &self.ui;
        self.ui.listed = match ui.tab {
            Tab::Nodes => nodes::draw(ui, frame, body, view),
            Tab::Objects => objects::draw(ui, &self.objects, frame, body, view),
            Tab::Pdos => pdos::draw(ui, &self.pdos, frame, body, view),
            Tab::Trace => trace::draw(ui, &self.trace, frame, body, view),
            Tab::Plots => plots::draw(ui, &self.plots, frame, body, view),
            Tab::Drives => drives::draw(ui, frame, body, view),
            Tab::Bus => bus::draw(ui, frame, body, view),
            Tab::Devices => devices::draw(ui, frame, body, view),
        };
        if let Some(shown) = &view.log {
            draw_log(frame, log, shown);
        }
        let areas = Layout::vertical(heights.into_iter().map(Constraint::Length)).split(foot);
        for (line, area) in said.into_iter().zip(&*areas) {
            frame.render_widget(Paragraph::new(line).wrap(Wrap { trim: false }), *area);
        }
        let stop = self.ui.text(if self.ui.prompt.is_some() { Text::StopTyping } else { Text::Stop });
        let stop = Span::styled(format!(" {stop} "), Style::new().fg(Color::White).bg(Color::Red).bold());
        let line = Line::from(vec![stop, Span::raw(format!("  {}", self.ui.text(Text::Help)))]);
        frame.render_widget(line, keys);
        if self.has_help {
            self.draw_help(frame);
        }
    }

    fn draw_head(&self, frame: &mut Frame<'_>, area: Rect, view: &View) {
        let [tabs, state] = Layout::vertical([Constraint::Length(1); 2]).areas(area);
        let tab = |tab| {
            let is_here = tab == self.ui.tab;
            let style = if is_here { Modifier::REVERSED | Modifier::BOLD } else { Modifier::empty() };
            Span::styled(self.tab(tab), style)
        };
        frame.render_widget(Line::from_iter(Tab::ALL.map(tab)), tabs);
        let (control, style) = match view.control.holder {
            None => (self.ui.text(Text::ControlFree), Style::new()),
            Some(client) if client == self.ui.client => (self.ui.text(Text::ControlHere), Style::new().bold().yellow()),
            Some(_) => (self.ui.text(Text::ControlThere), Style::new().magenta()),
        };
        let load = view.bus.load_percent.map_or_else(String::new, |load| format!("  {load:.0} %"));
        let state_of_bus = match &*view.bus.state {
            ACTIVE => Span::raw(ACTIVE),
            other => Span::raw(format!("{WRONG}{other}")).red().bold(),
        };
        let line = Line::from(vec![
            Span::styled(format!(" {}  ", view.bus.name), Modifier::BOLD),
            state_of_bus,
            Span::raw(format!("  {}/s{load}  ", view.bus.frames_per_second)),
            Span::styled(control, style),
        ]);
        frame.render_widget(line, state);
    }

    /// The last line: the prompt, else the last message, else help on keys.
    fn foot(&self) -> Line<'static> {
        if let Some(Prompt { title, of, typed, .. }) = &self.ui.prompt {
            let of = if of.is_empty() { String::new() } else { format!("{of}: ") };
            return Line::from(format!(" {of}{title}: {typed}▏")).bold();
        }
        let help = || Line::from(format!(" {}", self.ui.tab.help(self.ui.language))).dim();
        self.notices.last().unwrap_or_else(help)
    }

    fn draw_help(&self, frame: &mut Frame<'_>) {
        let area = frame.area().centered(Constraint::Percentage(90), Constraint::Percentage(80));
        let mut lines = vec![Line::from(self.ui.text(Text::HelpAll)), Line::default()];
        // Begin with the current tab: a low screen has no space for all.
        for tab in (0..Tab::ALL.len()).map(|by| self.ui.tab.further(by)) {
            lines.push(Line::from(self.ui.text(tab.title())).bold());
            lines.push(Line::from(tab.help(self.ui.language)));
        }
        let help = Paragraph::new(lines).wrap(Wrap { trim: false }).block(Block::bordered().title(" ? "));
        frame.render_widget(Clear, area);
        frame.render_widget(help, area);
    }
}

/// Draws the position in a log.
fn draw_log(frame: &mut Frame<'_>, area: Rect, log: &Log) {
    let width = usize::from(area.width.saturating_sub(30));
    let place = (log.position / log.seconds.max(1e-9) * width as f64) as usize;
    let bar: String = (0..width).map(|at| if at == place.min(width.saturating_sub(1)) { '●' } else { '─' }).collect();
    frame.render_widget(Line::from(format!(" {:>9.3} / {:<9.3} s {bar}", log.position, log.seconds)), area);
}

/// The number of lines of a text, wrapped at words.
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
