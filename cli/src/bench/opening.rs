//! Opens the page without showing its token to other users.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// A file that redirects the browser to the page and that only this user can read, because all users can see the
/// command lines of programs. Deleted when dropped.
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

/// The user's own folder for running programs, or else the one for temporary files.
fn folder() -> PathBuf {
    let own = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    own.filter(|folder| folder.is_absolute() && folder.is_dir()).unwrap_or_else(std::env::temp_dir)
}

fn write(url: &str, folder: &Path) -> io::Result<NamedTempFile> {
    // On Unix, tempfile makes it readable by its owner only.
    let mut file = Builder::new().prefix("lexican-bench-").suffix(".html").tempfile_in(folder)?;
    let url = url.replace('&', "&amp;");
    writeln!(
        file,
        "<!doctype html>\n<meta charset=\"utf-8\">\n<meta name=\"referrer\" content=\"no-referrer\">\n\
         <meta http-equiv=\"refresh\" content=\"0; url={url}\">\n<title>lexican bench</title>\n<a href=\"{url}\">lexican bench</a>"
    )?;
    Ok(file)
}
