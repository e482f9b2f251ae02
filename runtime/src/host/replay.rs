//! A log as a link, which receives the frames of the log.

use std::borrow::ToOwned;
use std::boxed::Box;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::string::String;

use super::candump::{self, NotALogLine};
use super::clock::{Clock, pause};
use super::{Incoming, Link, LinkError, Pace};
use crate::{Frame, Instant};

/// Longer than any line of `candump -L`: a file without line ends is refused.
const LONGEST_LINE: u64 = 4096;

/// A frame, and when it was received.
type Timed = io::Result<(Instant, Frame)>;

/// A [`Link`] that receives the frames of a log, written by `candump -L` or by lexican, and sends none.
///
/// Its time is that of the log, from the first frame on. After the last frame it returns
/// [`LinkError::Ended`].
pub struct Replay {
    frames: Box<dyn Iterator<Item = Timed> + Send>,
    next: Option<Timed>,
    now: Instant,
    /// In real time: the machine's clock, and the log's time at its start.
    pacer: Option<(Clock, Instant)>,
}

impl Replay {
    /// Opens a log, for the frames of `interface`, or for all.
    pub fn open(path: &Path, interface: Option<&str>, pace: Pace) -> Result<Self, ReplayError> {
        let file = File::open(path).map_err(|error| ReplayError::Io { path: path.to_owned(), error })?;
        let interface = interface.map(ToOwned::to_owned);
        let mut lines = Lines { path: path.to_owned(), lines: BufReader::new(file), line: 0, interface };
        let first = lines.read()?;
        Ok(Replay::from_first(first, Box::new(lines), pace))
    }

    /// A link over the frames of a log in another format.
    pub fn of(
        mut frames: impl Iterator<Item = io::Result<(Instant, Frame)>> + Send + 'static,
        pace: Pace,
    ) -> io::Result<Self> {
        let first = frames.next().transpose()?;
        Ok(Replay::from_first(first, Box::new(frames), pace))
    }

    fn from_first(first: Option<(Instant, Frame)>, frames: Box<dyn Iterator<Item = Timed> + Send>, pace: Pace) -> Self {
        let now = first.map_or(Instant::ZERO, |(at, _)| at);
        Replay { frames, next: first.map(Ok), now, pacer: (pace == Pace::RealTime).then(|| (Clock::new(), now)) }
    }

    fn pass_to(&mut self, to: Instant) {
        self.now = self.now.max(to);
        if let Some((clock, start)) = &self.pacer {
            let passed = clock.now().since(Instant::ZERO);
            pause(self.now.since(*start) - passed);
        }
    }
}

impl Link for Replay {
    fn is_real_time(&self) -> bool {
        self.pacer.is_some()
    }

    fn now(&self) -> Instant {
        self.now
    }

    fn send(&mut self, _: &Frame) -> Result<(), LinkError> {
        Err(LinkError::ReadOnly)
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        if let Some(Ok((at, _))) = self.next
            && at > until
        {
            self.pass_to(until);
            return Ok(None);
        }
        let (at, frame) = match self.next.take() {
            Some(Ok(next)) => next,
            Some(Err(error)) => return Err(LinkError::Io(error)),
            None => return Err(LinkError::Ended),
        };
        self.pass_to(at);
        // Time does not go back, even if that of the log does.
        self.next = self.frames.next().map(|next| next.map(|(at, frame)| (at.max(self.now), frame)));
        Ok(Some(Incoming::Frame(frame)))
    }
}

/// The lines of a log of `candump -L`.
struct Lines {
    path: PathBuf,
    lines: BufReader<File>,
    /// The number of the last line read.
    line: usize,
    interface: Option<String>,
}

impl Lines {
    fn read(&mut self) -> Result<Option<(Instant, Frame)>, ReplayError> {
        let mut text = String::new();
        loop {
            text.clear();
            let read = self.lines.by_ref().take(LONGEST_LINE).read_line(&mut text);
            let read = read.map_err(|error| ReplayError::Io { path: self.path.clone(), error })?;
            if read == 0 {
                return Ok(None);
            }
            self.line += 1;
            if read as u64 == LONGEST_LINE && !text.ends_with('\n') {
                return Err(ReplayError::LongLine { path: self.path.clone(), line: self.line });
            }
            if text.trim().is_empty() {
                continue;
            }
            let line: candump::Line =
                text.parse().map_err(|error| ReplayError::Line { path: self.path.clone(), line: self.line, error })?;
            if self.interface.as_ref().is_none_or(|interface| *interface == line.interface) {
                return Ok(Some((line.at, line.frame)));
            }
        }
    }
}

impl Iterator for Lines {
    type Item = Timed;

    fn next(&mut self) -> Option<Timed> {
        self.read().map_err(io::Error::other).transpose()
    }
}

/// Why a log cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum ReplayError {
    #[error("{}: {error}", path.display())]
    Io {
        path: PathBuf,
        /// The error of the operating system.
        error: io::Error,
    },
    /// A line is not one of a log.
    #[error("{}:{line}: {error}; write logs with `candump -L`", path.display())]
    Line {
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        error: NotALogLine,
    },
    /// A line is longer than any line of a log.
    #[error("{}:{line}: the line does not end; write logs with `candump -L`", path.display())]
    LongLine {
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::string::ToString;

    fn log(name: &str, text: &str) -> PathBuf {
        let path = std::env::temp_dir().join(std::format!("lexican-{}-{name}.log", std::process::id()));
        fs::write(&path, text).unwrap();
        path
    }

    fn at(us: u64) -> Instant {
        Instant::from_micros(us)
    }

    #[test]
    fn frames_come_at_their_time_and_then_the_log_ends() {
        let path = log("time", "(5.000100) can0 080#\n\n(5.000300) can1 081#\n(5.000200) can0 082#\n");
        let mut link = Replay::open(&path, None, Pace::Virtual).unwrap();
        assert_eq!(link.now(), at(5_000_100));
        let mut heard = |until| (link.receive_frame(at(until)).map(|frame| frame.map(|f| f.id().raw())), link.now());
        assert!(matches!(heard(9_000_000), (Ok(Some(0x080)), now) if now == at(5_000_100)));
        assert!(matches!(heard(5_000_150), (Ok(None), now) if now == at(5_000_150)));
        assert!(matches!(heard(9_000_000), (Ok(Some(0x081)), now) if now == at(5_000_300)));
        assert!(matches!(heard(9_000_000), (Ok(Some(0x082)), now) if now == at(5_000_300)));
        assert!(matches!(heard(9_000_000), (Err(LinkError::Ended), _)));
        fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_line_without_end_is_not_read_to_its_end() {
        let frame = "(5.000100) can0 080#\n";
        let path = log("long", &std::format!("{frame}{}", " ".repeat(LONGEST_LINE as usize)));
        let mut link = Replay::open(&path, None, Pace::Virtual).unwrap();
        assert_eq!(link.receive_frame(at(9_000_000)).unwrap().map(|frame| frame.id().raw()), Some(0x080));
        let error = link.receive(at(9_000_000)).unwrap_err().to_string();
        assert!(error.contains(".log:2: the line does not end"), "{error}");
        fs::write(&path, std::format!("{}{frame}", " ".repeat(LONGEST_LINE as usize - frame.len()))).unwrap();
        assert!(Replay::open(&path, None, Pace::Virtual).is_ok());
        fs::remove_file(path).unwrap();
    }

    #[test]
    fn frames_of_other_interfaces_are_skipped_and_none_are_sent() {
        let path = log("interface", "(5.000100) can0 080#\n(5.000300) can1 081#\n");
        let mut link = Replay::open(&path, Some("can1"), Pace::Virtual).unwrap();
        let frame = link.receive_frame(at(9_000_000)).unwrap().unwrap();
        assert_eq!(frame.id().raw(), 0x081);
        assert!(matches!(link.send(&frame), Err(LinkError::ReadOnly)));
        fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_bad_line_is_named_after_the_frames_before_it() {
        let path = log("bad", "(5.000100) can0 080#\nnonsense\n");
        let mut link = Replay::open(&path, None, Pace::Virtual).unwrap();
        assert_eq!(link.receive_frame(at(9_000_000)).unwrap().map(|frame| frame.id().raw()), Some(0x080));
        let error = link.receive(at(9_000_000)).unwrap_err().to_string();
        assert!(error.contains(".log:2: the line does not begin with a time stamp"), "{error}");
        assert!(matches!(link.receive(at(9_000_000)), Err(LinkError::Ended)));
        fs::remove_file(path).unwrap();
    }
}
