//! A simulated microcontroller: QEMU's `mps2-an386`, a board with a Cortex-M4.
//!
//! The program prints, keeps files and exits by semihosting; UART 0 is a pseudo-terminal. QEMU runs under `timeout`, so
//! that it ends even if this process does not end it.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

const QEMU: &str = "qemu-system-arm";

/// QEMU names the terminal of UART 0 in a line: `char device redirected to /dev/pts/3 (label serial0)`.
const TERMINAL: &str = "char device redirected to ";

/// The file with the output of QEMU and the program.
const CONSOLE: &str = "console.txt";

/// The file with the error output of QEMU, and the message of a panic.
const COMPLAINTS: &str = "complaints.txt";

/// A board with a program.
pub(crate) struct Board<'a> {
    /// The program: an ELF file.
    pub elf: &'a Path,
    /// The folder of the program's files. Its output is in `console.txt`.
    pub folder: &'a Path,
    /// Each instruction takes 2ⁿ ns on the board's clock, however fast this machine is. `None`: the board's clock is
    /// that of this machine.
    pub icount: Option<u8>,
    /// The time after which QEMU is ended.
    pub seconds: u32,
}

/// Whether QEMU is installed; if not, the reason to skip a check.
pub(crate) fn is_installed() -> Result<(), String> {
    let found = Command::new(QEMU).arg("--version").output();
    found.map(|_| ()).map_err(|error| format!("{QEMU}: {error}: apt-get install {QEMU}"))
}

impl Board<'_> {
    /// Runs the program to its end, and returns what it has printed.
    pub(crate) fn run(&self) -> Result<String, String> {
        let mut child = self.spawn("none")?;
        let ended = child.wait().map_err(|error| format!("{QEMU}: {error}"))?;
        if ended.success() { self.printed() } else { Err(self.failure(&format!("{ended} (124: not done in time)"))) }
    }

    /// Starts the program, and leaves it running.
    pub(crate) fn start(&self) -> Result<Running, String> {
        let mut running = Running { child: self.spawn("pty")?, terminal: PathBuf::new(), line: None };
        // QEMU prints this line before the program starts, or ends.
        while matches!(running.child.try_wait(), Ok(None)) {
            let console = self.read(CONSOLE)?;
            let line = console.split_once('\n').and_then(|(line, _)| line.strip_prefix(TERMINAL)?.split(' ').next());
            if let Some(terminal) = line {
                running.terminal = terminal.into();
                running.connect().map_err(|error| self.failure(&error))?;
                return Ok(running);
            }
            nap();
        }
        Err(self.failure("no terminal for UART 0"))
    }

    /// What the program has printed since it was started.
    pub(crate) fn printed(&self) -> Result<String, String> {
        let lines = self.read(CONSOLE)?;
        Ok(lines.lines().filter(|line| !line.starts_with(TERMINAL)).flat_map(|line| [line, "\n"]).collect())
    }

    fn failure(&self, what: &str) -> String {
        format!("{QEMU} with {}: {what}{}", self.elf.display(), self.complaints())
    }

    /// The output of QEMU and the program, to explain a failure. Begins on a new line.
    pub(crate) fn complaints(&self) -> String {
        let printed = [COMPLAINTS, CONSOLE].map(|file| self.read(file).unwrap_or_default());
        format!("\n{}", printed.concat())
    }

    fn read(&self, file: &str) -> Result<String, String> {
        let path = self.folder.join(file);
        let bytes = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    fn spawn(&self, serial: &str) -> Result<Child, String> {
        let create = |file: &str| File::create(self.folder.join(file));
        let made = fs::create_dir_all(self.folder).and_then(|()| Ok((create(CONSOLE)?, create(COMPLAINTS)?)));
        let (console, complaints) = made.map_err(|error| format!("{}: {error}", self.folder.display()))?;
        let mut command = in_time("timeout");
        command.args(["--kill-after=2", &self.seconds.to_string(), QEMU, "-machine", "mps2-an386", "-nodefaults"]);
        command.args(["-display", "none", "-monitor", "none", "-audiodev", "none,id=none", "-serial", serial]);
        command.args(["-semihosting-config", "enable=on,target=native"]);
        if let Some(shift) = self.icount {
            command.args(["-icount", &format!("shift={shift}")]);
        }
        // QEMU runs in the folder, where semihosting opens files.
        let elf = std::path::absolute(self.elf).map_err(|error| format!("{}: {error}", self.elf.display()))?;
        command.arg("-kernel").arg(elf).current_dir(self.folder);
        command.stdin(Stdio::null()).stdout(console).stderr(complaints);
        command.spawn().map_err(|error| format!("timeout {QEMU}: {error}"))
    }
}

/// A board that runs. Dropping it cuts its power.
pub(crate) struct Running {
    /// `timeout`, which hands a signal on to QEMU.
    child: Child,
    terminal: PathBuf,
    /// Open as long as the board runs, because QEMU polls once a second whether anyone has opened the terminal.
    line: Option<File>,
}

/// `O_NOCTTY`: the terminal does not become the controlling terminal of this process.
const NOT_OURS: i32 = 0o400;

impl Running {
    /// The pseudo-terminal at UART 0.
    pub(crate) fn terminal(&self) -> &Path {
        &self.terminal
    }

    /// Opens the terminal, and waits until the program answers an empty line with an empty line, as serial CAN adapters
    /// do.
    fn connect(&mut self) -> Result<(), String> {
        let opened = File::options().read(true).write(true).custom_flags(NOT_OURS).open(&self.terminal);
        self.line = Some(opened.map_err(|error| format!("{}: {error}", self.terminal.display()))?);
        self.send("\r")?;
        let answer = self.line.as_mut().map(|line| line.read_exact(&mut [0]));
        answer.unwrap_or(Ok(())).map_err(|error| format!("no answer from the program: {error}"))
    }

    /// Sends text to the program.
    pub(crate) fn send(&mut self, text: &str) -> Result<(), String> {
        let sent = self.line.as_mut().map(|line| line.write_all(text.as_bytes()));
        sent.unwrap_or(Ok(())).map_err(|error| format!("{}: {error}", self.terminal.display()))
    }

    /// Waits until the program ends itself.
    pub(crate) fn wait(&mut self) -> Result<(), String> {
        let ended = self.child.wait().map_err(|error| format!("{QEMU}: {error}"))?;
        if ended.success() { Ok(()) } else { Err(format!("{QEMU}: {ended} (124: not done in time)")) }
    }

    /// Cuts the board's power.
    pub(crate) fn stop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            // Not `Child::kill`, which would leave QEMU behind.
            let _ = Command::new("kill").arg(self.child.id().to_string()).status();
        }
        let _ = self.child.wait();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop();
    }
}

/// A command with raised priority, if this process may raise it: the command has deadlines of milliseconds.
pub(crate) fn in_time(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new("nice");
    command.arg("--adjustment=-15").arg(program);
    command
}

/// Waits a little for another process.
#[expect(clippy::disallowed_methods, reason = "QEMU and the command are other processes")]
pub(crate) fn nap() {
    thread::sleep(Duration::from_millis(10));
}
