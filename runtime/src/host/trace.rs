//! Events of the shells for `tracing`; does nothing without the feature.
//!
//! Shells call these functions when a frame passes between them and their link, and when the manager reports an event.

use super::{Incoming, LinkError};
use crate::manager::Event;
use crate::{Frame, Instant};

#[cfg(feature = "tracing")]
mod target {
    pub(super) const FRAMES: &str = "lexican::frames";
    pub(super) const LINK: &str = "lexican::link";
    pub(super) const NODES: &str = "lexican::nodes";
}

/// The result of reading a link.
#[inline]
pub(super) fn received(now: Instant, incoming: Option<&Incoming>) {
    #[cfg(feature = "tracing")]
    match incoming {
        Some(Incoming::Frame(frame)) => tracing::trace!(target: target::FRAMES, %now, %frame, "received"),
        Some(Incoming::State(state)) => tracing::warn!(target: target::LINK, %now, %state, "bus state"),
        Some(Incoming::Gap(frames)) => tracing::warn!(target: target::LINK, %now, frames, "frames are missing"),
        None => {}
    }
    #[cfg(not(feature = "tracing"))]
    let _ = (now, incoming);
}

#[inline]
pub(super) fn sent(now: Instant, frame: &Frame, result: &Result<(), LinkError>) {
    #[cfg(feature = "tracing")]
    match result {
        Ok(()) => tracing::trace!(target: target::FRAMES, %now, %frame, "sent"),
        Err(error) => tracing::warn!(target: target::LINK, %now, %frame, %error, "not sent"),
    }
    #[cfg(not(feature = "tracing"))]
    let _ = (now, frame, result);
}

/// An event of the manager, or of the network that it keeps up. PDOs and SYNC are reported as frames only.
#[inline]
pub(super) fn event(now: Instant, event: &Event) {
    #[cfg(feature = "tracing")]
    match event {
        Event::Pdo { .. } | Event::Sync(_) => {}
        Event::Sdo { node, event } => tracing::debug!(target: target::NODES, %now, %node, ?event, "SDO"),
        Event::Time(_) | Event::Stranger { .. } => tracing::debug!(target: target::NODES, %now, ?event, "event"),
        _ => tracing::info!(target: target::NODES, %now, ?event, "event"),
    }
    #[cfg(not(feature = "tracing"))]
    let _ = (now, event);
}
