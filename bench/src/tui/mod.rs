//! The terminal's face.
//!
//! [`Screen`] is a state machine: keys and answers go in, commands come out, and it draws a view. [`run`] connects it to a bench
//! and a terminal.

mod bus;
mod devices;
mod drives;
mod nodes;
mod objects;
mod pdos;
mod plots;
mod screen;
mod text;
mod trace;

use std::io;
use std::time::Duration;

use ratatui::Terminal;
use ratatui::backend::Backend;
use ratatui::crossterm::event::{Event, poll, read};

use crate::engine::{Bench, Reply};
pub use screen::{Action, Purpose, Screen};
pub use text::Language;

/// How often the screen is drawn.
const DRAW: Duration = Duration::from_millis(100);

/// Shows a bench on a terminal until somebody leaves. The terminal is taken and given back by the caller.
///
/// # Errors
///
/// The terminal is gone.
pub fn run<B: Backend<Error = io::Error>>(
    bench: &Bench,
    terminal: &mut Terminal<B>,
    language: Language,
) -> io::Result<()> {
    let face = bench.open_face();
    let mut screen = Screen::new(face.number(), language);
    let mut open: Vec<(Purpose, Reply)> = Vec::new();
    loop {
        let view = bench.view();
        terminal.draw(|frame| screen.draw(frame, &view))?;
        if let Some((purpose, command)) = screen.wants(&view)
            && open.iter().all(|(known, _)| *known != purpose)
        {
            open.push((purpose, face.ask(command)));
        }
        let mut wait = DRAW;
        while poll(wait)? {
            wait = Duration::ZERO;
            let action = match read()? {
                Event::Key(key) => screen.handle_key(key, &view),
                Event::Paste(text) => {
                    screen.paste(&text);
                    None
                }
                // It is drawn anew, in its new size.
                _ => break,
            };
            match action {
                None => {}
                Some(Action::Leave) => return Ok(()),
                Some(Action::Ask(purpose, command)) => open.push((purpose, face.ask(command))),
            }
        }
        let mut waiting = Vec::new();
        for (purpose, mut reply) in open {
            match reply.take() {
                Some(result) => screen.take(purpose, result),
                None => waiting.push((purpose, reply)),
            }
        }
        open = waiting;
    }
}
