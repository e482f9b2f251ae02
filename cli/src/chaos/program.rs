//! Runs a program as a process group: captures its output and its end, and leaves no process behind.

use std::io::Read;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration as StdDuration;

use lexican_simulation::chaos::{End, Signal};
use nix::sys::signal::{Signal as Unix, killpg};
use nix::unistd::Pid;

use crate::output::{Failure, reason};

/// The length of the output's end that is kept, in bytes.
const KEPT: usize = 1 << 16;
/// How long to wait for the rest of the output after the program has ended.
const FLUSHED: StdDuration = StdDuration::from_millis(500);

pub(super) struct Program {
    child: Child,
    /// The process group, whose number is that of the process.
    group: Pid,
    stdout: Receiver<Vec<u8>>,
    stderr: Receiver<Vec<u8>>,
    /// The exit status. After the end, the process number may be reused.
    ended: Option<ExitStatus>,
}

impl Program {
    /// Starts the program in a new process group, with the bus in place of `{bus}` and in its environment.
    pub(super) fn start(command: &[String], bus: &str) -> Result<Self, Failure> {
        let mut words = command.iter().map(|word| word.replace("{bus}", bus));
        let name = words.next().unwrap_or_default();
        let mut child = Command::new(&name)
            .args(words)
            .env(crate::bus::BUS, bus)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0)
            .spawn()
            .map_err(|error| Failure::new(format_args!("cannot run {name}: {}", reason(&error))))?;
        let group = Pid::from_raw(child.id() as i32);
        let (stdout, stderr) = (follow(child.stdout.take()), follow(child.stderr.take()));
        Ok(Program { child, group, stdout, stderr, ended: None })
    }

    pub(super) fn signal(&self, signal: Signal) {
        let signal = match signal {
            _ if self.ended.is_some() => return,
            Signal::Terminate => Unix::SIGTERM,
            Signal::Interrupt => Unix::SIGINT,
            Signal::Kill => Unix::SIGKILL,
            Signal::Stop => Unix::SIGSTOP,
            Signal::Continue => Unix::SIGCONT,
        };
        self.signal_group(signal);
    }

    fn signal_group(&self, signal: Unix) {
        // Ignore an error: the whole group may have ended already.
        let _ = killpg(self.group, signal);
    }

    /// Whether the program has ended; then ends the processes that it left behind.
    pub(super) fn has_ended(&mut self) -> Result<bool, Failure> {
        if self.ended.is_none() {
            self.ended = self
                .child
                .try_wait()
                .map_err(|error| Failure::new(format_args!("cannot wait for the program: {}", reason(&error))))?;
            if self.ended.is_some() {
                self.signal_group(Unix::SIGKILL);
            }
        }
        Ok(self.ended.is_some())
    }

    /// Ends the rest of the group; returns how the program has ended, and what it printed on stderr.
    pub(super) fn finish(self) -> (End, String) {
        self.signal(Signal::Kill);
        let text = |from: &Receiver<Vec<u8>>| {
            String::from_utf8_lossy(&from.recv_timeout(FLUSHED).unwrap_or_default()).into_owned()
        };
        let stdout = text(&self.stdout);
        let last_line = stdout.lines().map(str::trim).rfind(|line| !line.is_empty()).unwrap_or_default().to_owned();
        (End { code: self.ended.and_then(|status| status.code()), last_line }, text(&self.stderr))
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.signal(Signal::Kill);
        let _ = self.child.wait();
    }
}

/// Sends the end of an output once it is complete.
fn follow(output: Option<impl Read + Send + 'static>) -> Receiver<Vec<u8>> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let (mut kept, mut buffer) = (Vec::new(), [0; 4096]);
        let Some(mut output) = output else { return };
        while let Ok(len @ 1..) = output.read(&mut buffer) {
            kept.extend_from_slice(&buffer[..len]);
            let over = kept.len().saturating_sub(KEPT);
            kept.drain(..over);
        }
        // Ignore an error: the receiver may be gone.
        let _ = sender.send(kept);
    });
    receiver
}
