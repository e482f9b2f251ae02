//! What a command says and leaves behind: text on the terminal, whole files, an exit code.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anstyle::{AnsiColor, Style};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value as Json};

/// How a command ended that did what it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Nothing to complain about: exit 0.
    Clean,
    /// Findings, differences, failed checks: exit 1.
    Found,
    /// Some of what was asked for could not be read, which has been said: exit 2.
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

/// Why a command could not do what it was asked for: exit 2, as for a wrong command line.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    help: Option<String>,
    silent: bool,
}

impl Failure {
    pub(crate) fn new(message: impl Display) -> Self {
        Failure { message: message.to_string(), help: None, silent: false }
    }

    /// With a hint what to do about it.
    pub(crate) fn help(mut self, help: impl Display) -> Self {
        self.help = Some(help.to_string());
        self
    }

    /// `what` went wrong with a file.
    pub(crate) fn file(what: &str, path: &Path, error: &io::Error) -> Self {
        Failure::new(format_args!("cannot {what} {}: {}", path.display(), reason(error)))
    }

    /// The message and the hint.
    #[cfg(test)]
    pub(crate) fn words(&self) -> (&str, Option<&str>) {
        (&self.message, self.help.as_deref())
    }

    /// Tells the user on stderr; returns the exit code.
    pub(crate) fn report(&self) -> ExitCode {
        if self.silent {
            return ExitCode::SUCCESS;
        }
        let mut stderr = anstream::stderr().lock();
        let (error, help) = (AnsiColor::Red.on_default().bold(), AnsiColor::Cyan.on_default().bold());
        // Where nobody listens on stderr there is nobody to tell.
        let _ = writeln!(stderr, "{error}error{error:#}: {}", self.message);
        if let Some(text) = &self.help {
            let _ = writeln!(stderr, "{help}help{help:#}: {text}");
        }
        ExitCode::from(2)
    }
}

/// The message without the hint.
impl Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

/// An error while writing to stdout. A command that would write for ever ends when nobody reads on (`lexican monitor |
/// head`), which is no failure; all others write to [`stdout`], and end as they would have.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        let silent = error.kind() == io::ErrorKind::BrokenPipe;
        Failure { silent, ..Failure::new(format_args!("cannot write the output: {}", reason(&error))) }
    }
}

/// What the operating system says, in lower case and without its number.
pub(crate) fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or_default();
    let mut letters = text.chars();
    letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
}

/// Whether colours are wanted on stdout: not in a pipe, and not where NO_COLOR is set (<https://no-color.org>).
pub(crate) fn colours() -> bool {
    anstream::AutoStream::choice(&io::stdout()) != anstream::ColorChoice::Never
}

/// Something that the user may want to know, on stderr.
pub(crate) fn note(message: impl Display) {
    let note = AnsiColor::Green.on_default().bold();
    let _ = writeln!(anstream::stderr().lock(), "{note}note{note:#}: {message}");
}

/// A complaint on stderr that does not end the command.
pub(crate) fn warn(message: impl Display) {
    let warning = AnsiColor::Yellow.on_default().bold();
    let _ = writeln!(anstream::stderr().lock(), "{warning}warning{warning:#}: {message}");
}

/// A bar on stderr for something that takes a while; where stderr is no terminal, nothing is shown.
pub(crate) fn progress(template: &str, steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template(template).expect("the template is valid");
    ProgressBar::new(steps).with_style(style)
}

/// Stdout. When nobody reads on (`lexican ... | head`), what is written is lost, and the command goes on to its end: its
/// exit code is a result, too.
pub(crate) fn stdout() -> Stdout {
    Stdout(anstream::stdout().lock())
}

/// The same for text that is to stay as it is, escape sequences in it as well.
pub(crate) fn raw_stdout() -> Stdout {
    Stdout(anstream::AutoStream::always_ansi(io::stdout().lock()))
}

pub(crate) struct Stdout(anstream::AutoStream<io::StdoutLock<'static>>);

impl Write for Stdout {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
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

/// A result on stdout: an object for programs, a line for people.
pub(crate) fn tell(as_json: bool, fields: Map<String, Json>, text: impl Display) -> Result<(), Failure> {
    let mut stdout = stdout();
    if as_json {
        writeln!(stdout, "{}", Json::Object(fields))?;
    } else {
        writeln!(stdout, "{text}")?;
    }
    stdout.flush()?;
    Ok(())
}

/// The fields of a JSON object.
pub(crate) fn fields(object: Json) -> Map<String, Json> {
    match object {
        Json::Object(fields) => fields,
        _ => Map::new(),
    }
}

/// Text in a style; without one where stdout is no terminal, because [`anstream`] takes it out again.
pub(crate) fn styled(style: Style, text: impl Display) -> String {
    format!("{style}{text}{style:#}")
}

/// Writes a file wholly or not at all: under another name first, which then takes the file's place.
pub(crate) fn write_whole(path: &Path, content: &[u8]) -> Result<(), Failure> {
    write_all_whole(&[(path.to_owned(), content.to_vec())])
}

/// Writes several files, none of which takes its place before all are written.
pub(crate) fn write_all_whole(files: &[(PathBuf, Vec<u8>)]) -> Result<(), Failure> {
    let failed = |path: &Path, error| {
        files.iter().for_each(|(path, _)| drop(std::fs::remove_file(unfinished(path))));
        Failure::file("write", path, &error)
    };
    for (path, content) in files {
        prepare(path, content).map_err(|error| failed(path, error))?;
    }
    for (path, _) in files.iter().filter(|(path, _)| !is_special(path)) {
        std::fs::rename(unfinished(path), path).map_err(|error| failed(path, error))?;
    }
    Ok(())
}

/// Writes what is to take the place of a file, with the rights that the file had.
fn prepare(path: &Path, content: &[u8]) -> io::Result<()> {
    if is_special(path) {
        return std::fs::write(path, content);
    }
    std::fs::write(unfinished(path), content)?;
    match std::fs::metadata(path) {
        Ok(old) => std::fs::set_permissions(unfinished(path), old.permissions()),
        Err(_) => Ok(()),
    }
}

/// A terminal, a pipe, `/dev/null`: something that no file may take the place of.
fn is_special(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir())
}

fn unfinished(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_written_together_or_not_at_all() {
        let folder = std::env::temp_dir().join(format!("lexican-output-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("in-the-way")).unwrap();
        let files = |second: &str| [(folder.join("a"), b"1".to_vec()), (folder.join(second), b"2".to_vec())];
        assert!(write_all_whole(&files("no/such/folder")).is_err());
        assert!(write_all_whole(&files("in-the-way")).is_err());
        let entries = |folder: &Path| std::fs::read_dir(folder).unwrap().count();
        assert_eq!(entries(&folder), 2, "the folder in the way, and the file that was whole before it failed");
        write_all_whole(&files("b")).unwrap();
        assert_eq!(std::fs::read(folder.join("b")).unwrap(), b"2");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_written_to_and_not_replaced() {
        write_whole(Path::new("/dev/null"), b"nothing").unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    }
}
