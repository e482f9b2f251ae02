//! The interface between a shell and a CAN interface.

use core::fmt;

use crate::{CobId, Duration, Frame, Instant};

/// A connection to a bus. The link's clock is the time of everything that runs over it: a link of a real
/// interface has the machine's time, a link of the [virtual bus](super::VirtualBus) has virtual
/// time, and code that waits through its link does not notice the difference.
///
/// A link survives trouble on its bus. When the interface goes down or the adapter is unplugged,
/// [`Link::receive`] reports it once, goes on waiting, and reports when the bus is back. Only an
/// error that [is final](LinkError::is_final) ends a link.
pub trait Link {
    /// The time now.
    fn now(&self) -> Instant;

    /// Hands a frame to the bus, and waits up to 100 ms for room. The frame may leave after this returns.
    ///
    /// Errors: [`LinkError`] if the link is gone or cannot take the frame. After an error that is not final, the frame
    /// is lost and the link remains.
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError>;

    /// As [`Link::send`], without waiting for room.
    ///
    /// Errors: [`LinkError::Full`] at once if there is no room.
    fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.send(frame)
    }

    /// Waits until `until` for a frame or a change of the bus's state; `None` if nothing came.
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError>;

    /// As [`Link::receive`], for a caller that has just read the clock as `now`, such as a loop around an `SdoClient`. This
    /// saves the link from reading it, which is a system call in a virtual machine.
    fn receive_at(&mut self, now: Instant, until: Instant) -> Result<Option<Incoming>, LinkError> {
        let _ = now;
        self.receive(until)
    }

    /// Whether the last [`Link::receive`] took all that had come, so that another call would find nothing, and the
    /// [descriptor](Link::descriptor) becomes readable at the next frame. Shells that wait for the descriptor then save
    /// a call. `false` if that is not known.
    fn is_drained(&self) -> bool {
        false
    }

    /// What the operating system reports as readable when there is something to receive, for shells that wait for
    /// several things. It changes when the link has lost and regained its interface, and is `None` in between. A link
    /// that never has a descriptor is polled every millisecond.
    #[cfg(unix)]
    fn descriptor(&self) -> Option<Descriptor> {
        None
    }

    /// Whether the link's time is real time, as on every real interface. Otherwise time passes during
    /// [`Link::receive`], as on the virtual bus, and that takes no real time. The tokio shell blocks in a link without
    /// a descriptor only if this is `false`, the default.
    fn is_real_time(&self) -> bool {
        false
    }

    /// How much later than nodes on CAN the nodes of this link may answer and obey, because of something in between:
    /// the shells wait this much longer for an answer. Zero on CAN.
    fn latency(&self) -> Duration {
        Duration::ZERO
    }

    /// Selects the COB-IDs to receive: a link that can filter drops other frames, so that a crowded bus costs nothing.
    /// No COB-IDs mean all frames, the default. Other frames may still be received, since the filters of a kernel are
    /// limited.
    ///
    /// Errors: [`LinkError`] if the operating system refuses the filters; which frames are then received is not known.
    fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
        let _ = ids;
        Ok(())
    }

    /// Waits until `until` for a frame. Changes of the bus's state are dropped.
    fn receive_frame(&mut self, until: Instant) -> Result<Option<Frame>, LinkError> {
        loop {
            match self.receive(until)? {
                Some(Incoming::Frame(frame)) => return Ok(Some(frame)),
                Some(Incoming::State(_) | Incoming::Gap(_)) => {}
                None => return Ok(None),
            }
        }
    }
}

macro_rules! pass_on {
    ($($lent:ty),*) => {
        $(
            impl<L: Link + ?Sized> Link for $lent {
                fn now(&self) -> Instant {
                    (**self).now()
                }
                fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
                    (**self).send(frame)
                }
                fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
                    (**self).receive(until)
                }
                fn receive_at(&mut self, now: Instant, until: Instant) -> Result<Option<Incoming>, LinkError> {
                    (**self).receive_at(now, until)
                }
                fn is_drained(&self) -> bool {
                    (**self).is_drained()
                }
                fn is_real_time(&self) -> bool {
                    (**self).is_real_time()
                }
                fn latency(&self) -> Duration {
                    (**self).latency()
                }
                fn listen_to(&mut self, ids: &[CobId]) -> Result<(), LinkError> {
                    (**self).listen_to(ids)
                }
                fn try_send(&mut self, frame: &Frame) -> Result<(), LinkError> {
                    (**self).try_send(frame)
                }
                #[cfg(unix)]
                fn descriptor(&self) -> Option<Descriptor> {
                    (**self).descriptor()
                }
            }
        )*
    };
}

pass_on!(std::boxed::Box<L>, &mut L);

/// A descriptor that stays open while it is in use.
#[cfg(unix)]
pub type Descriptor = std::sync::Arc<dyn std::os::fd::AsRawFd + Send + Sync>;

/// How long a frame may wait for room. A frame takes 11 ms at the lowest bit rate of CANopen, 10 kbit/s, so a working
/// bus makes room several times in this span.
#[cfg(any(feature = "tokio", feature = "slcan", all(feature = "socketcan", target_os = "linux")))]
pub(super) const PATIENCE: Duration = Duration::from_millis(100);

/// Something received from a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incoming {
    /// A frame of another node.
    Frame(Frame),
    /// The bus has changed its state. A link begins in [`BusState::Active`].
    State(BusState),
    /// This many frames are missing at this point: the machine did not read them in time, and the operating system had
    /// no room to keep them.
    Gap(u32),
}

/// The state of the controller (ISO 11898-1, 6.14), or why there is no controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BusState {
    /// The error counters are below 96.
    #[default]
    Active,
    /// An error counter has reached 96.
    Warning,
    /// An error counter has reached 128: no node acknowledges, or the bit rates differ.
    Passive,
    /// The controller has left the bus: too many errors. It carries nothing until it is restarted.
    Off,
    /// The controller has left the bus after too many errors. It carries nothing until it is restarted.
    Down,
    /// The interface is gone: unplugged, or deleted.
    Removed,
}

impl BusState {
    /// Whether frames get through, perhaps with errors.
    #[must_use]
    pub const fn carries_frames(self) -> bool {
        matches!(self, BusState::Active | BusState::Warning | BusState::Passive)
    }
}

impl fmt::Display for BusState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            BusState::Active => "error active",
            BusState::Warning => "error warning",
            BusState::Passive => "error passive",
            BusState::Off => "bus-off",
            BusState::Down => "down",
            BusState::Removed => "removed",
        })
    }
}

/// Why a link has failed, or does not carry a frame.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The operating system refused.
    #[error("the link to the bus failed: {0}")]
    Io(#[from] std::io::Error),
    /// The bus carries no frames at present.
    #[error("the bus carries no frames, it is {0}")]
    NoBus(BusState),
    /// The interface's buffer stayed full.
    #[error("the transmit buffer stays full: no node on the bus acknowledges, or it is overloaded")]
    Full,
    /// The link can only receive.
    #[error("a log takes no frames: it can be listened to, and nothing else")]
    ReadOnly,
    /// The log has no more frames.
    #[error("the log ends here")]
    Ended,
    /// The other end is gone.
    #[error("the bus is gone: the other side of this link has ended")]
    Closed,
}

impl LinkError {
    /// Whether the link has ended; otherwise only this frame is lost.
    #[must_use]
    pub const fn is_final(&self) -> bool {
        !matches!(self, LinkError::NoBus(_) | LinkError::Full | LinkError::ReadOnly)
    }

    /// A copy for another caller.
    #[cfg(feature = "tokio")]
    pub(super) fn again(&self) -> LinkError {
        match self {
            LinkError::Io(error) => LinkError::Io(match error.raw_os_error() {
                Some(code) => std::io::Error::from_raw_os_error(code),
                None => std::io::Error::new(error.kind(), std::string::ToString::to_string(error)),
            }),
            LinkError::NoBus(state) => LinkError::NoBus(*state),
            LinkError::Full => LinkError::Full,
            LinkError::ReadOnly => LinkError::ReadOnly,
            LinkError::Ended => LinkError::Ended,
            LinkError::Closed => LinkError::Closed,
        }
    }
}
