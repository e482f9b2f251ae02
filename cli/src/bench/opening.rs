//! How the page is opened so that nobody else learns its token.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// A file that sends the browser to the page, and that only this user can read: every user of the machine sees with what a program was
/// started. It goes when this is dropped.
pub(super) struct Opening {
    _file: NamedTempFile,
}

impl Opening {
    /// Opens an address in the user's browser.
    pub(super) fn of(url: &str) -> io::Result<Self> {
        let file = write(url, &folder())?;
        open::that_detached(file.path())?;
        Ok(Opening { _file: file })
    }
}

/// That for files of running programs, which is this user's own; else that for any temporary ones.
fn folder() -> PathBuf {
    let own = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    own.filter(|folder| folder.is_absolute() && folder.is_dir()).unwrap_or_else(std::env::temp_dir)
}

fn write(url: &str, folder: &Path) -> io::Result<NamedTempFile> {
    // On Unix only its owner may read and write it.
    let mut file = Builder::new().prefix("lexican-bench-").suffix(".html").tempfile_in(folder)?;
    let url = url.replace('&', "&amp;");
    writeln!(
        file,
        "<!doctype html>\n<meta charset=\"utf-8\">\n<meta name=\"referrer\" content=\"no-referrer\">\n\
         <meta http-equiv=\"refresh\" content=\"0; url={url}\">\n<title>lexican bench</title>\n<a href=\"{url}\">lexican bench</a>"
    )?;
    Ok(file)
}
