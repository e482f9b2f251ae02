//! Writes logs of any format.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use lexican_runtime::host::kept::Replacement;

use super::codec::{Encode, WriteError};
use super::{Format, Record};
use crate::text::files::Existing;

enum Output {
    File(BufWriter<LogFile>),
    Stream(Box<dyn Write + Send>),
    Memory,
}

enum LogFile {
    /// Created with the first bytes.
    Wanted(PathBuf, Existing),
    /// Written in place.
    Growing(File),
    /// Written under another name, and renamed at the end.
    Beside(Replacement),
}

impl LogFile {
    fn open(&mut self) -> io::Result<&mut File> {
        if let LogFile::Wanted(path, existing) = self {
            let mut options = OpenOptions::new();
            options.write(true);
            match existing {
                Existing::Keep => options.create_new(true),
                Existing::Replace => options.create(true).truncate(true),
            };
            *self = LogFile::Growing(options.open(path)?);
        }
        match self {
            LogFile::Growing(file) => Ok(file),
            LogFile::Beside(new) => Ok(new.file()),
            LogFile::Wanted(..) => unreachable!("it was opened"),
        }
    }
}

impl Write for LogFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.open()?.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.open()?.flush()
    }
}

impl Seek for LogFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.open()?.seek(to)
    }
}

/// Writes a log: frames one after another, then [`finish`](Self::finish).
pub struct Writer {
    output: Output,
    encode: Box<dyn Encode>,
    bytes: Vec<u8>,
    written: u64,
    unflushed: bool,
}

impl Writer {
    /// Writes to a file that is created with the first frame and grows.
    ///
    /// Errors: [`io::ErrorKind::AlreadyExists`] if the file exists and is to be kept.
    pub fn create(path: &Path, format: Format, existing: Existing) -> io::Result<Self> {
        Self::to_file(path, format, existing, || Ok(LogFile::Wanted(path.to_owned(), existing)))
    }

    /// Writes to a file that appears, or replaces an existing one, only when complete.
    pub fn create_whole(path: &Path, format: Format, existing: Existing) -> io::Result<Self> {
        Self::to_file(path, format, existing, || Replacement::begin(path).map(LogFile::Beside))
    }

    fn to_file(
        path: &Path,
        format: Format,
        existing: Existing,
        file: impl FnOnce() -> io::Result<LogFile>,
    ) -> io::Result<Self> {
        existing.guard(path, [])?;
        // The beginning of a pipe or device cannot be rewritten; a folder is refused here.
        if path.exists() && !path.is_file() {
            return Ok(Self::new(File::create(path)?, format));
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder {
            std::fs::metadata(folder)?;
        }
        Ok(Self::of(Output::File(BufWriter::with_capacity(BUFFER, file()?)), format))
    }

    /// Writes to any output, buffered.
    pub fn new(output: impl Write + Send + 'static, format: Format) -> Self {
        Self::of(Output::Stream(Box::new(BufWriter::with_capacity(BUFFER, output))), format)
    }

    /// Writes to memory; [`into_bytes`](Self::into_bytes) returns the log.
    #[must_use]
    pub fn in_memory(format: Format) -> Self {
        Self::of(Output::Memory, format)
    }

    fn of(output: Output, format: Format) -> Self {
        Writer { output, encode: format.encoder(), bytes: Vec::new(), written: 0, unflushed: false }
    }

    /// Writes a frame. Times should not go back: formats with relative times cannot express a frame before the first.
    ///
    /// If the format cannot express the frame, the log stays as it was.
    pub fn write(&mut self, record: &Record) -> Result<(), WriteError> {
        self.encode.record(&mut self.bytes, record)?;
        self.unflushed = true;
        self.put()
    }

    /// Hands everything written so far to the operating system; the log can be read up to here.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        if !std::mem::take(&mut self.unflushed) {
            return Ok(());
        }
        self.encode.flush(&mut self.bytes);
        self.settle()
    }

    /// Writes the end of the log.
    pub fn finish(mut self) -> Result<(), WriteError> {
        self.encode.flush(&mut self.bytes);
        self.encode.finish(&mut self.bytes);
        self.settle()?;
        if let Output::File(file) = self.output
            && let LogFile::Beside(new) = file.into_inner().map_err(io::IntoInnerError::into_error)?
        {
            new.complete()?;
        }
        Ok(())
    }

    /// Writes the end of the log, and returns its bytes.
    #[must_use]
    pub fn into_bytes(mut self) -> Vec<u8> {
        self.encode.flush(&mut self.bytes);
        self.encode.finish(&mut self.bytes);
        self.bytes
    }

    /// The size of the log so far, in bytes, without what the format holds back.
    #[must_use]
    pub const fn written(&self) -> u64 {
        self.written
    }

    fn put(&mut self) -> Result<(), WriteError> {
        // One call: the buffer passes on each piece whole, so that a file never ends within a frame.
        match &mut self.output {
            Output::File(file) => file.write_all(&self.bytes)?,
            Output::Stream(stream) => stream.write_all(&self.bytes)?,
            Output::Memory => return Ok(()),
        }
        self.written += self.bytes.len() as u64;
        self.bytes.clear();
        Ok(())
    }

    fn settle(&mut self) -> Result<(), WriteError> {
        self.put()?;
        match &mut self.output {
            Output::Stream(stream) => stream.flush()?,
            Output::Memory => {}
            Output::File(file) => {
                if let Some(beginning) = self.encode.beginning(self.written) {
                    file.seek(SeekFrom::Start(0))?;
                    file.write_all(&beginning)?;
                    file.seek(SeekFrom::End(0))?;
                }
                file.flush()?;
            }
        }
        Ok(())
    }
}

const BUFFER: usize = 64 * 1024;
