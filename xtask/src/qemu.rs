//! A microcontroller without one: QEMU's `mps2-an386`, a board with a Cortex-M4.
//!
//! The program prints, keeps files and exits by semihosting. QEMU runs below `timeout`,
//! so that it ends even when this process does not end it.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, Stdio};

const QEMU: &str = "qemu-system-arm";

/// The file with what QEMU and the program print.
const CONSOLE: &str = "console.txt";

/// The file with what QEMU and a panic complain about.
const COMPLAINTS: &str = "complaints.txt";

/// A board with a program.
pub(crate) struct Board<'a> {
    /// The program: an ELF file.
    pub elf: &'a Path,
    /// Where the program's files lie. What it prints is in `console.txt`.
    pub folder: &'a Path,
    /// Each instruction takes 2ⁿ ns of the board's time, however fast this machine is. Without it the board's clock
    /// is this machine's.
    pub icount: Option<u8>,
    /// When QEMU is ended, whatever the program does.
    pub seconds: u32,
}

/// Whether QEMU can be had; where not, the reason for which something is skipped.
pub(crate) fn is_installed() -> Result<(), String> {
    let found = Command::new(QEMU).arg("--version").output();
    found.map(|_| ()).map_err(|error| format!("{QEMU}: {error}: apt-get install {QEMU}"))
}

impl Board<'_> {
    /// Runs the program to its end, and returns what it has printed.
    ///
    /// # Errors
    ///
    /// The program reports a failure or panics, or does not end in time. What it has printed is in the message.
    pub(crate) fn run(&self) -> Result<String, String> {
        let mut child = self.spawn()?;
        let ended = child.wait().map_err(|error| format!("{QEMU}: {error}"))?;
        if ended.success() { self.printed() } else { Err(self.failure(&format!("{ended} (124: not done in time)"))) }
    }

    /// What the program has printed since it was started.
    ///
    /// # Errors
    ///
    /// It was not started.
    pub(crate) fn printed(&self) -> Result<String, String> {
        self.read(CONSOLE)
    }

    fn failure(&self, what: &str) -> String {
        let printed = [COMPLAINTS, CONSOLE].map(|file| self.read(file).unwrap_or_default());
        format!("{QEMU} with {}: {what}\n{}", self.elf.display(), printed.concat())
    }

    fn read(&self, file: &str) -> Result<String, String> {
        let path = self.folder.join(file);
        let bytes = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    fn spawn(&self) -> Result<Child, String> {
        let create = |file: &str| File::create(self.folder.join(file));
        let made = fs::create_dir_all(self.folder).and_then(|()| Ok((create(CONSOLE)?, create(COMPLAINTS)?)));
        let (console, complaints) = made.map_err(|error| format!("{}: {error}", self.folder.display()))?;
        let mut command = Command::new("timeout");
        command.args(["--kill-after=2", &self.seconds.to_string(), QEMU, "-machine", "mps2-an386", "-nodefaults"]);
        command.args(["-display", "none", "-monitor", "none", "-audiodev", "none,id=none", "-serial", "none"]);
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
