//! Writing a log of any format.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use super::codec::{Encode, WriteError};
use super::{Format, Record, asc, blf, candump, pcap, pcapng, trc};

enum Output {
    File(BufWriter<File>),
    Stream(Box<dyn Write + Send>),
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
    /// Makes a file, or replaces it.
    ///
    /// # Errors
    ///
    /// When the operating system refuses.
    pub fn create(path: &Path, format: Format) -> io::Result<Self> {
        let file = File::create(path)?;
        // The beginning of a pipe or a device cannot be written again.
        let is_regular = file.metadata()?.is_file();
        let file = BufWriter::with_capacity(BUFFER, file);
        Ok(Self::of(if is_regular { Output::File(file) } else { Output::Stream(Box::new(file)) }, format))
    }

    /// Writes to anywhere, through a buffer.
    pub fn new(output: impl Write + Send + 'static, format: Format) -> Self {
        Self::of(Output::Stream(Box::new(BufWriter::with_capacity(BUFFER, output))), format)
    }

    fn of(output: Output, format: Format) -> Self {
        let encode: Box<dyn Encode> = match format {
            Format::Candump => Box::new(candump::Write),
            Format::Pcap => Box::new(pcap::Write::default()),
            Format::Pcapng => Box::new(pcapng::Write::default()),
            Format::Asc => Box::new(asc::Write::default()),
            Format::Trc(version) => Box::new(trc::Write::new(version)),
            Format::Blf => Box::new(blf::Write::default()),
        };
        Writer { output, encode, bytes: Vec::new(), written: 0, unflushed: false }
    }

    /// Writes a frame. Times should not go back: formats with relative times cannot have one before the first.
    ///
    /// # Errors
    ///
    /// [`WriteError`]; a frame that the format cannot express leaves the log as it was.
    pub fn write(&mut self, record: &Record) -> Result<(), WriteError> {
        self.encode.record(&mut self.bytes, record)?;
        self.unflushed = true;
        self.put()
    }

    /// Hands everything to the operating system, as a log that can be read up to here.
    ///
    /// # Errors
    ///
    /// [`WriteError::Io`].
    pub fn flush(&mut self) -> Result<(), WriteError> {
        if !std::mem::take(&mut self.unflushed) {
            return Ok(());
        }
        self.encode.flush(&mut self.bytes);
        self.settle()
    }

    /// Writes what belongs at the end.
    ///
    /// # Errors
    ///
    /// [`WriteError::Io`].
    pub fn finish(mut self) -> Result<(), WriteError> {
        self.encode.flush(&mut self.bytes);
        self.encode.finish(&mut self.bytes);
        self.settle()
    }

    /// How many bytes the log has so far; those that a format holds back are not counted.
    #[must_use]
    pub const fn written(&self) -> u64 {
        self.written
    }

    fn put(&mut self) -> Result<(), WriteError> {
        // In one piece: the buffer passes on whole pieces, so that a file is never cut in the middle of a frame.
        match &mut self.output {
            Output::File(file) => file.write_all(&self.bytes)?,
            Output::Stream(stream) => stream.write_all(&self.bytes)?,
        }
        self.written += self.bytes.len() as u64;
        self.bytes.clear();
        Ok(())
    }

    fn settle(&mut self) -> Result<(), WriteError> {
        self.put()?;
        match &mut self.output {
            Output::Stream(stream) => stream.flush()?,
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
