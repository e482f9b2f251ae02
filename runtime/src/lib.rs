//! CANopen without I/O: the device's side and the manager's.
//!
//! A valve, and a manager that opens it, on a bus in virtual time:
//!
//! ```
//! # #[cfg(feature = "std")]
//! # fn main() -> Result<(), lexican_runtime::host::AccessError> {
//! use lexican_runtime::NodeId;
//! use lexican_runtime::device::Event;
//! use lexican_runtime::host::{Station, VirtualBus, blocking::Network};
//! # mod od {
//! #     use lexican_runtime::object::{Access, DataType, Dictionary, Object, PdoMapping, Ro, Row, Rw, Table};
//! #     pub const TARGET: Object<u16, Rw> = Object::new(0x2000, 0);
//! #     pub const ACTUAL: Object<u16, Ro> = Object::new(0x2001, 0);
//! #     static TABLE: Table = Table {
//! #         rows: &[
//! #             Row::new(0x2000, 0, DataType::Unsigned16, Access::Rw, PdoMapping::None).at(0, 2),
//! #             Row::new(0x2001, 0, DataType::Unsigned16, Access::Ro, PdoMapping::None).at(2, 2),
//! #         ],
//! #         limits: &[],
//! #         image: &[0; 4],
//! #     };
//! #     pub fn storage(node: lexican_runtime::NodeId) -> Dictionary<4> { Dictionary::new(&TABLE, node) }
//! # }
//!
//! let (bus, node) = (VirtualBus::with_bit_rate(500), NodeId::literal(7));
//! // `od` is generated from the data sheet of the valve.
//! let valve = Station::new(bus.now(), node, od::storage(node)).follow(|_, _, od, event| {
//!     if event == Event::Written(od::TARGET.address()) {
//!         od.set(od::ACTUAL, od.get(od::TARGET));
//!     }
//! });
//! // On a machine: `Participant::new(link, valve)`, with the link of an interface.
//! bus.attach(valve);
//!
//! let mut network = Network::new(bus.link());
//! network.write(node, od::TARGET, 500)?;
//! assert_eq!(network.read(node, od::ACTUAL)?, 500);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "std"))]
//! # fn main() {}
//! ```
//!
//! | to | take |
//! | --- | --- |
//! | read, write and command the nodes of a bus | [`host::blocking::Network`] or [`host::tokio::Network`] |
//! | run a node on an operating system | [`host::Station`] in a [`host::Participant`] |
//! | run a node without one | [`device::Device`], lent a dictionary at each call |
//! | decide when each frame is sent | [`manager::Manager`], and the [services](service) |
//! | decode frames | [`wire`] |
//! | try any of this without hardware | [`host::VirtualBus`] |
//!
//! Objects are handles that `lexican-codegen` generates from a data sheet ([`include_od!`]). What the data sheet does not
//! allow does not compile where a type can express it, and is not sent where only the value can.
//!
//! # Features
//!
//! None is on by default: this is the core, for firmware.
//!
//! | feature | adds |
//! | --- | --- |
//! | `std` | [`host`]: the [blocking shell](host::blocking), the [device shell](host::Participant), the [virtual bus](host::VirtualBus), [logs of candump](host::Replay) |
//! | `socketcan` | [the CAN interfaces](host::socketcan) of a Linux kernel |
//! | `slcan` | [serial adapters](host::slcan) that speak the Lawicel protocol |
//! | `tokio` | the [shell for tokio](host::tokio) |
//! | `tracing` | frames (targets `lexican::frames`, level trace), trouble of links (`lexican::link`, warn) and events of nodes (`lexican::nodes`, info and debug), reported by the shells |
//! | `defmt` | `defmt::Format` for the values of the core, for the log of a firmware |
//! | `embedded-can` | conversions of frames and identifiers; with `std`, [drivers of controllers as links](host::EmbeddedCan) |
//! | `embedded-storage` | [drivers of flash](FlashSlots) for [stored values](service::snapshot) |
//!
//! # Layers
//!
//! From the bottom up:
//!
//! - [`id`], [`frame`], [`time`], [`abort`], [`cia301`]: the basic types and constants;
//! - [`object`]: typed handles of a device's objects, and the dictionary that a device serves;
//! - [`wire`]: encoding and decoding, one file per protocol, without state;
//! - [`service`]: one state machine per protocol;
//! - [`device`] and [`manager`]: the composites, one for either side;
//! - [`procedure`]: sequences of steps as data, and what runs them;
//! - [`profile`]: device profiles;
//! - [`host`]: links and shells, the only part that does I/O.
//!
//! The core reads no clock (time is an argument), queues no frame (transmissions are
//! pulled and computed from state), allocates nothing, and has neither `unsafe` nor globals.
#![cfg_attr(docsrs, feature(doc_cfg))]
#![no_std]

#[cfg(test)]
extern crate self as lexican_runtime;
#[cfg(any(feature = "std", test))]
extern crate std;

pub mod abort;
pub mod device;
#[cfg(feature = "embedded-can")]
mod embedded_can;
#[cfg(feature = "embedded-storage")]
mod embedded_storage;
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
#[cfg(feature = "embedded-storage")]
pub use embedded_storage::FlashSlots;
pub use frame::Frame;
pub use id::{CobId, InvalidNodeId, NodeId};
pub use lexican_cia::cia301;
pub use time::{Duration, Instant, Measured, NoDuration};
