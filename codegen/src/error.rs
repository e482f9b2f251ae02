//! The errors of generating.

use std::fmt;
use std::path::PathBuf;

/// Why nothing was generated.
///
/// `Debug` prints all findings with the lines of the data sheet, because a build script shows it if `main` returns the
/// error or unwraps it. `Display` is one line.
#[derive(thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Error {
    /// Neither [`Config::eds`](crate::Config::eds) nor [`Config::device`](crate::Config::device) was called.
    #[error("no data sheet is named: call `.eds(\"path/to.eds\")` or `.device(\"vendor/device\")`")]
    NoDataSheet,
    /// An overlay was given before any data sheet.
    #[error("the overlay {} comes before the data sheet that it corrects", .0.display())]
    OverlayFirst(PathBuf),
    /// A module name was given before any data sheet.
    #[error("the name `{0}` comes before the data sheet whose file it names")]
    ModuleFirst(String),
    /// A denied or allowed code does not exist.
    #[error("there is no finding `{code}`{}", did_you_mean(.near))]
    UnknownCode {
        code: String,
        /// Similar codes.
        near: Vec<&'static str>,
    },
    /// A file cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    Read { path: PathBuf, reason: std::io::Error },
    /// A file cannot be written.
    #[error("cannot write {}: {reason}", path.display())]
    Write { path: PathBuf, reason: std::io::Error },
    /// A file is empty or binary, and so no data sheet.
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
        /// Similar names.
        near: Vec<&'static str>,
    },
    /// Neither [`Config::out_dir`](crate::Config::out_dir) nor the environment variable `OUT_DIR` names a folder.
    #[error("`OUT_DIR` is not set: call this from a build script, or name a folder with `.out_dir(..)`")]
    NoOutDir,
    /// The path of the runtime is not a Rust path.
    #[error("`{0}` is not the path of a crate or module, such as `::lexican_runtime`")]
    RuntimePath(String),
    /// Two data sheets would be written to the same file.
    #[error("two data sheets would be written to `{0}.rs`: name one of them with `.module(\"…\")`")]
    SameName(String),
    /// The data sheet or its overlay has errors, or no object at all.
    #[error("{summary}")]
    Findings {
        summary: String,
        /// All findings with their lines.
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
