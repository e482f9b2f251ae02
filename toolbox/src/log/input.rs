//! The bytes and lines of a log, with their positions.

use std::io::{self, BufRead, BufReader, Chain, Cursor, Read};

/// Longer than any line of a log; a file without line ends is refused.
const LONGEST_LINE: u64 = 64 * 1024;

/// The first bytes, by which the format was recognised, followed by the rest.
type Source = Chain<Cursor<Vec<u8>>, Box<dyn Read + Send>>;

pub(super) struct Input {
    source: BufReader<Source>,
    line: Vec<u8>,
    /// The number of the last line read.
    pub(super) lines: u64,
    /// The number of bytes read.
    pub(super) offset: u64,
}

/// Why reading stopped.
pub(super) enum Fault {
    Io(io::Error),
    Flaw(Flaw),
    /// The log ends in the middle of a frame.
    Cut,
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Fault::Io(error)
    }
}

impl From<Flaw> for Fault {
    fn from(flaw: Flaw) -> Self {
        Fault::Flaw(flaw)
    }
}

/// What is wrong with a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Flaw {
    /// A line does not end.
    #[error("the line does not end")]
    LongLine,
    /// A time stamp cannot be read.
    #[error("the line has no time stamp")]
    Time,
    /// A frame names no interface.
    #[error("the line names no interface")]
    Interface,
    /// A frame cannot be read, or is not a valid CAN frame.
    #[error("this is no CAN frame")]
    Frame,
    /// An unknown version of the format.
    #[error("version {major}.{minor} of the format is not known")]
    Version {
        /// Before the dot.
        major: u16,
        /// After the dot.
        minor: u16,
    },
    /// A required column is missing.
    #[error("the columns lack time, identifier, or length")]
    Columns,
    /// The packets are not from a CAN interface.
    #[error("the packets are of link type {0}, not of SocketCAN, which is 227")]
    LinkType(u32),
    /// A block has an impossible length.
    #[error("a block of {0} bytes cannot be here")]
    Length(u64),
    /// The byte order of a section is not valid.
    #[error("the byte order is neither little nor big endian")]
    ByteOrder,
    /// More interfaces than any machine has.
    #[error("there are more than {MOST_INTERFACES} interfaces")]
    Interfaces,
    /// A packet refers to an interface that was not described.
    #[error("a packet is of interface {0}, which is not described")]
    UnknownInterface(u32),
    /// There is no object where one should begin.
    #[error("there is no object here")]
    Object,
    /// The compression of a container is unknown.
    #[error("compression method {0} is not known")]
    Compression(u16),
    /// A compressed container is damaged, or its unpacked size is too large.
    #[error("a compressed container cannot be unpacked")]
    Inflate,
}

/// The most interfaces that a file can make a reader remember.
pub(super) const MOST_INTERFACES: usize = 1024;

impl Input {
    pub(super) fn new(head: Vec<u8>, rest: Box<dyn Read + Send>) -> Self {
        let source = BufReader::with_capacity(64 * 1024, Cursor::new(head).chain(rest));
        Input { source, line: Vec::new(), lines: 0, offset: 0 }
    }

    /// The next line without its end, and whether it had one; `None` at the end of the log. Bytes that are not UTF-8,
    /// as in comments of older tools, become replacement characters.
    pub(super) fn line(&mut self) -> Result<Option<(std::borrow::Cow<'_, str>, bool)>, Fault> {
        self.line.clear();
        let read = self.source.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut self.line)? as u64;
        if read == 0 {
            return Ok(None);
        }
        self.lines += 1;
        self.offset += read;
        let ended = self.line.ends_with(b"\n");
        if read == LONGEST_LINE && !ended {
            return Err(Flaw::LongLine.into());
        }
        Ok(Some((String::from_utf8_lossy(&self.line), ended)))
    }

    /// Fills `bytes`; `false` if the log has ended.
    pub(super) fn fill(&mut self, bytes: &mut [u8]) -> Result<bool, Fault> {
        if self.source.fill_buf()?.is_empty() {
            return Ok(false);
        }
        match self.source.read_exact(bytes) {
            Ok(()) => {}
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Err(Fault::Cut),
            Err(error) => return Err(error.into()),
        }
        self.offset += bytes.len() as u64;
        Ok(true)
    }

    /// The next `N` bytes, in the middle of something.
    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut bytes = [0; N];
        if self.fill(&mut bytes)? { Ok(bytes) } else { Err(Fault::Cut) }
    }

    /// Replaces `bytes` by the next `count` bytes; allocates no more than the log has.
    pub(super) fn vec(&mut self, bytes: &mut Vec<u8>, count: u64) -> Result<(), Fault> {
        bytes.clear();
        let read = self.source.by_ref().take(count).read_to_end(bytes)? as u64;
        self.offset += read;
        if read == count { Ok(()) } else { Err(Fault::Cut) }
    }

    /// Skips bytes.
    pub(super) fn skip(&mut self, count: u64) -> Result<(), Fault> {
        let skipped = io::copy(&mut self.source.by_ref().take(count), &mut io::sink())?;
        self.offset += skipped;
        if skipped == count { Ok(()) } else { Err(Fault::Cut) }
    }
}
