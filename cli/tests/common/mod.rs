//! Runs the command.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The result of a run.
pub(crate) struct Run {
    args: String,
    /// The exit code; `None` after a signal.
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

#[allow(dead_code, reason = "not every test needs both")]
impl Run {
    /// Checks the exit code, and that stdout contains the text.
    #[track_caller]
    pub(crate) fn on_stdout(&self, code: i32, text: &str) {
        assert!(self.code == Some(code) && self.stdout.contains(text), "no {text:?} and exit code {code}: {self}");
    }

    /// Checks the exit code, and that stderr contains the text.
    #[track_caller]
    pub(crate) fn on_stderr(&self, code: i32, text: &str) {
        assert!(self.code == Some(code) && self.stderr.contains(text), "no {text:?} and exit code {code}: {self}");
    }
}

impl fmt::Display for Run {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "lexican {}\nexit code {:?}\n{}{}", self.args, self.code, self.stdout, self.stderr)
    }
}

/// Runs the command with these arguments.
#[allow(dead_code, reason = "not every test runs it anywhere")]
pub(crate) fn lexican(args: &[&str]) -> Run {
    lexican_in(Path::new(env!("CARGO_TARGET_TMPDIR")), args)
}

/// Runs the command in a folder.
pub(crate) fn lexican_in(folder: &Path, args: &[&str]) -> Run {
    let output = Command::new(env!("CARGO_BIN_EXE_lexican"))
        .args(args)
        .current_dir(folder)
        .env_remove("LEXICAN_BUS")
        .stdin(Stdio::null())
        .output()
        .expect("the command was built for this test");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the command prints UTF-8");
    let args = format!("{args:?}");
    let run = Run { args, code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) };
    assert!(!run.stderr.contains("panicked"), "{run}");
    run
}

/// An empty folder for one test.
#[allow(dead_code, reason = "not every test has files")]
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the folder for tests is writable");
    folder
}

/// The names of the files in a folder, sorted.
#[allow(dead_code, reason = "not every test looks at files")]
pub(crate) fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("the folder exists");
    let mut names: Vec<_> =
        entries.map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
