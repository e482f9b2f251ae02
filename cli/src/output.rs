//! The output of commands: text on the terminal, files, exit codes.

use std::cell::RefCell;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use anstyle::{AnsiColor, Style};
use indicatif::{ProgressBar, ProgressStyle};
use lexican_runtime::host::kept::replace;
use lexican_runtime::host::{AccessError, BusState, LinkError};
use lexican_runtime::service::sdo_client::SdoError;
pub(crate) use lexican_toolbox::text::files::reason;
use lexican_toolbox::text::files::{Existing, ReadError};
pub(crate) use lexican_toolbox::text::json::fields;
use lexican_toolbox::values::lookup::ObjectError;
use serde_json::Value as Json;

/// The result of a command that could do its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Outcome {
    /// No findings: exit 0.
    Clean,
    /// Findings, differences, failed checks: exit 1.
    Found,
    /// Some input could not be read, and this has been reported: exit 2.
    Unreadable,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> ExitCode {
        ExitCode::from(match outcome {
            Outcome::Clean => 0,
            Outcome::Found => 1,
            Outcome::Unreadable => 2,
        })
    }
}

/// Why a command could not do its work: exit 2, as for wrong arguments.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    help: Option<String>,
    /// Printed in full before the message.
    findings: String,
    silent: bool,
}

impl Failure {
    pub(crate) fn new(message: impl Display) -> Self {
        Failure { message: message.to_string(), help: None, findings: String::new(), silent: false }
    }

    /// Adds advice.
    pub(crate) fn help(mut self, help: impl Display) -> Self {
        self.help = Some(help.to_string());
        self
    }

    /// Adds advice, if there is any.
    pub(crate) fn help_if(self, help: Option<String>) -> Self {
        Failure { help, ..self }
    }

    /// Adds findings, to be printed before the message.
    pub(crate) fn after(self, findings: String) -> Self {
        Failure { findings, ..self }
    }

    /// `cannot WHAT FILE: REASON`.
    pub(crate) fn file(what: &str, path: &Path, error: &io::Error) -> Self {
        let help = match error.kind() {
            io::ErrorKind::AlreadyExists => Some("--force replaces it".to_owned()),
            io::ErrorKind::ResourceBusy => Some("name another file".to_owned()),
            _ => None,
        };
        Failure::new(format_args!("cannot {what} {}: {}", path.display(), reason(error))).help_if(help)
    }

    /// The message and the advice.
    pub(crate) fn words(&self) -> (&str, Option<&str>) {
        (&self.message, self.help.as_deref())
    }

    /// Prints the failure on stderr; returns the exit code.
    pub(crate) fn report(&self) -> ExitCode {
        if self.silent {
            return ExitCode::SUCCESS;
        }
        let mut stderr = stderr();
        let (error, help) = (AnsiColor::Red.on_default().bold(), AnsiColor::Cyan.on_default().bold());
        // Ignore an error: if stderr is closed, the exit code remains.
        let _ = writeln!(stderr, "{}{error}error{error:#}: {}", self.findings, self.message);
        if let Some(text) = &self.help {
            let _ = writeln!(stderr, "{help}help{help:#}: {text}");
        }
        ExitCode::from(2)
    }
}

/// The message without the advice.
impl Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

/// An error while writing to stdout. Endless commands stop when their reader leaves (`lexican monitor | head`), which
/// is no failure. All others write to [`stdout`], and end with their own exit code.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        let silent = error.kind() == io::ErrorKind::BrokenPipe;
        Failure { silent, ..Failure::new(format_args!("cannot write the output: {}", reason(&error))) }
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Failure::new(error)
    }
}

impl From<ObjectError> for Failure {
    fn from(error: ObjectError) -> Self {
        Failure::new(&error).help(error.advice())
    }
}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        let failure = Failure::new(&error);
        match error {
            LinkError::NoBus(BusState::Down) => {
                failure.help("set the interface up: `ip link set can0 up type can bitrate 500000`")
            }
            LinkError::NoBus(BusState::Removed) => failure.help("plug the adapter in, then repeat the command"),
            LinkError::NoBus(_) => failure.help(
                "are bit rate, wiring and termination right? Then set the interface down and up again, or let it \
                 restart by itself: `ip link set can0 type can restart-ms 100`",
            ),
            LinkError::Full => {
                failure.help("is another node on the bus, with power and at this bit rate? Frames must be acknowledged")
            }
            LinkError::ReadOnly => failure.help("`lexican monitor --bus log:FILE` shows it"),
            _ => failure,
        }
    }
}

impl From<AccessError> for Failure {
    fn from(error: AccessError) -> Self {
        match error {
            AccessError::Sdo { error: SdoError::TimedOut { .. }, .. } => Failure::new(&error).help(NO_ANSWER),
            AccessError::Sdo { error: SdoError::Violation { .. }, .. } => Failure::new(&error).help(
                "two nodes with one node-ID cause this, or two programs that access one node; `lexican scan` \
                 finds such nodes",
            ),
            AccessError::Link(error) => error.into(),
            _ => Failure::new(error),
        }
    }
}

/// The advice for a node that does not answer.
pub(crate) const NO_ANSWER: &str = "is the node on this bus, with power and at this bit rate? `lexican scan` shows all nodes \
     and their states: one in STOPPED answers after `lexican nmt pre-operational --node NODE`";

/// The message about frames that the machine received but the command did not.
pub(crate) fn missing_frames(frames: u32) -> String {
    format!("{frames} frames are missing here: they came faster than they were read")
}

/// A flag that is set by Ctrl-C, SIGTERM and SIGHUP.
#[cfg(feature = "full")]
pub(crate) fn ctrl_c() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let handler = Arc::clone(&flag);
    on_ctrl_c(move || handler.store(true, Ordering::Relaxed))?;
    Ok(flag)
}

/// Calls `handler` at Ctrl-C, SIGTERM and SIGHUP, which then do not end the command. A sequence runs several commands,
/// each with its own handler.
#[cfg(feature = "full")]
pub(crate) fn on_ctrl_c(handler: impl FnMut() + Send + 'static) -> Result<(), Failure> {
    static HANDLERS: Mutex<Vec<Box<dyn FnMut() + Send>>> = Mutex::new(Vec::new());
    let all = || HANDLERS.lock().unwrap_or_else(PoisonError::into_inner);
    let mut handlers = all();
    handlers.push(Box::new(handler));
    if handlers.len() > 1 {
        return Ok(());
    }
    drop(handlers);
    ctrlc::set_handler(move || all().iter_mut().for_each(|handler| handler()))
        .map_err(|error| Failure::new(format_args!("cannot handle Ctrl-C: {error}")))
}

/// Whether to use colours on stdout: not in a pipe, and not if NO_COLOR is set (<https://no-color.org>).
pub(crate) fn colours() -> bool {
    anstream::AutoStream::choice(&io::stdout()) != anstream::ColorChoice::Never
}

/// Prints a note on stderr.
pub(crate) fn note(message: impl Display) {
    let note = AnsiColor::Green.on_default().bold();
    let _ = writeln!(stderr(), "{note}note{note:#}: {message}");
}

/// Prints a problem that does not end the command on stderr.
pub(crate) fn warn(message: impl Display) {
    let warning = AnsiColor::Yellow.on_default().bold();
    let _ = writeln!(stderr(), "{warning}warning{warning:#}: {message}");
}

/// A progress bar on stderr; hidden if stderr is no terminal.
pub(crate) fn progress(template: &str, steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template(template).expect("the template is valid");
    if is_kept() { ProgressBar::hidden() } else { ProgressBar::new(steps).with_style(style) }
}

/// A spinner on stderr for work of unknown length; hidden if stderr is no terminal.
pub(crate) fn spinner(message: String) -> ProgressBar {
    let spinner = if is_kept() { ProgressBar::hidden() } else { ProgressBar::new_spinner().with_message(message) };
    spinner.enable_steady_tick(std::time::Duration::from_millis(200));
    spinner
}

/// Stdout for commands that end by themselves. If the reader leaves (`lexican ... | head`), the rest of the output is
/// dropped and the command continues, because its exit code is a result as well.
pub(crate) fn stdout() -> Stdout {
    Stdout(anstream::stdout().lock())
}

/// The same for data, in which escape sequences are kept.
pub(crate) fn raw_stdout() -> Stdout {
    Stdout(anstream::AutoStream::always_ansi(io::stdout().lock()))
}

fn stderr() -> Stdout<impl Write> {
    Stdout(anstream::stderr().lock())
}

thread_local! {
    /// The output of this thread, if it is being captured.
    static KEPT: RefCell<Option<Vec<u8>>> = const { RefCell::new(None) };
}

fn is_kept() -> bool {
    KEPT.with_borrow(Option::is_some)
}

/// Captures the output of `action`, for a client that shows something else on the terminal.
pub(crate) fn kept<T>(action: impl FnOnce() -> T) -> (T, String) {
    KEPT.set(Some(Vec::new()));
    let (result, printed) = (action(), KEPT.take().unwrap_or_default());
    (result, anstream::adapter::strip_str(&String::from_utf8_lossy(&printed)).to_string())
}

/// Writes to a stream, or to the captured output.
pub(crate) struct Stdout<S = anstream::AutoStream<io::StdoutLock<'static>>>(S);

impl<S: Write> Write for Stdout<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if KEPT.with_borrow_mut(|kept| kept.as_mut().map(|kept| kept.extend(bytes))).is_some() {
            return Ok(bytes.len());
        }
        unless_broken(self.0.write(bytes), bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        unless_broken(self.0.flush(), ())
    }
}

fn unless_broken<T>(result: io::Result<T>, otherwise: T) -> io::Result<T> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(otherwise),
        result => result,
    }
}

/// Prints a result as a JSON object or as text.
pub(crate) fn print_result(as_json: bool, object: impl Into<Json>, text: impl Display) -> Result<(), Failure> {
    let mut stdout = stdout();
    if as_json {
        writeln!(stdout, "{}", object.into())?;
    } else {
        writeln!(stdout, "{text}")?;
    }
    stdout.flush()?;
    Ok(())
}

/// `1 case`, `2 cases`.
pub(crate) fn plural(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Text in a style, which [`anstream`] removes if stdout is no terminal.
pub(crate) fn styled(style: Style, text: impl Display) -> String {
    format!("{style}{text}{style:#}")
}

/// The option to replace existing files.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(crate) struct ForceArgs {
    /// Replace the file if there is one
    #[arg(long)]
    force: bool,
}

impl ForceArgs {
    pub(crate) const fn is_given(self) -> bool {
        self.force
    }

    pub(crate) const fn existing(self) -> Existing {
        if self.force { Existing::Replace } else { Existing::Keep }
    }

    /// Before the work begins, refuses a file that exists and is to be kept, or that the same command reads.
    pub(crate) fn guard<'a>(self, path: &Path, read: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
        self.existing().guard(path, read).map_err(|error| Failure::file("write", path, &error))
    }

    /// Writes a file, unless it exists with other content and is to be kept.
    pub(crate) fn write(self, path: &Path, content: &[u8]) -> Result<(), Failure> {
        let is_same = || std::fs::read(path).is_ok_and(|present| present == content);
        match self.guard(path, []) {
            Err(_) if is_same() => Ok(()),
            guarded => guarded.and_then(|()| write_whole(path, content)),
        }
    }
}

/// Replaces a file as a whole, or leaves it as it is. Symbolic links are kept, and devices such as `/dev/null` are
/// written to.
pub(crate) fn write_whole(path: &Path, content: &[u8]) -> Result<(), Failure> {
    let is_special = std::fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir());
    let written = if is_special { std::fs::write(path, content) } else { replace(path, content) };
    written.map_err(|error| Failure::file("write", path, &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_as_a_whole_or_not_at_all() {
        let folder = std::env::temp_dir().join(format!("lexican-output-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("in-the-way")).unwrap();
        for path in ["no/such/folder", "in-the-way"] {
            assert!(write_whole(&folder.join(path), b"1").is_err(), "{path}");
        }
        for content in [b"1", b"2"] {
            write_whole(&folder.join("a"), content).unwrap();
            assert_eq!(std::fs::read(folder.join("a")).unwrap(), content);
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("a", folder.join("link")).unwrap();
            write_whole(&folder.join("link"), b"3").unwrap();
            assert!(std::fs::symlink_metadata(folder.join("link")).unwrap().is_symlink());
            assert_eq!(std::fs::read(folder.join("a")).unwrap(), b"3");
            std::fs::remove_file(folder.join("link")).unwrap();
        }
        let left = std::fs::read_dir(&folder).unwrap().count();
        assert_eq!(left, 2, "the folder in the way and the file, nothing beside them");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_written_to_and_not_replaced() {
        write_whole(Path::new("/dev/null"), b"nothing").unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    }
}
