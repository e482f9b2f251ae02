//! Runs the command on a terminal, and looks at its screen.
#![expect(clippy::disallowed_methods, reason = "a process is waited for")]

use std::fs::File;
use std::io::{Read, Write};
use std::num::NonZero;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use nix::pty::{Winsize, openpty};
use vt100::Parser;

const ROWS: NonZero<u16> = NonZero::new(40).unwrap();
const COLUMNS: NonZero<u16> = NonZero::new(140).unwrap();

/// How long a screen may take: the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(60);

/// The command on a terminal.
pub(crate) struct Terminal {
    child: Child,
    keyboard: File,
    screen: Arc<Mutex<Parser>>,
}

impl Terminal {
    /// Runs the command with these arguments.
    pub(crate) fn run(args: &[&str]) -> Self {
        let size = Winsize { ws_row: ROWS.get(), ws_col: COLUMNS.get(), ws_xpixel: 0, ws_ypixel: 0 };
        let pty = openpty(&size, None).expect("a pseudo-terminal");
        let end = || Stdio::from(pty.slave.try_clone().expect("a descriptor"));
        let child = Command::new(env!("CARGO_BIN_EXE_lexican"))
            .args(args)
            .current_dir(Path::new(env!("CARGO_TARGET_TMPDIR")))
            .env("TERM", "xterm-256color")
            .env_remove("NO_COLOR")
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .expect("the command was built for this test");
        let mut output = File::from(pty.master.try_clone().expect("a descriptor"));
        let screen = Arc::new(Mutex::new(Parser::new(ROWS, COLUMNS, 0)));
        let shown = Arc::clone(&screen);
        // Ends when the command has closed its end.
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = output.read(&mut bytes) {
                shown.lock().unwrap().process(&bytes[..count]);
            }
        });
        Terminal { child, keyboard: File::from(pty.master), screen }
    }

    /// What the screen shows.
    pub(crate) fn text(&self) -> String {
        self.screen.lock().unwrap().screen().contents()
    }

    /// Waits until the screen shows what is wanted; returns it.
    #[track_caller]
    pub(crate) fn wait_for(&mut self, what: impl Fn(&str) -> bool) -> String {
        let begun = Instant::now();
        loop {
            let text = self.text();
            if what(&text) {
                return text;
            }
            assert!(begun.elapsed() < PATIENCE, "the screen shows:\n{text}");
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Presses keys.
    pub(crate) fn press(&mut self, keys: &str) {
        self.keyboard.write_all(keys.as_bytes()).expect("the command reads its keys");
    }

    /// Waits for the end of the command; returns its exit code, and what the screen shows then.
    #[track_caller]
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let begun = Instant::now();
        let status = loop {
            match self.child.try_wait().expect("it is our child") {
                Some(status) => break status,
                None => assert!(begun.elapsed() < PATIENCE, "it does not end:\n{}", self.text()),
            }
            thread::sleep(Duration::from_millis(10));
        };
        // Its last output may still be on the way.
        let (mut before, mut text) = (String::new(), self.text());
        while before != text {
            thread::sleep(Duration::from_millis(50));
            before = std::mem::replace(&mut text, self.text());
        }
        (status.code(), text)
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
