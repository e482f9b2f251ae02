//! The processes of a measurement: who reads, who answers, and how one is started and read.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// The node-ID of the device that the clients read from.
pub(super) const NODE: u8 = 5;

pub(super) type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Who reads, and who answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) client: Party,
    pub(super) device: Party,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Party {
    Blocking,
    Tokio,
    TokioTask,
    Lexican,
    Python,
}

impl Party {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Party::Blocking => "lexican, blocking",
            Party::Tokio => "lexican, tokio",
            Party::TokioTask => "lexican, tokio, in a task",
            Party::Lexican => "lexican",
            Party::Python => "python-canopen",
        }
    }

    /// Its name on the command line.
    pub(super) const fn part(self) -> &'static str {
        match self {
            Party::Blocking => "blocking",
            Party::Tokio => "tokio",
            Party::TokioTask => "tokio-task",
            Party::Lexican => "device",
            Party::Python => "python",
        }
    }
}

/// This program again, in another part.
pub(super) fn ourselves(part: &[&str]) -> Outcome<Command> {
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("play").args(part);
    Ok(command)
}

/// Another process, until the end of the scope. It ends when its standard input does.
pub(super) struct Player {
    child: Child,
    output: BufReader<std::process::ChildStdout>,
}

impl Player {
    pub(super) fn start(mut command: Command) -> Outcome<Self> {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let output = BufReader::new(child.stdout.take().expect("it is piped"));
        Ok(Player { child, output })
    }

    pub(super) fn line(&mut self) -> Outcome<String> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        if line.is_empty() { Err("a process ended before its time".into()) } else { Ok(line.trim().to_owned()) }
    }

    /// The processor time of the process so far.
    pub(super) fn processor_s(&self) -> Outcome<f64> {
        // In ticks, of which a turn has some hundred.
        const TICKS_PER_S: f64 = 100.0;
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id()))?;
        let fields = stat.rsplit(')').next().unwrap_or_default().split_ascii_whitespace();
        let ticks = fields.skip(11).take(2).map(str::parse::<f64>).sum::<Result<f64, _>>()?;
        Ok(ticks / TICKS_PER_S)
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        // It was measured; its exit status does not matter.
        let _ = self.child.wait();
    }
}
