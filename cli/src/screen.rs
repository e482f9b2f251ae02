//! A full-screen display that is redrawn until the user leaves it.

use std::io::{IsTerminal, stdin, stdout};
use std::time::Duration as WallDuration;

use ratatui::crossterm::event::{Event, KeyCode, KeyEventKind, KeyModifiers, poll, read};
use ratatui::text::{Line, Text};
use ratatui::widgets::{Paragraph, Widget};
use ratatui::{DefaultTerminal, Frame};

use crate::output::{Failure, reason};

/// Takes the whole terminal, and gives it back when dropped.
pub(crate) struct Screen {
    terminal: DefaultTerminal,
}

impl Screen {
    /// Whether both stdin and stdout are terminals.
    pub(crate) fn is_possible() -> bool {
        stdin().is_terminal() && stdout().is_terminal()
    }

    /// Takes the terminal, if there is one.
    pub(crate) fn take() -> Result<Option<Self>, Failure> {
        if !Screen::is_possible() {
            return Ok(None);
        }
        let terminal = ratatui::try_init().map_err(failure)?;
        Ok(Some(Screen { terminal }))
    }

    pub(crate) fn draw(&mut self, render: impl FnOnce(&mut Frame<'_>)) -> Result<(), Failure> {
        self.terminal.draw(render).map_err(failure)?;
        Ok(())
    }

    /// Whether the user wants to leave, by `q`, Esc or Ctrl-C.
    pub(crate) fn is_left(&mut self) -> Result<bool, Failure> {
        while poll(WallDuration::ZERO).map_err(failure)? {
            let Event::Key(key) = read().map_err(failure)? else { continue };
            let is_interrupt = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
            let leaves = is_interrupt || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc);
            if leaves && key.kind != KeyEventKind::Release {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

fn failure(error: std::io::Error) -> Failure {
    Failure::new(format_args!("the terminal cannot be used: {}", reason(&error)))
}

/// Draws lines with a hint how to leave at the bottom; lines that do not fit are cut off at the end.
pub(crate) fn render(lines: Vec<Line<'static>>, frame: &mut Frame<'_>) {
    let mut area = frame.area();
    area.height = area.height.saturating_sub(1);
    let is_cut = lines.len() > area.height.into();
    Paragraph::new(Text::from(lines)).render(area, frame.buffer_mut());
    let hint = if is_cut { "q to leave; the terminal is too low for all lines" } else { "q to leave" };
    area.y = area.height;
    area.height = 1;
    Line::from(hint).style(ratatui::style::Modifier::DIM).render(area, frame.buffer_mut());
}

/// Lines as plain text.
pub(crate) fn plain(lines: &[Line<'_>]) -> String {
    lines.iter().map(|line| format!("{}\n", line.to_string().trim_end())).collect()
}
