//! A long SDO transfer that is followed, and may be interrupted.

use std::ops::ControlFlow;

use lexican_runtime::service::sdo_client::Payload;

/// The bytes of a transfer, and a function that gets how many of them have been transferred. At a [`ControlFlow::Break`]
/// the transfer is aborted.
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

    /// Whether the transfer was aborted because `follow` has said so.
    pub const fn is_interrupted(&self) -> bool {
        self.is_interrupted
    }

    /// The bytes.
    pub fn into_payload(self) -> P {
        self.payload
    }

    fn goes_on(&mut self, transferred: u32) -> bool {
        self.is_interrupted = self.is_interrupted || (self.follow)(transferred).is_break();
        !self.is_interrupted
    }
}

/// Fewer bytes than there should be end the transfer with an abort.
impl<P: Payload, F: FnMut(u32) -> ControlFlow<()>> Payload for Followed<P, F> {
    fn load(&mut self, offset: u32, buffer: &mut [u8]) -> usize {
        if self.goes_on(offset) { self.payload.load(offset, buffer) } else { 0 }
    }

    fn store(&mut self, offset: u32, data: &[u8]) -> usize {
        if self.goes_on(offset) { self.payload.store(offset, data) } else { 0 }
    }
}
