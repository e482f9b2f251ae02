//! CANopen, the device's side and the manager's, without I/O.
//!
//! | who wants to | takes |
//! | --- | --- |
//! | read, write and command the nodes of a bus | `host::blocking::Network`, or `host::tokio::Network` |
//! | be a node, on an operating system | `host::Station` behind a `host::Participant` |
//! | be a node, without one | [`device::Device`], lent a dictionary at each call |
//! | decide alone when anything is sent | [`manager::Manager`], and the [services](service) |
//! | read frames | [`wire`] |
//! | try any of this without hardware | `host::VirtualBus` |
//!
//! Objects are handles that `lexican-codegen` makes of a data sheet ([`include_od!`]). What the data sheet does not allow
//! does not compile where a type can say it, and is not sent where only the value can.
//!
//! From the bottom up:
//!
//! - [`id`], [`frame`], [`time`], [`abort`], [`cia301`]: the words that everything else speaks in;
//! - [`object`]: typed handles of a device's objects, and the dictionary that a device serves;
//! - [`wire`]: bytes to meaning and back, one file per protocol, without state;
//! - [`service`]: one state machine per protocol;
//! - [`device`] and [`manager`]: the composites, one for either side;
//! - [`procedure`]: sequences of steps as data, and what runs them;
//! - [`profile`]: what device profiles add;
//! - `host`, behind the feature `std`: links and shells, the only part that does I/O. Links to interfaces have features
//!   of their own, `socketcan` and `slcan`; so has the shell for `tokio`.
//!
//! With the feature `defmt`, the values of the core have a `defmt::Format`, for the log of a firmware.
//!
//! What is absent: no clock is read (time is an argument), no frame is queued (transmissions are
//! pulled and computed from state), nothing is allocated, nothing is `unsafe`, nothing is global.
#![no_std]

#[cfg(test)]
extern crate self as lexican_runtime;
#[cfg(any(feature = "std", test))]
extern crate std;

pub mod abort;
pub mod cia301;
pub mod device;
#[cfg(feature = "defmt")]
mod formats;
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
