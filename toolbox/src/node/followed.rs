//! Long SDO transfers with progress, which can be interrupted.

use std::ops::ControlFlow;

use lexican_runtime::service::sdo_client::Payload;

/// A payload that calls a function with the number of bytes transferred; [`ControlFlow::Break`] aborts the transfer.
#[derive(Debug)]
pub struct Followed<P, F> {
    payload: P,
    follow: F,
    is_interrupted: bool,
}

impl<P: Payload, F: FnMut(u32) -> ControlFlow<()>> Followed<P, F> {
    /// Follows the transfer of `payload`.
    pub const fn new(payload: P, follow: F) -> Self {
        Followed { payload, follow, is_interrupted: false }
    }

    /// Whether `follow` has interrupted the transfer.
    pub const fn is_interrupted(&self) -> bool {
        self.is_interrupted
    }

    /// The payload.
    pub fn into_payload(self) -> P {
        self.payload
    }

    fn goes_on(&mut self, transferred: u32) -> bool {
        self.is_interrupted = self.is_interrupted || (self.follow)(transferred).is_break();
        !self.is_interrupted
    }
}

/// To interrupt, it has fewer bytes than announced, which makes the client abort.
impl<P: Payload, F: FnMut(u32) -> ControlFlow<()>> Payload for Followed<P, F> {
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        if self.goes_on(offset) { self.payload.load(offset, buffer) } else { 0 }
    }

    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        if self.goes_on(offset) { self.payload.store(offset, data) } else { 0 }
    }
}
