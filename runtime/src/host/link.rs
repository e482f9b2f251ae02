//! What a shell needs of a CAN interface, whatever carries the frames.

use crate::{Frame, Instant};

/// A way onto a bus. The link's clock is the time of everything that runs over it: a link of a real
/// interface tells the machine's time, a link of the [virtual bus](super::VirtualBus) tells virtual
/// time, and code that waits through its link does not notice the difference.
pub trait Link {
    /// The time now.
    fn now(&self) -> Instant;

    /// Hands a frame to the bus. It may leave later than this returns.
    ///
    /// # Errors
    ///
    /// [`LinkError`] when the link is gone or cannot take the frame.
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError>;

    /// Waits for a frame, no longer than `until`; `None` when none came.
    ///
    /// # Errors
    ///
    /// [`LinkError`] when the link is gone.
    fn receive(&mut self, until: Instant) -> Result<Option<Frame>, LinkError>;
}

impl<L: Link + ?Sized> Link for std::boxed::Box<L> {
    fn now(&self) -> Instant {
        (**self).now()
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        (**self).send(frame)
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Frame>, LinkError> {
        (**self).receive(until)
    }
}

/// A link does not carry frames any more, or not this one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The operating system refused.
    #[error("the link to the bus failed: {0}")]
    Io(#[from] std::io::Error),
    /// The other end is gone.
    #[error("the bus is gone: nobody serves this link any more")]
    Closed,
}
