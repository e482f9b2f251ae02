//! A simulated device on a bus of pseudo-terminals, to be used by other commands.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

use serde_json::Value;

use crate::common::{Run, lexican};

/// A running `lexican simulate`, ended with the test.
pub(crate) struct Simulation {
    process: Child,
    pub(crate) stdin: ChildStdin,
    events: Receiver<String>,
    pub(crate) buses: Vec<String>,
}

#[allow(dead_code, reason = "not every test needs all")]
impl Simulation {
    /// Begins a simulation in a folder, and waits until its device has booted.
    pub(crate) fn begin(folder: &Path, args: &[&str]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_lexican"))
            // It ends even if the test is killed.
            .args([&["simulate", "--json", "--for", "600s"], args].concat())
            .current_dir(folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdin = process.stdin.take().unwrap();
        let events = lines(process.stdout.take().unwrap());
        let mut simulation = Simulation { process, stdin, events, buses: Vec::new() };
        let serving = simulation.until("serving");
        let buses = serving["buses"].as_array().unwrap().iter();
        simulation.buses = buses.map(|bus| bus.as_str().unwrap().to_owned()).collect();
        if !args.contains(&"none") {
            assert_eq!(simulation.until("state")["state"], "PRE-OPERATIONAL");
        }
        simulation
    }

    /// The next event of this kind; skips others.
    #[track_caller]
    pub(crate) fn until(&mut self, event: &str) -> Value {
        let mut before = String::new();
        loop {
            let Ok(line) = self.events.recv() else { panic!("no event {event:?} after:\n{before}") };
            let json: Value = serde_json::from_str(&line).unwrap();
            if json["event"] == event {
                return json;
            }
            before += &(line + "\n");
        }
    }

    /// Types a line, and returns the answer.
    #[track_caller]
    pub(crate) fn asks(&mut self, line: &str, event: &str) -> Value {
        writeln!(self.stdin, "{line}").unwrap();
        self.until(event)
    }

    /// Gives its terminals names that no other simulation has. The number of a closed terminal is reused, so a command
    /// that waits for its bus to come back would go on with the drive of another test.
    pub(crate) fn on_terminals_of_its_own(mut self, folder: &Path) -> Self {
        for bus in &mut self.buses {
            let terminal = bus.strip_prefix("slcan:").unwrap();
            let link = folder.join(terminal.replace('/', "-"));
            std::os::unix::fs::symlink(terminal, &link).unwrap();
            *bus = format!("slcan:{}", link.display());
        }
        self
    }

    /// Ends the simulation, and removes its terminals.
    pub(crate) fn vanish(&mut self) {
        for link in self.buses.iter().filter_map(|bus| bus.strip_prefix("slcan:")) {
            std::fs::remove_file(link).unwrap();
        }
        self.asks("quit", "summary");
    }

    /// Runs another command on its first bus.
    pub(crate) fn run(&self, command: &str, args: &[&str]) -> Run {
        let command: Vec<_> = command.split(' ').chain(["--bus", &self.buses[0]]).collect();
        lexican(&[&command, args].concat())
    }

    /// Runs another command, which must succeed and print some words.
    #[track_caller]
    pub(crate) fn check(&self, command: &str, args: &[&str], words: &str) {
        self.run(command, args).on_stdout(0, words);
    }

    /// Presses Ctrl-C, and returns the last line and the exit code.
    pub(crate) fn interrupt(mut self) -> (Value, Option<i32>) {
        let pid = self.process.id().to_string();
        assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
        let summary = self.until("summary");
        (summary, self.process.wait().unwrap().code())
    }
}

impl Drop for Simulation {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Reads the lines of a process as they come: if its pipe were full, the process would wait, and the device with it. A
/// search by LSS alone fills most of a pipe.
pub(crate) fn lines(stdout: ChildStdout) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        BufReader::new(stdout).lines().map_while(Result::ok).try_for_each(|line| sender.send(line))
    });
    receiver
}
