//! How a drive notices that its manager is gone.

use std::fmt;

use lexican_runtime::object::DataType;
use lexican_runtime::service::heartbeat_producer::HeartbeatProducer;
use lexican_runtime::service::node_guard::NodeGuard;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{Duration, Frame, Instant, NodeId};

use crate::description::Number;
use crate::error::{Capability, Error};

/// How soon a drive is to notice that its manager is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Supervision {
    /// 1 ms to 65 s.
    pub within: Duration,
    /// The node-ID under which this program sends heartbeats to a drive that consumes them (1016h). No node on the bus
    /// may have it.
    pub manager: NodeId,
}

impl Supervision {
    /// Heartbeats are sent under the node-ID 127.
    #[must_use]
    pub const fn within(within: Duration) -> Self {
        Supervision { within, manager: NodeId::literal(127) }
    }

    pub(crate) const USUAL: Supervision = Supervision::within(Duration::from_secs(1));
}

impl Default for Supervision {
    /// Within a second, in which three of four signs of life may be late or lost.
    fn default() -> Self {
        Supervision::USUAL
    }
}

/// How a drive notices that its manager is gone. What it does then is set in the drive (1029h, 6007h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Protection {
    /// Not at all: the drive goes on with its last order.
    #[default]
    None,
    /// By life guarding (100Ch, 100Dh; CiA 301, 7.2.8.3.2.1): the driver's guarding requests stop.
    LifeGuarding {
        /// How often the driver sends a request.
        guard_time: Duration,
        /// How many requests may be missing.
        life_time_factor: u8,
    },
    /// As a consumer of heartbeats (1016h; CiA 301, 7.2.8.3.2.2): the driver's heartbeats stop.
    Heartbeat {
        /// The sub-index in 1016h.
        entry: u8,
        /// The node-ID under which the driver sends heartbeats.
        manager: NodeId,
        /// How often the driver sends one.
        period: Duration,
        /// How long the drive waits for one.
        within: Duration,
    },
}

impl Protection {
    /// Whether `error` means that the drive cannot be protected: it has neither a free heartbeat consumer nor life
    /// guarding, or refuses to have them armed.
    #[must_use]
    pub const fn is_lacking(error: &Error) -> bool {
        matches!(
            error,
            Error::Unsupported { what: Capability::Protection, .. }
                | Error::HeartbeatExcludesGuarding { .. }
                | Error::Sdo(SdoError::Aborted { .. })
        )
    }

    /// The protection that has been armed, or none if the drive cannot be protected. Reports either to `tracing`.
    pub(crate) fn or_none(node: NodeId, armed: Result<Protection, Error>) -> Result<Protection, Error> {
        match armed {
            Err(why) if Protection::is_lacking(&why) => {
                report(node, Protection::None, Some(&why));
                Ok(Protection::None)
            }
            armed => armed.inspect(|protection| report(node, *protection, None)),
        }
    }

    /// The object that disarms it when 0 is written: 100Ch, or the entry of 1016h.
    pub(crate) const fn switch(self) -> Option<Number> {
        match self {
            Protection::None => None,
            Protection::LifeGuarding { .. } => Some(GUARD_TIME),
            Protection::Heartbeat { entry, .. } => Some(consumer(entry)),
        }
    }
}

/// Guard time, in ms (100Ch).
pub(crate) const GUARD_TIME: Number = Number::new(0x100C, 0x00, DataType::Unsigned16);

/// An entry of 1016h.
pub(crate) const fn consumer(entry: u8) -> Number {
    Number::new(0x1016, entry, DataType::Unsigned32)
}

/// Reports to `tracing` how a drive notices that this program is gone, or why it does not.
pub(crate) fn report(node: NodeId, protection: Protection, why: Option<&Error>) {
    #[cfg(feature = "tracing")]
    match (protection, why) {
        (Protection::None, Some(why)) => tracing::warn!(target: "lexican::drive", %node, %why, "not protected"),
        (Protection::None, None) => tracing::warn!(target: "lexican::drive", %node, "connected unprotected, as asked"),
        (protection, _) => tracing::info!(target: "lexican::drive", %node, %protection, "protected"),
    }
    #[cfg(not(feature = "tracing"))]
    let _ = (node, protection, why);
}

impl fmt::Display for Protection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Protection::None => f.write_str("none: the drive goes on with its last order if this program dies"),
            Protection::LifeGuarding { guard_time, life_time_factor } => {
                write!(f, "life guarding, {life_time_factor} times {guard_time}")
            }
            Protection::Heartbeat { manager, within, .. } => {
                write!(f, "heartbeat of node {manager} within {within}")
            }
        }
    }
}

/// Sends the signs of life for a protected drive.
#[derive(Debug, Default)]
pub(crate) enum KeepAlive {
    #[default]
    None,
    Guard(NodeGuard),
    Heartbeat(HeartbeatProducer),
}

impl KeepAlive {
    pub(crate) fn new(now: Instant, node: NodeId, protection: Protection) -> Self {
        match protection {
            Protection::None => KeepAlive::None,
            Protection::LifeGuarding { guard_time, life_time_factor } => {
                let mut guard = NodeGuard::new(node, guard_time, life_time_factor);
                guard.start(now);
                KeepAlive::Guard(guard)
            }
            Protection::Heartbeat { manager, period, .. } => {
                let mut heartbeat = HeartbeatProducer::new(manager);
                heartbeat.configure(now, period, Duration::ZERO);
                KeepAlive::Heartbeat(heartbeat)
            }
        }
    }

    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        match self {
            KeepAlive::None => {}
            // A drive that does not answer is noticed by the SDO accesses of the operations.
            KeepAlive::Guard(guard) => drop(guard.handle_timeout(now)),
            KeepAlive::Heartbeat(heartbeat) => heartbeat.handle_timeout(now),
        }
    }

    pub(crate) fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        match self {
            KeepAlive::None => None,
            KeepAlive::Guard(guard) => guard.poll_transmit(now),
            KeepAlive::Heartbeat(heartbeat) => heartbeat.poll_transmit(now, NmtState::Operational),
        }
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        match self {
            KeepAlive::None => None,
            KeepAlive::Guard(guard) => guard.poll_timeout(),
            KeepAlive::Heartbeat(heartbeat) => heartbeat.poll_timeout(),
        }
    }
}
