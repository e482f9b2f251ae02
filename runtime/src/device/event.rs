//! What happens to a device.

use crate::abort::AbortCode;
use crate::id::NodeId;
use crate::object::{Address, TimeOfDay};
use crate::service::nmt::Reset;
use crate::service::{guarding, heartbeat_consumer};
use crate::wire::nmt::NmtState;

/// What happened to a device. One frame or deadline is at most one event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Event {
    /// The device is in another NMT state.
    StateChanged(NmtState),
    /// A manager asks for a reset. The device is silent until the application has reset its values
    /// and calls [`Device::restart`](super::Device::restart).
    Reset(Reset),
    /// A client has written an entry, and the dictionary has it. When the entry configures the
    /// communication, it is in effect already.
    Written(Address),
    /// A client's access to an entry failed, or the client gave up.
    SdoAborted {
        address: Address,
        reason: AbortCode,
    },
    /// The objects of an RPDO are in the dictionary.
    RpdoReceived {
        /// 1 to 512.
        number: u16,
    },
    /// The same, but the dictionary refused at least one of the objects.
    RpdoRefused {
        /// 1 to 512.
        number: u16,
        /// The first object that was refused.
        address: Address,
        reason: AbortCode,
    },
    /// An RPDO was shorter than its mapping, and ignored.
    RpdoTooShort {
        /// 1 to 512.
        number: u16,
        expected: u8,
        got: u8,
    },
    /// An RPDO did not come within its deadline.
    RpdoTimedOut {
        /// 1 to 512.
        number: u16,
    },
    /// SYNC: received, or sent by the device itself. [`Device::applied`](super::Device::applied) lists the RPDOs
    /// that took effect with it.
    Sync {
        /// When the producer counts.
        counter: Option<u8>,
    },
    Time(TimeOfDay),
    /// Something happened to a node whose heartbeat the device consumes (1016h).
    Heartbeat {
        node: NodeId,
        event: heartbeat_consumer::Event,
    },
    /// Guarding requests have stopped for longer than the life time, or have come again.
    LifeGuarding(guarding::Event),
}

/// A parameter whose value in the dictionary the device cannot serve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Misconfigured {
    /// The parameter.
    pub address: Address,
    /// With what a write of the same value would be refused.
    pub reason: AbortCode,
}
