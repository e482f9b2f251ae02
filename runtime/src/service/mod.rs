//! One state machine per protocol and peer.
//!
//! All of them have the same four verbs, by convention and not by trait, since they differ in what
//! they are lent:
//!
//! - `handle_frame(now, &frame) -> Option<Event>` for what comes from the bus;
//! - `handle_timeout(now) -> Option<Event>` when the time of `poll_timeout` has come;
//! - `poll_transmit(now) -> Option<Frame>` until there is nothing more to send;
//! - `poll_timeout() -> Option<Instant>`: when to call `handle_timeout`, `None` for never.

pub mod sdo_client;
pub mod sdo_server;
