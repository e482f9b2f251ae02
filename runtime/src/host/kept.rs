//! Files in which devices store their parameters: a text with a checksum, replaced as a whole.
//!
//! ```text
//! lexican parameters 2
//! 2410:01 64 00
//! end 1 entries, crc32 3B0D4C1F
//! ```

use std::borrow::ToOwned;
use std::ffi::OsString;
use std::format;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::string::{String, ToString};
use std::vec::Vec;

use crate::wire::crc::Crc32;

/// The kind of a stored text, in its first line: `lexican parameters 2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptFormat {
    /// The name, such as `lexican parameters`.
    pub name: &'static str,
    /// The version of its lines.
    pub version: u32,
}

/// Why a text is not a valid stored text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeptError {
    /// The text is empty, or all zero.
    #[error("empty, as after a power failure; remove it to begin with a new device, or bring back an older copy")]
    Empty,
    /// Another program has written it.
    #[error("the first line is not `{name} {version}`; name another file", name = .0.name, version = .0.version)]
    Foreign(KeptFormat),
    /// Another version of lexican has written it.
    #[error("of another version than {version}; name another file, or remove this one", version = .0.version)]
    Version(KeptFormat),
    /// Its end is missing, or its checksum is wrong.
    #[error(
        "cut off or changed: the last line and its checksum do not fit the rest; remove it to begin with a new device"
    )]
    Torn,
}

impl KeptFormat {
    /// The text with these lines. Lines with a colon count as entries of the dictionary: `2410:01 64 00`.
    #[must_use]
    pub fn seal(&self, lines: &[String]) -> String {
        let mut text = format!("{} {}\n", self.name, self.version);
        lines.iter().for_each(|line| text.extend([line, "\n"]));
        let end = end(&text);
        text + &end + "\n"
    }

    /// The lines of a text.
    ///
    /// Errors: see [`KeptError`]. No text with a changed, missing or additional character is accepted, except for the
    /// line ends of Windows.
    pub fn unseal(&self, text: &str) -> Result<Vec<String>, KeptError> {
        let text = text.replace("\r\n", "\n");
        if text.is_empty() || text.bytes().all(|byte| byte == 0) {
            return Err(KeptError::Empty);
        }
        let version = text.lines().next().and_then(|first| first.strip_prefix(self.name)?.strip_prefix(' '));
        if version.ok_or(KeptError::Foreign(*self))? != self.version.to_string() {
            return Err(KeptError::Version(*self));
        }
        let (body, last) = text.strip_suffix('\n').and_then(|text| text.rsplit_once('\n')).ok_or(KeptError::Torn)?;
        let body = format!("{body}\n");
        if last != end(&body) {
            return Err(KeptError::Torn);
        }
        Ok(body.lines().skip(1).map(str::to_owned).collect())
    }
}

fn end(body: &str) -> String {
    let entries = body.lines().filter(|line| line.contains(':')).count();
    let mut crc = Crc32::new();
    crc.update(body.as_bytes());
    format!("end {entries} entries, crc32 {:08X}", crc.get())
}

/// A file that is replaced as a whole: after a power failure it holds the old text or the new one.
#[derive(Clone, Debug)]
pub struct KeptFile {
    path: PathBuf,
    /// The content; `None` if that is not known.
    saved: Option<String>,
}

impl KeptFile {
    /// The file and its content; `None` if there is no such file yet.
    ///
    /// Errors: the error of the operating system, or [`io::ErrorKind::InvalidInput`] if the path is a folder, a
    /// terminal or `/dev/null`.
    pub fn open(path: &Path) -> io::Result<(Self, Option<String>)> {
        match fs::metadata(path) {
            Ok(found) if !found.is_file() => {
                Err(io::Error::new(io::ErrorKind::InvalidInput, "not a file that can be replaced"))
            }
            // A symbolic link is kept: its target is replaced.
            Ok(_) => {
                let path = fs::canonicalize(path)?;
                let text = String::from_utf8_lossy(&fs::read(&path)?).into_owned();
                Ok((KeptFile { path, saved: Some(text.clone()) }, Some(text)))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                Ok((KeptFile { path: path.to_owned(), saved: None }, None))
            }
            Err(error) => Err(error),
        }
    }

    /// Replaces the content, unless it is already `text`.
    ///
    /// After an error the content is unchanged.
    pub fn save(&mut self, text: String) -> io::Result<()> {
        if self.saved.as_ref() == Some(&text) {
            return Ok(());
        }
        replace(&self.path, text.as_bytes())?;
        self.saved = Some(text);
        Ok(())
    }
}

/// Writes a new file next to the old one, and then replaces that: if the power fails, one of them is complete.
///
/// After an error the old file is unchanged.
pub fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut new = Replacement::begin(path)?;
    new.file().write_all(content)?;
    new.complete()
}

/// A file that is being written next to the one that it will replace. If it is dropped before it is complete, it is
/// removed.
#[derive(Debug)]
pub struct Replacement {
    path: PathBuf,
    new: PathBuf,
    file: File,
    is_complete: bool,
}

impl Replacement {
    /// Makes an empty file next to `path`, or next to the target of a symbolic link. Its name, `.NAME.lexican-new`, is
    /// reserved for this, so a file left by a killed program is overwritten.
    pub fn begin(path: &Path) -> io::Result<Self> {
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let mut name = OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(".lexican-new");
        let new = path.with_file_name(name);
        let file = File::create(&new)?;
        Ok(Replacement { path, new, file, is_complete: false })
    }

    /// The file that is being written.
    pub const fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Renames the file to its final name. The content is synced first; otherwise the name could lead to an empty file.
    ///
    /// After an error the old file is unchanged.
    pub fn complete(mut self) -> io::Result<()> {
        if let Ok(old) = fs::metadata(&self.path) {
            self.file.set_permissions(old.permissions())?;
        }
        self.file.sync_all()?;
        sync_folder(&self.path)?;
        fs::rename(&self.new, &self.path)?;
        self.is_complete = true;
        sync_folder(&self.path)
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        if !self.is_complete {
            // The first error is the one to report.
            let _ = fs::remove_file(&self.new);
        }
    }
}

/// Syncs a file name, which is stored in its folder.
#[cfg(unix)]
fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    File::open(folder)?.sync_all()
}

/// Other systems cannot open a folder; the journal of the file system has the rename.
#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    const FORMAT: KeptFormat = KeptFormat { name: "lexican parameters", version: 2 };

    fn lines() -> Vec<String> {
        vec!["node 5".to_owned(), "2410:01 64 00".to_owned()]
    }

    #[test]
    fn what_is_sealed_is_unsealed() {
        let text = FORMAT.seal(&lines());
        assert!(text.starts_with("lexican parameters 2\nnode 5\n2410:01 64 00\nend 1 entries, crc32 "), "{text}");
        assert_eq!(FORMAT.unseal(&text), Ok(lines()));
        assert_eq!(FORMAT.unseal(&text.replace('\n', "\r\n")), Ok(lines()));
        assert_eq!(FORMAT.unseal(&FORMAT.seal(&[])), Ok(vec![]));
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_refused() {
        let text = FORMAT.seal(&lines());
        for bit in 0..text.len() * 8 {
            let mut bytes = text.clone().into_bytes();
            bytes[bit / 8] ^= 1 << (bit % 8);
            let changed = String::from_utf8_lossy(&bytes);
            assert!(FORMAT.unseal(&changed).is_err(), "bit {bit}: {changed}");
        }
        for end in 0..text.len() {
            assert!(FORMAT.unseal(&text[..end]).is_err(), "{end}");
        }
    }

    #[test]
    fn foreign_texts_are_refused_with_the_reason() {
        let check = |text: &str, expected| assert_eq!(FORMAT.unseal(text), Err(expected), "{text:?}");
        check("", KeptError::Empty);
        check("\0\0\0", KeptError::Empty);
        check("%PDF-1.4\n", KeptError::Foreign(FORMAT));
        check("lexican parameters 1\nend\n", KeptError::Version(FORMAT));
        check("lexican parameters 2\n2410:01 64 00\n", KeptError::Torn);
        assert!(KeptError::Empty.to_string().contains("remove it to begin with a new device"));
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("lexican-kept-{}-{name}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn a_file_is_replaced_and_unchanged_when_it_cannot_be() {
        let folder = folder("replace");
        let path = folder.join("kept.txt");
        let (mut file, held) = KeptFile::open(&path).unwrap();
        assert_eq!(held, None);
        file.save("one".to_owned()).unwrap();
        assert_eq!(KeptFile::open(&path).unwrap().1.as_deref(), Some("one"));
        // The name of the new file is taken.
        fs::create_dir(folder.join(".kept.txt.lexican-new")).unwrap();
        assert!(file.save("two".to_owned()).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"one");
        fs::remove_dir(folder.join(".kept.txt.lexican-new")).unwrap();
        file.save("two".to_owned()).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        fs::remove_dir_all(&folder).unwrap();
    }

    /// A program that is killed drops nothing.
    #[test]
    fn what_a_killed_program_has_left_is_in_nobodys_way() {
        let folder = folder("killed");
        let (path, own) = (folder.join("out"), folder.join("out.new"));
        fs::write(&own, "somebody's own").unwrap();
        let mut killed = Replacement::begin(&path).unwrap();
        killed.file().write_all(b"half of a long text").unwrap();
        core::mem::forget(killed);
        let mut next = Replacement::begin(&path).unwrap();
        next.file().write_all(b"whole").unwrap();
        next.complete().unwrap();
        assert_eq!(
            (fs::read(&path).unwrap(), fs::read(&own).unwrap()),
            (b"whole".to_vec(), b"somebody's own".to_vec())
        );
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_folder_is_not_replaced() {
        let folder = folder("none");
        assert_eq!(KeptFile::open(&folder).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn symbolic_links_and_permissions_remain() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = folder("link");
        let (target, link) = (folder.join("target"), folder.join("link"));
        fs::write(&target, "one").unwrap();
        fs::set_permissions(&target, fs::Permissions::from_mode(0o600)).unwrap();
        symlink(&target, &link).unwrap();
        KeptFile::open(&link).unwrap().0.save("two".to_owned()).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"two");
        assert_eq!(fs::metadata(&target).unwrap().permissions().mode() & 0o777, 0o600);
        fs::remove_dir_all(&folder).unwrap();
    }
}
