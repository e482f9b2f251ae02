//! A log in several files, of which only the newest are kept.

use std::collections::VecDeque;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::codec::WriteError;
use super::{Format, Record, Writer};
use crate::text::files::Existing;

/// Size limits of a recording; without limits it is one file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// A file that reaches this size, in bytes, is followed by the next one.
    pub file: Option<u64>,
    /// When all files together exceed this size, in bytes, the oldest is deleted.
    pub all: Option<u64>,
}

/// A recording: one file, or numbered ones side by side, `bus-0001.log` and so on.
pub struct Files {
    path: PathBuf,
    format: Format,
    limits: Limits,
    existing: Existing,
    writer: Writer,
    /// Finished files that were not deleted, with their sizes.
    finished: VecDeque<(PathBuf, u64)>,
    finished_bytes: u64,
    number: u32,
}

impl Files {
    /// Begins the first file. A limit for all files requires one for each file.
    ///
    /// Errors: [`io::ErrorKind::AlreadyExists`] if a file exists and is to be kept, including a numbered one that the
    /// recording would reach later.
    pub fn create(path: &Path, format: Format, limits: Limits, existing: Existing) -> io::Result<Self> {
        let first = if limits.file.is_some() { numbered(path, 1) } else { path.to_owned() };
        if limits.file.is_some()
            && existing == Existing::Keep
            && let Some(name) = other_numbered(path)
        {
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, format!("{name} is there already")));
        }
        Ok(Files {
            path: path.to_owned(),
            format,
            limits,
            existing,
            writer: Writer::create(&first, format, existing)?,
            finished: VecDeque::new(),
            finished_bytes: 0,
            number: 1,
        })
    }

    /// Writes to a stream instead of files.
    #[must_use]
    pub fn stream(writer: Writer, format: Format) -> Self {
        Files {
            path: PathBuf::new(),
            format,
            limits: Limits::default(),
            existing: Existing::Keep,
            writer,
            finished: VecDeque::new(),
            finished_bytes: 0,
            number: 1,
        }
    }

    /// Writes a frame; begins the next file if this one is full.
    pub fn write(&mut self, record: &Record) -> Result<(), WriteError> {
        self.writer.write(record)?;
        if self.limits.file.is_some_and(|limit| self.writer.written() >= limit) {
            self.number += 1;
            let next = Writer::create(&numbered(&self.path, self.number), self.format, self.existing)?;
            let full = std::mem::replace(&mut self.writer, next);
            full.finish()?;
            let path = numbered(&self.path, self.number - 1);
            let bytes = fs::metadata(&path)?.len();
            self.finished.push_back((path, bytes));
            self.finished_bytes += bytes;
        }
        let most = self.limits.all.unwrap_or(u64::MAX);
        while self.written() > most
            && let Some((path, bytes)) = self.finished.pop_front()
        {
            self.finished_bytes -= bytes;
            fs::remove_file(path)?;
        }
        Ok(())
    }

    /// The current file.
    #[must_use]
    pub fn path(&self) -> PathBuf {
        if self.limits.file.is_some() { numbered(&self.path, self.number) } else { self.path.clone() }
    }

    /// The size of all files that were not deleted, in bytes.
    #[must_use]
    pub const fn written(&self) -> u64 {
        self.finished_bytes + self.writer.written()
    }

    /// See [`Writer::flush`].
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.writer.flush()
    }

    /// See [`Writer::finish`].
    pub fn finish(self) -> Result<(), WriteError> {
        self.writer.finish()
    }
}

/// `bus.log` as `bus-0001.log`.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number:04}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Another numbered file of the same name in the folder.
fn other_numbered(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let names = fs::read_dir(folder).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let is_numbered = |name: &String| {
        let number = Path::new(name).file_stem().and_then(|stem| stem.to_str()?.rsplit_once('-')?.1.parse().ok());
        number.is_some_and(|number| numbered(path, number).file_name().is_some_and(|own| own == name.as_str()))
    };
    names.filter(is_numbered).min()
}

#[cfg(test)]
mod tests {
    use super::super::{Direction, INTERFACE, Reader};
    use super::*;
    use lexican_runtime::{CobId, Frame, Instant};

    #[test]
    fn full_files_are_followed_by_others_and_the_oldest_are_deleted() {
        let folder = std::env::temp_dir().join(format!("lexican-log-files-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let limits = Limits { file: Some(100), all: Some(250) };
        let mut files = Files::create(&folder.join("bus.log"), Format::Candump, limits, Existing::Keep).unwrap();
        let record = |us| Record {
            at: Instant::from_micros(us),
            interface: INTERFACE.into(),
            direction: Direction::Received,
            frame: Frame::from_array(CobId::SYNC, []),
        };
        // 30 bytes each, four in a file.
        (0..18).for_each(|us| files.write(&record(us)).unwrap());
        assert_eq!((files.path(), files.written()), (folder.join("bus-0005.log"), 180));
        files.finish().unwrap();
        let mut left: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        left.sort();
        assert_eq!(left, ["bus-0004.log", "bus-0005.log"].map(|name| folder.join(name)));
        let times = left.iter().flat_map(|path| Reader::open(path, None).unwrap());
        let times: Vec<_> = times.map(|record| record.unwrap().at.as_micros()).collect();
        assert_eq!(times, [12, 13, 14, 15, 16, 17]);
        // A recording that would reach an existing file later does not begin.
        let again = |existing| Files::create(&folder.join("bus.log"), Format::Candump, limits, existing).map(|_| ());
        assert_eq!(again(Existing::Keep).unwrap_err().to_string(), "bus-0004.log is there already");
        again(Existing::Replace).unwrap();
        assert!(!folder.join("bus-0001.log").exists(), "a file is made with the first frames");
        fs::remove_dir_all(folder).unwrap();
    }
}
