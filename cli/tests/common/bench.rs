//! A running `lexican bench`.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A running bench that serves its page, ended with the test.
pub(crate) struct Bench {
    process: Child,
    /// The address that it has printed.
    pub(crate) url: String,
}

#[allow(dead_code, reason = "not every test needs all")]
impl Bench {
    /// Starts a bench in a folder, without opening a browser.
    pub(crate) fn begin(folder: &Path, args: &[&str]) -> Self {
        Bench::begin_with(folder, &[&["--no-open"], args].concat(), &[])
    }

    /// Starts a bench in a folder and with an environment.
    pub(crate) fn begin_with(folder: &Path, args: &[&str], environment: &[(&str, &str)]) -> Self {
        let mut process = Command::new("timeout")
            // It ends even if the test is killed.
            .args(["--foreground", "600", env!("CARGO_BIN_EXE_lexican"), "bench"])
            .args(args)
            .current_dir(folder)
            .env_remove("LEXICAN_BUS")
            .envs(environment.iter().copied())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut url = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut url).unwrap();
        Bench { process, url: url.trim().to_owned() }
    }

    /// The address without the token.
    pub(crate) fn origin(&self) -> &str {
        self.url.split_once("/?").unwrap().0
    }

    /// The token of this run.
    pub(crate) fn token(&self) -> &str {
        let token = self.url.split_once("/?token=").unwrap_or_else(|| panic!("{}", self.url)).1;
        token.split('&').next().unwrap()
    }

    /// Ends it as Ctrl-C does; returns the exit code.
    pub(crate) fn interrupt(mut self) -> Option<i32> {
        self.terminate();
        self.process.wait().unwrap().code()
    }

    /// As [`Bench::interrupt`], and repeated until it has ended, because the first signal may have come too early.
    pub(crate) fn interrupt_twice(mut self) -> Option<i32> {
        loop {
            self.terminate();
            if let Some(status) = self.process.try_wait().unwrap() {
                return status.code();
            }
        }
    }

    /// `timeout` passes the signal on, in the foreground only once. SIGKILL would leave the bench behind.
    fn terminate(&self) {
        let _ = Command::new("kill").args(["-TERM", &self.process.id().to_string()]).status();
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        if matches!(self.process.try_wait(), Ok(None)) {
            self.terminate();
            let _ = self.process.wait();
        }
    }
}
