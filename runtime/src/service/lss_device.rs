//! LSS as a device sees it: it is found by its identity, and takes node-ID and bit rate (CiA 305).
//!
//! The service stands beside [`Device`](crate::device::Device), because a device may have no node-ID yet:
//! the application gives it the frames of [`lss::REQUEST`], and restarts the device when a node-ID takes effect.

use crate::frame::Frame;
use crate::id::NodeId;
use crate::time::{Duration, Instant};
use crate::wire::lss::{self, Bound, Identity, LssRequest, LssResponse, LssState, Part};

/// What the device itself must do.
pub trait LssHost {
    /// Whether the device supports a bit rate: entry `index` of `table`. With `true`, it is taken for the next
    /// [`Event::ActivateBitTiming`] and for [`LssHost::store`].
    fn configure_bit_timing(&mut self, table: u8, index: u8) -> bool;

    /// Stores the node-ID and the bit rate that was configured.
    fn store(&mut self, node: Option<NodeId>) -> Result<(), StoreError>;
}

/// Why a configuration is not stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StoreError {
    /// The device has no storage for it.
    #[error("storing is not supported")]
    NotSupported,
    /// The storage failed.
    #[error("the storage medium failed")]
    Failed,
}

/// The result of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// The device had no node-ID, and has one now: it boots with it.
    NodeIdGiven(NodeId),
    /// All devices change their bit rate: be silent from now on, change after `delay`, and transmit again
    /// after another `delay`.
    ActivateBitTiming {
        /// How long to wait.
        delay: Duration,
    },
}

/// The LSS state machine of a device.
#[derive(Clone, Copy, Debug)]
pub struct LssDevice {
    identity: Identity,
    /// What the device runs with.
    active: Option<NodeId>,
    /// The node-ID that it takes at the next reset.
    pending: Option<NodeId>,
    state: LssState,
    /// The parts of the identity that a selection has met so far, without gaps.
    selected: u8,
    /// The bounds of the identity that were met so far, without gaps.
    identified: u8,
    /// The part that a scan is at.
    scanned: Part,
    answer: Option<LssResponse>,
}

impl LssDevice {
    /// A device of this identity, with or without a node-ID.
    #[must_use]
    pub const fn new(identity: Identity, node: Option<NodeId>) -> Self {
        LssDevice {
            identity,
            active: node,
            pending: node,
            state: LssState::Waiting,
            selected: 0,
            identified: 0,
            scanned: Part::Vendor,
            answer: None,
        }
    }

    /// The state.
    #[must_use]
    pub const fn state(&self) -> LssState {
        self.state
    }

    /// The node-ID that takes effect with the next reset of the communication, and is active from then on.
    pub const fn reset(&mut self) -> Option<NodeId> {
        self.active = self.pending;
        self.state = LssState::Waiting;
        self.answer = None;
        self.active
    }

    /// Takes a request.
    pub fn handle_frame(&mut self, _now: Instant, frame: &Frame, host: &mut dyn LssHost) -> Option<Event> {
        if frame.id() != lss::REQUEST || frame.is_remote() {
            return None;
        }
        let Some(request) = LssRequest::parse(frame.data()) else {
            self.refuse(frame.data());
            return None;
        };
        match request {
            LssRequest::SwitchGlobal(state) => self.switch(state),
            LssRequest::SwitchSelective(part, value) => self.select(part, value),
            LssRequest::Identify(bound, value) => self.identify(bound, value),
            LssRequest::IdentifyUnconfigured => {
                if self.active.is_none() && self.pending.is_none() {
                    self.answer = Some(LssResponse::Unconfigured);
                }
                None
            }
            LssRequest::Fastscan { value, bits_left, part, next } => self.scan(value, bits_left, part, next),
            _ if self.state == LssState::Waiting => None,
            request => self.configure(request, host),
        }
    }

    /// A node-ID that is none is refused; anything else that is unknown is ignored.
    fn refuse(&mut self, data: &[u8]) {
        let is_configure_node = data.first() == Some(&0x11) && data.len() == 8;
        if is_configure_node && self.state == LssState::Configuration {
            self.answer = Some(LssResponse::ConfigureNode { error: 1, specific: 0 });
        }
    }

    fn switch(&mut self, state: LssState) -> Option<Event> {
        let before = core::mem::replace(&mut self.state, state);
        self.selected = 0;
        // Leaving the configuration gives a device without node-ID the one that it was given.
        let given = self
            .pending
            .filter(|_| self.active.is_none() && before == LssState::Configuration && state == LssState::Waiting)?;
        self.active = Some(given);
        Some(Event::NodeIdGiven(given))
    }

    fn select(&mut self, part: Part, value: u32) -> Option<Event> {
        let expected = part.number() == self.selected || part == Part::Vendor;
        let met = self.state == LssState::Waiting && expected && self.identity.part(part) == value;
        self.selected = if met { part.number() + 1 } else { 0 };
        if met && part == Part::Serial {
            self.selected = 0;
            self.state = LssState::Configuration;
            self.answer = Some(LssResponse::Selected);
        }
        None
    }

    fn identify(&mut self, bound: Bound, value: u32) -> Option<Event> {
        let met = match bound {
            Bound::Vendor => self.identity.vendor == value,
            Bound::Product => self.identity.product == value,
            Bound::RevisionLow => self.identity.revision >= value,
            Bound::RevisionHigh => self.identity.revision <= value,
            Bound::SerialLow => self.identity.serial >= value,
            Bound::SerialHigh => self.identity.serial <= value,
        };
        let number = bound as u8;
        let expected = number == self.identified || bound == Bound::Vendor;
        self.identified = if met && expected { number + 1 } else { 0 };
        if met && expected && bound == Bound::SerialHigh {
            self.identified = 0;
            self.answer = Some(LssResponse::Identified);
        }
        None
    }

    fn scan(&mut self, value: u32, bits_left: u8, part: Part, next: Part) -> Option<Event> {
        // Only devices without node-ID are looked for.
        if self.active.is_some() || self.pending.is_some() || self.state != LssState::Waiting {
            return None;
        }
        if bits_left == 0x80 {
            self.scanned = Part::Vendor;
            self.answer = Some(LssResponse::Identified);
            return None;
        }
        let mask = u32::MAX.checked_shl(u32::from(bits_left)).unwrap_or(0);
        if part != self.scanned || (self.identity.part(part) ^ value) & mask != 0 {
            return None;
        }
        self.answer = Some(LssResponse::Identified);
        if bits_left == 0 {
            self.scanned = next;
            if next < part {
                self.state = LssState::Configuration;
            }
        }
        None
    }

    fn configure(&mut self, request: LssRequest, host: &mut dyn LssHost) -> Option<Event> {
        self.answer = match request {
            LssRequest::ConfigureNode(node) => {
                self.pending = node;
                Some(LssResponse::ConfigureNode { error: 0, specific: 0 })
            }
            LssRequest::ConfigureBitTiming { table, index } => {
                let error = u8::from(!host.configure_bit_timing(table, index));
                Some(LssResponse::ConfigureBitTiming { error, specific: 0 })
            }
            LssRequest::ActivateBitTiming { delay_ms } => {
                return Some(Event::ActivateBitTiming { delay: Duration::from_millis(delay_ms.into()) });
            }
            LssRequest::Store => {
                let error = match host.store(self.pending) {
                    Ok(()) => 0,
                    Err(StoreError::NotSupported) => 1,
                    Err(StoreError::Failed) => 2,
                };
                Some(LssResponse::Store { error, specific: 0 })
            }
            LssRequest::Inquire(part) => Some(LssResponse::Inquired(part, self.identity.part(part))),
            LssRequest::InquireNode => Some(LssResponse::InquiredNode(self.active)),
            _ => None,
        };
        None
    }

    /// The answer to the last request.
    pub fn poll_transmit(&mut self, _now: Instant) -> Option<Frame> {
        Some(self.answer.take()?.frame())
    }
}
