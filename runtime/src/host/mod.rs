//! Where the core meets the world: links that carry frames, and shells that drive the state machines
//! over them. No protocol logic is in here; the clocks and the sockets are.

pub mod candump;
#[cfg(any(feature = "slcan", all(feature = "socketcan", target_os = "linux")))]
mod clock;
mod link;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
pub mod socketcan;
mod virtual_bus;

pub use link::{BusState, Incoming, Link, LinkError};
pub use virtual_bus::{Fate, Node, Pace, VirtualBus, VirtualLink};
