//! Why nothing was generated.

use std::fmt;
use std::path::PathBuf;

/// Why nothing was generated.
///
/// `Debug` prints all findings with the lines of the data sheet: it is what a build script shows that returns the error
/// from `main` or unwraps it. `Display` is one line.
#[derive(thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Error {
    /// Neither [`Config::eds`](crate::Config::eds) nor [`Config::device`](crate::Config::device) was called.
    #[error("no data sheet is named: call `.eds(\"path/to.eds\")` or `.device(\"vendor/device\")`")]
    NoDataSheet,
    /// An overlay was given before any data sheet that it could correct.
    #[error("the overlay {} comes before the data sheet that it corrects", .0.display())]
    OverlayFirst(PathBuf),
    /// A name was given before any data sheet that it could name the file of.
    #[error("the name `{0}` comes before the data sheet whose file it names")]
    ModuleFirst(String),
    /// No finding has a code that was denied or allowed.
    #[error("there is no finding `{code}`{}", did_you_mean(.near))]
    UnknownCode {
        code: String,
        /// Codes that look like it.
        near: Vec<&'static str>,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    Read { path: PathBuf, reason: std::io::Error },
    /// A file cannot be written.
    #[error("cannot write {}: {reason}", path.display())]
    Write { path: PathBuf, reason: std::io::Error },
    /// A file is no data sheet: it is empty, or it is binary.
    #[error("{} is {what}, not an electronic data sheet", path.display())]
    NotADataSheet {
        path: PathBuf,
        /// `empty`, `a binary file`.
        what: &'static str,
    },
    /// The device library has no such device.
    #[error("the device library has no `{name}`{}", did_you_mean(.near))]
    UnknownDevice {
        name: String,
        /// Names that look like it.
        near: Vec<&'static str>,
    },
    /// Neither [`Config::out_dir`](crate::Config::out_dir) was called nor does the environment name a folder.
    #[error("`OUT_DIR` is not set: call this from a build script, or name a folder with `.out_dir(..)`")]
    NoOutDir,
    /// The path of the runtime is not a path of Rust.
    #[error("`{0}` is not the path of a crate or module, such as `::lexican_runtime`")]
    RuntimePath(String),
    /// Two data sheets would be written to one file.
    #[error("two data sheets would be written to `{0}.rs`: name one of them with `.module(\"…\")`")]
    SameName(String),
    /// The data sheet or its overlay has errors, or no object at all.
    #[error("{summary}")]
    Findings {
        summary: String,
        /// All findings with the lines they are about.
        report: String,
    },
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Findings { summary, report } => write!(f, "{summary}\n\n{report}"),
            other => fmt::Display::fmt(other, f),
        }
    }
}

fn did_you_mean(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        names => format!("; did you mean `{}`?", names.join("`, `")),
    }
}
