//! Bytes and lines of a log, with where they are.

use std::io::{self, BufRead, BufReader, Chain, Cursor, Read};

/// Longer than any line of a log, so that a file without line ends is refused.
const LONGEST_LINE: u64 = 64 * 1024;

/// The beginning of the log, which its format was recognised by, and the rest.
type Source = Chain<Cursor<Vec<u8>>, Box<dyn Read + Send>>;

pub(super) struct Input {
    source: BufReader<Source>,
    line: Vec<u8>,
    /// The number of the line that was read last.
    pub(super) lines: u64,
    /// How many bytes were read.
    pub(super) offset: u64,
}

/// Why reading does not go on.
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

/// What is wrong in a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Flaw {
    /// A line does not end.
    #[error("the line does not end")]
    LongLine,
    /// A time stamp cannot be read.
    #[error("the line has no time stamp")]
    Time,
    /// An interface is missing.
    #[error("the line names no interface")]
    Interface,
    /// A frame cannot be read, or cannot be on a bus.
    #[error("this is no CAN frame")]
    Frame,
    /// A version that is not known.
    #[error("version {major}.{minor} of the format is not known")]
    Version {
        /// Before the dot.
        major: u16,
        /// After the dot.
        minor: u16,
    },
    /// The table's columns lack one that is needed.
    #[error("the columns lack time, identifier, or length")]
    Columns,
    /// The packets are not those of a CAN interface.
    #[error("the packets are of link type {0}, not of SocketCAN, which is 227")]
    LinkType(u32),
    /// A block has a length that it cannot have.
    #[error("a block of {0} bytes cannot be here")]
    Length(u64),
    /// The block has no known kind of byte order.
    #[error("the byte order is neither little nor big endian")]
    ByteOrder,
    /// More interfaces than any machine has.
    #[error("there are more than {MOST_INTERFACES} interfaces")]
    Interfaces,
    /// A packet of an interface that was not described before.
    #[error("a packet is of interface {0}, which is not described")]
    UnknownInterface(u32),
    /// Something else stands where an object begins.
    #[error("there is no object here")]
    Object,
    /// A container is compressed in an unknown way.
    #[error("compression method {0} is not known")]
    Compression(u16),
    /// A compressed container is damaged, or becomes far too large.
    #[error("a compressed container cannot be unpacked")]
    Inflate,
}

/// A bound for what a file can make a reader keep.
pub(super) const MOST_INTERFACES: usize = 1024;

impl Input {
    pub(super) fn new(head: Vec<u8>, rest: Box<dyn Read + Send>) -> Self {
        let source = BufReader::with_capacity(64 * 1024, Cursor::new(head).chain(rest));
        Input { source, line: Vec::new(), lines: 0, offset: 0 }
    }

    /// The next line, without its end, and whether it has one; `None` at the end. Bytes that are no UTF-8, as in comments of
    /// older tools, become replacement characters.
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

    /// Fills `bytes`; `false` at the end of the log.
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

    /// The next `N` bytes of something that has begun.
    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut bytes = [0; N];
        if self.fill(&mut bytes)? { Ok(bytes) } else { Err(Fault::Cut) }
    }

    /// Replaces `bytes` by the next `count` ones; takes no more memory than there are bytes.
    pub(super) fn vec(&mut self, bytes: &mut Vec<u8>, count: u64) -> Result<(), Fault> {
        bytes.clear();
        let read = self.source.by_ref().take(count).read_to_end(bytes)? as u64;
        self.offset += read;
        if read == count { Ok(()) } else { Err(Fault::Cut) }
    }

    /// Passes over bytes.
    pub(super) fn skip(&mut self, count: u64) -> Result<(), Fault> {
        let skipped = io::copy(&mut self.source.by_ref().take(count), &mut io::sink())?;
        self.offset += skipped;
        if skipped == count { Ok(()) } else { Err(Fault::Cut) }
    }
}
