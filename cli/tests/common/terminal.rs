//! Runs the command on a terminal, and reads its screen.
#![expect(clippy::disallowed_methods, reason = "a process is waited for")]
#![allow(dead_code, reason = "not every test needs all")]

use std::fs::File;
use std::io::{Read, Write};
use std::num::NonZero;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use nix::fcntl::OFlag;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use vt100::Parser;

const ROWS: NonZero<u16> = NonZero::new(40).unwrap();
const COLUMNS: NonZero<u16> = NonZero::new(140).unwrap();

/// How long a screen may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Something with a screen and keys.
pub(crate) trait Screen {
    /// The text on the screen.
    fn text(&self) -> String;

    /// Presses keys: the bytes that a terminal sends for them.
    fn press(&mut self, keys: &str);

    /// Waits until the screen satisfies `what`; returns its text.
    #[track_caller]
    fn wait_for(&mut self, what: impl Fn(&str) -> bool) -> String {
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
}

/// The command on a terminal.
pub(crate) struct Terminal {
    child: Child,
    keyboard: File,
    screen: Arc<Mutex<Parser>>,
    is_closed: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
}

impl Terminal {
    /// Runs the command with these arguments.
    pub(crate) fn run(args: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lexican"));
        Terminal::of(command.args(args).current_dir(Path::new(env!("CARGO_TARGET_TMPDIR"))))
    }

    /// Runs a command.
    pub(crate) fn of(command: &mut Command) -> Self {
        // No process of another test may inherit the descriptor, or it could not be closed.
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC;
        let master = posix_openpt(flags).expect("a pseudo-terminal");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("it is ours");
        let path = ptsname_r(&master).expect("it has a name");
        let slave = File::options().read(true).write(true).custom_flags(OFlag::O_NOCTTY.bits()).open(&path);
        let slave = slave.expect("its other end");
        let size = ["-F", &path, "rows", &ROWS.to_string(), "columns", &COLUMNS.to_string()];
        assert!(Command::new("stty").args(size).status().expect("coreutils").success());
        let master = File::from(OwnedFd::from(master));
        let end = || Stdio::from(slave.try_clone().expect("a descriptor"));
        let child = command
            .env("TERM", "xterm-256color")
            .env_remove("NO_COLOR")
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .expect("the command is there");
        // The builder keeps its descriptors for its next process, which would keep the terminal open.
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut output = master.try_clone().expect("a descriptor");
        let screen = Arc::new(Mutex::new(Parser::new(ROWS, COLUMNS, 0)));
        let shown = Arc::clone(&screen);
        let is_closed = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&is_closed);
        // Ends when the command has closed its end, or the terminal is closed.
        let reader = thread::spawn(move || {
            let mut bytes = [0; 4096];
            while !ends.load(Ordering::Relaxed) {
                let mut ready = [PollFd::new(output.as_fd(), PollFlags::POLLIN)];
                if poll(&mut ready, PollTimeout::from(50_u8)) == Ok(0) {
                    continue;
                }
                let Ok(count @ 1..) = output.read(&mut bytes) else { return };
                shown.lock().unwrap().process(&bytes[..count]);
            }
        });
        Terminal { child, keyboard: master, screen, is_closed, reader: Some(reader) }
    }

    /// Closes the terminal's window, and waits for the end of the command; returns its exit code.
    #[track_caller]
    pub(crate) fn close(mut self) -> Option<i32> {
        self.is_closed.store(true, Ordering::Relaxed);
        self.reader.take().map(JoinHandle::join);
        self.keyboard = File::open("/dev/null").expect("there is nothing");
        self.wait()
    }

    /// Waits for the end of the command; returns its exit code.
    #[track_caller]
    fn wait(&mut self) -> Option<i32> {
        let begun = Instant::now();
        loop {
            match self.child.try_wait().expect("it is our child") {
                Some(status) => return status.code(),
                None => assert!(begun.elapsed() < PATIENCE, "it does not end:\n{}", self.text()),
            }
            thread::sleep(Duration::from_millis(10));
        }
    }

    /// Waits for the end of the command; returns its exit code, and what the screen shows then.
    #[track_caller]
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let code = self.wait();
        // Its last output may still be in the pipe: the reader ends after it.
        let begun = Instant::now();
        while self.reader.as_ref().is_some_and(|reader| !reader.is_finished()) {
            assert!(begun.elapsed() < PATIENCE, "a process has the terminal:\n{}", self.text());
            thread::sleep(Duration::from_millis(10));
        }
        (code, self.text())
    }
}

impl Screen for Terminal {
    fn text(&self) -> String {
        self.screen.lock().unwrap().screen().contents()
    }
    fn press(&mut self, keys: &str) {
        self.keyboard.write_all(keys.as_bytes()).expect("the command reads its keys");
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
