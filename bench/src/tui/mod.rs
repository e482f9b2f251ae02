//! The bench in a terminal.
//!
//! [`Screen`] is a state machine: keys and answers go in, requests come out, and it draws a view. [`run`] connects it
//! to a bench and a terminal.

mod action;
mod bus;
mod devices;
mod draw;
mod drives;
mod list;
mod nodes;
mod notices;
mod objects;
mod pdos;
mod plots;
mod prompt;
mod screen;
mod tab;
mod text;
mod trace;
mod ui;

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ratatui::backend::Backend;
use ratatui::crossterm::event::{
    DisableBracketedPaste, DisableMouseCapture, EnableBracketedPaste, EnableMouseCapture, Event, poll, read,
};
use ratatui::crossterm::execute;
use ratatui::{DefaultTerminal, Terminal};

use crate::engine::{Bench, Reply};
pub use action::{Action, Purpose};
pub use screen::Screen;
pub use text::Language;

/// The interval of drawing.
const DRAW: Duration = Duration::from_millis(100);

/// Takes the terminal, with mouse events and bracketed paste. A panic restores the terminal.
pub fn take_terminal() -> io::Result<DefaultTerminal> {
    let terminal = ratatui::try_init()?;
    IS_TAKEN.store(true, Ordering::Relaxed);
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        release_input();
        hook(panic);
    }));
    execute!(io::stdout(), EnableMouseCapture, EnableBracketedPaste)?;
    Ok(terminal)
}

/// Gives the terminal back if it was taken. If the terminal is gone, this does nothing: `ratatui::restore` would write
/// to it and panic.
pub fn give_terminal_back() {
    if IS_TAKEN.swap(false, Ordering::Relaxed) {
        release_input();
        let _ = ratatui::try_restore();
    }
}

/// Whether the terminal is taken.
static IS_TAKEN: AtomicBool = AtomicBool::new(false);

fn release_input() {
    let _ = execute!(io::stdout(), DisableBracketedPaste, DisableMouseCapture);
}

/// Shows a bench on a terminal until the user leaves. The caller takes and gives back the terminal.
pub fn run<B: Backend<Error = io::Error>>(
    bench: &Bench,
    terminal: &mut Terminal<B>,
    language: Language,
) -> io::Result<()> {
    let client = bench.open_client();
    let mut screen = Screen::new(client.number(), language);
    let mut open: Vec<(Purpose, Reply)> = Vec::new();
    loop {
        let view = bench.view();
        terminal.draw(|frame| screen.draw(frame, &view))?;
        if let Some((purpose, request)) = screen.wants(&view)
            && open.iter().all(|(known, _)| *known != purpose)
        {
            open.push((purpose, client.ask(request)));
        }
        let mut wait = DRAW;
        while let Some(event) = next_event(wait)? {
            wait = Duration::ZERO;
            let action = match event {
                Event::Key(key) => screen.handle_key(key, &view),
                Event::Mouse(mouse) => {
                    screen.handle_mouse(mouse, &view);
                    None
                }
                Event::Paste(text) => {
                    screen.paste(&text);
                    None
                }
                // A change of size only needs drawing.
                _ => None,
            };
            match action {
                None => {}
                Some(Action::Leave) => return Ok(()),
                Some(Action::Ask(purpose, request)) => open.push((purpose, client.ask(request))),
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

fn next_event(wait: Duration) -> io::Result<Option<Event>> {
    if poll(wait)? { read().map(Some) } else { Ok(None) }
}
