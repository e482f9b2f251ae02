//! One state machine per protocol and peer.
//!
//! All of them have the same four verbs, by convention and not by trait, since they differ in what
//! they are lent:
//!
//! - `handle_frame(now, &frame) -> Option<Event>` for what comes from the bus;
//! - `handle_timeout(now) -> Option<Event>` when the time of `poll_timeout` has come;
//! - `poll_transmit(now) -> Option<Frame>` until there is nothing more to send;
//! - `poll_timeout() -> Option<Instant>`: when to call `handle_timeout`, `None` for never.
//!
//! A service handles the frames of its COB-ID and ignores others. The composites
//! [`Device`](crate::device::Device) and [`Manager`](crate::manager::Manager) see to it that frames reach their service.

pub mod choice;
pub mod emcy_consumer;
pub mod emcy_producer;
pub mod guarding;
pub mod heartbeat_consumer;
pub mod heartbeat_producer;
pub mod lss_device;
pub mod lss_manager;
pub mod mapping;
pub mod nmt;
pub mod nmt_manager;
pub mod node_guard;
pub(crate) mod objects;
pub mod program;
pub mod rpdo;
mod sdo_block;
pub mod sdo_client;
pub mod sdo_server;
pub mod snapshot;
pub mod storage;
pub mod sync_consumer;
pub mod sync_producer;
pub mod tpdo;
