//! Runs the command in tmux, and reads its screen.

use std::path::Path;
use std::process::{Command, Output};

use crate::terminal::Screen;

/// A separate tmux server, with the command in its only window.
pub(crate) struct Tmux {
    socket: String,
}

impl Tmux {
    /// Runs the command with these arguments; `None` if tmux is not installed.
    pub(crate) fn run(folder: &Path, args: &[&str]) -> Option<Self> {
        Command::new("tmux").arg("-V").output().ok()?;
        let tmux = Tmux { socket: folder.join("tmux.socket").display().to_string() };
        let folder = folder.display().to_string();
        // The shell keeps running, so that the screen remains. It prints the exit code, because tmux may learn of that
        // late or never.
        let shell = ["sh", "-c", "\"$0\" \"$@\"; echo \"ended with $?\"; exec sleep 600"];
        let begin = ["new-session", "-d", "-x", "140", "-y", "40", "-c", &folder];
        let output = tmux.tmux(&[&begin, &shell[..], &[env!("CARGO_BIN_EXE_lexican")], args].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Some(tmux)
    }

    fn tmux(&self, args: &[&str]) -> Output {
        let mut command = Command::new("tmux");
        command.args(["-S", &self.socket, "-f", "/dev/null"]).args(args).env_remove("TMUX").env_remove("NO_COLOR");
        command.output().expect("it is installed")
    }

    /// Waits for the end of the command; returns its exit code.
    #[track_caller]
    pub(crate) fn end(mut self) -> Option<i32> {
        let text = self.wait_for(|text| text.lines().any(|line| line.starts_with("ended with ")));
        text.split_once("ended with ")?.1.split_whitespace().next()?.parse().ok()
    }
}

impl Screen for Tmux {
    fn text(&self) -> String {
        String::from_utf8_lossy(&self.tmux(&["capture-pane", "-p"]).stdout).into_owned()
    }
    fn press(&mut self, keys: &str) {
        let bytes: Vec<String> = keys.bytes().map(|byte| format!("{byte:02x}")).collect();
        let bytes: Vec<&str> = bytes.iter().map(String::as_str).collect();
        self.tmux(&[&["send-keys", "-H"], &bytes[..]].concat());
    }
}

impl Drop for Tmux {
    fn drop(&mut self) {
        self.tmux(&["kill-server"]);
    }
}
