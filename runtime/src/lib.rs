//! CANopen without I/O.
//!
//! From the bottom up:
//!
//! - [`id`], [`frame`], [`time`], [`abort`]: the words that everything else speaks in;
//! - [`object`]: typed handles of a device's objects, and the dictionary that a device serves;
//! - [`wire`]: bytes to meaning and back, one file per protocol, without state;
//! - [`service`]: one state machine per protocol;
//! - [`device`] and [`manager`]: the composites, one for either side;
//! - [`procedure`]: sequences of steps as data, and what runs them;
//! - [`profile`]: what device profiles add;
//! - `host`, behind the feature `std`: links and shells, the only part that does I/O.
//!
//! What is absent: no clock is read (time is an argument), no frame is queued (transmissions are
//! pulled and computed from state), nothing is allocated, nothing is `unsafe`, nothing is global.
#![no_std]

#[cfg(test)]
extern crate self as lexican_runtime;
#[cfg(any(feature = "std", test))]
extern crate std;

pub mod abort;
pub mod device;
pub mod frame;
#[cfg(feature = "std")]
pub mod host;
pub mod id;
pub mod manager;
pub mod object;
pub mod procedure;
pub mod profile;
pub mod service;
#[cfg(test)]
#[allow(dead_code, unreachable_pub, reason = "integration tests use it too")]
pub(crate) mod testing;
pub mod time;
pub mod wire;

pub use abort::AbortCode;
pub use frame::Frame;
pub use id::{CobId, InvalidNodeId, NodeId};
pub use time::{Duration, Instant};
